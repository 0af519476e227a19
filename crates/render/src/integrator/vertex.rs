//! A path vertex: a surface with its BSDF, evaluated in world directions.

use super::{FirstHit, World};
use furrow_base::geometry::{Hit, Interaction, Ray};
use furrow_base::math::{Frame, Spectrum, ToInt, Vec3};
use furrow_optics::bsdf::Bsdf;

/// A surface hit by a ray.
#[derive(Clone, Copy)]
pub(super) struct Vertex {
    /// Surface interaction.
    pub(super) at: Interaction,
    /// BSDF at the interaction.
    pub(super) bsdf: Bsdf,
    frame: Frame,
    /// Direction back along the ray, world coordinates.
    wo: Vec3,
    /// The same direction in the shading frame.
    seen: Vec3,
}

/// A ray scattered by a surface.
pub(super) struct Scattered {
    /// Direction, world coordinates.
    pub(super) wi: Vec3,
    /// f · |cos θi| divided by the density.
    pub(super) weight: Spectrum,
    /// Density per solid angle.
    pub(super) pdf: f32,
}

impl Vertex {
    /// Builds the vertex of `ray` at `hit`.
    #[inline]
    pub(super) fn new(world: &World<'_>, ray: &Ray, hit: &Hit, at: Interaction) -> Self {
        let wo = -ray.direction;
        let part = &world.scene.parts[hit.part.to_usize()];
        let (bsdf, frame) = world.scene.materials[part.material.to_usize()].scatter(&at, wo);
        Self { at, bsdf, frame, wo, seen: frame.to_local(wo) }
    }

    /// Returns the first-hit features for denoising and output channels.
    pub(super) fn describe(&self, distance: f32) -> FirstHit {
        let normal = if self.seen.z < 0.0 { -self.frame.z } else { self.frame.z };
        FirstHit { part: self.at.part, distance, normal, albedo: self.albedo() }
    }

    /// Approximate reflectance from the side of the incident ray.
    #[inline]
    pub(super) fn albedo(&self) -> Spectrum {
        self.bsdf.reflectance(self.seen.z)
    }

    /// Approximate fraction of light from all sides that is scattered on. For a leaf, transmission is assumed equal to
    /// reflection.
    #[inline]
    pub(super) fn returned(&self) -> Spectrum {
        if self.bsdf.transmits() { self.albedo() * 2.0 } else { self.albedo() }
    }

    /// Normal for choosing lights: on the viewer's side, unless the surface transmits light.
    #[inline]
    pub(super) fn normal(&self) -> Vec3 {
        if self.seen.z < 0.0 && !self.bsdf.transmits() { -self.frame.z } else { self.frame.z }
    }

    /// Returns `true` if scattering from `wo` to `wi` crosses the geometric surface exactly when it crosses the plane
    /// of the shading frame. Where the two disagree, a normal map would leak light, so nothing is scattered.
    #[inline]
    fn consistent(&self, wi: Vec3, wi_local_z: f32) -> bool {
        (self.at.ng.dot(self.wo) * self.at.ng.dot(wi) > 0.0) == (self.seen.z * wi_local_z > 0.0)
    }

    /// Returns f · |cos θi| towards `wi`, and its density.
    #[inline]
    pub(super) fn eval_pdf(&self, wi: Vec3) -> (Spectrum, f32) {
        let local = self.frame.to_local(wi);
        if self.consistent(wi, local.z) { self.bsdf.eval_pdf(self.seen, local) } else { (Spectrum::ZERO, 0.0) }
    }

    /// Samples a lobe and a direction from three numbers in [0, 1). Returns `None` if the light is absorbed.
    #[inline]
    pub(super) fn sample(&self, u: [f32; 3]) -> Option<Scattered> {
        let s = self.bsdf.sample(self.seen, u)?;
        let wi = self.frame.to_world(s.wi);
        self.consistent(wi, s.wi.z).then_some(Scattered { wi, weight: s.weight, pdf: s.pdf })
    }
}
