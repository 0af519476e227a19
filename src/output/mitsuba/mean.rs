//! The directions that a scene's ground is seen from and lit from, over which scattering that Mitsuba's own plugins lack is averaged.
//!
//! A Lambert surface in place of a rough or a hairy one can be as bright for one pair of directions, or on the mean over many. What counts in an
//! image are those that it has: from pieces of the ground that turn to the camera, as large as they appear, to the lights, by the irradiance
//! that each gives. What hides them from either, and light that was scattered before, are left out.

use crate::bsdf::SurfaceLayer;
use crate::geometry::Hit;
use crate::math::{Spectrum, Vec2, Vec3, vec2};
use crate::scene::tag::Class;
use crate::scene::{Part, Scene};
use std::f32::consts::PI;

/// Rays along either side of the image by which it is found what the camera sees of the plane z = 0.
const GRID: u32 = 8;
/// Triangles of the ground that are looked at, about.
const PIECES: usize = 4096;
/// Directions to each light from each piece.
const DRAWS: u32 = 8;
/// The golden ratio less one: multiples of it, modulo one, lie evenly (a Fibonacci lattice).
const GOLDEN: f32 = 0.618_034;

/// A piece of ground that turns to the camera.
#[derive(Clone, Copy, Debug)]
struct Piece {
    at: Vec3,
    normal: Vec3,
    to_eye: Vec3,
    /// Its area as the camera sees it.
    seen: f32,
}

/// Two directions above a surface, and their weight.
#[derive(Clone, Copy, Debug)]
struct Pair {
    /// Cosines of the angles from the surface's normal to the eye and to the light.
    cos: [f32; 2],
    /// Cosine of the angle between the two.
    between: f32,
    weight: f32,
}

/// Means over the pairs of a scene; the weights sum to one.
#[derive(Clone, Debug)]
pub(super) struct Mean {
    pairs: Vec<Pair>,
}

/// Hairs and bloom on both sides of a leaf, on the mean.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cover {
    /// Of either side: what it lets through of the light that goes in and out, and what it reflects itself.
    pub(super) sides: [(Spectrum, Spectrum); 2],
    /// What both let through of light that passes the leaf.
    pub(super) across: Spectrum,
}

impl Mean {
    /// Of a scene as it is exported. The same scene gives the same means.
    pub(super) fn of(scene: &Scene) -> Self {
        let mut pairs = Vec::new();
        let mut drawn = 0;
        for piece in pieces(scene) {
            for light in &scene.lights {
                for _ in 0..DRAWS {
                    drawn += 1;
                    let u = [(drawn as f32 * GOLDEN).fract(), ((drawn % DRAWS) as f32 + 0.5) / DRAWS as f32];
                    let Some(light) = light.sample_li(piece.at, u) else { continue };
                    let cos = [piece.normal.dot(piece.to_eye), piece.normal.dot(light.wi)];
                    let weight = piece.seen * light.radiance.mean() * cos[1] / light.pdf;
                    if cos[0] > 1e-3 && cos[1] > 1e-3 {
                        pairs.push(Pair { cos, between: piece.to_eye.dot(light.wi), weight });
                    }
                }
            }
        }
        let total: f32 = pairs.iter().map(|pair| pair.weight).sum();
        for pair in &mut pairs {
            pair.weight /= total.max(f32::MIN_POSITIVE);
        }
        Self { pairs }
    }

    /// Mean of max(0, cos Δφ) sin α tan β, the factor of B in Oren & Nayar 1994.
    pub(super) fn retroreflection(&self) -> f32 {
        let term = |pair: &Pair| {
            let [eye, light] = pair.cos;
            pair.weight * (pair.between - eye * light).max(0.0) / eye.max(light)
        };
        self.pairs.iter().map(term).sum()
    }

    /// What lies on the upper and the lower side of a leaf.
    pub(super) fn cover(&self, layers: [Option<SurfaceLayer>; 2]) -> Cover {
        let side = |layer: Option<SurfaceLayer>| layer.map_or((Spectrum::ONE, Spectrum::ZERO), |l| self.layer(l));
        Cover { sides: layers.map(side), across: self.across(layers) }
    }

    /// What a layer on the side that is seen lets through of the light that goes in and out, and what it reflects itself.
    fn layer(&self, layer: SurfaceLayer) -> (Spectrum, Spectrum) {
        let mut sums = (Spectrum::ZERO, Spectrum::ZERO);
        for pair in &self.pairs {
            let through = pair.cos.map(|cos| layer.through(cos));
            sums.0 += through[0] * through[1] * pair.weight;
            sums.1 += SurfaceLayer::reflect(pair.cos, through) * (PI * pair.weight);
        }
        sums
    }

