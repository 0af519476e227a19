//! Placement of a mesh that is shared by several plants.

use crate::math::{Mat3, Vec3};

/// Similarity transform from mesh to world coordinates: rotation, uniform scale and translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Rotation, without scale.
    pub rotation: Mat3,
    /// Uniform scale, above 0. Angles and normals are unaffected.
    pub scale: f32,
    /// World position of the mesh origin, metres.
    pub offset: Vec3,
}

impl Placement {
    /// Returns rotation and scale as one matrix `m`: a mesh point `p` maps to `m * p + offset`.
    #[inline]
    pub fn matrix(&self) -> Mat3 {
        self.rotation * self.scale
    }

    /// Transforms a point from mesh to world coordinates.
    #[inline]
    pub fn point(&self, p: Vec3) -> Vec3 {
        self.rotation * (p * self.scale) + self.offset
    }

    /// Rotates a direction from mesh to world coordinates; its length is unchanged.
    #[inline]
    pub fn direction(&self, d: Vec3) -> Vec3 {
        self.rotation * d
    }

    /// Rotates a direction from world to mesh coordinates; its length is unchanged.
    #[inline]
    pub fn to_mesh(&self, d: Vec3) -> Vec3 {
        self.rotation.transpose() * d
    }
}
