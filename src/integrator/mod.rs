//! How much light comes back along a ray.

mod backscatter;
mod falsecolor;
mod path;
mod roulette;
mod vertex;

use crate::geometry::{Hit, Interaction, Intersect, PACKET, Ray};
use crate::math::Spectrum;
use crate::sampling::Sampler;
use crate::scene::Scene;

pub use falsecolor::FalseColor;
pub use path::{PathTracer, Technique};

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
        Some((hit, self.at(&hit, width + spread * hit.t)))
    }

    /// A hit, worked out; `footprint` in metres.
    #[inline]
    fn at(&self, hit: &Hit, footprint: f32) -> Interaction {
        self.scene.parts[hit.part as usize].interaction(hit, footprint)
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
    /// Index of its part.
    pub part: u32,
    /// Distance along the ray, metres.
    pub distance: f32,
    /// Unit shading normal, facing the camera, world.
    pub normal: crate::math::Vec3,
    /// Directional-hemispherical reflectance, about.
    pub albedo: Spectrum,
}

/// One sample of a pixel: its ray, and the numbers that decide what becomes of it.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// From the camera.
    pub ray: Ray,
    /// Its numbers.
    pub sampler: Sampler,
}

/// Answers camera rays. `spread` is the growth of a ray's width, metres a metre.
pub trait Integrator: Sync {
    /// What comes back along a ray.
    fn li(&self, world: &World<'_>, sample: &Sample, spread: f32) -> Sighting;

    /// The same for samples of one pixel: their rays go nearly the same way and are cheaper asked together. Nothing is seen
    /// where there is no sample.
    fn li_packet(&self, world: &World<'_>, samples: &[Option<Sample>; PACKET], spread: f32) -> [Sighting; PACKET] {
        samples.map(|sample| sample.map_or_else(Sighting::default, |sample| self.li(world, &sample, spread)))
    }
}
