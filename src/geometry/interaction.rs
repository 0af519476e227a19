//! A hit, worked out: where, which way the surface faces, and how its texture lies on it.

use super::{Hit, Mesh, Placement, Ray};
use crate::math::{Vec2, Vec3};

/// A point of a surface that a ray met.
#[derive(Clone, Copy, Debug)]
pub struct Interaction {
    /// The point, metres, from the barycentrics: much nearer to the triangle than the ray's own arithmetic.
    pub p: Vec3,
    /// Unit normal of the triangle, out of the upper side.
    pub ng: Vec3,
    /// Unit interpolated normal, on the same side as `ng`.
    pub ns: Vec3,
    /// Texture coordinates.
    pub uv: Vec2,
    /// Edges from the triangle's first corner to its second and third, metres and texture coordinates.
    edges: [(Vec3, Vec2); 2],
    /// Index of the part.
    pub part: u32,
    /// Index of the triangle.
    pub triangle: u32,
    /// Diameter of what the ray sees of the surface, metres: the width of texture to average over.
    pub footprint: f32,
    /// Factor on the colour of what is met there, R, G, B: 1 but where parts that share a material differ.
    pub tint: Vec3,
}

impl Interaction {
    /// Works out a hit on `mesh`; `footprint` in metres.
    #[inline]
    pub fn new(mesh: &Mesh, hit: &Hit, footprint: f32) -> Self {
        let corners = mesh.triangles[hit.triangle as usize].map(|i| i as usize);
        let [a, b, c] = corners.map(|i| mesh.positions[i]);
        let [na, nb, nc] = corners.map(|i| mesh.normals[i]);
        let [ta, tb, tc] = corners.map(|i| mesh.uvs[i]);
        let w = 1.0 - hit.u - hit.v;
        let (e1, e2) = (b - a, c - a);
        let ng = e1.cross(e2).normalize_or(Vec3::Z);
        let ns = (na * w + nb * hit.u + nc * hit.v).normalize_or(ng);
        Self {
            p: a * w + b * hit.u + c * hit.v,
            ng,
            ns: if ns.dot(ng) < 0.0 { -ns } else { ns },
            uv: ta * w + tb * hit.u + tc * hit.v,
            edges: [(e1, tb - ta), (e2, tc - ta)],
            part: hit.part,
            triangle: hit.triangle,
            footprint,
            tint: Vec3::ONE,
        }
    }

    /// The same of a mesh that stands elsewhere.
    #[inline]
    #[must_use]
    pub fn placed(self, placement: &Placement) -> Self {
        let edges = self.edges.map(|(edge, uv)| (placement.direction(edge) * placement.scale, uv));
        let [ng, ns] = [self.ng, self.ns].map(|normal| placement.direction(normal));
        Self { p: placement.point(self.p), ng, ns, edges, ..self }
    }

    /// The same of what has another tint, R, G, B.
    #[inline]
    #[must_use]
    pub fn tinted(self, tint: Vec3) -> Self {
        Self { tint, ..self }
    }

    /// ∂p/∂u and ∂p/∂v, metres; zero where the texture coordinates are degenerate.
    #[inline]
    pub fn tangents(&self) -> (Vec3, Vec3) {
        let [(e1, t1), (e2, t2)] = self.edges;
        let determinant = t1.perp_dot(t2);
        if determinant.abs() <= 1e-20 {
            return (Vec3::ZERO, Vec3::ZERO);
        }
        let inverse = 1.0 / determinant;
        ((e1 * t2.y - e2 * t1.y) * inverse, (e2 * t1.x - e1 * t2.x) * inverse)
    }

    /// A start for a ray that leaves along `direction`, off the surface by a few units in the last place of the coordinates.
    ///
    /// A fixed tenth of a millimetre, as is common, would lose the contact shadows between leaf and soil; a millionth of
    /// the coordinates' size clears the rounding of `p` (below 3e-7 of it) and no more.
    #[inline]
    pub fn leave(&self, direction: Vec3) -> Vec3 {
        let scale = 1e-6 * self.p.abs().max_element().max(0.25);
        self.p + self.ng * if direction.dot(self.ng) < 0.0 { -scale } else { scale }
    }

    /// The ray that leaves along `direction`, as far as `t_max`.
    #[inline]
    pub fn ray(&self, direction: Vec3, t_max: f32) -> Ray {
        Ray::until(self.leave(direction), direction, t_max)
    }
}
