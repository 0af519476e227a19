//! Colour matrix from the camera's filter colours to display colours.
//!
//! It is applied after the white balance and before the tone curve, so white is (1, 1, 1) and is preserved if every row
//! sums to 1.

use furrow_base::ron_file::{NonNegative, Signed, Vary};
use furrow_base::sampling::rng::Stream;
use serde::{Deserialize, Serialize};

/// Colour matrix.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
#[expect(clippy::large_enum_variant, reason = "a scene file has one")]
pub enum MatrixDesc {
    /// No matrix: the channels are unchanged.
    #[default]
    Off,
    /// Scales saturation by this factor: 0 is grey, 1 is unchanged. Luminance is preserved.
    Saturation(Vary<NonNegative<10>>),
    /// Weights of R, G, B in the new R, G and B. A row that sums to 1 preserves white.
    Rows(MatrixRow, MatrixRow, MatrixRow),
}

/// Weights of R, G, B.
pub type MatrixRow = (Vary<Signed<100>>, Vary<Signed<100>>, Vary<Signed<100>>);

/// Luminance weights of linear Rec. 709.
const LUMA: [f32; 3] = [0.2126, 0.7152, 0.0722];

impl MatrixDesc {
    /// Samples the matrix, row by row; `None` if it is off.
    pub fn draw(&self, stream: &mut Stream) -> Option<[[f32; 3]; 3]> {
        match self {
            Self::Off => None,
            Self::Saturation(factor) => {
                let factor = factor.draw32(stream);
                Some([0, 1, 2].map(|row| {
                    [0, 1, 2].map(|column| (1.0 - factor) * LUMA[column] + if row == column { factor } else { 0.0 })
                }))
            }
            Self::Rows(r, g, b) => Some([r, g, b].map(|(x, y, z)| [x, y, z].map(|weight| weight.draw32(stream)))),
        }
    }
}

/// Multiplies a colour by a matrix.
pub(in crate::sensor) fn apply(matrix: &[[f32; 3]; 3], color: [f32; 3]) -> [f32; 3] {
    matrix.map(|row| row.iter().zip(color).map(|(weight, value)| weight * value).sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::sampling::Purpose;

    fn matrix(page: &str) -> [[f32; 3]; 3] {
        ron::from_str::<MatrixDesc>(page).unwrap().draw(&mut Stream::of(1, 0, Purpose::Test, 0)).unwrap()
    }

    #[test]
    fn white_stays_white_and_grey_keeps_its_level() {
        let pages = ["Saturation(1.4)", "Saturation(0)", "Rows((1.6, -0.5, -0.1), (-0.2, 1.5, -0.3), (0, -0.6, 1.6))"];
        for page in pages {
            for level in [0.0, 0.18, 1.0] {
                let seen = apply(&matrix(page), [level; 3]);
                assert!(seen.iter().all(|v| (v - level).abs() < 1e-6), "{page}: {seen:?}");
            }
        }
        assert!(MatrixDesc::default().draw(&mut Stream::of(1, 0, Purpose::Test, 0)).is_none());
    }

    #[test]
    fn saturation_keeps_luminance_and_draws_from_grey() {
        let luminance = |c: [f32; 3]| c.iter().zip(LUMA).map(|(v, w)| v * w).sum::<f32>();
        let leaf = [0.1, 0.3, 0.05];
        let seen = apply(&matrix("Saturation(1.5)"), leaf);
        assert!((luminance(seen) - luminance(leaf)).abs() < 1e-6);
        assert!((seen[1] - seen[0] - 1.5 * 0.2).abs() < 1e-6 && (seen[1] - seen[2] - 1.5 * 0.25).abs() < 1e-6);
    }
}
