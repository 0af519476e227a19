//! Export for Mitsuba: finds the view and light directions of a scene's surfaces, over which the writer averages
//! scattering that Mitsuba's own plugins lack.
//!
//! Rays through the image find points of ground and leaves, and shadow rays test which lights reach each point, so
//! hidden and shadowed points do not count.
//!
//! Indirect light is ignored. It arrives from other directions, but on the lessons' scenes it changed the ratio of the
//! exported to the original brightness by only 0.2 %.

use furrow_base::Result;
use furrow_base::geometry::{Interaction, Ray};
use furrow_base::math::{Frame, ToFloat, ToInt, Vec3, vec2};
use furrow_optics::bsdf::Form;
use furrow_output::Export;
use furrow_output::mitsuba::{self, Crossing, Directions, Leveled, Pair};
use furrow_render::accel::EmbreeAccel;
use furrow_render::integrator::World;
use furrow_render::scene::Scene;
use std::path::Path;

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

/// Writes `scene` into `folder` as [`furrow_output::mitsuba::write`] does; `text` is stored in the files.
pub fn export(folder: &Path, scene: &Scene, text: &str) -> Result<Export> {
    let leveled = Leveled::of(scene);
    mitsuba::write(folder, scene, &leveled, &directions(scene, &leveled)?, text)
}

/// Returns the pairs of directions of a scene for export. Deterministic.
fn directions(scene: &Scene, leveled: &Leveled) -> Result<Directions> {
    let geometry = EmbreeAccel::build_quickly(&scene.surfaces(), 0, None)?;
    let world = World::new(scene, &geometry);
    let sights: Vec<Sight> = (0..RAYS).filter_map(|i| sight(&world, leveled, i)).collect();
    let (leaves, ground): (Vec<Sight>, Vec<Sight>) = sights.into_iter().partition(|sight| sight.leaf);
    let leaves = lit(&world, &leaves, Sight::crossing);
    let mut pairs = lit(&world, &ground, Sight::pair);
    if pairs.is_empty() {
        pairs = lit(&world, &plane(scene), Sight::pair);
    }
    Ok(Directions::new(pairs, leaves))
}

/// Returns the surface point hit by ray number `i` through the image.
fn sight(world: &World<'_>, leveled: &Leveled, i: u32) -> Option<Sight> {
    let camera = &world.scene.camera;
    let size = vec2(camera.width().to_f32(), camera.height().to_f32());
    let place = vec2((i.to_f32() + 0.5) / RAYS.to_f32(), (i.to_f32() * GOLDEN).fract());
    let (origin, direction) = camera.ray(place * size, [0.5; 2]);
    let (hit, at) = world.interact(&Ray::new(origin, direction), 0.0, camera.pixel_angle())?;
    let material = &leveled.materials[leveled.of_parts[hit.part.to_usize()].to_usize()];
    let (bsdf, frame) = material.scatter(&at, -direction);
    let (weight, leaf) = match bsdf.form() {
        Form::Rough { albedo, .. } => (albedo.mean(), false),
        Form::Sheet { .. } => (1.0, true),
        Form::Unsupported if bsdf.transmits() => (1.0, true),
        Form::Unsupported => (bsdf.reflectance(1.0).mean(), false),
    };
    let side = 1.0_f32.copysign(at.ng.dot(-direction));
    let local = mitsuba::relief(material, at.uv);
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
                let u = [(drawn.to_f32() * GOLDEN).fract(), ((drawn % DRAWS).to_f32() + 0.5) / DRAWS.to_f32()];
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
    let size = vec2(camera.width().to_f32(), camera.height().to_f32());
    let met = |i: u32| {
        let place = vec2((i % GRID).to_f32() + 0.5, (i / GRID).to_f32() + 0.5) / GRID.to_f32();
        let (origin, direction) = camera.ray(place * size, [0.5; 2]);
        let distance = -origin.z / direction.z;
        (direction.z < -1e-3 && distance > 0.0).then(|| (origin + direction * distance, -direction))
    };
    let points: Vec<(Vec3, Vec3)> = (0..GRID * GRID).filter_map(met).collect();
    if points.is_empty() { vec![(Vec3::ZERO, Vec3::Z)] } else { points }
}
