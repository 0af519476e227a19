//! View and light directions of a scene's surfaces, over which scattering that Mitsuba's own plugins lack is averaged.
//!
//! A Lambertian surface that replaces a rough, wet or hairy one can match its brightness for one pair of directions, or
//! on average over many. The pairs that occur in the image matter. Rays through the image find points of ground and
//! leaves, and shadow rays test which lights reach each point, so hidden and shadowed points do not count.
//!
//! Indirect light is ignored. It arrives from other directions, but on the lessons' scenes it changed the ratio of the
//! exported to the original brightness by only 0.2 %.
//!
//! Notation: E is the irradiance of a light on a plane that faces it, n the shading normal, n' the normal that
//! `normalmap` derives from the same relief, c(θ) the transmission of the water film (see `Wet`), and ρ (A + B s) the
//! ground's Oren–Nayar model. The albedo is exported times
//!
//! `k = Σ ρ E (n·l) (A + B s) c(θ_eye) c(θ_light) / Σ ρ E (n'·l)`, `s = max(0, cos Δφ) sin α tan β`.
//!
//! Both sums are over the same pairs of points and light directions, so the diffuse direct light of the ground in the
//! image is preserved. The two normals differ where a slope of the mesh meets a slope of the relief. This renderer adds
//! slopes over the ground plane; `normalmap` rotates the relief with the mesh and is darker on average, by 1.4 % on
//! `02-one-plant.ron`.

use super::level::Leveled;
use super::look;
use furrow_base::Result;
use furrow_base::geometry::{Interaction, Ray};
use furrow_base::math::{Frame, Spectrum, Vec3, vec2};
use furrow_optics::bsdf::microfacet::Ggx;
use furrow_optics::bsdf::{Bsdf, Rough, SurfaceLayer, fresnel};
use furrow_optics::optics::Shadowing;
use furrow_render::accel::EmbreeAccel;
use furrow_render::integrator::World;
use furrow_render::scene::Scene;
use std::f32::consts::PI;

/// Number of rays through the image.
const RAYS: u32 = 4096;
/// Number of sampled directions to each light from each point.
const DRAWS: u32 = 4;
/// Number of rays along either side of the image that sample the plane z = 0, used if the camera sees no ground.
const GRID: u32 = 8;
/// The golden ratio minus one. Its multiples modulo one are evenly distributed (a Fibonacci lattice).
const GOLDEN: f32 = 0.618_034;
/// Cosine below which a direction counts as tangential to the surface.
const ALONG: f32 = 1e-3;

/// Surface point that the camera sees.
#[derive(Clone, Copy, Debug)]
struct Sight {
    at: Vec3,
    to_eye: Vec3,
    /// Origin of rays to the lights; `None` for a point that is never shadowed.
    from: Option<Interaction>,
    /// Geometric normal of the triangle; all normals here are on the camera's side.
    geometric: Vec3,
    /// Interpolated normal of the mesh.
    smooth: Vec3,
    /// Shading normal of this renderer.
    normal: Vec3,
    /// Exported normal.
    written: Vec3,
    /// `true` if the material has relief at this point.
    relief: bool,
    /// Fraction of the image times the albedo; for a leaf the fraction alone.
    weight: f32,
    /// `true` for a leaf.
    leaf: bool,
}

impl Sight {
    /// Returns the pair of directions for a leaf lit from `wi`; `sent` is the irradiance on a plane that faces the
    /// light. `None` if mesh and relief disagree about the light's side.
    fn crossing(&self, wi: Vec3, sent: f32) -> Option<Crossing> {
        let [eye, light] = [self.normal.dot(self.to_eye), self.normal.dot(wi)];
        let agree = eye > ALONG && light.abs() > ALONG && light * self.geometric.dot(wi) > 0.0;
        let weight = self.weight * sent * light.abs();
        agree.then_some(Crossing { cos: [eye, light.abs()], across: light < 0.0, weight })
    }

