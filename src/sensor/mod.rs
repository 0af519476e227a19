//! The camera: which ray belongs to a pixel, which pixel to a point; and the sensor that turns radiance into bytes. And the LiDAR.
//!
//! | file | idea |
//! |---|---|
//! | `lens` | a camera: what it is, how it bends rays, where it stands, how it moves, what it blurs |
//! | `chip` | exposure, noise, mosaic, whole numbers |
//! | `develop` | white balance, colour matrix, tone curve, sharpening, JPEG |
//! | `chain` | the sensor: its steps in their order |
//! | `lidar` | a rotating LiDAR: its pulses, their width, the echoes that it tells |
//! | `settings`, `preset`, `given` | a sensor as a scene file writes it, sensors by their names, and values left to them |
//! | `record` | a sensor as it was drawn |
//!
//! OpenCV's conventions throughout: camera x right, y down, z forward; pixel (0, 0) covers 0 to 1 and has its centre at 0.5;
//! intrinsics in pixels. Intrinsics are f64, rays f32.

mod chain;
mod chip;
mod develop;
mod given;
mod lens;
mod lidar;
mod preset;
mod record;
mod settings;
#[cfg(test)]
mod tests;

pub use chain::{Deep, Linear, Photograph, Sensor};
pub use chip::{
    Adc, AdcDesc, Black, Demosaic, Depth, Exposure, ExposureDesc, MosaicDesc, Noise, NoiseDesc, Pattern, Percent,
};
pub use develop::{
    Jpeg, JpegDesc, MatrixDesc, MatrixRow, Quality, Sharpen, SharpenDesc, Tone, WhiteBalance, WhiteBalanceDesc,
};
pub use lens::{
    Aperture, ApertureDesc, ApertureRecord, Camera, CameraDesc, CameraModel, CameraRecord, Distortion, DistortionDesc,
    IntrinsicsDesc, Motion, MotionDesc, MotionRecord, PixelBox, Pose, PoseDesc, Psf, PsfDesc,
};
pub use lidar::{BeamRay, BeamsDesc, LIDARS, Lidar, LidarDesc, Pulse, PulsesDesc, Returns};
pub use preset::PRESETS;
pub use record::SensorRecord;
pub use settings::SensorDesc;
