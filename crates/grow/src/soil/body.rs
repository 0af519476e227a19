//! Rounded polyhedra: the shapes of clods and stones.
//!
//! A shape is a sphere cut by random planes with worn edges: in direction u its radius is r(u) = (1 + Σₖ max(0, nₖ·u /
//! dₖ)^p)^(−1/p), a polytope for large p and a sphere without planes, times 1 + noise. Aggregates are blocks that broke
//! along such planes and were rounded by the harrow; stones are more worn (small p, little noise).

use furrow_base::geometry::Mesh;
use furrow_base::math::{Mat3, Quat, ToFloat, ToInt, Vec2, Vec3, vec3};
use furrow_base::sampling::Stream;
use furrow_optics::texture::noise::Perlin;
use std::collections::BTreeMap;

/// Closed shape with a radius of about 1 around the origin.
#[derive(Clone, Debug)]
pub(super) struct Shape {
    pub(super) positions: Vec<Vec3>,
    pub(super) normals: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
}

/// Parameters of a shape's planes and wear.
#[derive(Clone, Copy, Debug)]
pub(super) struct ShapeParameters {
    /// Range of the number of planes.
    pub(super) planes: (usize, usize),
    /// Range of the planes' distance from the centre.
    pub(super) distance: (f32, f32),
    /// Range of p, the sharpness of the edges.
    pub(super) sharpness: (f32, f32),
    /// Amplitude of lumps with about half the body's size.
    pub(super) lumps: f32,
    /// Amplitude of the roughness, with sizes from a quarter of the body's size down.
    pub(super) rough: f32,
}

/// Number of levels of detail, with 32, 80, 320, 1280 and 5120 triangles.
pub(super) const LEVELS: usize = 5;

/// Returns the number of triangles of a whole shape at a level.
pub(super) fn triangles(level: usize) -> usize {
    [32, 80, 320, 1280, 5120][level]
}

/// Returns a triangulated unit sphere.
fn sphere(level: usize) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let (mut corners, mut triangles) = if level == 0 { octahedron() } else { icosahedron() };
    for _ in 0..level.max(1) {
        let mut middles = BTreeMap::new();
        let mut finer = Vec::with_capacity(4 * triangles.len());
        for [a, b, c] in triangles {
            let mut middle = |i: u32, j: u32| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    corners.push((corners[i.to_usize()] + corners[j.to_usize()]).normalize());
                    corners.len().to_u32() - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    (corners, triangles)
}

fn octahedron() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let corners = vec![Vec3::X, Vec3::Y, Vec3::NEG_X, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    let triangles = (0..4).flat_map(|i| [[i, (i + 1) % 4, 4], [(i + 1) % 4, i, 5]]).collect();
    (corners, triangles)
}

fn icosahedron() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    // Two poles and two staggered rings of five.
    let ring = |z: f32, shift: f32| {
        (0..5u8).map(move |k| {
            let (s, c) = ((f32::from(k) + shift) * std::f32::consts::TAU / 5.0).sin_cos();
            vec3(c, s, 0.0) * (1.0 - z * z).sqrt() + vec3(0.0, 0.0, z)
        })
    };
    let z = 0.2f32.sqrt();
    let corners =
        std::iter::once(Vec3::Z).chain(ring(z, 0.0)).chain(ring(-z, 0.5)).chain(std::iter::once(Vec3::NEG_Z)).collect();
    let triangles = (0..5)
        .flat_map(|k| {
            let (a, b) = (1 + k, 1 + (k + 1) % 5);
            let (c, d) = (a + 5, b + 5);
            [[0, a, b], [a, c, b], [b, c, d], [c, 11, d]]
        })
        .collect();
    (corners, triangles)
}

impl Shape {
    /// Builds a random shape; the same random stream gives the same body at every level.
    pub(super) fn new(level: usize, cut: ShapeParameters, stream: &mut Stream) -> Self {
        let planes: Vec<Vec3> = (0..cut.planes.0 + stream.index(cut.planes.1 - cut.planes.0 + 1))
            .map(|_| direction(stream) / stream.range32(cut.distance.0, cut.distance.1))
            .collect();
        let p = stream.range32(cut.sharpness.0, cut.sharpness.1);
        let noise = Perlin::new(stream.seed32());
        let (mut positions, triangles) = sphere(level);
        for v in &mut positions {
            let polytope: f32 = planes.iter().map(|n| n.dot(*v).max(0.0).powf(p)).sum();
            let q = v.as_dvec3();
            let lumps = noise.at3(q.x * 1.3 + 3.1, q.y * 1.3, q.z * 1.3).to_f32();
            let q = q * 2.9;
            let rough = noise.fbm3([q.x, q.y + 7.7, q.z], 1 + level.to_u32(), 0.6).to_f32();
            *v *= (1.0 + polytope).powf(-1.0 / p) * (1.0 + cut.lumps * lumps + cut.rough * rough);
        }
        let uvs = vec![Vec2::ZERO; positions.len()];
        let Mesh { positions, normals, triangles, .. } = Mesh::smooth(positions, uvs, triangles);
        Self { positions, normals, triangles }
    }
}

/// Draws a uniform direction on the sphere.
fn direction(stream: &mut Stream) -> Vec3 {
    let z = stream.range32(-1.0, 1.0);
    let (s, c) = stream.range32(0.0, std::f32::consts::TAU).sin_cos();
    vec3(c, s, 0.0) * (1.0 - z * z).max(0.0).sqrt() + vec3(0.0, 0.0, z)
}