    /// Returns the pair of directions for light from `wi`; `sent` is the irradiance on a plane that faces the light.
    /// `None` if no light is scattered to the eye.
    fn pair(&self, wi: Vec3, sent: f32) -> Option<Pair> {
        let cos = [self.normal.dot(self.to_eye), self.normal.dot(wi)];
        let above = self.geometric.dot(wi) > 0.0;
        let ours = if above && cos[0] > ALONG && cos[1] > ALONG { cos[1] } else { 0.0 };
        // Mitsuba rejects directions that are on different sides of the relief and of the mesh.
        let seen = above && self.written.dot(self.to_eye) > 0.0 && self.smooth.dot(wi) > 0.0;
        let written = if seen { self.written.dot(wi).max(0.0) } else { 0.0 };
        let [weight, written] = [ours, written].map(|cos| self.weight * sent * cos);
        let (cos, between) = (cos.map(|c| c.max(ALONG)), self.to_eye.dot(wi));
        (weight + written > 0.0).then_some(Pair { cos, between, weight, written, relief: self.relief })
    }
}

/// Two directions above a surface, with their weight.
#[derive(Clone, Copy, Debug)]
struct Pair {
    /// Cosines of the angles from the surface's normal to the eye and to the light.
    cos: [f32; 2],
    /// Cosine of the angle between the two directions.
    between: f32,
    /// Light that a Lambertian surface with this renderer's normal scatters to the eye.
    weight: f32,
    /// The same light with the exported normal.
    written: f32,
    /// `true` if the material has relief at this point.
    relief: bool,
}

/// Two directions at a leaf, with their weight.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    /// Cosines of the angles from the surface's normal to the eye and to the light, each on its own side.
    cos: [f32; 2],
    /// `true` if the light is on the other side than the eye.
    across: bool,
    /// Light that falls on the leaf from this direction.
    weight: f32,
}

/// Pairs of directions of a scene; the weights of those on the ground sum to one.
#[derive(Clone, Debug)]
pub(super) struct Mean {
    pairs: Vec<Pair>,
    leaves: Vec<Crossing>,
}

/// Mean effect of hairs and wax bloom on both sides of a leaf.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cover {
    /// For each side: transmission of light that enters and leaves through the layer, and the layer's own reflectance.
    pub(super) sides: [(Spectrum, Spectrum); 2],
    /// Transmission through both layers of light that crosses the leaf.
    pub(super) across: Spectrum,
}

impl Mean {
    /// Computes the means of a scene for export. Deterministic.
    pub(super) fn of(scene: &Scene, leveled: &Leveled) -> Result<Self> {
        let geometry = EmbreeAccel::build_quickly(&scene.surfaces(), 0, None)?;
        let world = World { scene, geometry: &geometry };
        let sights: Vec<Sight> = (0..RAYS).filter_map(|i| sight(&world, leveled, i)).collect();
        let (leaves, ground): (Vec<Sight>, Vec<Sight>) = sights.into_iter().partition(|sight| sight.leaf);
        let leaves = lit(&world, &leaves, Sight::crossing);
        let mut pairs = lit(&world, &ground, Sight::pair);
        if pairs.is_empty() {
            pairs = lit(&world, &plane(scene), Sight::pair);
        }
        let total: f32 = pairs.iter().map(|pair| pair.weight).sum();
        for pair in &mut pairs {
            pair.weight /= total.max(f32::MIN_POSITIVE);
            pair.written /= total.max(f32::MIN_POSITIVE);
        }
        Ok(Self { pairs, leaves })
    }

