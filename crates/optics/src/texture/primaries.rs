//! Colour primaries of image files, converted to those of Rec. 709.
//!
//! Whites are adapted with the Bradford transform. Source: Lindbloom, "RGB/XYZ matrices" and "Chromatic adaptation";
//! ITU-R BT.709.

use furrow_base::math::{DMat3, DVec3};

/// Largest difference of chromaticities that is ignored.
const SAME: f64 = 1e-3;
/// Bradford matrix, by columns.
const BRADFORD: DMat3 =
    DMat3::from_cols_array(&[0.8951, -0.7502, 0.0389, 0.2664, 1.7135, -0.0685, -0.1614, 0.0367, 1.0296]);
const REC709: Primaries = Primaries([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], [0.3127, 0.3290]]);

/// CIE x and y of red, green, blue and white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Primaries(pub(super) [[f64; 2]; 4]);

impl Primaries {
    /// Returns the matrix that converts linear colours to Rec. 709; `None` if they are of Rec. 709. The error is a
    /// message.
    pub(super) fn to_rec709(self) -> Result<Option<DMat3>, String> {
        let pairs = self.0.as_flattened().iter().zip(REC709.0.as_flattened());
        if pairs.clone().all(|(a, b)| (a - b).abs() <= SAME) {
            return Ok(None);
        }
        let matrix = REC709.to_xyz().inverse() * adaptation(self.white(), REC709.white()) * self.to_xyz();
        // Coincident primaries give infinite or undefined entries.
        if matrix.is_finite() { Ok(Some(matrix)) } else { Err("its chromaticities do not span colours".into()) }
    }

    fn white(self) -> DVec3 {
        xyz(self.0[3])
    }

    /// Returns the matrix from linear colours to XYZ; it maps (1, 1, 1) to the white.
    fn to_xyz(self) -> DMat3 {
        let [red, green, blue, white] = self.0.map(xyz);
        let directions = DMat3::from_cols(red, green, blue);
        directions * DMat3::from_diagonal(directions.inverse() * white)
    }
}

/// Returns XYZ of luminance 1 for a chromaticity.
fn xyz([x, y]: [f64; 2]) -> DVec3 {
    DVec3::new(x / y, 1.0, (1.0 - x - y) / y)
}

fn adaptation(from: DVec3, to: DVec3) -> DMat3 {
    let scale = (BRADFORD * to) / (BRADFORD * from);
    BRADFORD.inverse() * DMat3::from_diagonal(scale) * BRADFORD
}

/// Converts linear colours in place.
pub(super) fn convert(rgb: &mut [[f32; 3]], matrix: DMat3) {
    for color in rgb {
        *color = (matrix * DVec3::from(color.map(f64::from))).as_vec3().into();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: white stays white; the ACES AP0 red of (1, 0, 0) is outside Rec. 709. Source: the matrix AP0 to linear
    /// Rec. 709 of the Academy's ctl files, whose first row is 2.5217, −1.1341, −0.3876.
    #[test]
    fn aces_becomes_rec_709() {
        let aces = Primaries([[0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.0770], [0.32168, 0.33767]]);
        let matrix = aces.to_rec709().unwrap().unwrap();
        assert!((matrix * DVec3::ONE - DVec3::ONE).abs().max_element() < 1e-9);
        let row = matrix.row(0);
        assert!((row - DVec3::new(2.5217, -1.1341, -0.3876)).abs().max_element() < 2e-3, "{row}");
        assert_eq!(REC709.to_rec709(), Ok(None));
        assert!(Primaries([[0.3, 0.3]; 4]).to_rec709().is_err());
    }
}
