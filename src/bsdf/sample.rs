//! The contract that every scattering keeps.

use crate::math::{Spectrum, Vec3};

/// A sampled direction.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// Direction to the light, local, unit.
    pub wi: Vec3,
    /// `eval(wo, wi) / pdf(wo, wi)`.
    pub weight: Spectrum,
    /// `pdf(wo, wi)`, per solid angle.
    pub pdf: f32,
}

/// Scattering in a local frame whose z axis is the normal of the upper side. `wo` points to the eye, `wi` to the light, both
/// away from the surface, unit; a negative z lies below. What is opaque looks the same from below as from above.
pub trait Scatter {
    /// f(wo, wi) · |cos θi|, 1/sr, zero where nothing scatters; and the density with which [`Scatter::sample`] returns `wi`,
    /// per solid angle. They share most of their work.
    fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Spectrum, f32);
    /// f(wo, wi) · |cos θi| alone.
    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        self.eval_pdf(wo, wi).0
    }
    /// The density alone.
    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.eval_pdf(wo, wi).1
    }
    /// Draws a direction from `u` ∈ [0, 1)³ (one number to choose a lobe, two for the direction); `None`: absorbed.
    fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample>;
}

/// A cosine-distributed direction about +z. Source: Malley's method on the concentric disc, Shirley & Chiu 1997.
#[inline]
pub(super) fn cosine(u: f32, v: f32) -> Vec3 {
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    let (r, phi) = if a == 0.0 && b == 0.0 {
        (0.0, 0.0)
    } else if a.abs() > b.abs() {
        (a, std::f32::consts::FRAC_PI_4 * (b / a))
    } else {
        (b, std::f32::consts::FRAC_PI_2 - std::f32::consts::FRAC_PI_4 * (a / b))
    };
    let (sin, cos) = phi.sin_cos();
    Vec3::new(r * cos, r * sin, (1.0 - r * r).max(0.0).sqrt())
}

/// Mirrors `v` into the hemisphere of `side` (±1): from the frame where z is up to the one the ray came from.
#[inline]
pub(super) fn facing(v: Vec3, side: f32) -> Vec3 {
    Vec3::new(v.x, v.y, v.z * side)
}
