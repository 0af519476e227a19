//! One image and everything that is known of it, in memory: what formats are made of.

use crate::model::photo::Jpegs;
use crate::model::record::Record;
use furrow_base::{Error, Result};
use furrow_render::film::Film;
use furrow_render::render::LabelMap;
use std::collections::BTreeMap;

/// One image of a dataset. Maps hold one value a pixel, row by row from the top; a map that is not known is empty.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// What is known in words and numbers.
    pub record: Record,
    /// 8-bit sRGB; empty where images are labels alone.
    pub rgb: Vec<[u8; 3]>,
    /// 8-bit near infrared.
    pub nir: Vec<u8>,
    /// Class: 0 soil, 1 crop, 2 weed, [`IGNORE`] for no label.
    pub semantics: Vec<u8>,
    /// Number of the species in the dataset's table, 0 for none.
    pub species: Vec<u8>,
    /// Number of what is there among [`PartKind::NUMBERED`](furrow_field::PartKind::NUMBERED), 0 for nothing.
    pub parts: Vec<u8>,
    /// Number of the plant, 0 for none.
    pub plants: Vec<u32>,
    /// Number of the leaf on its plant, 0 for none.
    pub leaves: Vec<u16>,
    /// Share of soil, crop and weed in the pixel, of 255; they sum to 255.
    pub coverage: Vec<[u8; 3]>,
    /// Distance along the optical axis, metres; infinite where nothing is.
    pub depth: Vec<f32>,
    /// Unit normal in the world, facing the camera; zero where nothing is.
    pub normals: Vec<[f32; 3]>,
    /// The files that `rgb` and `nir` are the pixels of, where photographs are stored as JPEG.
    pub jpeg: Option<Jpegs>,
    /// What was rendered; only in the process that rendered it.
    pub film: Option<Rendered>,
}

impl Sample {
    /// What only the renderer knows of it; an error that names the `format` which asks, for an image that was not rendered now.
    pub fn rendered(&self, format: &str) -> Result<&Rendered> {
        self.film.as_ref().ok_or_else(|| {
            Error::misuse(format!("image {}: only the renderer knows what --format {format} holds", self.record.name))
        })
    }
}

/// What formats for compositing (layers, Cryptomattes) hold beyond a photograph.
#[derive(Clone, Debug, PartialEq)]
pub struct Rendered {
    /// Linear radiance, its variance, what each sample met; none where images are labels alone.
    pub film: Option<Film>,
    /// Which part lies at each pixel's centre, and who that is.
    pub labels: LabelMap,
    /// Class, plant and leaf of each part.
    pub tags: Vec<furrow_render::scene::tag::Tag>,
    /// What each part is.
    pub kinds: Vec<furrow_field::PartKind>,
    /// What grows.
    pub plants: Vec<furrow_field::PlantRecord>,
    /// Who looked.
    pub camera: furrow_optics::sensor::Camera,
    /// Where what this image shows lies in others of its field; none unless a format asks for it.
    pub flows: Vec<Flow>,
    /// What is wrong with the leaf at each pixel's centre; none unless a format asks for it.
    pub damage: Vec<furrow_render::material::Damage>,
}

/// Where what is at each pixel's centre lies in another image of the same field.
#[derive(Clone, Debug, PartialEq)]
pub struct Flow {
    /// Which image: `next` of the same camera, or another camera of the same frame by its name.
    pub to: String,
    /// From here to there, pixels right and down; not a number where nothing is, or behind the other lens.
    pub pixels: Vec<[f32; 2]>,
    /// Whether the other image shows it.
    pub visible: Vec<bool>,
}

/// Stands for "no label" in [`Sample::semantics`].
pub const IGNORE: u8 = 255;

impl Sample {
    /// Width and height, pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.record.width, self.record.height)
    }

    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.record.width as usize * self.record.height as usize
    }

    /// A number for every leaf that is unique in the image, 0 for none: leaves count through the image by plant and leaf.
    pub fn leaf_instances(&self) -> Vec<u32> {
        let numbers: BTreeMap<(u32, u16), u32> = self
            .record
            .leaves()
            .enumerate()
            .map(|(i, (plant, leaf))| ((plant.number, leaf.number), i as u32 + 1))
            .collect();
        let of = |(plant, leaf): (&u32, &u16)| numbers.get(&(*plant, *leaf)).copied().unwrap_or(0);
        self.plants.iter().zip(&self.leaves).map(of).collect()
    }
}