    /// Returns k of this module's equation. It replaces Oren–Nayar's A and B, the transmission of a water film over a
    /// fraction of the surface, and the shadowing by fine relief. If the image has both surfaces with relief and
    /// without, only those that match `relief` are used.
    pub(super) fn soil(
        &self,
        [a, b]: [f32; 2],
        film: Option<(Ggx, f32)>,
        shadowing: Option<Shadowing>,
        relief: bool,
    ) -> f32 {
        let any = self.pairs.iter().any(|pair| pair.relief == relief && pair.written > 0.0);
        let scale = film.map_or(1.0, |(coat, _)| norm(coat.ior));
        let through = |cos: f32| {
            film.map_or(1.0, |(coat, share)| 1.0 + share * ((1.0 - fresnel::dielectric(cos, coat.ior)) / scale - 1.0))
        };
        let (mut ours, mut written) = (0.0_f64, 0.0_f64);
        for pair in self.pairs.iter().filter(|pair| !any || pair.relief == relief) {
            let [eye, light] = pair.cos;
            // max(0, cos Δφ) sin α tan β of Oren & Nayar 1994 without trigonometry, as in `OrenNayar`.
            let s = (pair.between - eye * light).max(0.0) / eye.max(light);
            let open = shadowing.map_or(1.0, |relief| relief.factor(light, eye, pair.between));
            ours += f64::from(pair.weight * (a + b * s) * through(eye) * through(light) * open);
            written += f64::from(pair.written);
        }
        if written > 0.0 { (ours / written) as f32 } else { a }
    }

    /// Returns the mean transmission of the coats that the eye and the light see, c(θ_eye) c(θ_light) of `Leaf`, over
    /// the leaves in view: for transmitted light if `across`, otherwise for reflected light. 1 if there are no leaves.
    pub(super) fn coats(&self, coats: [Option<Ggx>; 2], across: bool) -> f32 {
        let norms = coats.map(|coat| coat.map_or(1.0, |coat| norm(coat.ior)));
        let through =
            |k: usize, cos: f32| coats[k].map_or(1.0, |coat| (1.0 - fresnel::dielectric(cos, coat.ior)) / norms[k]);
        let (mut sum, mut weights) = (0.0_f64, 0.0_f64);
        for crossing in self.leaves.iter().filter(|crossing| crossing.across == across) {
            let [eye, light] = crossing.cos;
            sum += f64::from(crossing.weight * through(0, eye) * through(1, light));
            weights += f64::from(crossing.weight);
        }
        if weights > 0.0 { (sum / weights) as f32 } else { 1.0 }
    }

    /// Returns the effect of the layers on the upper and the lower side of a leaf.
    pub(super) fn cover(&self, layers: [Option<SurfaceLayer>; 2]) -> Cover {
        let side = |layer: Option<SurfaceLayer>| layer.map_or((Spectrum::ONE, Spectrum::ZERO), |l| self.layer(l));
        Cover { sides: layers.map(side), across: self.across(layers) }
    }

    /// Returns the transmission of light that enters and leaves through a layer on the visible side, and the layer's
    /// own reflectance.
    fn layer(&self, layer: SurfaceLayer) -> (Spectrum, Spectrum) {
        let mut sums = (Spectrum::ZERO, Spectrum::ZERO);
        for pair in &self.pairs {
            let through = pair.cos.map(|cos| layer.through(cos));
            sums.0 += through[0] * through[1] * pair.weight;
            sums.1 += SurfaceLayer::reflect(pair.cos, through) * (PI * pair.weight);
        }
        sums
    }

    /// Returns the transmission through both layers of light that crosses the leaf: one on the eye's side, the other on
    /// the light's.
    fn across(&self, [near, far]: [Option<SurfaceLayer>; 2]) -> Spectrum {
        let through = |layer: Option<SurfaceLayer>, cos| layer.map_or(Spectrum::ONE, |layer| layer.through(cos));
        let both = |pair: &Pair| through(near, pair.cos[0]) * through(far, pair.cos[1]) * pair.weight;
        self.pairs.iter().map(both).fold(Spectrum::ZERO, |sum, part| sum + part)
    }
}

/// Returns √((1 − F₀)(1 − F̄)) of a smooth interface of this index, the normalisation of its transmission (see `Wet`
/// and `Leaf`).
fn norm(ior: f32) -> f32 {
    ((1.0 - fresnel::dielectric(1.0, ior)) * (1.0 - fresnel::hemispherical(ior))).sqrt()
}

