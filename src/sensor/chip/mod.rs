//! The chip: from light to whole numbers, one colour a pixel.
//!
//! | file | idea |
//! |---|---|
//! | `level` | what a linear value means: response of the channels, full well |
//! | `exposure` | how long the shutter is open, as a factor |
//! | `noise` | electrons: shot and read noise, dark current, fixed pattern |
//! | `bayer` | which colour a pixel sees, and interpolation of the others |
//! | `adc` | whole numbers above a black level |

mod adc;
mod bayer;
mod exposure;
mod level;
mod noise;

pub use adc::{Adc, AdcDesc, Black, Depth};
pub(super) use bayer::Mosaic;
pub use bayer::{Demosaic, MosaicDesc, Pattern};
pub use exposure::{Exposure, ExposureDesc, Percent};
pub(super) use level::{CLIP, RESPONSE};
pub(super) use noise::NoiseWritten;
pub use noise::{Noise, NoiseDesc};
