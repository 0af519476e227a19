//! Ray–triangle intersection. This module knows meshes and their alpha masks, but not materials, lights or tags.

pub mod brute;
mod embree;

use furrow_base::geometry::{AlphaMask, Mesh, Placement};
use furrow_base::math::Vec3;
use std::sync::Arc;

pub use brute::BruteForce;
pub use embree::{EmbreeAccel, PreviousBuild, prepare_thread, version};

/// Geometry of one part. Its part index is its position in the slice that an accelerator is built from.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    /// Triangle mesh.
    pub mesh: &'a Mesh,
    /// Opacity mask; `None` if opaque everywhere.
    pub mask: Option<&'a Arc<AlphaMask>>,
    /// Placement of the mesh; `None` if it is in world coordinates. Consecutive surfaces with the same placement become
    /// one instance.
    pub instance: Option<&'a Arc<Placement>>,
}

impl Surface<'_> {
    /// Returns the vertices of triangle `i` in world coordinates.
    #[inline]
    pub fn corners(&self, i: u32) -> [Vec3; 3] {
        let corners = self.mesh.corners(i);
        self.instance.map_or(corners, |placement| corners.map(|p| placement.point(p)))
    }
}
