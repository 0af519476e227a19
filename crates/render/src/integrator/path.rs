//! Path tracing with next-event estimation.
//!
//! The first surface samples every light; later surfaces sample one, chosen by its potential contribution. Scattered
//! rays find the same emission, so both techniques are combined by multiple importance sampling (Veach & Guibas 1995,
//! balance heuristic). At the first surface the weights account for the expected number of samples of each technique.
//!
//! Splitting and termination of paths depend on what they can still contribute relative to the light found so far
//! ([`RouletteSplitting`]). Unbiased: every contribution is divided by its sampling probability.
//!
//! Under several lights, camera rays and [trails](super::trail) are traced once. What is found under each light is the
//! same, bit by bit, as under this light alone.

use super::roulette::RouletteSplitting;
use super::trail::{Fleeting, KeptTrails, ScatteredRay, Trail, Trails};
use super::vertex::Vertex;
use super::{CameraSample, Integrator, Sample, World};
use crate::scene::Haze;
use furrow_base::geometry::{PACKET, Ray};
use furrow_base::math::{RoundTo, Spectrum, ToInt, Vec3};
use furrow_base::sampling::{Sampler, sets};
use furrow_optics::light::Light;

/// Techniques that can be switched off individually without changing the expected image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Technique {
    /// Next-event estimation. If off, emission is found only by scattered rays.
    pub light_sampling: bool,
    /// Multiple importance sampling. If off, only light samples count, if light sampling is on.
    pub mis: bool,
    /// Russian roulette and splitting according to the expected contribution. If off, every path is followed exactly
    /// once.
    pub roulette: bool,
}

impl Default for Technique {
    fn default() -> Self {
        Self { light_sampling: true, mis: true, roulette: true }
    }
}

/// The path tracer.
#[derive(Clone, Copy, Debug)]
pub struct PathTracer {
    /// Maximum number of surfaces on a path, from 1. Energy of longer paths is lost; few paths survive roulette beyond
    /// the default of 12.
    pub max_depth: u32,
    /// Maximum radiance of a path per band; infinite keeps the estimate unbiased.
    pub clamp: f32,
    /// Enabled techniques.
    pub technique: Technique,
}

impl Default for PathTracer {
    fn default() -> Self {
        Self { max_depth: 12, clamp: f32::INFINITY, technique: Technique::default() }
    }
}

/// Last scattering event, needed for the MIS weight of emission found by a scattered ray.
struct Origin<'a> {
    flight: &'a ScatteredRay,
    asked: LightStrategy,
}

/// Light sampling strategy of a surface.
#[derive(Clone, Copy)]
enum LightStrategy {
    /// All lights are sampled. `rays` is the expected number of scattered rays per sample of a wide light.
    All { rays: f32 },
    /// One light is sampled, with probability proportional to its importance.
    One,
}

/// Direct light at a first surface.
#[derive(Clone, Copy)]
struct Direct {
    found: Spectrum,
    /// Same as in [`LightStrategy::All`].
    rays: f32,
}

impl Default for Direct {
    fn default() -> Self {
        Self { found: Spectrum::ZERO, rays: 1.0 }
    }
}

/// Start of a trail at a first surface.
struct Start<'a> {
    first: &'a Vertex,
    /// Random numbers of its ray.
    u: [f32; 3],
    /// Same as in [`LightStrategy::All`].
    rays: f32,
    throughput: Spectrum,
}

/// First surfaces of a packet, with the samplers of their samples.
type Seen = [Option<(Vertex, Sampler)>; PACKET];

impl PathTracer {
    /// Radiance of the infinite lights along a ray that left the scene.
    fn escaped(&self, world: &World<'_>, ray: &Ray, from: Option<&Origin<'_>>) -> Spectrum {
        let mut sum = Spectrum::ZERO;
        for light in world.lights {
            let Some(from) = from else {
                sum += light.seen(ray.direction);
                continue;
            };
            let emitted = light.le(ray.direction);
            if !emitted.is_black() {
                sum += emitted * self.weigh(world, from, light, || light.pdf_li(from.flight.p, ray.direction));
            }
        }
        sum
    }

    /// Radiance at the camera of a surface of radiance `surface` at a distance, metres: haze attenuates it and adds light.
    #[inline]
    fn through_air(&self, world: &World<'_>, ray: &Ray, distance: f32, surface: Spectrum) -> Spectrum {
        match &world.scene.haze {
            None => surface,
            Some(haze) => {
                let sky = Ray { direction: Haze::horizontal(ray.direction), ..*ray };
                haze.over(distance, surface, self.escaped(world, &sky, None))
            }
        }
    }

