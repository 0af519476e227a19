//! Integrators: estimate the radiance along camera rays.

mod backscatter;
mod falsecolor;
mod path;
mod roulette;
mod trail;
mod vertex;

use crate::scene::Scene;
use furrow_base::geometry::{Hit, Interaction, Intersect, PACKET, Ray};
use furrow_base::math::{Spectrum, ToInt};
use furrow_base::sampling::Sampler;
use furrow_optics::light::Light;

pub use falsecolor::FalseColor;
pub use path::{PathTracer, Technique};

/// A scene together with the accelerator that intersects its rays.
#[derive(Clone, Copy)]
pub struct World<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Lights, those of the scene or others.
    pub lights: &'a [Light],
    /// The accelerator.
    pub geometry: &'a dyn Intersect,
}

impl<'a> World<'a> {
    /// Returns a scene under its own lights.
    pub fn new(scene: &'a Scene, geometry: &'a dyn Intersect) -> Self {
        Self { scene, lights: &scene.lights, geometry }
    }

    /// Returns the same scene under other lights.
    #[must_use]
    pub fn under(self, lights: &'a [Light]) -> Self {
        Self { lights, ..self }
    }
}

impl World<'_> {
    /// Returns the nearest surface along a ray whose width grows from `width` metres by `spread` metres per metre.
    #[inline]
    pub fn interact(&self, ray: &Ray, width: f32, spread: f32) -> Option<(Hit, Interaction)> {
        let hit = self.geometry.closest(ray)?;
        Some((hit, self.at(&hit, width + spread * hit.t)))
    }

    /// Computes the surface interaction for a hit; `footprint` in metres.
    #[inline]
    fn at(&self, hit: &Hit, footprint: f32) -> Interaction {
        self.scene.parts[hit.part.to_usize()].interaction(hit, footprint)
    }
}

/// Result of one camera sample.
#[derive(Clone, Copy, Debug, Default)]
pub struct CameraSample {
    /// Radiance along the ray.
    pub radiance: Spectrum,
    /// First surface hit, if any.
    pub first: Option<FirstHit>,
}

/// First surface hit by a camera ray: auxiliary features for denoising, and output channels.
#[derive(Clone, Copy, Debug)]
pub struct FirstHit {
    /// Index of the part.
    pub part: u32,
    /// Distance along the ray, metres.
    pub distance: f32,
    /// Unit shading normal in world coordinates, facing the camera.
    pub normal: furrow_base::math::Vec3,
    /// Approximate directional–hemispherical reflectance.
    pub albedo: Spectrum,
}

/// One sample of a pixel: its camera ray and its random numbers.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Camera ray.
    pub ray: Ray,
    /// Random numbers of the sample.
    pub sampler: Sampler,
}

/// Estimates the radiance along camera rays. `spread` is the growth of a ray's width in metres per metre.
pub trait Integrator: Sync {
    /// Estimates the radiance of one sample.
    fn li(&self, world: &World<'_>, sample: &Sample, spread: f32) -> CameraSample;

    /// Estimates the radiance of several samples of one pixel. Their nearly parallel rays are traced faster as a
    /// packet. Empty lanes return the default.
    fn li_packet(&self, world: &World<'_>, samples: &[Option<Sample>; PACKET], spread: f32) -> [CameraSample; PACKET] {
        samples.map(|sample| sample.map_or_else(CameraSample::default, |sample| self.li(world, &sample, spread)))
    }

    /// Estimates the radiance of the same samples in several worlds that differ only in their lights. Each result is
    /// that of [`Self::li_packet`], bit by bit.
    fn li_packet_lit(
        &self,
        worlds: &[World<'_>],
        samples: &[Option<Sample>; PACKET],
        spread: f32,
    ) -> Vec<[CameraSample; PACKET]> {
        worlds.iter().map(|world| self.li_packet(world, samples, spread)).collect()
    }
}
