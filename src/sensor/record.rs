//! What was drawn of a sensor, for those who measure in its images.

use super::chain::Sensor;
use serde::{Deserialize, Serialize};

/// What was drawn of a sensor's steps behind the noise and before it; each is there where it was taken.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SensorRecord {
    /// Standard deviations of the blur, colour and NIR.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub psf_px: Option<[f32; 2]>,
    /// How far outside their places red and blue lie in the corners.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shift_px: Option<[f32; 2]>,
    /// The colour matrix, row by row.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub matrix: Option<[[f32; 3]; 3]>,
    /// Amount of the sharpening, and its radius in pixels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sharpen: Option<[f32; 2]>,
    /// Quality of the compression.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub jpeg_quality: Option<u32>,
}

impl Sensor {
    /// What was drawn of its steps; `None` where none of them is taken.
    pub fn record(&self) -> Option<SensorRecord> {
        let record = SensorRecord {
            psf_px: (self.psf.color > 0.0 || self.psf.nir > 0.0).then_some([self.psf.color, self.psf.nir]),
            shift_px: (self.psf.shift != [0.0; 2]).then_some(self.psf.shift),
            matrix: self.matrix,
            sharpen: (self.sharpen.amount > 0.0).then_some([self.sharpen.amount, self.sharpen.radius]),
            jpeg_quality: self.jpeg.map(|jpeg| jpeg.quality),
        };
        (record != SensorRecord::default()).then_some(record)
    }
}
