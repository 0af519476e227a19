//! Records of a field that are written beside its images: species that the scene file can place, and conditions drawn for the field.

use super::lighting::Lighting;
use super::season::Season;
use crate::desc::Detail;
use crate::horizon::HorizonRecord;
use furrow_grow::scatter::{RowsRecord, WeedsRecord};
use furrow_grow::soil::SoilRecord;
use furrow_optics::light::LightRecord;
use furrow_optics::sensor::{CameraRecord, SensorRecord};
use furrow_render::scene::tag::{Class, lowercase};
use serde::{Deserialize, Serialize};

/// A species that a scene file can place, or a model from disk.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SpeciesRecord {
    /// English name; for a model its name in the scene file, or else its file name without folder and extension.
    pub name: String,
    /// EPPO code; empty for a model.
    pub eppo: String,
    /// Crop or weed.
    #[serde(with = "lowercase")]
    pub class: Class,
}

/// Values drawn for one field. Every number is in SI units or carries its unit in its name; bands are R, G, B, NIR.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Conditions {
    /// Camera, at the size of the image.
    pub camera: CameraRecord,
    /// Sensor effects beyond counting light; `None` for an ideal sensor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensor: Option<SensorRecord>,
    /// Lights, in the order of the scene file.
    pub lights: Vec<LightRecord>,
    /// Choices made for each `OneOf` among the scene file's lights; left out if it has none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lighting: Vec<Lighting>,
    /// Ground; `None` if the scene file has none.
    pub soil: Option<SoilRecord>,
    /// Hedge and haze beyond the field; left out if the scene file has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub horizon: Option<HorizonRecord>,
    /// Sown crops and models in rows, in the order of the scene file.
    pub crops: Vec<CropRecord>,
    /// Weeds and models sown by density, in the order of the scene file.
    pub weeds: Vec<WeedRecord>,
    /// Index into the scene file's `Either` lists of growths that applies to all plants.
    pub season: Season,
    /// Level of geometric detail that `detail: Auto` chose; left out if it is `Full`, and if the scene file sets the level.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub detail: Option<Detail>,
}

/// One crop of a field.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CropRecord {
    /// English name of the species; of a model its name, or else its file name without folder and extension.
    pub species: String,
    /// Seed rows.
    pub rows: RowsRecord,
}

/// One weed of a field.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WeedRecord {
    /// English name of the species; of a model its name, or else its file name without folder and extension.
    pub species: String,
    /// Density and clustering.
    pub spread: WeedsRecord,
}
