//! What a field knows of itself beside its meshes: who may grow in it, and under what conditions.

use super::assemble::{Lighting, Season};
use super::tag::{Class, lowercase};
use crate::light::LightRecord;
use crate::scatter::{RowsRecord, WeedsRecord};
use crate::sensor::{CameraRecord, SensorRecord};
use crate::soil::SoilRecord;
use serde::{Deserialize, Serialize};

/// One of the species that a scene file can draw, or a model from disk.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SpeciesRecord {
    /// English name; of a model its file's name.
    pub name: String,
    /// EPPO code; empty for a model.
    pub eppo: String,
    /// Crop or weed.
    #[serde(with = "lowercase")]
    pub class: Class,
}

/// What was drawn for one field. Every number is SI or carries its unit in its name; bands are R, G, B, NIR.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Conditions {
    /// Who looks, at the size of the image.
    pub camera: CameraRecord,
    /// What its sensor does beyond counting light; none where that is all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensor: Option<SensorRecord>,
    /// What shines, in the order of the scene file.
    pub lights: Vec<LightRecord>,
    /// Which of the scene file's lists of lights are among them; left out where it has none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lighting: Vec<Lighting>,
    /// The ground; none where the scene file has none.
    pub soil: Option<SoilRecord>,
    /// What was sown, in the order of the scene file.
    pub crops: Vec<CropRecord>,
    /// What came by itself, in the order of the scene file.
    pub weeds: Vec<WeedRecord>,
    /// Which of the scene file's growths all plants have.
    pub season: Season,
}

/// One crop of a field.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CropRecord {
    /// Scientific name.
    pub species: String,
    /// Where it was drilled.
    pub rows: RowsRecord,
}

/// One weed of a field.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WeedRecord {
    /// Scientific name.
    pub species: String,
    /// How densely it came and how it gathers.
    pub spread: WeedsRecord,
}
