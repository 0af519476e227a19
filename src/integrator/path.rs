//! Path tracing with next-event estimation.
//!
//! At every surface one light is chosen by what it can give there, sampled, and tested by a shadow ray; the same emission is
//! also found by scattered rays, and multiple importance sampling (Veach & Guibas 1995, the balance heuristic) weighs the
//! two. Long paths end by Russian roulette on their throughput. Unbiased: every choice is paid back by its chance.

use super::{FirstHit, Integrator, Sighting, World};
use crate::geometry::{Interaction, Ray};
use crate::light::Light;
use crate::math::{Spectrum, Vec3};
use crate::sampling::{Sampler, sets};

/// Which techniques are at work: each can be switched off, and the mean of the image must not move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Technique {
    /// Sample the lights (else emission is only found by chance).
    pub light_sampling: bool,
    /// Weigh light and scattering samples by each other (else light sampling alone counts where it is on).
    pub mis: bool,
    /// End dim paths by chance.
    pub roulette: bool,
}

impl Default for Technique {
    fn default() -> Self {
        Self { light_sampling: true, mis: true, roulette: true }
    }
}

/// The path tracer.
#[derive(Clone, Copy, Debug)]
pub struct Path {
    /// Largest number of surfaces on a path, from 1. Energy beyond it is lost: the default, 12, is past what roulette leaves.
    pub max_depth: u32,
    /// Radiance a single path may bring, per band; infinite leaves the estimate unbiased.
    pub clamp: f32,
    /// What is at work.
    pub technique: Technique,
}

impl Default for Path {
    fn default() -> Self {
        Self { max_depth: 12, clamp: f32::INFINITY, technique: Technique::default() }
    }
}

/// Growth of a ray's width after a diffuse bounce, metres a metre: textures seen by scattered light may be this coarse.
const DIFFUSE_SPREAD: f32 = 0.1;

/// Where the last scattering happened and how: what weighing an emission found by chance needs.
struct Origin {
    p: Vec3,
    normal: Vec3,
    two_sided: bool,
    pdf: f32,
}

impl Path {
    /// Weight of emission from `light` found by the scattered ray that left `from` along `wi`.
    fn weigh(&self, world: &World<'_>, from: Option<&Origin>, light: &Light, light_pdf: impl FnOnce() -> f32) -> f32 {
        let Some(from) = from else { return 1.0 };
        match (self.technique.light_sampling, self.technique.mis) {
            (false, _) => 1.0,
            (true, false) => 0.0,
            (true, true) => {
                let total = total_importance(world, from.p, from.normal, from.two_sided);
                let chance = light.importance(from.p, from.normal, from.two_sided) / total.max(f32::MIN_POSITIVE);
                from.pdf / (from.pdf + chance * light_pdf())
            }
        }
    }

    /// Light that reaches the surface straight from a light and scatters towards `wo`.
    #[inline]
    fn direct(&self, world: &World<'_>, at: &Interaction, local: &Local, u: [f32; 4]) -> Spectrum {
        let two_sided = local.bsdf.transmits();
        let normal = local.normal();
        let total = total_importance(world, at.p, normal, two_sided);
        if total <= 0.0 {
            return Spectrum::ZERO;
        }
        let mut left = u[0] * total;
        let mut chosen = None;
        for light in &world.scene.lights {
            let importance = light.importance(at.p, normal, two_sided);
            if importance > 0.0 {
                chosen = Some((light, importance / total));
                left -= importance;
                if left < 0.0 {
                    break;
                }
            }
        }
        let Some((light, chance)) = chosen else { return Spectrum::ZERO };
        let Some(s) = light.sample_li(at.p, [u[1], u[2]]) else { return Spectrum::ZERO };
        let (f, bsdf_pdf) = local.eval_pdf(at, s.wi);
        if f.is_black() || s.pdf <= 0.0 {
            return Spectrum::ZERO;
        }
        // A lamp stands at a finite distance; the ray stops just short of it.
        let ray = at.ray(s.wi, s.distance * (1.0 - 1e-5));
        if world.geometry.occluded(&ray) {
            return Spectrum::ZERO;
        }
        let light_pdf = chance * s.pdf;
        let weight = if self.technique.mis { light_pdf / (light_pdf + bsdf_pdf) } else { 1.0 };
        f * s.radiance * (weight / light_pdf)
    }
}

#[inline]
fn total_importance(world: &World<'_>, p: Vec3, normal: Vec3, two_sided: bool) -> f32 {
    world.scene.lights.iter().map(|l| l.importance(p, normal, two_sided)).sum()
}

