//! The contract of a light. The variants implement it; `light/mod.rs` dispatches to them.
//!
//! For one light, let L(p, ω) be the unoccluded radiance that arrives at p from the unit direction ω:
//! - [`Emitter::sample_li`] samples ω with the density per solid angle that [`Emitter::pdf_li`] returns, and returns
//!   L(p, ω) and that same density, which is never zero. `None` if the light does not reach the point.
//! - pdf_li integrates to one over the sphere wherever the light reaches the point, and is above zero wherever L is.
//!   The mean of L·f/pdf over samples is therefore ∫ L f dω for any f.
//! - [`Emitter::le`] is L of lights at infinity, for directions that leave the scene. [`Emitter::hit`] is L of lights
//!   with a position. A ray that leaves the scene adds `le` of every light; any other ray must be tested against `hit`
//!   of every light. Lamps are not geometry: they have no part label and cast no shadow.
//! - [`Emitter::seen`] is the version of `le` for camera rays. It illuminates nothing, so it need not equal `le`
//!   exactly.
//! - [`Emitter::importance`] is above zero wherever the light can contribute.
//! - No function here allocates.

use furrow_base::math::{Spectrum, Vec3};

/// Sampled direction towards a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// Unit direction to the light in world space.
    pub wi: Vec3,
    /// Distance to the light in metres; infinite for sun, sky and environment.
    pub distance: f32,
    /// Radiance from that direction, W·m⁻²·sr⁻¹·nm⁻¹ per band.
    pub radiance: Spectrum,
    /// Density per solid angle, above zero.
    pub pdf: f32,
}

/// Intersection of a ray with a lamp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LampHit {
    /// Distance along the ray in metres.
    pub distance: f32,
    /// Radiance towards the ray's origin.
    pub radiance: Spectrum,
    /// Density per solid angle with which `sample_li` at the ray's origin samples this direction.
    pub pdf: f32,
}

/// Contract of a light; see the module documentation.
pub trait Emitter {
    /// Samples a direction from `p` (metres, world) to the light with two numbers in [0, 1).
    fn sample_li(&self, p: Vec3, u: [f32; 2]) -> Option<LightSample>;

    /// Returns the density per solid angle with which `sample_li` samples the unit direction `wi` at `p`.
    fn pdf_li(&self, p: Vec3, wi: Vec3) -> f32;

    /// Returns the radiance along a ray that left the scene in the unit direction `dir`; zero for lamps.
    fn le(&self, dir: Vec3) -> Spectrum;

    /// Returns the radiance that a camera sees along a ray that left the scene: `le`, or a smooth version if `le` is a
    /// table with steps.
    #[inline]
    fn seen(&self, dir: Vec3) -> Spectrum {
        self.le(dir)
    }

    /// Intersects a ray with a light that has a position.
    fn hit(&self, origin: Vec3, dir: Vec3) -> Option<LampHit>;

    /// Returns a cheap estimate of the irradiance (mean of the bands) at `p` on a surface of unit normal `n`; with
    /// `two_sided`, the sum over both sides.
    fn importance(&self, p: Vec3, n: Vec3, two_sided: bool) -> f32;

    /// Returns the unoccluded irradiance of a horizontal plane at the world's origin, W·m⁻²·nm⁻¹ per band.
    fn horizontal_irradiance(&self) -> Spectrum;

    /// Returns `true` if neighbouring points see the whole light in nearly the same direction, so that shadow rays to it
    /// are best traced together.
    #[inline]
    fn is_narrow(&self) -> bool {
        false
    }

    /// Returns `true` if rays that leave the scene see the light, `false` if it has a position.
    #[inline]
    fn is_infinite(&self) -> bool {
        true
    }
}
