//! What every light promises. The variants keep it; `light/mod.rs` chooses between them.
//!
//! For one light, with L(p, ω) the radiance that arrives at p from the unit direction ω, unoccluded:
//! - [`Emitter::sample_li`] draws ω with the density that [`Emitter::pdf_li`] states, per solid angle, and returns L(p, ω) and
//!   that same density, never zero. `None` where the point sees nothing of the light.
//! - pdf_li integrates to one over the sphere wherever the point sees the light, and is above zero wherever L is: so the mean
//!   of L·f/pdf over samples is ∫ L f dω for any f.
//! - [`Emitter::le`] is L for directions that leave the scene, of lights infinitely far away; [`Emitter::hit`] is L for lights
//!   with a place. A ray that left adds `le` of every light; a ray that did not must be tested against `hit` of every light.
//!   Lamps are no geometry: they are never seen as a part and cast no shadow.
//! - [`Emitter::seen`] is what a camera sees of `le` itself; nothing is lit by it, so it need not be `le` to the last bit.
//! - [`Emitter::importance`] is above zero wherever the light can contribute.
//! - Nothing here allocates.

use crate::math::{Spectrum, Vec3};

/// A direction drawn towards a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// Unit direction to the light, world.
    pub wi: Vec3,
    /// Metres to the light; infinite for sun, sky and environment.
    pub distance: f32,
    /// Radiance that arrives from there, W·m⁻²·sr⁻¹·nm⁻¹ per band.
    pub radiance: Spectrum,
    /// Density per solid angle, above zero.
    pub pdf: f32,
}

/// A lamp met by a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LampHit {
    /// Metres along the ray.
    pub distance: f32,
    /// Radiance towards the ray's origin.
    pub radiance: Spectrum,
    /// Density per solid angle with which `sample_li` at the ray's origin draws this direction.
    pub pdf: f32,
}

/// The promise of a light; see the module for what it says.
pub trait Emitter {
    /// Draws a direction from `p` (metres, world) to the light with two numbers in [0, 1).
    fn sample_li(&self, p: Vec3, u: [f32; 2]) -> Option<LightSample>;

    /// Density per solid angle with which `sample_li` draws the unit direction `wi` at `p`.
    fn pdf_li(&self, p: Vec3, wi: Vec3) -> f32;

    /// Radiance along a ray that left the scene in the unit direction `dir`; zero for lamps.
    fn le(&self, dir: Vec3) -> Spectrum;

    /// Radiance that a camera sees along a ray that left the scene: `le`, or a smoother picture of it where that is a table with steps.
    #[inline]
    fn seen(&self, dir: Vec3) -> Spectrum {
        self.le(dir)
    }

    /// The light as met by a ray, for lights with a place.
    fn hit(&self, origin: Vec3, dir: Vec3) -> Option<LampHit>;

    /// A cheap estimate of the irradiance (mean of the bands) at `p` on a surface of unit normal `n`; with `two_sided`, on both
    /// sides together.
    fn importance(&self, p: Vec3, n: Vec3, two_sided: bool) -> f32;

    /// Irradiance of a horizontal plane at the world's origin, unoccluded, W·m⁻²·nm⁻¹ per band.
    fn horizontal_irradiance(&self) -> Spectrum;
}
