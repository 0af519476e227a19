//! Where a mesh stands that several plants share.

use crate::math::{Mat3, Vec3};

/// A rotation, a size and a place: mesh coordinates to the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// A rotation, without scale.
    pub rotation: Mat3,
    /// Factor on the mesh's lengths, above 0; angles and normals stay.
    pub scale: f32,
    /// Where the mesh's origin stands, metres.
    pub offset: Vec3,
}

impl Placement {
    /// Rotation and size in one matrix: points p of the mesh stand at this times p, plus the offset.
    #[inline]
    pub fn matrix(&self) -> Mat3 {
        self.rotation * self.scale
    }

    /// A point of the mesh in the world.
    #[inline]
    pub fn point(&self, p: Vec3) -> Vec3 {
        self.rotation * (p * self.scale) + self.offset
    }

    /// A direction of the mesh in the world, as long as it was.
    #[inline]
    pub fn direction(&self, d: Vec3) -> Vec3 {
        self.rotation * d
    }

    /// A direction of the world in the mesh, as long as it was.
    #[inline]
    pub fn to_mesh(&self, d: Vec3) -> Vec3 {
        self.rotation.transpose() * d
    }
}
