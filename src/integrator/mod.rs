//! How much light comes back along a ray.

mod effort;
mod falsecolor;
mod path;
mod vertex;

use crate::geometry::{Hit, Interaction, Intersect, Ray};
use crate::math::Spectrum;
use crate::sampling::Sampler;
use crate::scene::Scene;

pub use falsecolor::FalseColor;
pub use path::{Path, Technique};

/// A scene and what answers its rays.
#[derive(Clone, Copy)]
pub struct World<'a> {
    /// What is out there.
    pub scene: &'a Scene,
    /// Who answers.
    pub geometry: &'a dyn Intersect,
}

impl World<'_> {
    /// The nearest surface along a ray whose width grows from `width` metres by `spread` metres a metre.
    #[inline]
    pub fn interact(&self, ray: &Ray, width: f32, spread: f32) -> Option<(Hit, Interaction)> {
        let hit = self.geometry.closest(ray)?;
        let mesh = &self.scene.parts[hit.part as usize].mesh;
        Some((hit, Interaction::new(mesh, &hit, width + spread * hit.t)))
    }
}

/// What one camera sample found.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sighting {
    /// Radiance along the ray.
    pub radiance: Spectrum,
    /// The first surface, if there was one.
    pub first: Option<FirstHit>,
}

/// The first surface that a camera ray meets: guides for denoising, channels for people.
#[derive(Clone, Copy, Debug)]
pub struct FirstHit {
    /// Distance along the ray, metres.
    pub distance: f32,
    /// Unit shading normal, facing the camera, world.
    pub normal: crate::math::Vec3,
    /// Directional-hemispherical reflectance, about.
    pub albedo: Spectrum,
}

/// Answers camera rays. `spread` is the growth of the ray's width, metres a metre.
pub trait Integrator: Sync {
    /// What comes back along `ray`.
    fn li(&self, world: &World<'_>, ray: &Ray, spread: f32, sampler: &Sampler) -> Sighting;
}
