//! Rays, hits and the interface of ray tracing backends.

use crate::math::Vec3;

/// A ray with `origin` in metres and unit `direction`. Only hits with 0 < t < `t_max` count.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Origin, metres.
    pub origin: Vec3,
    /// Unit direction.
    pub direction: Vec3,
    /// Largest hit distance, metres.
    pub t_max: f32,
}

impl Ray {
    /// Builds an unbounded ray.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, t_max: f32::INFINITY }
    }

    /// Builds a ray that ends at `t_max` metres.
    pub fn until(origin: Vec3, direction: Vec3, t_max: f32) -> Self {
        Self { origin, direction, t_max }
    }
}

/// Intersection of a ray with a triangle. The point is `(1 − u − v) a + u b + v c` for the triangle's vertices a, b, c.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Index of the part.
    pub part: u32,
    /// Index of the triangle in the part's original mesh.
    pub triangle: u32,
    /// Barycentric weight of the second vertex.
    pub u: f32,
    /// Barycentric weight of the third vertex.
    pub v: f32,
    /// Distance along the ray, metres.
    pub t: f32,
}

/// A ray tracing backend. Alpha masks are part of the geometry: transparent points are never hit.
pub trait Intersect: Sync {
    /// Returns the nearest hit.
    fn closest(&self, ray: &Ray) -> Option<Hit>;
    /// Returns `true` if the ray hits anything.
    fn occluded(&self, ray: &Ray) -> bool;

    /// Traces a packet of nearly parallel rays with [`Self::closest`] semantics. Lanes without a ray return `None`.
    fn closest_packet(&self, rays: &[Option<Ray>; PACKET]) -> [Option<Hit>; PACKET] {
        rays.map(|ray| self.closest(&ray?))
    }

    /// Traces a packet of nearly parallel rays with [`Self::occluded`] semantics. Lanes without a ray return `false`.
    fn occluded_packet(&self, rays: &[Option<Ray>; PACKET]) -> [bool; PACKET] {
        rays.map(|ray| ray.is_some_and(|ray| self.occluded(&ray)))
    }
}

/// Number of rays in a packet.
pub const PACKET: usize = 8;
