//! What rays hit. Knows meshes and their alpha masks; never materials, lights or tags.

pub mod brute;
mod embree;
mod rtc;

use crate::geometry::{AlphaMask, Mesh};
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
}
