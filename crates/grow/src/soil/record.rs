//! Record of the drawn parameters of a ground.

use furrow_base::math::Spectrum;
use serde::{Deserialize, Serialize};

/// Ground of one field.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SoilRecord {
    /// Moisture.
    pub moisture: MoistureRecord,
    /// Mean reflectance of the dry soil, R, G, B, NIR, if the scene file names colours; else that of loess, which
    /// determines the NIR.
    pub reflectance: Spectrum,
    /// The layers in the order of the scene file.
    pub layers: Vec<LayerRecord>,
    /// Size of the largest patches of one layer.
    pub blend_scale_m: f64,
    /// Sharpness of the borders between layers: 0 mixes evenly.
    pub blend_sharpness: f32,
    /// Relief.
    pub relief: ReliefRecord,
    /// Effect of rain since the last tillage, 0..1.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub slaked: f32,
    /// Cracks; `None` if there are none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cracks: Option<CracksRecord>,
    /// Soil aggregates.
    pub clods: ClodsRecord,
    /// Fraction of the ground covered by stones, for each population.
    pub stones_cover: Vec<f32>,
    /// Plant residue.
    pub litter: LitterRecord,
}

/// Moisture of one ground: 0 air-dry, 1 saturated.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MoistureRecord {
    /// Requested mean; the actual one may differ, since values are clamped to 0..1.
    pub mean: f32,
    /// Standard deviation of the patches.
    pub spread: f32,
    /// Size of the patches, metres.
    pub patch_m: f64,
}

/// One layer of one ground.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LayerRecord {
    /// File name of its albedo texture, without folder.
    pub name: String,
    /// Share relative to the other layers; all sum to one. Noise and heights then decide which layer covers a place.
    pub share: f32,
}

/// Track of one wheel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WheelRecord {
    /// Distance from the world's origin to the centre line of the track, across the rows.
    pub middle_m: f32,
    /// Width.
    pub width_mm: f32,
    /// Depth of the track's floor.
    pub depth_mm: f32,
    /// Distance between lugs; 0 for a smooth tyre.
    pub lugs_mm: f32,
    /// Distance between repeated tracks; 0 for a single track.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub every_m: f32,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks by reference")]
fn is_zero(value: &f32) -> bool {
    *value == 0.0
}

/// Marks of a tool on one ground.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ToolRecord {
    /// Distance between grooves.
    pub spacing_mm: f32,
    /// Depth of the grooves.
    pub depth_mm: f32,
    /// Angle between the grooves and the rows.
    pub angle_deg: f32,
    /// Fraction of roughness and clods that is pressed flat.
    pub pressed: f32,
}

/// Cracks of one ground.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CracksRecord {
    /// Fraction of the ground that is cracked.
    pub cover: f32,
    /// Width of the plates.
    pub plate_mm: f32,
    /// Width of the oldest cracks.
    pub width_mm: f32,
    /// Depth of the oldest cracks.
    pub depth_mm: f32,
    /// Height of the plates' rims.
    pub curl_mm: f32,
}

/// Relief of one ground.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReliefRecord {
    /// Root mean square height of the noise.
    pub rms_mm: f32,
    /// Hurst exponent.
    pub hurst: f32,
    /// Longest wavelength.
    pub longest_m: f32,
    /// Slope of the field.
    pub tilt_deg: f32,
    /// Direction in which the ground rises, clockwise from north.
    pub tilt_azimuth_deg: f32,
    /// Wheel tracks.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub wheels: Vec<WheelRecord>,
    /// Marks of tools over the whole ground.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tools: Vec<ToolRecord>,
    /// Press wheel imprint along the rows; `None` if nothing was sown.
    pub row: Option<RowReliefRecord>,
}

/// Profile across a seed row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RowReliefRecord {
    /// Depth of the furrow.
    pub depth_mm: f32,
    /// Width of the furrow.
    pub width_mm: f32,
    /// Height of the ridge.
    pub ridge_mm: f32,
    /// Fraction of roughness and clods that is pressed flat in the furrow.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub pressed: f32,
}

/// Aggregates of one ground: the number longer than L is proportional to L^−exponent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClodsRecord {
    /// Number of aggregates longer than 5 mm, per m².
    pub over_5mm_per_m2: f32,
    /// Exponent of the power law.
    pub exponent: f32,
    /// Fraction of the number of crumbs that the power law gives.
    pub crumbs_amount: f32,
    /// Fraction of the ground's moisture that dry aggregates have lost.
    pub dryness: f32,
    /// Fraction of aggregates that have lost none.
    pub damp: f32,
    /// Looseness of the clods: 0 for normal sinking, 1 for none.
    pub loose: f32,
    /// Fraction of joints and pores that fine earth fills.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub filled: f32,
}

/// Litter of one ground.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LitterRecord {
    /// Fraction of the ground covered by straw.
    pub straw_cover: f32,
    /// Number of standing stalks per m².
    #[serde(default, skip_serializing_if = "is_zero")]
    pub stubble_per_m2: f32,
    /// Number of sticks per m².
    pub sticks_per_m2: f32,
    /// Number of bits of dead leaves and roots per m².
    pub bits_per_m2: f32,
    /// Mean weathering of straw.
    pub weathering: f32,
}
