//! When there are samples enough.

use std::time::Duration;

/// When there are samples enough: after a fixed number, at a target error, or when the time is up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// Samples a pixel, 1 to [`Sampler::MAX_SAMPLES`](crate::sampling::Sampler::MAX_SAMPLES); the most where an error or a time decides.
    pub spp: u32,
    /// Sample each tile until its median relative error is expected to be this: 0.02 for 2 %. From 0.0001 to 1.
    pub target_error: Option<f32>,
    /// Stop in time for the files to be there. What more samples would change, this decides: the image depends on the machine.
    pub time: Option<Duration>,
    /// Remove noise with Open Image Denoise.
    pub denoise: bool,
}

impl Default for Quality {
    /// [`Quality::SPP`] samples a pixel, not denoised.
    fn default() -> Self {
        Self::spp(Self::SPP)
    }
}

impl Quality {
    /// Samples a pixel unless said otherwise.
    pub const SPP: u32 = 64;
    /// Most samples a pixel, unless said otherwise, where an error or a time decides.
    pub const MOST_SPP: u32 = 4096;

    /// So many samples a pixel.
    pub const fn spp(spp: u32) -> Self {
        Self { spp, target_error: None, time: None, denoise: false }
    }

    /// As many samples as this median relative error needs, where it needs them.
    pub const fn error(target: f32) -> Self {
        Self { spp: Self::MOST_SPP, target_error: Some(target), time: None, denoise: false }
    }

    /// The best image within this time.
    pub const fn within(time: Duration) -> Self {
        Self { spp: Self::MOST_SPP, target_error: None, time: Some(time), denoise: false }
    }

    /// The same, denoised.
    #[must_use]
    pub const fn denoised(self) -> Self {
        Self { denoise: true, ..self }
    }

    /// Whether the number of samples is known beforehand.
    pub fn is_fixed(&self) -> bool {
        self.target_error.is_none() && self.time.is_none()
    }
}
