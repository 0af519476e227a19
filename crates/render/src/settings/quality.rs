//! Sampling quality: criteria for when to stop adding samples.

use std::time::Duration;

/// When to stop adding samples: at a fixed number, at a target error, or at a time limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// Samples per pixel, 1 to [`Sampler::MAX_SAMPLES`](furrow_base::sampling::Sampler::MAX_SAMPLES). The maximum if a
    /// target error or time limit is set.
    pub spp: u32,
    /// Sample each tile until its median relative error is expected to be this, e.g. 0.02 for 2 %. From 0.0001 to 1.
    pub target_error: Option<f32>,
    /// Stop in time for the files to be written within this limit. The number of samples, and thus the image, depends
    /// on the machine.
    pub time: Option<Duration>,
    /// Denoise with Open Image Denoise.
    pub denoise: bool,
}

impl Default for Quality {
    /// [`Quality::SPP`] samples per pixel, not denoised.
    fn default() -> Self {
        Self::spp(Self::SPP)
    }
}

impl Quality {
    /// Default number of samples per pixel.
    pub const SPP: u32 = 64;
    /// Default maximum number of samples per pixel with a target error or time limit.
    pub const MOST_SPP: u32 = 4096;

    /// A fixed number of samples per pixel.
    pub const fn spp(spp: u32) -> Self {
        Self { spp, target_error: None, time: None, denoise: false }
    }

    /// Adaptive sampling to this median relative error.
    pub const fn error(target: f32) -> Self {
        Self { spp: Self::MOST_SPP, target_error: Some(target), time: None, denoise: false }
    }

    /// Best image within a time limit.
    pub const fn within(time: Duration) -> Self {
        Self { spp: Self::MOST_SPP, target_error: None, time: Some(time), denoise: false }
    }

    /// Enables denoising.
    #[must_use]
    pub const fn denoised(self) -> Self {
        Self { denoise: true, ..self }
    }

    /// Returns `true` if the number of samples is fixed in advance.
    pub fn is_fixed(&self) -> bool {
        self.target_error.is_none() && self.time.is_none()
    }
}
