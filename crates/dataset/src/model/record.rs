//! What is known of one image in words and numbers: its `record.json`.

use crate::model::rle::{Box2, Rle};
use crate::model::split::Split;
use furrow_field::record::Conditions;
use furrow_field::traits::{Canopy, LeafTraits, PlantTraits};
use furrow_grow::plant::Condition;
use furrow_render::film::Sampling;
use furrow_render::scene::tag::{Class, lowercase};
use serde::{Deserialize, Serialize, Serializer, ser};

/// One image.
///
/// Pixels count from the top left; a point is in continuous pixel coordinates, where the first pixel's centre is (0.5, 0.5).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Its number in the dataset.
    pub index: u64,
    /// Its name: the number in six digits or more.
    pub name: String,
    /// What its file was called where it was imported from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// Which split it is in.
    pub split: Split,
    /// Which image of its field it is, where several are taken.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub capture: Option<CaptureRecord>,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Pixels of each class, in the order of their numbers.
    pub classes: Vec<ClassShare>,
    /// Pixels that have no label (imported images only).
    #[serde(default, skip_serializing_if = "is_zero")]
    pub ignored: u64,
    /// Its plants, by number: those that the image shows and those that others hide in it.
    pub plants: Vec<Plant>,
    /// What was drawn for it: camera, lights, soil, rows, stage; null for an imported image.
    #[serde(default, skip_serializing_if = "Option::is_none", serialize_with = "sorted")]
    pub conditions: Option<Conditions>,
    /// Leaf area over the ground that it shows; null in older records, for an imported image, and where the camera sees the horizon.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub canopy: Option<Canopy>,
    /// How the sensor was set; null for an imported image, and for one that is labels alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exposure: Option<Exposure>,
    /// How well it is sampled; left out where that is not known, and of a denoised image.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sampling: Option<Sampling>,
    /// What whoever made it should know.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
}

impl Record {
    /// Whether there is a photograph of it; a field that was labelled alone has none.
    pub fn has_photograph(&self) -> bool {
        self.exposure.is_some() || self.conditions.is_none()
    }
}

/// Writes conditions as records have always had them: keys in the order of the alphabet, numbers with the digits of double precision.
#[expect(clippy::ref_option, reason = "serde calls it with a reference to the field")]
fn sorted<S: Serializer>(conditions: &Option<Conditions>, serializer: S) -> Result<S::Ok, S::Error> {
    serde_json::to_value(conditions).map_err(ser::Error::custom)?.serialize(serializer)
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference to the field")]
fn is_zero(n: &u64) -> bool {
    *n == 0
}

/// One image of a drive, of a rig or of a day.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CaptureRecord {
    /// Number of the field.
    pub field: u64,
    /// The day on which it was taken, counted from the emergence of the field's first crop; left out of fields that have no days.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub day: Option<u32>,
    /// How many images its camera took before, on all days.
    pub frame: u32,
    /// Name of the camera.
    pub camera: String,
    /// When, seconds after the first image.
    pub time_s: f64,
}

/// How the sensor was set: by these numbers the photographs are the radiance's.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Exposure {
    /// Linear level (1 is white) of green per radiance, per W·m⁻²·sr⁻¹·nm⁻¹.
    pub gain: f32,
    /// The same in near infrared.
    pub nir_gain: f32,
    /// Gains of the white balance on R, G, B.
    pub white_balance: [f32; 3],
}

/// How much of an image a class has.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClassShare {
    /// The class.
    #[serde(with = "lowercase")]
    pub class: Class,
    /// Pixels whose centre shows it.
    pub pixels: u64,
    /// Sum over pixels of the share of it in each, in pixels; null without coverage.
    pub covered: Option<f64>,
}

