//! OpenCV's lens model with all of its coefficients: rational radial, tangential, thin prism, and a tilted sensor.
//!
//! Let (x, y) be the pinhole image at unit distance, r² = x² + y² and
//! q = (1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶). Then
//! x″ = x q + 2 p1 x y + p2 (r² + 2x²) + s1 r² + s2 r⁴,
//! y″ = y q + p1 (r² + 2y²) + 2 p2 x y + s3 r² + s4 r⁴,
//! and a projection by the matrix of the tilts τx and τy maps (x″, y″, 1) to the image.
//! Source: OpenCV 5.0, module calib3d, "Detailed description" and `computeTiltProjectionMatrix`; Scheimpflug tilt:
//! Louhichi et al. 2007.

/// Coefficients of the model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpenCv {
    /// Radial: k1 to k3 of the numerator, k4 to k6 of the denominator.
    pub k: [f64; 6],
    /// Tangential: p1, p2.
    pub p: [f64; 2],
    /// Thin prism: s1 to s4.
    pub s: [f64; 4],
    /// Tilts of the sensor about x and y, radians.
    pub tilt: [f64; 2],
}

/// Matrix of a projection of the plane, row by row.
type Homography = [[f64; 3]; 3];

impl OpenCv {
    /// Maps a pinhole image point to the distorted image.
    pub(super) fn distort(&self, at: [f64; 2]) -> [f64; 2] {
        let flat = self.flat(at).0;
        if self.tilt == [0.0; 2] { flat } else { project(&self.tilted(), flat).0 }
    }

    /// Returns the derivatives of [`Self::distort`], row by row.
    pub(super) fn jacobian(&self, at: [f64; 2]) -> [[f64; 2]; 2] {
        let (flat, slope) = self.flat(at);
        if self.tilt == [0.0; 2] {
            return slope;
        }
        let outer = project(&self.tilted(), flat).1;
        [0, 1].map(|i| [0, 1].map(|j| outer[i][0] * slope[0][j] + outer[i][1] * slope[1][j]))
    }

    /// Returns a starting point for the inversion: the image point on the sensor without its tilt.
    pub(super) fn untilted(&self, to: [f64; 2]) -> [f64; 2] {
        if self.tilt == [0.0; 2] { to } else { project(&inverse(&self.tilted()), to).0 }
    }

    /// Returns the image point on a sensor without tilt, and its derivatives.
    fn flat(&self, [x, y]: [f64; 2]) -> ([f64; 2], [[f64; 2]; 2]) {
        let Self { k: [k1, k2, k3, k4, k5, k6], p: [p1, p2], s: [s1, s2, s3, s4], .. } = *self;
        let r2 = x * x + y * y;
        let above = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let below = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6));
        let q = above / below;
        // Derivative with respect to r².
        let dq = (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3) - q * (k4 + r2 * (2.0 * k5 + r2 * 3.0 * k6))) / below;
        let at = [
            x * q + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x) + r2 * (s1 + r2 * s2),
            y * q + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y + r2 * (s3 + r2 * s4),
        ];
        let (prism_x, prism_y) = (2.0 * (s1 + 2.0 * r2 * s2), 2.0 * (s3 + 2.0 * r2 * s4));
        let mixed = 2.0 * x * y * dq + 2.0 * p1 * x + 2.0 * p2 * y;
        let slope = [
            [q + 2.0 * x * x * dq + 2.0 * p1 * y + 6.0 * p2 * x + prism_x * x, mixed + prism_x * y],
            [mixed + prism_y * x, q + 2.0 * y * y * dq + 6.0 * p1 * y + 2.0 * p2 * x + prism_y * y],
        ];
        (at, slope)
    }

    /// Returns the projection of the tilted sensor.
    fn tilted(&self) -> Homography {
        let ([sx, sy], [cx, cy]) = (self.tilt.map(f64::sin), self.tilt.map(f64::cos));
        // Rotation about y times rotation about x.
        let rotation = [[cy, sy * sx, -sy * cx], [0.0, cx, sx], [sy, -cy * sx, cy * cx]];
        let depth = rotation[2][2];
        let row = |i: usize| [0, 1, 2].map(|j| depth * rotation[i][j] - rotation[i][2] * rotation[2][j]);
        [row(0), row(1), rotation[2]]
    }
}

/// Returns a projected point and the derivatives of the projection there.
fn project(by: &Homography, [x, y]: [f64; 2]) -> ([f64; 2], [[f64; 2]; 2]) {
    let [a, b, c] = by.map(|row| row[0] * x + row[1] * y + row[2]);
    let at = [a / c, b / c];
    let slope = [0, 1].map(|i| [0, 1].map(|j| (by[i][j] - at[i] * by[2][j]) / c));
    (at, slope)
}

/// Returns the inverse of a projection, up to a factor.
fn inverse(of: &Homography) -> Homography {
    let cofactor = |i: usize, j: usize| {
        let (a, b, c, d) = ((i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3);
        of[a][c] * of[b][d] - of[a][d] * of[b][c]
    };
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| cofactor(j, i)))
}
