//! The interface that every BSDF implements.

use furrow_base::math::{Spectrum, Vec3};

/// Sampled direction with its weight and density.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// Direction towards the light, unit vector in the local frame.
    pub wi: Vec3,
    /// `eval(wo, wi) / pdf(wo, wi)`.
    pub weight: Spectrum,
    /// `pdf(wo, wi)`, per solid angle.
    pub pdf: f32,
}

/// Scattering in a local frame whose z axis is the normal of the upper side.
///
/// `wo` points to the eye and `wi` to the light. Both are unit vectors that point away from the surface; a negative z
/// is below it. An opaque surface looks the same from below as from above.
pub trait Scatter {
    /// Returns f(wo, wi) · |cos θi| in 1/sr, zero where nothing is scattered, and the density per solid angle with
    /// which [`Scatter::sample`] returns `wi`. One function, because both share most of their work.
    fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Spectrum, f32);
    /// Returns f(wo, wi) · |cos θi| alone.
    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        self.eval_pdf(wo, wi).0
    }
    /// Returns the density alone.
    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.eval_pdf(wo, wi).1
    }
    /// Samples a direction from `u` ∈ [0, 1)³: one number chooses the lobe, two the direction. `None` means that the
    /// light is absorbed.
    fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample>;
}

/// Samples a cosine-distributed direction about +z. Source: Malley's method on the concentric disc, Shirley & Chiu
/// 1997.
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

/// Mirrors `v` into the hemisphere of `side` (±1): converts from the frame with z up to the frame that the ray came
/// from.
#[inline]
pub(super) fn facing(v: Vec3, side: f32) -> Vec3 {
    Vec3::new(v.x, v.y, v.z * side)
}
