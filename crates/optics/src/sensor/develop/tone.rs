//! Tone curve: a soft shoulder for the highlights, followed by the display's transfer function.

use crate::sensor::chip::CLIP;
use furrow_base::ron_file::{Num, Positive};
use serde::{Deserialize, Serialize};

/// Tone curve from linear sensor values (1 is white) to stored values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum Tone {
    /// Shoulder that compresses the highlights, then sRGB; resembles photographic film.
    #[default]
    Film,
    /// sRGB, clipped at white.
    Srgb,
    /// `Film` with darker shadows and brighter highlights, as in phones.
    SCurve,
    /// The linear value to the power 1/γ, clipped at white; 2.2 is close to sRGB.
    Gamma(Num<Positive<10>>),
    /// Proportional, clipped at white; for measurements.
    Linear,
}

/// Linear value at which the shoulder starts.
const KNEE: f32 = 0.6;

impl Tone {
    /// Returns the stored value, 0 to 1, of a linear value; monotonically increasing.
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

/// Returns the mean of the value and 3v² − 2v³, which preserves black, the middle and white.
fn contrasted(v: f32) -> f32 {
    0.5 * (v + v * v * (3.0 - 2.0 * v))
}

/// Identity up to the knee. From there to the clip value, the remaining distance is raised to a power so that the slope
/// is continuous at the knee and the curve reaches 1 with slope 0: y = 1 − (1 − knee)(1 − t)^m with m = (clip −
/// knee)/(1 − knee).
fn shoulder(x: f32) -> f32 {
    if x <= KNEE {
        return x;
    }
    let left = ((CLIP - x) / (CLIP - KNEE)).max(0.0);
    1.0 - (1.0 - KNEE) * left.powf((CLIP - KNEE) / (1.0 - KNEE))
}

/// Transfer function of IEC 61966-2-1.
fn srgb(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    if x <= 0.0031308 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::ToFloat;

    #[test]
    fn curves_rise_from_black_to_white() {
        for tone in [Tone::Film, Tone::Srgb, Tone::SCurve, Tone::Gamma(Num::new(2.2)), Tone::Linear] {
            let bytes = [-0.1, 0.0, CLIP, 9.0].map(|x| (tone.apply(x) * 255.0).round());
            assert_eq!(bytes, [0.0, 0.0, 255.0, 255.0], "{tone:?}");
            let steps: Vec<f32> = (0..=2000).map(|i| tone.apply(i.to_f32() * CLIP / 2000.0)).collect();
            assert!(steps.is_sorted(), "{tone:?}");
        }
        let middle = Tone::Gamma(Num::new(2.0)).apply(0.25);
        assert!((middle - 0.5).abs() < 1e-6 && (contrasted(0.5) - 0.5).abs() < 1e-6 && contrasted(0.2) < 0.16);
        assert!((shoulder(KNEE + 1e-3) - KNEE - 1e-3).abs() < 1e-5, "the knee bends");
    }
}
