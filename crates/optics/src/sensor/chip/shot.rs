//! Record of an exposure: what the four bands of an image collected.

use serde::{Deserialize, Serialize};

/// Exposure of the four bands of an image, R, G, B, NIR.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShotRecord {
    /// Exposure time, seconds.
    pub time_s: [f32; 4],
    /// Analog gain, as a factor.
    pub analog_gain: [f32; 4],
    /// Electrons of a pixel at which its band saturates: the full well, or less with analog gain.
    pub full_scale_electrons: [f32; 4],
    /// Fraction of the pixels that are saturated before noise is added.
    pub saturated: [f32; 4],
}
