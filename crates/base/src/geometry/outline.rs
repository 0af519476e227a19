//! Outline of a leaf blade, shared by the flat rest mesh and by the procedural texture of the blade.
//!
//! Along the midrib t runs from 0 (base) to 1 (tip). The half-width is `½W · t^a (1 − t)^b`, normalised to ½W at the
//! widest point, t = a / (a + b). Area = L·W·B(a + 1, b + 1)/norm with the Beta function B.
//!
//! A leaf image shows the blade with its tip at the top, its base at the bottom and the midrib on the middle column.
//! Length and width fill the image except for [`MARGIN`] on each side.

use crate::math::{ToFloat, Vec2, vec2};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};
use std::ops::Range;

/// Margin around the blade in its image, on each side, as a fraction of the blade's length and width.
pub const MARGIN: f32 = 0.04;

/// Allowed exponents. Beyond this range the widest point is at an end, or the blade is too thin to be visible.
const EXPONENTS: Range<f64> = 0.001..20.0;

/// [`EXPONENTS`] in words, for messages and the schema.
const EXPONENTS_IN_WORDS: &str = "at least 0.001 and below 20";

/// Texture coordinates of a blade point: `x` as a fraction of the full width (−½..½, positive to the right), `t` as a
/// fraction of the length.
pub fn uv(x: f32, t: f32) -> Vec2 {
    let scale = 1.0 / (1.0 + 2.0 * MARGIN);
    vec2(0.5 + x * scale, 1.0 - (t + MARGIN) * scale)
}

/// Outline of a leaf blade.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum Outline {
    /// `t^a (1 − t)^b`.
    Power {
        /// Exponent at the base: small values are blunt, values above 1 taper.
        #[serde(deserialize_with = "exponent")]
        #[schemars(extend("x-range" = EXPONENTS_IN_WORDS, "minimum" = EXPONENTS.start, "exclusiveMaximum" = EXPONENTS.end))]
        a: f32,
        /// Exponent at the tip.
        #[serde(deserialize_with = "exponent")]
        #[schemars(extend("x-range" = EXPONENTS_IN_WORDS, "minimum" = EXPONENTS.start, "exclusiveMaximum" = EXPONENTS.end))]
        b: f32,
    },
    /// The whole rectangle of the image: for photographs and for lobed leaves, whose alpha channel cuts the shape.
    Full,
}

/// Deserializes an exponent and checks its range.
fn exponent<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f32, D::Error> {
    let x = f64::deserialize(deserializer)?;
    let out_of_range = || D::Error::custom(format!("{x:?} is out of range: it must be {EXPONENTS_IN_WORDS}"));
    EXPONENTS.contains(&x).then_some(x.to_f32()).ok_or_else(out_of_range)
}

impl Outline {
    /// Half-width at `t` ∈ [0, 1] as a fraction of the full width, 0..½.
    pub fn half_width(self, t: f32) -> f32 {
        match self {
            Self::Full => 0.5,
            Self::Power { a, b } => {
                let peak = a / (a + b);
                let norm = peak.powf(a) * (1.0 - peak).powf(b);
                0.5 * t.clamp(0.0, 1.0).powf(a) * (1.0 - t.clamp(0.0, 1.0)).powf(b) / norm
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Source: area divided by L·W of the classic shapes (Beta function), to three digits.
    #[test]
    fn areas_are_those_of_the_beta_function() {
        for (a, b, area) in
            [(0.55, 1.1, 0.676), (0.6, 0.6, 0.757), (0.7, 1.4, 0.631), (2.0, 0.5, 0.532), (0.5, 0.5, 0.785)]
        {
            let o = Outline::Power { a, b };
            let n = 20_000;
            let sum: f32 =
                (0..n).map(|i| 2.0 * o.half_width((i.to_f32() + 0.5) / n.to_f32())).sum::<f32>() / n.to_f32();
            assert!((sum - area).abs() < 2e-3, "{a} {b}: {sum}");
        }
    }

    /// Rationale: an exponent out of range produced meshes of NaN, and these an invisible blade. Expected: an error
    /// that names the number and its position; half-widths up to ½ at both ends of the allowed range.
    #[test]
    fn exponents_of_no_shape_are_refused_where_they_stand() {
        for wrong in ["1e-30", "0.0", "-1.0", "20.0", "1e20", "inf", "NaN"] {
            for (text, column) in
                [(format!("Power(a: {wrong}, b: 0.5)"), 10), (format!("Power(a: 0.5, b: {wrong})"), 18)]
            {
                let error = ron::from_str::<Outline>(&text).unwrap_err();
                assert_eq!((error.span.start.line, error.span.start.col), (1, column), "{text}");
                assert!(error.to_string().contains(&format!("{wrong} is out of range")), "{error}");
            }
        }
        for (a, b) in [("0.001", "19.99"), ("19.99", "0.001"), ("0.001", "0.001"), ("19.99", "19.99")] {
            let outline: Outline = ron::from_str(&format!("Power(a: {a}, b: {b})")).unwrap();
            let widths = (0..=100).map(|i| outline.half_width(i.to_f32() / 100.0));
            assert!(widths.into_iter().all(|w| (0.0..=0.5001).contains(&w)), "{a} {b}");
        }
    }
}
