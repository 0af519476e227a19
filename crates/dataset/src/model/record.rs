//! Labels and metadata of one image: its `record.json`.

use crate::model::rle::{Box2, Rle};
use crate::model::split::Split;
use furrow_field::record::Conditions;
use furrow_field::traits::{Canopy, LeafTraits, PlantTraits};
use furrow_grow::plant::Condition;
use furrow_optics::sensor::ShotRecord;
use furrow_render::film::Sampling;
use furrow_render::scene::tag::{Class, lowercase};
use furrow_render::settings::Preset;
use serde::{Deserialize, Serialize, Serializer, ser};

/// Record of one image.
///
/// Pixels count from the top left. Points are in continuous pixel coordinates, where the centre of the first pixel is
/// (0.5, 0.5).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Number of the image in the dataset, from 0.
    pub index: u64,
    /// Name of the image: its number in six digits or more.
    pub name: String,
    /// Original file name of an imported image.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// Split of the image.
    pub split: Split,
    /// Position of the image in the drive, the rig or the days of its field; `None` if each field has one image and no
    /// days.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub capture: Option<CaptureRecord>,
    /// Number of the light among those under which the view is rendered, 0 for the field's own; `None` if there is only one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light: Option<u64>,
    /// Image width, pixels.
    pub width: u32,
    /// Image height, pixels.
    pub height: u32,
    /// Pixels of each class, in the order of the class numbers.
    pub classes: Vec<ClassShare>,
    /// Number of pixels without a label (imported images only).
    #[serde(default, skip_serializing_if = "is_zero")]
    pub ignored: u64,
    /// Plants by number: the visible ones, and those within the frame that are occluded.
    pub plants: Vec<Plant>,
    /// Sampled values of the field: camera, lights, soil, rows, growth stage; null for an imported image.
    #[serde(default, skip_serializing_if = "Option::is_none", serialize_with = "sorted")]
    pub conditions: Option<Conditions>,
    /// Leaf area above the visible ground; null in records of earlier versions, for an imported image, and if the
    /// camera sees the horizon.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub canopy: Option<Canopy>,
    /// Exposure of the sensor; null for imported and labels-only images.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exposure: Option<Exposure>,
    /// Sampling noise of the image; omitted if it is unknown, and for a denoised image.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sampling: Option<Sampling>,
    /// Preset of quality of the image, which is biased; omitted for the full integrator.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quality: Option<Preset>,
    /// Warnings for the author of the scene file.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
}

impl Record {
    /// Returns whether a colour image belongs to the record; labels-only images have none.
    pub fn has_photograph(&self) -> bool {
        self.exposure.is_some() || self.conditions.is_none()
    }
}

/// Serializes conditions in the format of all versions: keys in alphabetical order, numbers with the digits of double
/// precision.
#[expect(clippy::ref_option, reason = "serde calls it with a reference to the field")]
fn sorted<S: Serializer>(conditions: &Option<Conditions>, serializer: S) -> Result<S::Ok, S::Error> {
    serde_json::to_value(conditions).map_err(ser::Error::custom)?.serialize(serializer)
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference to the field")]
fn is_zero(n: &u64) -> bool {
    *n == 0
}

/// Position of an image in a drive, a rig or the days of a field.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CaptureRecord {
    /// Number of the field.
    pub field: u64,
    /// Day of the image, counted from the emergence of the field's first crop; omitted for fields without days.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub day: Option<u32>,
    /// Number of images that its camera took before, on all days.
    pub frame: u32,
    /// Name of the camera.
    pub camera: String,
    /// Time since the first image, seconds.
    pub time_s: f64,
}

/// Exposure of the sensor: factors from radiance to pixel values.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Exposure {
    /// Linear level of green (1 is white) per radiance in W·m⁻²·sr⁻¹·nm⁻¹.
    pub gain: f32,
    /// The same for near infrared.
    pub nir_gain: f32,
    /// White-balance gains of R, G and B.
    pub white_balance: [f32; 3],
    /// Exposure time, analog gain, electrons at full scale and saturated fraction of R, G, B and NIR; null in records of
    /// earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bands: Option<ShotRecord>,
}

/// Pixels of one class in an image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClassShare {
    /// The class.
    #[serde(with = "lowercase")]
    pub class: Class,
    /// Number of pixels whose centre shows the class.
    pub pixels: u64,
    /// Sum over all pixels of the fraction covered by the class, in pixels; null without coverage.
    pub covered: Option<f64>,
}

