//! Rays, hits, and the promise of whatever answers them.

use crate::math::Vec3;

/// A ray. `origin` in metres, `direction` unit; only hits with 0 < t < `t_max` count.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Start, metres.
    pub origin: Vec3,
    /// Unit direction.
    pub direction: Vec3,
    /// End, metres along the direction.
    pub t_max: f32,
}

impl Ray {
    /// A ray without end.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, t_max: f32::INFINITY }
    }

    /// A ray that ends at `t_max` metres.
    pub fn until(origin: Vec3, direction: Vec3, t_max: f32) -> Self {
        Self { origin, direction, t_max }
    }
}

/// Where a ray met a triangle. The point is `(1 − u − v) a + u b + v c` of the triangle's corners a, b, c.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Index of the part.
    pub part: u32,
    /// Index of the triangle in the part's mesh as given.
    pub triangle: u32,
    /// Barycentric weight of the second corner.
    pub u: f32,
    /// Barycentric weight of the third corner.
    pub v: f32,
    /// Distance, metres.
    pub t: f32,
}

/// Answers rays. Alpha masks are part of the geometry: a transparent point is not there.
pub trait Intersect: Sync {
    /// The nearest hit.
    fn closest(&self, ray: &Ray) -> Option<Hit>;
    /// Whether anything is hit at all.
    fn occluded(&self, ray: &Ray) -> bool;

    /// [`Self::closest`] of rays that go nearly the same way, asked together; none where there is no ray.
    fn closest_packet(&self, rays: &[Option<Ray>; PACKET]) -> [Option<Hit>; PACKET] {
        rays.map(|ray| self.closest(&ray?))
    }

    /// [`Self::occluded`] of rays that go nearly the same way, asked together; false where there is no ray.
    fn occluded_packet(&self, rays: &[Option<Ray>; PACKET]) -> [bool; PACKET] {
        rays.map(|ray| ray.is_some_and(|ray| self.occluded(&ray)))
    }
}

/// Rays asked together at most.
pub const PACKET: usize = 8;
