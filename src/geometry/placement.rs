//! Where a mesh stands that several plants share.

use crate::math::{Mat3, Vec3};

/// A rotation and a place: mesh coordinates to the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// A rotation, without scale.
    pub rotation: Mat3,
    /// Where the mesh's origin stands, metres.
    pub offset: Vec3,
}

impl Placement {
    /// A point of the mesh in the world.
    #[inline]
    pub fn point(&self, p: Vec3) -> Vec3 {
        self.rotation * p + self.offset
    }

    /// A direction of the mesh in the world.
    #[inline]
    pub fn direction(&self, d: Vec3) -> Vec3 {
        self.rotation * d
    }

    /// A direction of the world in the mesh.
    #[inline]
    pub fn to_mesh(&self, d: Vec3) -> Vec3 {
        self.rotation.transpose() * d
    }
}