/// One plant in an image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plant {
    /// Number of the plant in `plants.png`.
    pub number: u32,
    /// Identity: 32 bits, never 0, unique among the plants and leaves of the field. It is the same in every image of
    /// the field, independent of the camera, the resolution and the other plants in view. Null in records of earlier
    /// versions and for an imported plant.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub id: Option<u32>,
    /// Crop or weed.
    #[serde(with = "lowercase")]
    pub class: Class,
    /// Number of the species in the dataset's table; 0 for none.
    pub kind: u16,
    /// Pixels of the plant in the image.
    pub seen: Seen,
    /// Point where the stem meets the ground.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stem: Option<Keypoint>,
    /// Properties of the grown plant; null for an imported plant.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grown: Option<PlantAttributes>,
    /// Leaves by number.
    pub leaves: Vec<Leaf>,
}

/// Properties of a plant beyond its pixels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlantAttributes {
    /// Common name from the species file, or the name of the model.
    pub species: String,
    /// EPPO code; empty for a model.
    pub eppo: String,
    /// Growth stage on the BBCH scale.
    pub bbch: u32,
    /// Days after emergence.
    pub age_days: f32,
    /// Point where the stem meets the ground, world space, metres.
    pub position_m: [f32; 3],
    /// Unit vector of the growth axis that the plant was sown with, world space; `lean_deg` of its species is added to
    /// it.
    pub axis: [f32; 3],
    /// Height, metres.
    pub height_m: f32,
    /// Radius of the vertical cylinder around the stem that contains the plant, metres.
    pub radius_m: f32,
    /// Number of leaves, including cotyledons, visible or not.
    pub leaves: u16,
    /// Leaf area and cover; null in records of earlier versions and for a model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub traits: Option<PlantTraits>,
    /// Condition (holes, dead tissue, dust, wilting), if the scene file sets one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub condition: Option<Condition>,
}

/// One leaf in an image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Leaf {
    /// Number of the leaf in `leaves.png`.
    pub number: u16,
    /// Identity, as for a plant.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub id: Option<u32>,
    /// Pixels of the leaf in the image.
    pub seen: Seen,
    /// Base of the blade.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base: Option<Keypoint>,
    /// Tip of the blade.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tip: Option<Keypoint>,
    /// Area, size and angles; null in records of earlier versions, and for leaves of models and of imported plants.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub traits: Option<LeafTraits>,
}

/// Pixels of a plant or a leaf in an image.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Seen {
    /// Number of pixels whose centre shows it.
    pub pixels: u32,
    /// Number of pixels whose centre would show it without occlusion; null if unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unoccluded: Option<u32>,
    /// The same if, in addition, the image extended beyond its frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub whole: Option<u32>,
    /// Bounding box of its pixels: x, y, width, height; null if none is visible.
    #[serde(rename = "box")]
    pub bounds: Option<Box2>,
    /// Mask of its pixels.
    pub mask: Option<Rle>,
}

impl Seen {
    /// Returns the fraction of the part within the frame that is not occluded, `pixels` / `unoccluded`. 1 if unknown.
    pub fn visible_fraction(&self) -> f64 {
        fraction(self.pixels, self.unoccluded)
    }

    /// Returns the visible fraction of the whole, including occluded parts and parts outside the frame, `pixels` /
    /// `whole`. 1 if unknown.
    pub fn shown_fraction(&self) -> f64 {
        fraction(self.pixels, self.whole)
    }

    /// Returns the fraction of the whole that is within the frame, occluded or not, `unoccluded` / `whole`. 1 if
    /// unknown.
    pub fn inside_fraction(&self) -> f64 {
        self.unoccluded.map_or(1.0, |n| fraction(n, self.whole))
    }
}

fn fraction(part: u32, all: Option<u32>) -> f64 {
    all.filter(|n| *n > 0).map_or(1.0, |n| f64::from(part) / f64::from(n))
}

/// A point of a plant in the image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Keypoint {
    /// Distance from the left edge, pixels; may be outside the image.
    pub x: f32,
    /// Distance from the top edge, pixels; may be outside the image.
    pub y: f32,
    /// Visibility.
    pub state: PointState,
}

/// Visibility of a keypoint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PointState {
    /// Outside the image.
    Outside,
    /// In the image, occluded.
    Hidden,
    /// In the image, not occluded.
    Visible,
}

impl Record {
    /// Returns the plants with at least one visible pixel.
    pub fn seen(&self) -> impl Iterator<Item = &Plant> {
        self.plants.iter().filter(|p| p.seen.pixels > 0)
    }

    /// Returns the visible leaves of the visible plants, each with its plant, in the order of their numbers.
    pub fn leaves(&self) -> impl Iterator<Item = (&Plant, &Leaf)> {
        self.seen().flat_map(|p| p.leaves.iter().filter(|l| l.seen.pixels > 0).map(move |l| (p, l)))
    }
}
