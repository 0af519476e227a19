//! What is asked of a field beyond its scene file.

use super::preview::Preview;
use super::progress::BuildProgress;
use crate::sensor::LidarDesc;
use crate::{Error, Result};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// What the command line adds to a scene file.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Instead of the scene file's seed.
    pub seed: Option<u64>,
    /// Which field.
    pub index: u64,
    /// On which day it is grown; on the scene file's first, or as its plants are written, unless given.
    pub day: Option<u32>,
    /// Image width; the field of view stays.
    pub width: Option<u32>,
    /// Image height.
    pub height: Option<u32>,
    /// Most bytes that a field may take; [`usual_memory`](crate::scene::estimate::usual_memory) unless given. Nothing of a field depends on it, but whether it is
    /// made.
    pub memory: Option<u64>,
    /// Where it is raised, the field is given up.
    pub stop: Option<Arc<AtomicBool>>,
    /// Told how far the field is.
    pub progress: Arc<BuildProgress>,
    /// Given for a preview: meshes are as coarse as its pixels, and what did not change since the field before is taken from there.
    pub preview: Option<Preview>,
    /// Whether the field is only labelled: what the ground looks like is not worked out, and it reflects nothing. Its shape, and everything that
    /// is told of the field, stays.
    pub unlit: bool,
    /// Whether only what is told of the field is wanted: hash, files, warnings, species, plants and conditions. What the ground looks like is not worked
    /// out, and no clods and no litter lie on it.
    pub told_only: bool,
    /// Whether leaves and stems keep the joints by which they bend ([`LeafAxis::rig`](crate::plant::LeafAxis::rig),
    /// [`PlantRecord::rig`](crate::scene::PlantRecord::rig)) and the weights of their corners.
    pub rigged: bool,
    /// Given for a scan: the field is grown as far and as finely as a LiDAR sees it, not its cameras.
    pub scan: Option<Scanner>,
}

/// Which LiDAR scans a field.
#[derive(Clone, Debug)]
pub enum Scanner {
    /// The scene file's.
    OfScene,
    /// This one, where the first camera is; of a scene file that has none.
    AtCamera(Box<LidarDesc>),
}

impl Options {
    /// An interruption, where the field is not wanted any more.
    pub(super) fn wanted(&self) -> Result<()> {
        let wanted = self.stop.as_ref().is_none_or(|stop| !stop.load(Ordering::Relaxed));
        if wanted { Ok(()) } else { Err(Error::interrupted()) }
    }
}
