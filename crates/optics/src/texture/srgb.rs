//! Conversion between 8-bit codes and linear values by lookup tables. Source: IEC 61966-2-1.

use furrow_base::math::{RoundTo, ToFloat, ToInt};
use std::sync::LazyLock;

/// Encoding of 8-bit values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum ColorSpace {
    /// sRGB colour, as written by cameras and image editors.
    Srgb,
    /// Linear value 0..1: masks, heights, normals.
    Linear,
}

static FROM_SRGB: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|i| decode(i.to_f32() / 255.0)));
static FROM_LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|i| i.to_f32() / 255.0));
/// Linear value above which code i + 1 is closer than code i.
static SRGB_STEPS: LazyLock<[f32; 255]> = LazyLock::new(|| std::array::from_fn(|i| decode((i.to_f32() + 0.5) / 255.0)));
/// Initial guess of the code for each of 4096 linear values.
static SRGB_GUESS: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let mut code = 0;
    (0..4096)
        .map(|i| {
            while code < 255 && i.to_f32() / 4095.0 > SRGB_STEPS[code] {
                code += 1;
            }
            code.to_u8()
        })
        .collect()
});

/// Converts an sRGB-encoded value to a linear value, both 0..1.
pub(super) fn decode(encoded: f32) -> f32 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

impl ColorSpace {
    /// Returns the linear value of each of the 256 codes.
    pub fn table(self) -> &'static [f32; 256] {
        match self {
            Self::Srgb => &FROM_SRGB,
            Self::Linear => &FROM_LINEAR,
        }
    }

    /// Returns the nearest code of a linear value, clamped to 0..1; for `Srgb`, nearest in the encoded scale.
    pub fn encode(self, linear: f32) -> u8 {
        let x = if linear > 0.0 { linear.min(1.0) } else { 0.0 };
        match self {
            Self::Linear => (x * 255.0 + 0.5).trunc_to::<u8>(),
            Self::Srgb => {
                let mut code = usize::from(SRGB_GUESS[(x * 4095.0).trunc_to::<usize>()]);
                while code < 255 && x > SRGB_STEPS[code] {
                    code += 1;
                }
                code.to_u8()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_survives_the_round_trip() {
        for space in [ColorSpace::Srgb, ColorSpace::Linear] {
            for code in 0..=255u8 {
                assert_eq!(space.encode(space.table()[usize::from(code)]), code, "{space:?}");
            }
            assert_eq!((space.encode(-1.0), space.encode(f32::NAN), space.encode(9.0)), (0, 0, 255));
        }
    }
}
