//! Lens: the mapping from the pinhole image to the distorted image, in one of several models.

use super::distortion::Distortion;
use super::fisheye::Fisheye;
use super::opencv::OpenCv;

/// Number of rings, and of spokes, of the polar grid on which derivatives are bounded.
const RINGS: u32 = 64;
/// Factor on the bounds, for places between the points of the grid.
const MARGIN: f64 = 1.25;

/// Model of a lens and its coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lens {
    /// Radial and tangential polynomials; all coefficients 0 are a pinhole.
    BrownConrady(Distortion),
    /// OpenCV's model with more than five coefficients.
    OpenCv(OpenCv),
    /// OpenCV's fisheye model.
    Fisheye(Fisheye),
}

impl From<Distortion> for Lens {
    fn from(distortion: Distortion) -> Self {
        Self::BrownConrady(distortion)
    }
}

impl Lens {
    /// Returns `true` if the lens does not distort.
    pub fn is_none(&self) -> bool {
        matches!(self, Self::BrownConrady(distortion) if distortion.is_none())
    }

    /// Returns the polynomials of a lens that has no other terms.
    pub fn polynomials(&self) -> Option<Distortion> {
        if let Self::BrownConrady(distortion) = self { Some(*distortion) } else { None }
    }

    /// Maps a pinhole image point to the distorted image.
    pub fn distort(&self, at: [f64; 2]) -> [f64; 2] {
        match self {
            Self::BrownConrady(of) => of.distort(at),
            Self::OpenCv(of) => of.distort(at),
            Self::Fisheye(of) => of.distort(at),
        }
    }

    /// Returns the pinhole image point that is mapped to `to`. Not a number if a fisheye maps no ray to it.
    pub fn undistort(&self, to: [f64; 2]) -> [f64; 2] {
        match self {
            Self::BrownConrady(of) => of.undistort(to),
            Self::OpenCv(of) => {
                let mut at = of.untilted(to);
                for _ in 0..30 {
                    let [x, y] = of.distort(at);
                    let (ex, ey) = (x - to[0], y - to[1]);
                    let [[a, b], [c, d]] = of.jacobian(at);
                    let area = a * d - b * c;
                    if area.is_nan() || area <= 0.0 {
                        break;
                    }
                    at = [at[0] - (d * ex - b * ey) / area, at[1] - (a * ey - c * ex) / area];
                    if ex.abs() + ey.abs() < 1e-8 {
                        break;
                    }
                }
                at
            }
            Self::Fisheye(of) => of.undistort(to),
        }
    }

    /// Returns the area of the distorted image per area of the pinhole image: above zero where the image does not fold
    /// over.
    pub fn stretch(&self, at: [f64; 2]) -> f64 {
        if let Self::BrownConrady(of) = self {
            return of.stretch(at);
        }
        let [[a, b], [c, d]] = self.jacobian(at);
        a * d - b * c
    }

    /// Returns upper bounds of the factor by which the lens stretches a length, and of its second derivative along any
    /// line, within this distance from the axis.
    pub(super) fn bend(&self, radius: f64) -> [f64; 2] {
        if let Self::BrownConrady(of) = self {
            return [of.slope(radius), of.curvature(radius)];
        }
        // The largest values of a fine polar grid.
        let step = radius / (4.0 * f64::from(RINGS));
        let norm = |m: [[f64; 2]; 2]| m.as_flattened().iter().map(|v| v * v).sum::<f64>();
        let mut most = [0.0_f64; 2];
        for place in 0..RINGS * RINGS {
            let (ring, turn) = (place / RINGS + 1, place % RINGS);
            let (sin, cos) = (f64::from(turn) / f64::from(RINGS) * std::f64::consts::TAU).sin_cos();
            let r = radius * f64::from(ring) / f64::from(RINGS);
            let at = [r * cos, r * sin];
            let here = self.jacobian(at);
            let second: f64 = [[step, 0.0], [0.0, step]]
                .map(|[dx, dy]| {
                    let there = self.jacobian([at[0] - dx, at[1] - dy]);
                    norm([0, 1].map(|i| [0, 1].map(|j| (here[i][j] - there[i][j]) / step)))
                })
                .iter()
                .sum();
            most = [most[0].max(norm(here).sqrt()), most[1].max(second.sqrt())];
        }
        most.map(|bound| MARGIN * bound)
    }

    /// Returns the derivatives of [`Self::distort`], row by row.
    fn jacobian(&self, at: [f64; 2]) -> [[f64; 2]; 2] {
        match self {
            Self::BrownConrady(of) => {
                let [a, b, d] = of.jacobian(at);
                [[a, b], [b, d]]
            }
            Self::OpenCv(of) => of.jacobian(at),
            Self::Fisheye(of) => of.jacobian(at),
        }
    }
}