    /// What the layers of both sides let through of light that passes the leaf: one on its way to the eye, the other from the light.
    fn across(&self, [near, far]: [Option<SurfaceLayer>; 2]) -> Spectrum {
        let through = |layer: Option<SurfaceLayer>, cos| layer.map_or(Spectrum::ONE, |layer| layer.through(cos));
        let both = |pair: &Pair| through(near, pair.cos[0]) * through(far, pair.cos[1]) * pair.weight;
        self.pairs.iter().map(both).fold(Spectrum::ZERO, |sum, part| sum + part)
    }
}

/// Pieces of the ground in view; of the plane z = 0 where there is no ground.
fn pieces(scene: &Scene) -> Vec<Piece> {
    let points = seen(scene);
    let (lo, hi) = points
        .iter()
        .fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(lo, hi), (at, _)| (lo.min(at.truncate()), hi.max(at.truncate())));
    let camera = &scene.camera;
    let eye = camera.pose().position;
    let inside = |at: Vec3| at.truncate().cmpge(lo).all() && at.truncate().cmple(hi).all();
    let piece = |part: &Part, triangle: u32| {
        let hit = Hit { part: 0, triangle, u: 1.0 / 3.0, v: 1.0 / 3.0, t: 0.0 };
        let [a, b, c] = part.corners(triangle);
        let at = (a + b + c) / 3.0;
        let to_eye = (eye - at).normalize_or_zero();
        let seen = 0.5 * (b - a).cross(c - a).dot(to_eye);
        // With its relief, which is finer than the mesh.
        let normal = || {
            let point = part.interaction(&hit, (eye - at).length() * camera.pixel_angle());
            scene.materials[part.material as usize].scatter(&point, to_eye).1.z
        };
        (seen > 0.0 && inside(at)).then(|| Piece { at, normal: normal(), to_eye, seen })
    };
    let ground = || scene.parts.iter().filter(|part| part.tag.class == Class::Soil);
    let triangles = || ground().flat_map(|part| (0..part.mesh.triangles.len() as u32).map(move |k| (part, k)));
    // Where there are many, some that are spread evenly stand for all.
    let every = triangles().count().div_ceil(PIECES).max(1);
    let all: Vec<Piece> = triangles().step_by(every).filter_map(|(part, k)| piece(part, k)).collect();
    if all.is_empty() {
        return points.into_iter().map(|(at, to_eye)| Piece { at, normal: Vec3::Z, to_eye, seen: to_eye.z }).collect();
    }
    all
}

/// Points of the plane z = 0 that the camera sees, with the directions to it; the origin from straight above where it sees none.
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
    use crate::bsdf::{Bsdf, Leaf, OrenNayar};

    /// Rationale: a surface written as Lambert must be as bright as what it stands for. Expected: for the directions of one scene, the formula's mean
    /// is that of the scattering itself. Source: `Bsdf::eval_pdf`, by the same pairs.
    #[test]
    fn means_are_those_of_the_scattering() {
        let direction = |elevation: f32, azimuth: f32| {
            vec2(azimuth.cos(), azimuth.sin()).extend(0.0) * elevation.cos() + Vec3::Z * elevation.sin()
        };
        let pairs = [(direction(0.9, 0.3), direction(0.8, 0.1), 0.7), (direction(1.2, 2.0), direction(0.5, -1.0), 0.3)];
        let pair =
            |(eye, light, weight): (Vec3, Vec3, f32)| Pair { cos: [eye.z, light.z], between: eye.dot(light), weight };
        let mean = Mean { pairs: pairs.map(pair).to_vec() };
        let brightness = |bsdf: Bsdf| {
            let part =
                |(eye, light, weight): &(Vec3, Vec3, f32)| bsdf.eval_pdf(*eye, *light).0 * (PI * weight / light.z);
            pairs.iter().map(part).fold(Spectrum::ZERO, |sum, part| sum + part)
        };
        let near = |a: Spectrum, b: Spectrum| (a - b).map(f32::abs).max() < 1e-5;
        let soil = OrenNayar::new(Spectrum::splat(0.2), 0.5);
        let [a, b] = soil.shape();
        assert!(near(brightness(Bsdf::OrenNayar(soil)), Spectrum::splat(0.2) * (a + b * mean.retroreflection())));

        let layer = SurfaceLayer::new(0.3, 0.2).unwrap();
        let reflectance = Spectrum::new(0.05, 0.1, 0.03, 0.5);
        let side = *Leaf::bare(reflectance, Spectrum::ZERO).both_sides()[0];
        let leaf = Leaf::new(side.layered(Some(layer)), side, Spectrum::ZERO);
        let (through, own) = mean.layer(layer);
        assert!(near(brightness(Bsdf::Leaf(leaf)), reflectance * through + own));
    }
}