/// One plant in an image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plant {
    /// Its number in `plants.png`.
    pub number: u32,
    /// Its identity, 32 bit and never 0: the same in every image of its field, whatever the camera, the resolution and the other
    /// plants in view; no other plant or leaf of the field has it. Null in older records and for an imported plant.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub id: Option<u32>,
    /// Crop or weed.
    #[serde(with = "lowercase")]
    pub class: Class,
    /// Its species' number in the dataset's table; 0 for one that has none.
    pub kind: u16,
    /// What the camera sees of it.
    pub seen: Seen,
    /// Where its stem meets the ground.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stem: Option<Keypoint>,
    /// What grew; null for an imported plant.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grown: Option<Grown>,
    /// Its leaves, by number.
    pub leaves: Vec<Leaf>,
}

/// What is known of a plant beyond its pixels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Grown {
    /// Common name as the species file has it, or the name of the model.
    pub species: String,
    /// EPPO code; empty for a model.
    pub eppo: String,
    /// Growth stage, BBCH.
    pub bbch: u32,
    /// Days after emergence.
    pub age_days: f32,
    /// Where its stem meets the ground, world, metres.
    pub position_m: [f32; 3],
    /// The axis that it was sown with, world, unit; `lean_deg` of its species comes on top.
    pub axis: [f32; 3],
    /// Its height, metres.
    pub height_m: f32,
    /// Radius of the upright cylinder about its stem that holds it, metres.
    pub radius_m: f32,
    /// Number of its leaves, seed leaves included, seen or not.
    pub leaves: u16,
    /// Its leaf area and cover; null in older records and for a model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub traits: Option<PlantTraits>,
    /// Its condition (holes, dead tissue, dust, wilting), where its scene file gave one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub condition: Option<Condition>,
}

/// One leaf in an image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Leaf {
    /// Its number in `leaves.png`.
    pub number: u16,
    /// Its identity, as a plant's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub id: Option<u32>,
    /// What the camera sees of it.
    pub seen: Seen,
    /// Where its blade begins.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base: Option<Keypoint>,
    /// Where its blade ends.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tip: Option<Keypoint>,
    /// Its area, size and angles; null in older records and for a leaf of a model or of an imported plant.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub traits: Option<LeafTraits>,
}

/// How much of a plant or a leaf an image shows.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Seen {
    /// Pixels whose centre shows it.
    pub pixels: u32,
    /// Pixels whose centre would show it if nothing stood before it; null where that is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unoccluded: Option<u32>,
    /// The same if the image also went on beyond its frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub whole: Option<u32>,
    /// The smallest box that holds its pixels: x, y, width, height; null where none is seen.
    #[serde(rename = "box")]
    pub bounds: Option<Box2>,
    /// Its pixels.
    pub mask: Option<Rle>,
}

impl Seen {
    /// Share of it, within the frame, that nothing hides: pixels over unoccluded pixels. 1 where that is not known.
    pub fn visible_fraction(&self) -> f64 {
        fraction(self.pixels, self.unoccluded)
    }

    /// Share of all of it that the image shows, hidden parts and parts beyond the frame counted. 1 where that is not known.
    pub fn shown_fraction(&self) -> f64 {
        fraction(self.pixels, self.whole)
    }

    /// Share of it that lies within the frame, hidden or not. 1 where that is not known.
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
    /// From the left edge, pixels; may lie outside the image.
    pub x: f32,
    /// From the top edge, pixels.
    pub y: f32,
    /// Whether it can be seen.
    pub state: PointState,
}

/// Whether a point can be seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PointState {
    /// Outside the image.
    Outside,
    /// In the image, behind something.
    Hidden,
    /// In the image, in sight.
    Visible,
}

impl Record {
    /// The plants that the image shows.
    pub fn seen(&self) -> impl Iterator<Item = &Plant> {
        self.plants.iter().filter(|p| p.seen.pixels > 0)
    }

    /// Plants and leaves that the image shows, each leaf with its plant; in the order of their numbers.
    pub fn leaves(&self) -> impl Iterator<Item = (&Plant, &Leaf)> {
        self.seen().flat_map(|p| p.leaves.iter().filter(|l| l.seen.pixels > 0).map(move |l| (p, l)))
    }
}
