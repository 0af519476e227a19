//! Path tracing with next-event estimation.
//!
//! The surface that the eye sees asks every light; the surfaces behind it ask one, chosen by what it can give there. The same
//! emission is also found by scattered rays, and multiple importance sampling (Veach & Guibas 1995, the balance heuristic)
//! weighs the two. How many rays go on from the first surface, and which paths end, follows from what they can still bring
//! beside what was found ([`Effort`]). Unbiased: every choice is paid back by its chance.

use super::effort::Effort;
use super::vertex::Vertex;
use super::{Integrator, Sighting, World};
use crate::geometry::Ray;
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
    /// Follow by chance what can bring little, and repeatedly what can bring much (else everything once).
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
    /// Whether every light was asked there, not one of them.
    asked_all: bool,
}

/// A scattered ray on its way.
struct Flight {
    ray: Ray,
    /// Its width where it starts, metres.
    width: f32,
    /// Growth of its width, metres a metre.
    spread: f32,
    throughput: Spectrum,
    from: Origin,
}

impl Flight {
    /// The ray that leaves `vertex` by the numbers `u`, before anyone asks whether it is worth following.
    #[inline]
    fn leave(vertex: &Vertex, u: [f32; 3], throughput: Spectrum, asked_all: bool) -> Option<Self> {
        let s = vertex.sample(u)?;
        let at = &vertex.at;
        let (normal, two_sided) = (vertex.normal(), vertex.bsdf.transmits());
        Some(Self {
            ray: at.ray(s.wi, f32::INFINITY),
            width: at.footprint,
            spread: DIFFUSE_SPREAD,
            throughput: throughput * s.weight,
            from: Origin { p: at.p, normal, two_sided, pdf: s.pdf, asked_all },
        })
    }
}

impl Path {
    /// Light of the infinite lights along a ray that left the scene.
    fn escaped(&self, world: &World<'_>, ray: &Ray, from: Option<&Origin>) -> Spectrum {
        let mut sum = Spectrum::ZERO;
        for light in &world.scene.lights {
            let emitted = light.le(ray.direction);
            if !emitted.is_black() {
                let weight =
                    from.map_or(1.0, |from| self.weigh(world, from, light, || light.pdf_li(from.p, ray.direction)));
                sum += emitted * weight;
            }
        }
        sum
    }

    /// Light of the lamps that a scattered ray meets before `end`. Lamps are seen by scattered light only: to the camera, as
    /// to the labels, they are not there.
    fn lamps(&self, world: &World<'_>, ray: &Ray, from: &Origin, end: f32) -> Spectrum {
        let mut sum = Spectrum::ZERO;
        for light in &world.scene.lights {
            if let Some(lamp) = light.hit(ray.origin, ray.direction)
                && lamp.distance < end
            {
                sum += lamp.radiance * self.weigh(world, from, light, || lamp.pdf);
            }
        }
        sum
    }

    /// Weight of emission from `light` found by the scattered ray that left `from`.
    #[inline]
    fn weigh(&self, world: &World<'_>, from: &Origin, light: &Light, light_pdf: impl FnOnce() -> f32) -> f32 {
        match (self.technique.light_sampling, self.technique.mis) {
            (false, _) => 1.0,
            (true, false) => 0.0,
            (true, true) => {
                let chance = if from.asked_all {
                    1.0
                } else {
                    let total = total_importance(world, from.p, from.normal, from.two_sided);
                    light.importance(from.p, from.normal, from.two_sided) / total.max(f32::MIN_POSITIVE)
                };
                from.pdf / (from.pdf + chance * light_pdf())
            }
        }
    }

    /// Light from `light`, asked with the probability `chance`, that reaches the surface unhindered and scatters to the eye.
    #[inline]
    fn ask(&self, world: &World<'_>, vertex: &Vertex, light: &Light, chance: f32, u: [f32; 2]) -> Spectrum {
        let Some(s) = light.sample_li(vertex.at.p, u) else { return Spectrum::ZERO };
        let (f, bsdf_pdf) = vertex.eval_pdf(s.wi);
        if f.is_black() || s.pdf <= 0.0 {
            return Spectrum::ZERO;
        }
        // A lamp stands at a finite distance; the ray stops just short of it.
        if world.geometry.occluded(&vertex.at.ray(s.wi, s.distance * (1.0 - 1e-5))) {
            return Spectrum::ZERO;
        }
        let light_pdf = chance * s.pdf;
        let weight = if self.technique.mis { light_pdf / (light_pdf + bsdf_pdf) } else { 1.0 };
        f * s.radiance * (weight / light_pdf)
    }

