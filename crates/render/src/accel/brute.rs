//! Brute-force intersection of every ray with every triangle in double precision: the reference for tests.

use super::Surface;
use furrow_base::geometry::{Hit, Intersect, Ray};
use furrow_base::math::{ToFloat, ToInt, Vec3};
use glam::DVec3;

/// Brute-force intersector. Exact where Embree is fast.
pub struct BruteForce<'a> {
    surfaces: &'a [Surface<'a>],
}

impl<'a> BruteForce<'a> {
    /// Builds an intersector over `surfaces`.
    pub fn new(surfaces: &'a [Surface<'a>]) -> Self {
        Self { surfaces }
    }

    /// Intersects a ray with one triangle. Hits on transparent texels of its mask are ignored.
    pub fn triangle(&self, ray: &Ray, part: u32, triangle: u32) -> Option<Hit> {
        let surface = &self.surfaces[part.to_usize()];
        let (t, u, v) = intersect(ray, surface.corners(triangle))?;
        if let Some(mask) = surface.mask {
            let [a, b, c] = surface.mesh.triangles[triangle.to_usize()].map(|k| surface.mesh.uvs[k.to_usize()]);
            let (u, v) = (u.to_f32(), v.to_f32());
            if !mask.opaque_at(a * (1.0 - u - v) + b * u + c * v) {
                return None;
            }
        }
        Some(Hit { part, triangle, u: u.to_f32(), v: v.to_f32(), t: t.to_f32() })
    }
}

/// Returns distance and barycentrics. Edges belong to the triangle. Source: Möller & Trumbore 1997.
fn intersect(ray: &Ray, [a, b, c]: [Vec3; 3]) -> Option<(f64, f64, f64)> {
    let (a, b, c) = (a.as_dvec3(), b.as_dvec3(), c.as_dvec3());
    let (origin, direction): (DVec3, DVec3) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (e1, e2) = (b - a, c - a);
    let p = direction.cross(e2);
    let determinant = e1.dot(p);
    if determinant == 0.0 {
        return None;
    }
    let s = origin - a;
    let u = s.dot(p) / determinant;
    let q = s.cross(e1);
    let v = direction.dot(q) / determinant;
    let t = e2.dot(q) / determinant;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && t < f64::from(ray.t_max)).then_some((t, u, v))
}

impl Intersect for BruteForce<'_> {
    fn closest(&self, ray: &Ray) -> Option<Hit> {
        let parts = self.surfaces.iter().enumerate();
        let all = parts.flat_map(|(p, s)| (0..s.mesh.triangles.len().to_u32()).map(move |t| (p.to_u32(), t)));
        all.filter_map(|(p, t)| self.triangle(ray, p, t)).min_by(|a, b| a.t.total_cmp(&b.t))
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.closest(ray).is_some()
    }
}
