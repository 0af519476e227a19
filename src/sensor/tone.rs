//! From linear values to 8 bits: a soft shoulder for the highlights, then the curve that screens expect.

use serde::{Deserialize, Serialize};

/// The curve from linear sensor values (1 is white) to what is stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Tone {
    /// A shoulder that rolls the highlights off, then sRGB: looks like a photograph.
    #[default]
    Film,
    /// sRGB, clipped at white.
    Srgb,
    /// Proportional, clipped at white: for measuring.
    Linear,
}

/// Where the shoulder begins.
const KNEE: f32 = 0.6;

/// The largest linear value a sensor gives: a tenth above white.
pub(super) const CLIP: f32 = 1.0 / 0.9;

impl Tone {
    /// The stored value, 0 to 1, of a linear one. Never falls as the value rises.
    pub fn apply(self, linear: f32) -> f32 {
        match self {
            Self::Film => srgb(shoulder(linear)),
            Self::Srgb => srgb(linear),
            Self::Linear => linear.clamp(0.0, 1.0),
        }
    }

    /// The same in 8 bits, rounded.
    pub fn byte(self, linear: f32) -> u8 {
        (self.apply(linear) * 255.0 + 0.5) as u8
    }
}

/// The identity up to the knee; from there to the clip value a power of the way left, leaving the knee without a bend and
/// reaching 1 level: y = 1 − (1 − knee)(1 − t)^m with m = (clip − knee)/(1 − knee).
fn shoulder(x: f32) -> f32 {
    if x <= KNEE {
        return x;
    }
    let left = ((CLIP - x) / (CLIP - KNEE)).max(0.0);
    1.0 - (1.0 - KNEE) * left.powf((CLIP - KNEE) / (1.0 - KNEE))
}

/// The transfer function of IEC 61966-2-1.
fn srgb(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    if x <= 0.0031308 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_rise_from_black_to_white() {
        for tone in [Tone::Film, Tone::Srgb, Tone::Linear] {
            assert_eq!(tone.byte(-0.1), 0);
            assert_eq!(tone.byte(0.0), 0);
            assert_eq!(tone.byte(CLIP), 255);
            assert_eq!(tone.byte(9.0), 255);
            let steps: Vec<f32> = (0..=2000).map(|i| tone.apply(i as f32 * CLIP / 2000.0)).collect();
            assert!(steps.is_sorted(), "{tone:?}");
        }
        assert!((shoulder(KNEE + 1e-3) - KNEE - 1e-3).abs() < 1e-5, "the knee bends");
    }
}
