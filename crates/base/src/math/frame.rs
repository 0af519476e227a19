//! Orthonormal frames, right-handed, with z as the normal.

use glam::Vec3;

/// An orthonormal, right-handed frame. `z` is the normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// First tangent, unit.
    pub x: Vec3,
    /// Second tangent, unit, `z × x`.
    pub y: Vec3,
    /// Normal, unit.
    pub z: Vec3,
}

impl Frame {
    /// Returns some frame around the unit vector `z`. Source: Duff et al. 2017, "Building an Orthonormal Basis,
    /// Revisited", JCGT 6(1).
    pub fn about(z: Vec3) -> Self {
        let sign = 1.0_f32.copysign(z.z);
        let a = -1.0 / (sign + z.z);
        let b = z.x * z.y * a;
        Self {
            x: Vec3::new(1.0 + sign * z.x * z.x * a, sign * b, -sign * z.x),
            y: Vec3::new(b, sign + z.y * z.y * a, -z.y),
            z,
        }
    }

    /// Returns the frame around the unit vector `z` whose x axis is as close as possible to `tangent`. If `tangent` is
    /// zero or parallel to `z`, the tangents are arbitrary.
    pub fn with_tangent(z: Vec3, tangent: Vec3) -> Self {
        let x = tangent - z * z.dot(tangent);
        let length_sq = x.length_squared();
        if length_sq < 1e-16 {
            return Self::about(z);
        }
        let x = x / length_sq.sqrt();
        Self { x, y: z.cross(x), z }
    }

    /// Transforms a vector from world to local coordinates.
    #[inline]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }

    /// Transforms a vector from local to world coordinates.
    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }
}
