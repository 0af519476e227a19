//! From linear values to stored ones: a soft shoulder for the highlights, then the curve that screens expect.

use crate::ron_file::{Num, Positive};
use crate::sensor::chip::CLIP;
use serde::{Deserialize, Serialize};

/// The curve from linear sensor values (1 is white) to what is stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum Tone {
    /// A shoulder that rolls the highlights off, then sRGB: looks like a photograph.
    #[default]
    Film,
    /// sRGB, clipped at white.
    Srgb,
    /// `Film`, with darker shadows and brighter lights: what phones make of a picture.
    SCurve,
    /// The power 1/γ of the linear value, clipped at white; 2.2 is near sRGB.
    Gamma(Num<Positive>),
    /// Proportional, clipped at white: for measuring.
    Linear,
}

/// Where the shoulder begins.
const KNEE: f32 = 0.6;

impl Tone {
    /// The stored value, 0 to 1, of a linear one. Never falls as the value rises.
    pub fn apply(self, linear: f32) -> f32 {
        match self {
            Self::Film => srgb(shoulder(linear)),
            Self::Srgb => srgb(linear),
            Self::SCurve => contrasted(srgb(shoulder(linear))),
            Self::Gamma(gamma) => linear.clamp(0.0, 1.0).powf(1.0 / gamma.f32()),
            Self::Linear => linear.clamp(0.0, 1.0),
        }
    }
}

/// Half of the way from a value to 3v² − 2v³, which leaves black, the middle and white where they are.
fn contrasted(v: f32) -> f32 {
    0.5 * (v + v * v * (3.0 - 2.0 * v))
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
        for tone in [Tone::Film, Tone::Srgb, Tone::SCurve, Tone::Gamma(Num::new(2.2)), Tone::Linear] {
            let bytes = [-0.1, 0.0, CLIP, 9.0].map(|x| (tone.apply(x) * 255.0).round());
            assert_eq!(bytes, [0.0, 0.0, 255.0, 255.0], "{tone:?}");
            let steps: Vec<f32> = (0..=2000).map(|i| tone.apply(i as f32 * CLIP / 2000.0)).collect();
            assert!(steps.is_sorted(), "{tone:?}");
        }
        let middle = Tone::Gamma(Num::new(2.0)).apply(0.25);
        assert!((middle - 0.5).abs() < 1e-6 && (contrasted(0.5) - 0.5).abs() < 1e-6 && contrasted(0.2) < 0.16);
        assert!((shoulder(KNEE + 1e-3) - KNEE - 1e-3).abs() < 1e-5, "the knee bends");
    }
}
