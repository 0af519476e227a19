//! Fisheye lens after Kannala & Brandt, as in OpenCV's module `fisheye`.
//!
//! A ray at the angle θ from the axis is mapped to the distance θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸) from the image's
//! centre. Here rays are points of the plane at unit distance, so the image must end before [`WIDEST`].
//! Source: Kannala & Brandt 2006, "A generic camera model and calibration method"; OpenCV 5.0, module calib3d, fisheye.

/// Largest angle of a ray from the axis, radians: 85°. The plane at unit distance has no points for 90°.
pub(super) const WIDEST: f64 = 85.0 * std::f64::consts::PI / 180.0;
/// Angle below which derivatives are those of the first terms.
const SMALL: f64 = 1e-4;

/// Coefficients of the model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fisheye {
    /// k1 to k4.
    pub k: [f64; 4],
}

impl Fisheye {
    /// Maps a pinhole image point to the distorted image.
    pub(super) fn distort(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let scale = self.scale(x.hypot(y)).0;
        [x * scale, y * scale]
    }

    /// Returns the derivatives of [`Self::distort`], row by row.
    pub(super) fn jacobian(&self, [x, y]: [f64; 2]) -> [[f64; 2]; 2] {
        let (scale, change) = self.scale(x.hypot(y));
        [[scale + x * x * change, x * y * change], [x * y * change, scale + y * y * change]]
    }

    /// Returns the pinhole image point that is mapped to `to`; not a number where no ray within [`WIDEST`] is.
    pub(super) fn undistort(&self, to: [f64; 2]) -> [f64; 2] {
        let distance = to[0].hypot(to[1]);
        if distance == 0.0 {
            return to;
        }
        let mut theta = distance.min(WIDEST);
        for _ in 0..30 {
            let (value, slope) = self.angle(theta);
            let step = (value - distance) / slope;
            theta -= step;
            if step.abs() < 1e-9 {
                break;
            }
        }
        let known = (0.0..=WIDEST).contains(&theta) && (self.angle(theta).0 - distance).abs() < 1e-9;
        let scale = if known { theta.tan() / distance } else { f64::NAN };
        [to[0] * scale, to[1] * scale]
    }

    /// Returns the distance in the image of a ray at this angle, and its derivative.
    fn angle(&self, theta: f64) -> (f64, f64) {
        let [k1, k2, k3, k4] = self.k;
        let t2 = theta * theta;
        (
            theta * (1.0 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4)))),
            1.0 + t2 * (3.0 * k1 + t2 * (5.0 * k2 + t2 * (7.0 * k3 + t2 * 9.0 * k4))),
        )
    }

    /// Returns the factor from the pinhole image to the distorted image at this distance from the axis, and its
    /// derivative divided by the distance.
    fn scale(&self, r: f64) -> (f64, f64) {
        if r < SMALL {
            let second = self.k[0] - 1.0 / 3.0;
            return (1.0 + second * r * r, 2.0 * second);
        }
        let (value, slope) = self.angle(r.atan());
        (value / r, (slope / (1.0 + r * r) - value / r) / (r * r))
    }
}
