//! Surface interaction at a hit: position, normals, and texture parameterisation.

use super::{Hit, Mesh, Placement, Ray};
use crate::math::{ToInt, Vec2, Vec3};

/// Point on a surface hit by a ray.
#[derive(Clone, Copy, Debug)]
pub struct Interaction {
    /// Position, metres, interpolated from the barycentrics: much closer to the triangle than `origin + t · direction`.
    pub p: Vec3,
    /// Unit geometric normal of the triangle, on its upper side.
    pub ng: Vec3,
    /// Unit interpolated shading normal, on the same side as `ng`.
    pub ns: Vec3,
    /// Texture coordinates.
    pub uv: Vec2,
    /// Edges from the triangle's first vertex to its second and third, in metres and in texture coordinates.
    edges: [(Vec3, Vec2); 2],
    /// Index of the part.
    pub part: u32,
    /// Index of the triangle.
    pub triangle: u32,
    /// Diameter of the ray's footprint on the surface, metres: the width over which textures are filtered.
    pub footprint: f32,
    /// Tint (R, G, B) multiplied onto the surface colour. 1 unless parts that share a material differ in colour.
    pub tint: Vec3,
}

impl Interaction {
    /// Computes the interaction for a hit on `mesh`; `footprint` in metres.
    #[inline]
    pub fn new(mesh: &Mesh, hit: &Hit, footprint: f32) -> Self {
        let corners = mesh.triangles[hit.triangle.to_usize()].map(ToInt::to_usize);
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

    /// Transforms the interaction from mesh to world coordinates.
    #[inline]
    #[must_use]
    pub fn placed(self, placement: &Placement) -> Self {
        let edges = self.edges.map(|(edge, uv)| (placement.direction(edge) * placement.scale, uv));
        let [ng, ns] = [self.ng, self.ns].map(|normal| placement.direction(normal));
        Self { p: placement.point(self.p), ng, ns, edges, ..self }
    }

    /// Replaces the tint (R, G, B).
    #[inline]
    #[must_use]
    pub fn tinted(self, tint: Vec3) -> Self {
        Self { tint, ..self }
    }

    /// Returns ∂p/∂u and ∂p/∂v, metres; zero where the texture coordinates are degenerate.
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

    /// Origin for a ray leaving along `direction`, offset from the surface by a few units in the last place of the
    /// coordinates.
    ///
    /// A fixed offset of 0.1 mm, as is common, would lose the contact shadows between leaf and soil. 1e-6 of the
    /// coordinate magnitude exceeds the rounding error of `p` (below 3e-7 of it) and is no larger than needed.
    #[inline]
    pub fn leave(&self, direction: Vec3) -> Vec3 {
        let scale = 1e-6 * self.p.abs().max_element().max(0.25);
        self.p + self.ng * if direction.dot(self.ng) < 0.0 { -scale } else { scale }
    }

    /// Builds the ray leaving along `direction` up to distance `t_max`.
    #[inline]
    pub fn ray(&self, direction: Vec3, t_max: f32) -> Ray {
        Ray::until(self.leave(direction), direction, t_max)
    }
}
