//! Sensor chip: from light to integers, one colour per pixel.
//!
//! | file | contents |
//! |---|---|
//! | `level` | meaning of a linear value: response of the channels, full well |
//! | `exposure` | exposure as a factor on the signal |
//! | `limits` | longest exposure time and largest analog gain |
//! | `shot` | record of an exposure |
//! | `noise` | electrons: shot and read noise, dark current, fixed pattern |
//! | `bayer` | Bayer mosaic and demosaicing |
//! | `adc` | quantisation above a black level |

mod adc;
mod bayer;
mod exposure;
mod level;
mod limits;
mod noise;
mod shot;

pub use adc::{Adc, AdcDesc, Black, Depth};
pub(super) use bayer::Mosaic;
pub use bayer::{Demosaic, MosaicDesc, Pattern};
pub use exposure::{Exposure, ExposureDesc, Percent};
pub(super) use level::{CLIP, RESPONSE};
pub use limits::{Limits, LimitsDesc};
pub(super) use limits::{LimitsWritten, Shutter};
pub(super) use noise::NoiseWritten;
pub use noise::{Noise, NoiseDesc};
pub use shot::ShotRecord;
