//! Record of a sampled sensor, for measurements in its images.

use super::chain::Sensor;
use serde::{Deserialize, Serialize};

/// Sampled values of a sensor's steps before and after the noise; steps that are off are absent.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SensorRecord {
    /// Standard deviations of the blur of colour and NIR.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub psf_px: Option<[f32; 2]>,
    /// Outward shifts of red and blue in the corners.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shift_px: Option<[f32; 2]>,
    /// Colour matrix, row by row.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub matrix: Option<[[f32; 3]; 3]>,
    /// Amount of sharpening, and its radius in pixels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sharpen: Option<[f32; 2]>,
    /// JPEG quality.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub jpeg_quality: Option<u32>,
}

impl Sensor {
    /// Returns the record of the sampled steps; `None` if all of them are off.
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
