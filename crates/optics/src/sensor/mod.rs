//! Cameras, sensors and LiDARs: the ray of a pixel, the pixel of a point, and the conversion of radiance to bytes.
//!
//! | file | contents |
//! |---|---|
//! | `lens` | camera: intrinsics, distortion, pose, motion, point spread |
//! | `chip` | exposure, noise, mosaic, quantisation |
//! | `develop` | white balance, colour matrix, tone curve, sharpening, JPEG |
//! | `chain` | the sensor: the sequence of its steps |
//! | `lidar` | rotating LiDAR: pulses, beam width, reported echoes |
//! | `settings`, `preset`, `given` | sensor description in a scene file, named sensors, and overriding their values |
//! | `record` | record of a sampled sensor |
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
    Adc, AdcDesc, Black, Demosaic, Depth, Exposure, ExposureDesc, Limits, LimitsDesc, MosaicDesc, Noise, NoiseDesc,
    Pattern, Percent, ShotRecord,
};
pub use develop::{
    Jpeg, JpegDesc, MatrixDesc, MatrixRow, Quality, Sharpen, SharpenDesc, Tone, WhiteBalance, WhiteBalanceDesc,
};
pub use lens::{
    Aperture, ApertureDesc, ApertureRecord, Calibration, Camera, CameraDesc, CameraModel, CameraRecord, Distortion,
    DistortionDesc, Fisheye, IntrinsicsDesc, Lens, LensRecord, Motion, MotionDesc, MotionRecord, OpenCv, PixelBox,
    Pose, PoseDesc, Psf, PsfDesc,
};
pub use lidar::{BeamRay, BeamsDesc, LIDARS, Lidar, LidarDesc, Pulse, PulsesDesc, Returns};
pub use preset::PRESETS;
pub use record::SensorRecord;
pub use settings::SensorDesc;
