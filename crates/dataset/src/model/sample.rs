//! One image with all its labels and metadata, in memory: the source of every format.

use crate::model::box3::UprightBox;
use crate::model::image_format::Jpegs;
use crate::model::record::Record;
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use furrow_render::film::Film;
use furrow_render::render::{LabelMap, WholeMask};
use std::collections::BTreeMap;

/// One image of a dataset. Maps contain one value per pixel, row by row from the top; a map that is not available is
/// empty.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Labels and metadata.
    pub record: Record,
    /// 8-bit sRGB; empty for labels-only images.
    pub rgb: Vec<[u8; 3]>,
    /// 8-bit near infrared.
    pub nir: Vec<u8>,
    /// Class: 0 soil, 1 crop, 2 weed, [`IGNORE`] for no label.
    pub semantics: Vec<u8>,
    /// Number of the species in the dataset's table, 0 for none.
    pub species: Vec<u8>,
    /// Number of the visible part among [`PartKind::NUMBERED`](furrow_field::PartKind::NUMBERED), 0 for none.
    pub parts: Vec<u8>,
    /// Number of the plant, 0 for none.
    pub plants: Vec<u32>,
    /// Number of the leaf on its plant, 0 for none.
    pub leaves: Vec<u16>,
    /// Fractions of soil, crop and weed in the pixel; they sum to 255.
    pub coverage: Vec<[u8; 3]>,
    /// Distance along the optical axis, metres; infinite where nothing is visible.
    pub depth: Vec<f32>,
    /// Unit normal in world space, facing the camera; zero where nothing is visible.
    pub normals: Vec<[f32; 3]>,
    /// JPEG files whose pixels are in `rgb` and `nir`; `None` if images are stored as PNG.
    pub jpeg: Option<Jpegs>,
    /// Results of the renderer; only in the process that rendered the image.
    pub film: Option<Rendered>,
}

impl Sample {
    /// Returns the results of the renderer. If the image was not rendered by this process, returns an error that names
    /// the `format` that needs them.
    pub fn rendered(&self, format: &str) -> Result<&Rendered> {
        self.film.as_ref().ok_or_else(|| {
            Error::misuse(format!(
                "image {}: --format {format} can be written only while the image is rendered",
                self.record.name
            ))
            .help("name the format when the dataset is made: `trace dataset --format`")
        })
    }
}

/// Results of the renderer that are not stored with the image but used by some formats, such as Cryptomattes in
/// `layers`.
#[derive(Clone, Debug, PartialEq)]
pub struct Rendered {
    /// Linear radiance, its variance and the parts that the samples hit; `None` for labels-only images.
    pub film: Option<Film>,
    /// Part, depth and normal at each pixel's centre.
    pub labels: LabelMap,
    /// Class, plant and leaf of each part.
    pub tags: Vec<furrow_render::scene::tag::Tag>,
    /// Kind of each part.
    pub kinds: Vec<furrow_field::PartKind>,
    /// Plants of the field.
    pub plants: Vec<furrow_field::PlantRecord>,
    /// Camera of the image.
    pub camera: furrow_optics::sensor::Camera,
    /// Optical flow to other images of the field; empty unless a format needs it.
    pub flows: Vec<Flow>,
    /// Damage of the leaf at each pixel's centre; empty unless a format needs it.
    pub damage: Vec<furrow_render::material::Damage>,
    /// Pixels that each plant would cover without occlusion, by its number; empty unless a format needs them.
    pub masks: BTreeMap<u32, WholeMask>,
    /// Boxes around each plant, by its number; empty unless a format needs them.
    pub boxes: BTreeMap<u32, PlantBoxes>,
}

/// Boxes around all vertices of a plant, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantBoxes {
    /// Upright in world space: x east, y north, z up.
    pub world: UprightBox,
    /// Upright in the image, in the camera's frame with the axes right, forward, down.
    pub camera: UprightBox,
}

/// Optical flow from one image to another of the same field.
#[derive(Clone, Debug, PartialEq)]
pub struct Flow {
    /// Other image: `next` for the next frame of the same camera, or the name of another camera for the same frame.
    pub to: String,
    /// Displacement of the point at each pixel's centre, pixels right and down; NaN where nothing is visible or the
    /// point is behind the other camera.
    pub pixels: Vec<[f32; 2]>,
    /// Whether the point is visible in the other image.
    pub visible: Vec<bool>,
}

/// Value for "no label" in [`Sample::semantics`].
pub const IGNORE: u8 = 255;

impl Sample {
    /// Returns width and height, pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.record.width, self.record.height)
    }

    /// Returns the number of pixels.
    pub fn pixels(&self) -> usize {
        self.record.width.to_usize() * self.record.height.to_usize()
    }

    /// Returns a leaf number for each pixel that is unique in the image, 0 for none. Leaves are numbered in the order
    /// of their plants and of their numbers on the plant.
    pub fn leaf_instances(&self) -> Vec<u32> {
        let numbers: BTreeMap<(u32, u16), u32> = self
            .record
            .leaves()
            .enumerate()
            .map(|(i, (plant, leaf))| ((plant.number, leaf.number), i.to_u32() + 1))
            .collect();
        let of = |(plant, leaf): (&u32, &u16)| numbers.get(&(*plant, *leaf)).copied().unwrap_or(0);
        self.plants.iter().zip(&self.leaves).map(of).collect()
    }
}