/// The scattering at a surface, seen from `wo`, in world directions.
struct Local {
    bsdf: crate::bsdf::Bsdf,
    frame: crate::math::Frame,
    wo: Vec3,
    /// `wo` in the frame.
    seen: Vec3,
}

impl Local {
    /// The normal by which lights are chosen: on the side that scatters, which is that of the eye unless light passes through.
    #[inline]
    fn normal(&self) -> Vec3 {
        if self.seen.z < 0.0 && !self.bsdf.transmits() { -self.frame.z } else { self.frame.z }
    }

    /// Whether going from `wo` to `wi` passes through the real triangle exactly when it passes through the shading frame's
    /// plane. Where the two disagree a normal map would leak light; nothing scatters there.
    #[inline]
    fn consistent(&self, at: &Interaction, wi: Vec3, wi_local_z: f32) -> bool {
        (at.ng.dot(self.wo) * at.ng.dot(wi) > 0.0) == (self.seen.z * wi_local_z > 0.0)
    }

    /// f · |cos θi| and its density.
    #[inline]
    fn eval_pdf(&self, at: &Interaction, wi: Vec3) -> (Spectrum, f32) {
        let local = self.frame.to_local(wi);
        if self.consistent(at, wi, local.z) { self.bsdf.eval_pdf(self.seen, local) } else { (Spectrum::ZERO, 0.0) }
    }
}

impl Integrator for Path {
    fn li(&self, world: &World<'_>, ray: &Ray, spread: f32, sampler: &Sampler) -> Sighting {
        let mut sighting = Sighting::default();
        let mut radiance = Spectrum::ZERO;
        let mut throughput = Spectrum::ONE;
        let mut ray = *ray;
        let (mut width, mut spread) = (0.0, spread);
        let mut origin: Option<Origin> = None;
        for depth in 0..=self.max_depth {
            let found = world.interact(&ray, width, spread);
            let end = found.as_ref().map_or(f32::INFINITY, |(hit, _)| hit.t);
            // Lamps are seen by scattered light only: to the camera, as to the labels, they are not there.
            if origin.is_some() {
                for light in &world.scene.lights {
                    if let Some(lamp) = light.hit(ray.origin, ray.direction)
                        && lamp.distance < end
                    {
                        radiance += throughput * lamp.radiance * self.weigh(world, origin.as_ref(), light, || lamp.pdf);
                    }
                }
            }
            let Some((hit, at)) = found else {
                for light in &world.scene.lights {
                    let emitted = light.le(ray.direction);
                    if !emitted.is_black() {
                        let p = origin.as_ref().map_or(ray.origin, |o| o.p);
                        let weight = self.weigh(world, origin.as_ref(), light, || light.pdf_li(p, ray.direction));
                        radiance += throughput * emitted * weight;
                    }
                }
                break;
            };
            if depth == self.max_depth {
                break;
            }
            let wo = -ray.direction;
            let part = &world.scene.parts[hit.part as usize];
            let (bsdf, frame) = world.scene.materials[part.material as usize].scatter(&at, wo);
            let local = Local { bsdf, frame, wo, seen: frame.to_local(wo) };
            if depth == 0 {
                let normal = if frame.z.dot(wo) < 0.0 { -frame.z } else { frame.z };
                sighting.first = Some(FirstHit { distance: hit.t, normal, albedo: bsdf.reflectance(local.seen.z) });
            }
            let lights = sampler.get4(sets::light(depth));
            let scattering = sampler.get4(sets::scatter(depth));
            if self.technique.light_sampling {
                radiance += throughput * self.direct(world, &at, &local, lights);
            }
            let Some(s) = bsdf.sample(local.seen, [scattering[0], scattering[1], scattering[2]]) else { break };
            let wi = frame.to_world(s.wi);
            if !local.consistent(&at, wi, s.wi.z) {
                break;
            }
            throughput *= s.weight;
            if self.technique.roulette {
                // Survival by what the path can still bring; the last number of the light set decides.
                let survive = throughput.max().min(0.95);
                if lights[3] >= survive {
                    break;
                }
                throughput *= 1.0 / survive;
            }
            origin = Some(Origin { p: at.p, normal: local.normal(), two_sided: bsdf.transmits(), pdf: s.pdf });
            ray = at.ray(wi, f32::INFINITY);
            width = at.footprint;
            spread = DIFFUSE_SPREAD;
        }
        sighting.radiance = Spectrum(radiance.0.min(Spectrum::splat(self.clamp).0));
        sighting
    }
}