/// Returns the surface point hit by ray number `i` through the image.
fn sight(world: &World<'_>, leveled: &Leveled, i: u32) -> Option<Sight> {
    let camera = &world.scene.camera;
    let size = vec2(camera.width() as f32, camera.height() as f32);
    let place = vec2((i as f32 + 0.5) / RAYS as f32, (i as f32 * GOLDEN).fract());
    let (origin, direction) = camera.ray(place * size, [0.5; 2]);
    let (hit, at) = world.interact(&Ray::new(origin, direction), 0.0, camera.pixel_angle())?;
    let material = &leveled.materials[leveled.of_parts[hit.part as usize] as usize];
    let (bsdf, frame) = material.scatter(&at, -direction);
    let (weight, leaf) = match bsdf {
        Bsdf::OrenNayar(b) => (b.albedo().mean(), false),
        Bsdf::Wet(b) => (b.base().albedo().mean(), false),
        Bsdf::Shadowed(b) => match b.base() {
            Rough::Dry(base) => (base.albedo().mean(), false),
            Rough::Wet(base) => (base.base().albedo().mean(), false),
        },
        Bsdf::Leaf(_) => (1.0, true),
    };
    let side = 1.0_f32.copysign(at.ng.dot(-direction));
    let local = look::relief(material, at.uv);
    let relief = local.x != 0.0 || local.y != 0.0;
    let written = if relief { Frame::with_tangent(at.ns, at.tangents().0).to_world(local) } else { at.ns };
    let [geometric, smooth, normal, written] = [at.ng, at.ns, frame.z, written].map(|n| n * side);
    let from = Some(at);
    Some(Sight { at: at.p, to_eye: -direction, from, geometric, smooth, normal, written, relief, weight, leaf })
}

/// Applies `pair` to all points and the sampled directions from which unoccluded light reaches them.
fn lit<T>(world: &World<'_>, sights: &[Sight], pair: impl Fn(&Sight, Vec3, f32) -> Option<T>) -> Vec<T> {
    let mut pairs = Vec::new();
    let mut drawn = 0;
    for sight in sights {
        for light in &world.scene.lights {
            for _ in 0..DRAWS {
                drawn += 1;
                let u = [(drawn as f32 * GOLDEN).fract(), ((drawn % DRAWS) as f32 + 0.5) / DRAWS as f32];
                let Some(light) = light.sample_li(sight.at, u) else { continue };
                // A lamp is at a finite distance; the shadow ray ends just before it.
                let reach = light.distance * (1.0 - 1e-5);
                let dark = || sight.from.is_some_and(|from| world.geometry.occluded(&from.ray(light.wi, reach)));
                let sent = light.radiance.mean() / light.pdf;
                pairs.extend(pair(sight, light.wi, sent).filter(|_| !dark()));
            }
        }
    }
    pairs
}

/// Returns points of the plane z = 0, treated as ground.
fn plane(scene: &Scene) -> Vec<Sight> {
    let sight = |(at, to_eye): (Vec3, Vec3)| {
        let [geometric, smooth, normal, written] = [Vec3::Z; 4];
        Sight {
            at,
            to_eye,
            from: None,
            geometric,
            smooth,
            normal,
            written,
            relief: false,
            weight: to_eye.z,
            leaf: false,
        }
    };
    seen(scene).into_iter().map(sight).collect()
}