    /// Radiance of the lamps that a scattered ray hits before `end`. Lamps are visible only to scattered rays, not to
    /// the camera or the labels.
    fn lamps(&self, world: &World<'_>, ray: &Ray, from: &Origin<'_>, end: f32) -> Spectrum {
        let mut sum = Spectrum::ZERO;
        for light in world.lights {
            if let Some(lamp) = light.hit(ray.origin, ray.direction)
                && lamp.distance < end
            {
                sum += lamp.radiance * self.weigh(world, from, light, || lamp.pdf);
            }
        }
        sum
    }

    /// MIS weight of emission from `light` found by a scattered ray from `from`.
    #[inline]
    fn weigh(&self, world: &World<'_>, from: &Origin<'_>, light: &Light, light_pdf: impl FnOnce() -> f32) -> f32 {
        match (self.technique.light_sampling, self.technique.mis) {
            (false, _) => 1.0,
            (true, false) => 0.0,
            (true, true) => {
                let (rays, asks) = match from.asked {
                    LightStrategy::All { rays } => (if light.is_narrow() { 1.0 } else { rays }, 1.0),
                    LightStrategy::One => {
                        let ScatteredRay { p, normal, two_sided, .. } = *from.flight;
                        let total = total_importance(world, p, normal, two_sided);
                        let own = light.importance(p, normal, two_sided);
                        (1.0, own / total.max(f32::MIN_POSITIVE))
                    }
                };
                rays * from.flight.pdf / (rays * from.flight.pdf + asks * light_pdf())
            }
        }
    }

    /// Samples `light`, which was selected with probability `chance`. Returns the contribution if unoccluded, and the
    /// shadow ray. `rays` is the expected number of scattered rays for the MIS weight.
    #[inline(always)]
    fn sample_light(
        &self,
        vertex: &Vertex,
        light: &Light,
        chance: f32,
        rays: f32,
        u: [f32; 2],
    ) -> Option<(Spectrum, Ray)> {
        let s = light.sample_li(vertex.at.p, u)?;
        let (f, bsdf_pdf) = vertex.eval_pdf(s.wi);
        if f.is_black() || s.pdf <= 0.0 {
            return None;
        }
        let light_pdf = chance * s.pdf;
        let weight = if self.technique.mis { light_pdf / (light_pdf + rays * bsdf_pdf) } else { 1.0 };
        // A lamp is at a finite distance; the shadow ray ends just short of it.
        Some((f * s.radiance * (weight / light_pdf), vertex.at.ray(s.wi, s.distance * (1.0 - 1e-5))))
    }

    /// Computes direct light at the first surfaces of a packet. Lights are sampled in order, each with a probability
    /// that depends on its contribution relative to the light found before. The sample position on light `narrow` is
    /// stratified jointly with the pixel position, because both move its shadow edges.
    fn sample_all_lights(
        &self,
        world: &World<'_>,
        seen: &Seen,
        roulette: &RouletteSplitting,
        narrow: Option<usize>,
    ) -> [Direct; PACKET] {
        let mut direct = [Direct::default(); PACKET];
        // `true` once a wide light was sampled: the light found before the first one fixes the MIS weights of all.
        let mut weighed = [false; PACKET];
        for (k, light) in world.lights.iter().enumerate() {
            let mut shadow = [None; PACKET];
            let mut brings = [Spectrum::ZERO; PACKET];
            for (i, (vertex, sampler)) in seen.iter().enumerate().filter_map(|(i, seen)| Some((i, seen.as_ref()?))) {
                let importance = light.importance(vertex.at.p, vertex.normal(), vertex.bsdf.transmits());
                if importance <= 0.0 {
                    continue;
                }
                let Direct { found, rays } = &mut direct[i];
                let chance = roulette.light(importance, vertex.albedo(), *found);
                if !light.is_narrow() && !weighed[i] {
                    *rays = roulette.split(vertex.returned(), *found) / chance;
                    weighed[i] = true;
                }
                let [own_u, own_v, asks, _] = sampler.get4(sets::first_light(k.to_u32()));
                if asks >= chance {
                    continue;
                }
                let place = if Some(k) == narrow {
                    let [_, _, u, v] = sampler.get4(sets::FIRST);
                    [u, v]
                } else {
                    [own_u, own_v]
                };
                let rays = if light.is_narrow() { 1.0 } else { *rays };
                // The MIS weight of scattered rays does not know this probability, so it is divided out here, outside
                // the weight.
                if let Some((light, ray)) = self.sample_light(vertex, light, 1.0, rays, place) {
                    brings[i] = light * (1.0 / chance);
                    shadow[i] = Some(ray);
                }
            }
            let dark = if light.is_narrow() {
                world.geometry.occluded_packet(&shadow)
            } else {
                shadow.map(|ray| ray.is_some_and(|ray| world.geometry.occluded(&ray)))
            };
            for i in 0..PACKET {
                if !dark[i] {
                    direct[i].found += brings[i];
                }
            }
        }
        direct
    }

