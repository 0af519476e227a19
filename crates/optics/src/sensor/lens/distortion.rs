//! Lens distortion after Brown & Conrady, in OpenCV's order and signs.
//!
//! Let (x, y) be the pinhole image at unit distance and r² = x² + y². Then
//! x′ = x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2x²),
//! y′ = y (1 + k1 r² + k2 r⁴ + k3 r⁶) + p1 (r² + 2y²) + 2 p2 x y.
//! Source: Brown 1971, "Close-range camera calibration"; OpenCV, module calib3d.

use furrow_base::ron_file::{Signed, Vary};
use furrow_base::sampling::rng::Stream;
use serde::{Deserialize, Serialize};

/// The five distortion coefficients; all zero is a pinhole.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distortion {
    /// Radial, r².
    pub k1: f64,
    /// Radial, r⁴.
    pub k2: f64,
    /// Tangential, along y.
    pub p1: f64,
    /// Tangential, along x.
    pub p2: f64,
    /// Radial, r⁶.
    pub k3: f64,
}

impl Distortion {
    /// Returns `true` if all coefficients are zero.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Maps a pinhole image point to the distorted image.
    pub fn distort(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let Self { k1, k2, p1, p2, k3 } = *self;
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        [
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        ]
    }

    /// Returns the derivatives of [`Self::distort`]: ∂x′/∂x, ∂x′/∂y = ∂y′/∂x, ∂y′/∂y.
    pub(super) fn jacobian(&self, [x, y]: [f64; 2]) -> [f64; 3] {
        let Self { k1, k2, p1, p2, k3 } = *self;
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));
        [
            radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x,
            x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y,
            radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x,
        ]
    }

    /// Returns the area of the distorted image per area of the pinhole image: above zero where the image does not fold
    /// over.
    pub fn stretch(&self, at: [f64; 2]) -> f64 {
        let [a, b, d] = self.jacobian(at);
        a * d - b * b
    }

    /// Returns an upper bound of the factor by which [`Self::distort`] stretches a length within this distance from the
    /// axis.
    pub fn slope(&self, r: f64) -> f64 {
        let Self { k1, k2, p1, p2, k3 } = *self;
        let r2 = r * r;
        // For r²ⁿ (x, y) it is (2n + 1) r²ⁿ, along the radius.
        1.0 + r2 * (3.0 * k1.abs() + r2 * (5.0 * k2.abs() + r2 * 7.0 * k3.abs())) + 8.0 * r * (p1.abs() + p2.abs())
    }

    /// Returns an upper bound of the second derivative of [`Self::distort`] along any line within this distance from
    /// the axis.
    pub fn curvature(&self, r: f64) -> f64 {
        let Self { k1, k2, p1, p2, k3 } = *self;
        let r2 = r * r;
        // For r²ⁿ (x, y) it is 2n (2n + 1) r²ⁿ⁻¹, along the radius.
        r * (6.0 * k1.abs() + r2 * (20.0 * k2.abs() + r2 * 42.0 * k3.abs())) + 8.0 * (p1.abs() + p2.abs())
    }

    /// Returns the pinhole image point that is mapped to `to`: Newton's method starting at `to`, accurate to about
    /// 10⁻¹⁵.
    pub fn undistort(&self, to: [f64; 2]) -> [f64; 2] {
        if self.is_none() {
            return to;
        }
        let mut at = to;
        for _ in 0..20 {
            let [x, y] = self.distort(at);
            let (ex, ey) = (x - to[0], y - to[1]);
            let [a, b, d] = self.jacobian(at);
            let det = a * d - b * b;
            if det <= 0.0 {
                break;
            }
            at = [at[0] - (d * ex - b * ey) / det, at[1] - (a * ey - b * ex) / det];
            // The error after a Newton step is the square of the previous one.
            if ex.abs() + ey.abs() < 1e-8 {
                break;
            }
        }
        at
    }
}

/// Lens distortion: OpenCV's coefficients, each 0 by default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DistortionDesc {
    /// Radial, r².
    pub k1: Vary<Signed<1000>>,
    /// Radial, r⁴.
    pub k2: Vary<Signed<1000>>,
    /// Tangential, along y.
    pub p1: Vary<Signed<1000>>,
    /// Tangential, along x.
    pub p2: Vary<Signed<1000>>,
    /// Radial, r⁶.
    pub k3: Vary<Signed<1000>>,
}

impl Default for DistortionDesc {
    fn default() -> Self {
        Self {
            k1: Vary::fixed(0.0),
            k2: Vary::fixed(0.0),
            p1: Vary::fixed(0.0),
            p2: Vary::fixed(0.0),
            k3: Vary::fixed(0.0),
        }
    }
}

impl DistortionDesc {
    /// Samples the distortion.
    pub fn draw(&self, stream: &mut Stream) -> Distortion {
        let mut draw = |of: &Vary<Signed<1000>>| of.draw(stream);
        Distortion {
            k1: draw(&self.k1),
            k2: draw(&self.k2),
            p1: draw(&self.p1),
            p2: draw(&self.p2),
            k3: draw(&self.k3),
        }
    }
}
