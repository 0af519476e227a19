//! What rays hit. Knows meshes and their alpha masks; never materials, lights or tags.

pub mod brute;
mod embree;
mod rtc;

use crate::geometry::{AlphaMask, Mesh, Placement};
use crate::math::Vec3;
use std::sync::Arc;

pub use brute::Brute;
pub use embree::{Before, EmbreeAccel, prepare_thread, version};

/// One part as the accelerators see it: its index is its place in the slice that is built.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    /// The triangles.
    pub mesh: &'a Mesh,
    /// Where they are there at all; `None` for everywhere.
    pub mask: Option<&'a Arc<AlphaMask>>,
    /// Where the mesh stands; `None` for one in the world. Neighbours with one placement are built as one instance.
    pub instance: Option<&'a Arc<Placement>>,
}

impl Surface<'_> {
    /// Corners of triangle `i` in the world.
    #[inline]
    pub fn corners(&self, i: u32) -> [Vec3; 3] {
        let corners = self.mesh.corners(i);
        self.instance.map_or(corners, |placement| corners.map(|p| placement.point(p)))
    }
}