/// Draws a uniform rotation. Source: Shoemake 1992, "Uniform random rotations".
fn any_rotation(stream: &mut Stream) -> Mat3 {
    let u = stream.uniform32();
    let (a, b) = (stream.range32(0.0, std::f32::consts::TAU), stream.range32(0.0, std::f32::consts::TAU));
    let (r, s) = ((1.0 - u).sqrt(), u.sqrt());
    Mat3::from_quat(Quat::from_xyzw(r * a.sin(), r * a.cos(), s * b.sin(), s * b.cos()).normalize())
}

/// Pose of a body: the linear map from its shape to the world, and the relative heights of its lowest and highest
/// vertex.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose {
    pub(super) basis: Mat3,
    pub(super) low: f32,
    pub(super) high: f32,
    /// Direction of the long axis on the ground.
    pub(super) turn: Vec2,
}

impl Pose {
    /// Draws the pose of a body with half-axes `axes` (long, middle, short) that lies flat except for a random tilt
    /// (standard deviation, radians).
    pub(super) fn lying(shape: &Shape, axes: Vec3, tilt: f32, stream: &mut Stream) -> Self {
        let turn = Vec2::from_angle(stream.range32(0.0, std::f32::consts::TAU));
        let tip = stream.normal().to_f32() * tilt;
        let side = Vec2::from_angle(stream.range32(0.0, std::f32::consts::TAU));
        let basis = Mat3::from_axis_angle(side.extend(0.0), tip)
            * Mat3::from_cols(turn.extend(0.0), turn.perp().extend(0.0), Vec3::Z)
            * Mat3::from_diagonal(axes)
            * any_rotation(stream);
        let row = basis.row(2);
        let (low, high) = shape
            .positions
            .iter()
            .map(|p| row.dot(*p))
            .fold((f32::MAX, f32::MIN), |(lo, hi), z| (lo.min(z), hi.max(z)));
        Self { basis, low, high, turn }
    }
}

/// Shape at its place in the world.
pub(super) struct Placed {
    pub(super) positions: Vec<Vec3>,
    /// Linear map of normals from the shape to the world.
    normals: Mat3,
    /// Upward vector to add to each normal, relative to its length; empty for none.
    pub(super) raised: Vec<f32>,
}

impl Placed {
    pub(super) fn new(shape: &Shape, pose: &Pose, centre: Vec3) -> Self {
        Self {
            positions: shape.positions.iter().map(|p| centre + pose.basis * *p).collect(),
            normals: pose.basis.inverse().transpose(),
            raised: Vec::new(),
        }
    }

    /// Returns the normal of vertex `i` of its shape.
    fn normal(&self, shape: &Shape, i: usize) -> Vec3 {
        let own = (self.normals * shape.normals[i]).normalize_or(Vec3::Z);
        self.raised.get(i).map_or(own, |raised| (own + Vec3::Z * *raised).normalize_or(Vec3::Z))
    }

    /// Adds the triangles to a mesh for which `shown` returns `true`. Its arguments are the vertices and the upward part
    /// of the normal. `uv` gets a vertex of the shape and its position in the world.
    pub(super) fn emit(
        &self,
        mesh: &mut Mesh,
        shape: &Shape,
        shown: impl Fn([Vec3; 3], f32) -> bool,
        uv: impl Fn(Vec3, Vec3) -> Vec2,
    ) {
        let mut index = vec![u32::MAX; self.positions.len()];
        for t in &shape.triangles {
            let corners = t.map(|i| self.positions[i.to_usize()]);
            let up = (corners[1] - corners[0]).cross(corners[2] - corners[0]).z;
            if !shown(corners, up) {
                continue;
            }
            mesh.triangles.push(t.map(|i| {
                let i = i.to_usize();
                if index[i] == u32::MAX {
                    index[i] = mesh.positions.len().to_u32();
                    mesh.positions.push(self.positions[i]);
                    mesh.normals.push(self.normal(shape, i));
                    mesh.uvs.push(uv(shape.positions[i], self.positions[i]));
                }
                index[i]
            }));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::sampling::Purpose;

    #[test]
    fn shapes_are_closed_outward_and_neither_potatoes_nor_spikes() {
        let cut = super::super::clod::CUT;
        for level in 0..LEVELS - 1 {
            for k in 0..24 {
                let shape = Shape::new(level, cut, &mut Stream::of(1, 0, Purpose::Test, k));
                assert_eq!(shape.triangles.len(), triangles(level));
                let volume: f32 = shape
                    .triangles
                    .iter()
                    .map(|t| {
                        let [a, b, c] = t.map(|i| shape.positions[i.to_usize()]);
                        a.cross(b).dot(c) / 6.0
                    })
                    .sum();
                assert!(volume > 0.8 && volume < 4.2, "{volume}");
                let radii: Vec<f32> = shape.positions.iter().map(|p| p.length()).collect();
                let (lo, hi) = radii.iter().fold((f32::MAX, 0f32), |(l, h), r| (l.min(*r), h.max(*r)));
                assert!(lo > 0.36 && hi < 1.35 && hi / lo > 1.12, "{lo} {hi}");
            }
        }
    }

    #[test]
    fn a_level_refines_the_same_body() {
        let shape = |level| Shape::new(level, super::super::clod::CUT, &mut Stream::of(1, 0, Purpose::Test, 3));
        let (coarse, fine) = (shape(2), shape(3));
        for (a, b) in coarse.positions.iter().zip(&fine.positions) {
            assert!(a.distance(*b) < 0.08);
        }
    }
}
