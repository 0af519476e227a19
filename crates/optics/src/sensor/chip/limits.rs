//! Limits of the exposure: its time, the aperture and the analog gain.
//!
//! A pixel collects n = s · t · L / N² electrons, where L is the radiance, N the f-number, t the exposure time and s the
//! sensitivity of the sensor: s = π/4 · τ · A · ∫QE dλ · λ/(hc), with the lens transmission τ and the pixel area A. White
//! is 90 % of the full well at gain 1. An exposure first takes a longer time, up to the longest; then it amplifies the
//! electrons, up to the largest gain. What is missing then stays dark.
//!
//! Sources: EMVA 1288, release 4.0, §2; the camera equation, e.g. Holst & Lomheim, "CMOS/CCD Sensors and Camera Systems".

use super::level::CLIP;
use crate::sensor::given::{Given, layered};
use furrow_base::ron_file::{NonNegative, Num, Positive};
use serde::Serialize;

layered! {
    /// Limits of the exposure. The defaults describe the JAI AD-130 in continuous operation.
    #[derive(Clone, Debug, PartialEq, Serialize, schemars::JsonSchema)]
    #[schemars(default)]
    pub struct LimitsDesc, LimitsWritten = "LimitsDesc" {
        /// Whether the exposure is limited; default true. Without limits the exposure time is as long as necessary.
        pub on: bool = Given<bool>,
        /// Longest exposure time; default 31.76, one frame at 31 frames per second.
        pub longest_ms: Num<Positive<60_000>> = Given<Num<Positive<60_000>>>,
        /// Largest analog gain, decibels; default 12.
        pub gain_db: Num<NonNegative<60>> = Given<Num<NonNegative<60>>>,
        /// F-number of a camera without an aperture of its own; default 4.
        pub f_number: Num<Positive<1000>> = Given<Num<Positive<1000>>>,
        /// Electrons per second that a green pixel collects behind a lens of f-number 1 from a radiance of
        /// 1 W·m⁻²·sr⁻¹·nm⁻¹; default 1.04e9.
        pub sensitivity: Num<Positive<1_000_000_000_000>> = Given<Num<Positive<1_000_000_000_000>>>,
    }
}

impl Default for LimitsDesc {
    fn default() -> Self {
        Self {
            on: true,
            longest_ms: Num::new(31.76),
            gain_db: Num::new(12.0),
            f_number: Num::new(4.0),
            sensitivity: Num::new(1.04e9),
        }
    }
}

impl LimitsDesc {
    /// Creates the limits of a sensor with pixels of this full well.
    pub fn build(&self, full_well: f32) -> Limits {
        let limited = |most: f32| if self.on { most } else { f32::INFINITY };
        Limits {
            longest_s: limited(self.longest_ms.f32() * 1e-3),
            gain: limited(10.0_f32.powf(self.gain_db.f32() / 20.0)),
            f_number: self.f_number.f32(),
            sensitivity: self.sensitivity.f32(),
            white: full_well / CLIP,
        }
    }
}

/// Limits of a sensor's exposure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Longest exposure time, seconds.
    pub longest_s: f32,
    /// Largest analog gain, as a factor.
    pub gain: f32,
    /// F-number of a camera without an aperture.
    pub f_number: f32,
    /// Electrons per second of a green pixel, per W·m⁻²·sr⁻¹·nm⁻¹ at f-number 1.
    pub sensitivity: f32,
    /// Electrons of white at gain 1.
    pub white: f32,
}

/// Exposure within the limits of a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::sensor) struct Shutter {
    /// Level (1 is white) per unit of signal.
    pub(in crate::sensor) level: f32,
    /// Analog gain: level per electron, relative to that at gain 1.
    pub(in crate::sensor) gain: f32,
    /// Exposure time, seconds.
    pub(in crate::sensor) time_s: f32,
}

impl Limits {
    /// Returns the exposure that comes closest to `level` per unit of signal, with the camera's f-number and its fixed
    /// exposure time, if it has them. A fixed time that is too long has its light reduced by a smaller aperture.
    pub(in crate::sensor) fn shutter(&self, level: f32, f_number: Option<f32>, fixed_s: Option<f32>) -> Shutter {
        let n = f_number.unwrap_or(self.f_number);
        // Level per signal and second at gain 1.
        let rate = self.sensitivity / (n * n * self.white);
        let longest = fixed_s.unwrap_or(self.longest_s);
        let most = rate * longest;
        match level / most {
            gain if gain <= 1.0 => Shutter { level, gain: 1.0, time_s: fixed_s.unwrap_or(level / rate) },
            gain if gain <= self.gain => Shutter { level, gain, time_s: longest },
            _ => Shutter { level: most * self.gain, gain: self.gain, time_s: longest },
        }
    }
}