    /// Direct light at a later surface: samples one light in proportion to its importance there.
    #[inline]
    fn sample_one_light(&self, world: &World<'_>, vertex: &Vertex, u: [f32; 3]) -> Spectrum {
        let (p, normal, two_sided) = (vertex.at.p, vertex.normal(), vertex.bsdf.transmits());
        let total = total_importance(world, p, normal, two_sided);
        if total <= 0.0 {
            return Spectrum::ZERO;
        }
        let mut left = u[0] * total;
        let mut chosen = None;
        for light in world.lights {
            let importance = light.importance(p, normal, two_sided);
            if importance > 0.0 {
                chosen = Some((light, importance / total));
                left -= importance;
                if left < 0.0 {
                    break;
                }
            }
        }
        match chosen.and_then(|(light, chance)| self.sample_light(vertex, light, chance, 1.0, [u[1], u[2]])) {
            Some((light, ray)) if !world.geometry.occluded(&ray) => light,
            _ => Spectrum::ZERO,
        }
    }

    /// Follows a trail from the first surface, where its ray is sampled with the numbers `u`, and returns the radiance along it.
    /// `branch` selects its random numbers, `found` is the light that its path has found so far.
    fn follow(
        &self,
        world: &World<'_>,
        trail: &mut impl Trail,
        Start { first, u, rays, mut throughput }: Start<'_>,
        roulette: &RouletteSplitting,
        (sampler, branch): (Sampler, u32),
        found: Spectrum,
    ) -> Spectrum {
        let mut radiance = Spectrum::ZERO;
        let mut asked = LightStrategy::All { rays };
        let Some(mut step) = trail.step(1, || ScatteredRay::leave(first, u)) else { return radiance };
        throughput *= step.flight.weight;
        for depth in 1..=self.max_depth {
            let met = step.met(world);
            let (flight, end) = (step.flight, met.as_ref().map_or(f32::INFINITY, |(hit, _)| hit.t));
            let from = Origin { flight: &flight, asked };
            radiance += throughput * self.lamps(world, &flight.ray, &from, end);
            let Some(met) = met else {
                return radiance + throughput * self.escaped(world, &flight.ray, Some(&from));
            };
            if depth == self.max_depth {
                break;
            }
            let vertex = step.vertex(world, &met);
            let lights = sampler.get4(sets::light(branch, depth));
            if self.technique.light_sampling {
                radiance += throughput * self.sample_one_light(world, &vertex, [lights[0], lights[1], lights[2]]);
            }
            let scatter = || {
                let [lobe, u, v, _] = sampler.get4(sets::scatter(branch, depth));
                ScatteredRay::leave(&vertex, [lobe, u, v])
            };
            let Some(next) = trail.step(depth + 1, scatter) else { break };
            step = next;
            throughput *= step.flight.weight;
            let chance = roulette.survive(throughput, found + radiance);
            if lights[3] >= chance {
                break;
            }
            throughput *= 1.0 / chance;
            asked = LightStrategy::One;
        }
        radiance
    }

