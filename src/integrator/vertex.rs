//! A surface on a path: its scattering, in world directions.

use super::{FirstHit, World};
use crate::bsdf::Bsdf;
use crate::geometry::{Hit, Interaction, Ray};
use crate::math::{Frame, Spectrum, Vec3};

/// A surface as a ray met it.
#[derive(Clone, Copy)]
pub(super) struct Vertex {
    /// Where.
    pub(super) at: Interaction,
    /// What scatters there.
    pub(super) bsdf: Bsdf,
    frame: Frame,
    /// Back along the ray, world.
    wo: Vec3,
    /// The same in the frame.
    seen: Vec3,
}

/// A ray that a surface scattered.
pub(super) struct Scattered {
    /// Where it goes, world.
    pub(super) wi: Vec3,
    /// f · |cos θi| over the density.
    pub(super) weight: Spectrum,
    /// Density per solid angle.
    pub(super) pdf: f32,
}

impl Vertex {
    /// The surface that `ray` met at `hit`.
    #[inline]
    pub(super) fn new(world: &World<'_>, ray: &Ray, hit: &Hit, at: Interaction) -> Self {
        let wo = -ray.direction;
        let part = &world.scene.parts[hit.part as usize];
        let (bsdf, frame) = world.scene.materials[part.material as usize].scatter(&at, wo);
        Self { at, bsdf, frame, wo, seen: frame.to_local(wo) }
    }

    /// What denoisers and people are told of it.
    pub(super) fn describe(&self, distance: f32) -> FirstHit {
        let normal = if self.seen.z < 0.0 { -self.frame.z } else { self.frame.z };
        FirstHit { part: self.at.part, distance, normal, albedo: self.albedo() }
    }

    /// Reflectance from the side it was met on, about.
    #[inline]
    pub(super) fn albedo(&self) -> Spectrum {
        self.bsdf.reflectance(self.seen.z)
    }

    /// What it sends on of the light from all sides, about: what a leaf lets through counts as what it reflects.
    #[inline]
    pub(super) fn returned(&self) -> Spectrum {
        if self.bsdf.transmits() { self.albedo() * 2.0 } else { self.albedo() }
    }

    /// The normal by which lights are chosen: on the side that scatters, which is that of the eye unless light passes through.
    #[inline]
    pub(super) fn normal(&self) -> Vec3 {
        if self.seen.z < 0.0 && !self.bsdf.transmits() { -self.frame.z } else { self.frame.z }
    }

    /// Whether going from `wo` to `wi` passes through the real triangle exactly when it passes through the shading frame's
    /// plane. Where the two disagree a normal map would leak light; nothing scatters there.
    #[inline]
    fn consistent(&self, wi: Vec3, wi_local_z: f32) -> bool {
        (self.at.ng.dot(self.wo) * self.at.ng.dot(wi) > 0.0) == (self.seen.z * wi_local_z > 0.0)
    }

    /// f · |cos θi| towards `wi` and its density.
    #[inline]
    pub(super) fn eval_pdf(&self, wi: Vec3) -> (Spectrum, f32) {
        let local = self.frame.to_local(wi);
        if self.consistent(wi, local.z) { self.bsdf.eval_pdf(self.seen, local) } else { (Spectrum::ZERO, 0.0) }
    }

    /// Scatters: which lobe, and where in it, by three numbers in [0, 1). `None` where the light is absorbed.
    #[inline]
    pub(super) fn sample(&self, u: [f32; 3]) -> Option<Scattered> {
        let s = self.bsdf.sample(self.seen, u)?;
        let wi = self.frame.to_world(s.wi);
        self.consistent(wi, s.wi.z).then_some(Scattered { wi, weight: s.weight, pdf: s.pdf })
    }
}
