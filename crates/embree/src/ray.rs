//! Rays and hits.

/// Number of rays in a packet.
pub const PACKET: usize = 8;

/// A ray segment; only hits with 0 < t < `t_max` count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start point.
    pub origin: [f32; 3],
    /// Direction, of any length; distances are in units of its length.
    pub direction: [f32; 3],
    /// Largest distance, in units of the direction's length; may be infinite.
    pub t_max: f32,
}

/// Intersection of a ray with a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Index of the instance among the geometries of the queried scene; `None` for a triangle of the scene itself.
    pub instance: Option<u32>,
    /// Index of the geometry in its scene: the queried one, or the instanced one.
    pub geometry: u32,
    /// Index of the triangle in its geometry.
    pub primitive: u32,
    /// Barycentric coordinate of the second vertex.
    pub u: f32,
    /// Barycentric coordinate of the third vertex.
    pub v: f32,
    /// Distance along the ray, in units of its direction's length.
    pub t: f32,
}