    /// Returns the indirect light at the first surface: radiance found by scattered rays, in addition to the direct
    /// light.
    fn indirect(
        &self,
        world: &World<'_>,
        (vertex, sampler): &(Vertex, Sampler),
        trails: &mut impl Trails,
        roulette: &RouletteSplitting,
        Direct { found: direct, rays }: Direct,
        narrow: Option<usize>,
    ) -> Spectrum {
        let mean = roulette.split(vertex.returned(), direct);
        let [lobe, own_u, own_v, extra] = sampler.get4(sets::scatter(0, 0));
        let count = (mean + extra).trunc_to::<u32>();
        let mut radiance = Spectrum::ZERO;
        for branch in 0..count {
            let u = match (branch, narrow) {
                (0, Some(_)) => [lobe, own_u, own_v],
                (0, None) => {
                    let [_, _, u, v] = sampler.get4(sets::FIRST);
                    [lobe, u, v]
                }
                _ => {
                    let [lobe, u, v, _] = sampler.get4(sets::scatter(branch, 0));
                    [lobe, u, v]
                }
            };
            let trail = trails.of(branch, narrow.is_some());
            let start = Start { first: vertex, u, rays, throughput: Spectrum::splat(1.0 / mean) };
            radiance += self.follow(world, trail, start, roulette, (*sampler, branch), direct + radiance);
        }
        radiance
    }

    /// Returns what the samples of a packet find, given their first surfaces.
    fn lit(
        &self,
        world: &World<'_>,
        samples: &[Option<Sample>; PACKET],
        (seen, distances): &(Seen, [f32; PACKET]),
        trails: &mut [impl Trails; PACKET],
    ) -> [CameraSample; PACKET] {
        let roulette = RouletteSplitting::new(world, self.technique.roulette);
        let narrow = world.lights.iter().position(Light::is_narrow).filter(|_| self.technique.light_sampling);
        let direct = if self.technique.light_sampling {
            self.sample_all_lights(world, seen, &roulette, narrow)
        } else {
            [Direct::default(); PACKET]
        };
        let mut sightings = [CameraSample::default(); PACKET];
        for i in 0..PACKET {
            let Some(sample) = &samples[i] else { continue };
            let (radiance, first) = match &seen[i] {
                Some(first) => {
                    let indirect = self.indirect(world, first, &mut trails[i], &roulette, direct[i], narrow);
                    let surface = direct[i].found + indirect;
                    let seen = self.through_air(world, &sample.ray, distances[i], surface);
                    (seen, Some(first.0.describe(distances[i])))
                }
                None => (self.escaped(world, &sample.ray, None), None),
            };
            sightings[i] = CameraSample { radiance: Spectrum(radiance.0.min(Spectrum::splat(self.clamp).0)), first };
        }
        sightings
    }
}

/// Returns the first surfaces of a packet, and their distances.
#[inline]
fn first_surfaces(world: &World<'_>, samples: &[Option<Sample>; PACKET], spread: f32) -> (Seen, [f32; PACKET]) {
    let hits = world.geometry.closest_packet(&samples.map(|sample| sample.map(|s| s.ray)));
    let (mut seen, mut distances): (Seen, _) = ([None; PACKET], [0.0; PACKET]);
    for i in 0..PACKET {
        if let (Some(Sample { ray, sampler }), Some(hit)) = (&samples[i], &hits[i]) {
            seen[i] = Some((Vertex::new(world, ray, hit, world.at(hit, spread * hit.t)), *sampler));
            distances[i] = hit.t;
        }
    }
    (seen, distances)
}

#[inline]
fn total_importance(world: &World<'_>, p: Vec3, normal: Vec3, two_sided: bool) -> f32 {
    world.lights.iter().map(|l| l.importance(p, normal, two_sided)).sum()
}

impl Integrator for PathTracer {
    fn li(&self, world: &World<'_>, sample: &Sample, spread: f32) -> CameraSample {
        let mut alone = [None; PACKET];
        alone[0] = Some(*sample);
        self.li_packet(world, &alone, spread)[0]
    }

    fn li_packet(&self, world: &World<'_>, samples: &[Option<Sample>; PACKET], spread: f32) -> [CameraSample; PACKET] {
        let first = first_surfaces(world, samples, spread);
        self.lit(world, samples, &first, &mut <[Fleeting; PACKET]>::default())
    }

    fn li_packet_lit(
        &self,
        worlds: &[World<'_>],
        samples: &[Option<Sample>; PACKET],
        spread: f32,
    ) -> Vec<[CameraSample; PACKET]> {
        let Some(any) = worlds.first() else { return Vec::new() };
        let first = first_surfaces(any, samples, spread);
        let mut trails = <[KeptTrails; PACKET]>::default();
        worlds.iter().map(|world| self.lit(world, samples, &first, &mut trails)).collect()
    }
}