/// Returns points of the plane z = 0 that the camera sees, with the directions to the camera; if it sees none, the
/// origin from straight above.
fn seen(scene: &Scene) -> Vec<(Vec3, Vec3)> {
    let camera = &scene.camera;
    let size = vec2(camera.width() as f32, camera.height() as f32);
    let met = |i: u32| {
        let place = vec2((i % GRID) as f32 + 0.5, (i / GRID) as f32 + 0.5) / GRID as f32;
        let (origin, direction) = camera.ray(place * size, [0.5; 2]);
        let distance = -origin.z / direction.z;
        (direction.z < -1e-3 && distance > 0.0).then(|| (origin + direction * distance, -direction))
    };
    let points: Vec<(Vec3, Vec3)> = (0..GRID * GRID).filter_map(met).collect();
    if points.is_empty() { vec![(Vec3::ZERO, Vec3::Z)] } else { points }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_optics::bsdf::{Leaf, OrenNayar, Side, Wet};

    /// Rationale: a surface exported as Lambertian must be as bright as the original. Expected: for the directions of
    /// one scene, the formula's mean equals that of the BSDF itself. Source: `Bsdf::eval_pdf`, with the same pairs.
    #[test]
    fn means_are_those_of_the_scattering() {
        let direction = |elevation: f32, azimuth: f32| {
            vec2(azimuth.cos(), azimuth.sin()).extend(0.0) * elevation.cos() + Vec3::Z * elevation.sin()
        };
        let pairs = [(direction(0.9, 0.3), direction(0.8, 0.1), 0.7), (direction(1.2, 2.0), direction(0.5, -1.0), 0.3)];
        let pair = |(eye, light, weight): (Vec3, Vec3, f32)| Pair {
            cos: [eye.z, light.z],
            between: eye.dot(light),
            weight,
            written: weight,
            relief: false,
        };
        let crossing =
            |(eye, light, weight): (Vec3, Vec3, f32)| Crossing { cos: [eye.z, light.z], across: false, weight };
        let mean = Mean { pairs: pairs.map(pair).to_vec(), leaves: pairs.map(crossing).to_vec() };
        let brightness = |bsdf: Bsdf| {
            let part =
                |(eye, light, weight): &(Vec3, Vec3, f32)| bsdf.eval_pdf(*eye, *light).0 * (PI * weight / light.z);
            pairs.iter().map(part).fold(Spectrum::ZERO, |sum, part| sum + part)
        };
        let near = |a: Spectrum, b: Spectrum| (a - b).map(f32::abs).max() < 1e-5;
        let soil = OrenNayar::new(Spectrum::splat(0.2), 0.5);
        let factor = mean.soil(soil.shape(), None, None, false);
        assert!(near(brightness(Bsdf::OrenNayar(soil)), Spectrum::splat(0.2) * factor));
        // The surface below a film, without the film's own reflection. If no pair has relief, those without it count.
        let wet = Wet::new(Spectrum::splat(0.2), 0.5, 0.6, 1.0);
        let film = brightness(Bsdf::Wet(wet)) - brightness(Bsdf::Wet(Wet::new(Spectrum::ZERO, 0.5, 0.6, 1.0)));
        let factor = mean.soil(wet.base().shape(), Some((wet.coat(), wet.film())), None, true);
        assert!(near(film, wet.base().albedo() * factor));

        let layer = SurfaceLayer::new(0.3, 0.2).unwrap();
        let reflectance = Spectrum::new(0.05, 0.1, 0.03, 0.5);
        let side = *Leaf::bare(reflectance, Spectrum::ZERO).both_sides()[0];
        let leaf = Leaf::new(side.layered(Some(layer)), side, Spectrum::ZERO);
        let (through, own) = mean.layer(layer);
        assert!(near(brightness(Bsdf::Leaf(leaf)), reflectance * through + own));

        // The tissue below a coat, without the coat's own reflection.
        let coated = |reflectance: Spectrum| Side::new(1.45, [0.3; 2], reflectance);
        let bright = |side: Side| brightness(Bsdf::Leaf(Leaf::new(side, side, Spectrum::ZERO)));
        let side = coated(Spectrum::splat(0.4));
        let below = bright(side) - bright(coated(Spectrum::ZERO));
        assert!(near(below, side.diffuse() * mean.coats([side.coat(); 2], false)));
    }
}