    /// Direct light at the first surface: every light, in order, as often as it matters beside those before it.
    #[inline]
    fn ask_all(&self, world: &World<'_>, vertex: &Vertex, effort: &Effort, sampler: Sampler) -> Spectrum {
        let (normal, two_sided, albedo) = (vertex.normal(), vertex.bsdf.transmits(), vertex.albedo());
        let mut found = Spectrum::ZERO;
        for (k, light) in world.scene.lights.iter().enumerate() {
            let importance = light.importance(vertex.at.p, normal, two_sided);
            if importance <= 0.0 {
                continue;
            }
            let chance = effort.light(importance, albedo, found);
            let u = sampler.get4(sets::first_light(k as u32));
            if u[2] < chance {
                // The weight of the other technique knows nothing of this chance, so it is paid back outside.
                found += self.ask(world, vertex, light, 1.0, [u[0], u[1]]) * (1.0 / chance);
            }
        }
        found
    }

    /// Direct light at a surface further on: one light, by its share of what all can give there.
    #[inline]
    fn ask_one(&self, world: &World<'_>, vertex: &Vertex, u: [f32; 3]) -> Spectrum {
        let (p, normal, two_sided) = (vertex.at.p, vertex.normal(), vertex.bsdf.transmits());
        let total = total_importance(world, p, normal, two_sided);
        if total <= 0.0 {
            return Spectrum::ZERO;
        }
        let mut left = u[0] * total;
        let mut chosen = None;
        for light in &world.scene.lights {
            let importance = light.importance(p, normal, two_sided);
            if importance > 0.0 {
                chosen = Some((light, importance / total));
                left -= importance;
                if left < 0.0 {
                    break;
                }
            }
        }
        chosen.map_or(Spectrum::ZERO, |(light, chance)| self.ask(world, vertex, light, chance, [u[1], u[2]]))
    }

    /// What comes back along a scattered ray that may meet surfaces number `depth` and on; `branch` names its numbers, `found`
    /// is the light that its path has brought already.
    fn follow(
        &self,
        world: &World<'_>,
        mut flight: Flight,
        effort: &Effort,
        sampler: Sampler,
        branch: u32,
        found: Spectrum,
    ) -> Spectrum {
        let mut radiance = Spectrum::ZERO;
        for depth in 1..=self.max_depth {
            let Flight { ray, throughput, ref from, .. } = flight;
            let met = world.interact(&ray, flight.width, flight.spread);
            radiance +=
                throughput * self.lamps(world, &ray, from, met.as_ref().map_or(f32::INFINITY, |(hit, _)| hit.t));
            let Some((hit, at)) = met else {
                return radiance + throughput * self.escaped(world, &ray, Some(from));
            };
            if depth == self.max_depth {
                break;
            }
            let vertex = Vertex::new(world, &ray, &hit, at);
            let lights = sampler.get4(sets::light(branch, depth));
            if self.technique.light_sampling {
                radiance += throughput * self.ask_one(world, &vertex, [lights[0], lights[1], lights[2]]);
            }
            let [lobe, u, v, _] = sampler.get4(sets::scatter(branch, depth));
            let Some(next) = Flight::leave(&vertex, [lobe, u, v], throughput, false) else { break };
            flight = next;
            let chance = effort.survive(flight.throughput, found + radiance);
            if lights[3] >= chance {
                break;
            }
            flight.throughput *= 1.0 / chance;
        }
        radiance
    }

    /// What the first surface sends to the eye.
    fn shade(&self, world: &World<'_>, vertex: &Vertex, sampler: Sampler) -> Spectrum {
        let effort = Effort::new(world, self.technique.roulette);
        let direct =
            if self.technique.light_sampling { self.ask_all(world, vertex, &effort, sampler) } else { Spectrum::ZERO };
        let mut radiance = direct;
        // What a leaf lets through counts as what it reflects.
        let returned = if vertex.bsdf.transmits() { vertex.albedo() * 2.0 } else { vertex.albedo() };
        let mean = effort.split(returned, direct);
        let [_, _, u, v] = sampler.get4(sets::FIRST);
        let [lobe, _, _, extra] = sampler.get4(sets::scatter(0, 0));
        let count = (mean + extra) as u32;
        for branch in 0..count {
            let u = if branch == 0 {
                [lobe, u, v]
            } else {
                let [lobe, u, v, _] = sampler.get4(sets::scatter(branch, 0));
                [lobe, u, v]
            };
            let Some(flight) = Flight::leave(vertex, u, Spectrum::splat(1.0 / mean), true) else { continue };
            radiance += self.follow(world, flight, &effort, sampler, branch, direct);
        }
        radiance
    }
}

#[inline]
fn total_importance(world: &World<'_>, p: Vec3, normal: Vec3, two_sided: bool) -> f32 {
    world.scene.lights.iter().map(|l| l.importance(p, normal, two_sided)).sum()
}

impl Integrator for Path {
    fn li(&self, world: &World<'_>, ray: &Ray, spread: f32, sampler: &Sampler) -> Sighting {
        let (radiance, first) = match world.interact(ray, 0.0, spread) {
            None => (self.escaped(world, ray, None), None),
            Some((hit, at)) => {
                let vertex = Vertex::new(world, ray, &hit, at);
                (self.shade(world, &vertex, *sampler), Some(vertex.describe(hit.t)))
            }
        };
        Sighting { radiance: Spectrum(radiance.0.min(Spectrum::splat(self.clamp).0)), first }
    }
}
