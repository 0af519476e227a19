//! The ground as it was drawn.

use crate::math::Spectrum;
use serde::{Deserialize, Serialize};

/// The ground of one field.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SoilRecord {
    /// How wet it is.
    pub moisture: MoistureRecord,
    /// Mean reflectance of the dry soil, R, G, B, NIR, where the scene file names colours; of loess, whose NIR is taken, where it does not.
    pub reflectance: Spectrum,
    /// The layers in the order of the scene file.
    pub layers: Vec<LayerRecord>,
    /// Size of the largest patches of one layer.
    pub blend_scale_m: f64,
    /// How hard the borders between them are: 0 mixes evenly.
    pub blend_sharpness: f32,
    /// The shape of the ground.
    pub relief: ReliefRecord,
    /// Aggregates.
    pub clods: ClodsRecord,
    /// Share of the ground under stones, one number a population.
    pub stones_cover: Vec<f32>,
    /// What plants of former years left.
    pub litter: LitterRecord,
}

/// Moisture of one ground: 0 air-dry, 1 saturated.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MoistureRecord {
    /// Mean asked for; patches that would be drier than dry cut it off.
    pub mean: f32,
    /// Standard deviation of the patches.
    pub spread: f32,
    /// Size of the patches.
    pub patch_m: f64,
}

/// One layer of one ground.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LayerRecord {
    /// File of its colour, without its folder.
    pub name: String,
    /// Its share beside the others; all sum to one. Of the weights before noise decides who lies where.
    pub share: f32,
}

/// One wheel's track.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WheelRecord {
    /// From the world's origin to the middle of the track, across the rows.
    pub middle_m: f32,
    /// Width.
    pub width_mm: f32,
    /// Depth of the floor.
    pub depth_mm: f32,
    /// From lug to lug; 0 for a smooth tyre.
    pub lugs_mm: f32,
    /// From one track to the next; 0 for one alone.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub every_m: f32,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks by reference")]
fn is_zero(metres: &f32) -> bool {
    *metres == 0.0
}

/// The shape of one ground.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReliefRecord {
    /// Root mean square height of the noise alone.
    pub rms_mm: f32,
    /// Hurst exponent.
    pub hurst: f32,
    /// Longest wavelength.
    pub longest_m: f32,
    /// Slope of the field.
    pub tilt_deg: f32,
    /// Side towards which it rises, clockwise from north.
    pub tilt_azimuth_deg: f32,
    /// Tracks of wheels.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub wheels: Vec<WheelRecord>,
    /// The print of the press wheel along the rows; none where nothing was sown.
    pub row: Option<RowReliefRecord>,
}

/// The profile across a seed row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RowReliefRecord {
    /// Depth of the furrow.
    pub depth_mm: f32,
    /// Its width.
    pub width_mm: f32,
    /// Height of the ridge.
    pub ridge_mm: f32,
}

/// The aggregates of one ground: how many are longer than L goes as L^−exponent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClodsRecord {
    /// How many are longer than 5 mm.
    pub over_5mm_per_m2: f32,
    /// The exponent.
    pub exponent: f32,
    /// Share of the crumbs that the law asks for.
    pub crumbs_amount: f32,
    /// Share of the ground's moisture that they have lost.
    pub dryness: f32,
    /// Share of them that have lost none.
    pub damp: f32,
    /// Share of their sinking that clods are spared.
    pub loose: f32,
}

/// The litter of one ground.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LitterRecord {
    /// Share of the ground under straw.
    pub straw_cover: f32,
    /// Sticks.
    pub sticks_per_m2: f32,
    /// Bits of dead leaves and roots.
    pub bits_per_m2: f32,
    /// Mean weathering of straw.
    pub weathering: f32,
}
