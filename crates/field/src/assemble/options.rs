//! Options of a field that are not in its scene file.

use super::preview::Preview;
use super::progress::BuildProgress;
use crate::profile::Profiler;
use furrow_base::{Error, Result};
use furrow_optics::sensor::LidarDesc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Options for building a field, as given on the command line.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Seed; the scene file's if `None`.
    pub seed: Option<u64>,
    /// Index of the field.
    pub index: u64,
    /// Day of the field. If `None`, the scene file's first day; without days, plants have the ages that the scene file gives.
    pub day: Option<u32>,
    /// Image width, pixels; the field of view does not change.
    pub width: Option<u32>,
    /// Image height, pixels.
    pub height: Option<u32>,
    /// Memory limit of a field, bytes; [`usual_memory`](crate::estimate::usual_memory) if `None`. It decides only whether the field is
    /// built, not its contents.
    pub memory: Option<u64>,
    /// Flag that cancels the construction of the field when it is set.
    pub stop: Option<Arc<AtomicBool>>,
    /// Receiver of the construction's progress.
    pub progress: Arc<BuildProgress>,
    /// Measures the CPU time of the construction's phases, if it is on.
    pub profiler: Profiler,
    /// Cache for a preview: meshes are only as fine as the pixels, and unchanged parts of the previous field are reused.
    pub preview: Option<Preview>,
    /// Whether the field is built for labels only: the ground's textures are not baked, so it is black. Shapes and all records stay the
    /// same.
    pub unlit: bool,
    /// Whether only the field's records are needed: hash, files, warnings, species, plants and conditions. The ground's textures are not
    /// baked, and clods and litter are left out.
    pub records_only: bool,
    /// Whether leaves and stems keep their bending joints ([`LeafAxis::rig`](furrow_grow::plant::LeafAxis::rig),
    /// [`PlantRecord::rig`](crate::PlantRecord::rig)) and the skinning weights of their vertices.
    pub rigged: bool,
    /// LiDAR for a scan: extent and resolution of the field follow from the LiDAR instead of the cameras.
    pub scan: Option<Scanner>,
}

/// Selects the LiDAR that scans a field.
#[derive(Clone, Debug)]
pub enum Scanner {
    /// The LiDAR of the scene file.
    OfScene,
    /// This LiDAR, at the position of the first camera, for a scene file that has no LiDAR.
    AtCamera(Box<LidarDesc>),
}

impl Options {
    /// Returns an interruption error if the stop flag is set.
    pub(super) fn wanted(&self) -> Result<()> {
        let wanted = self.stop.as_ref().is_none_or(|stop| !stop.load(Ordering::Relaxed));
        if wanted { Ok(()) } else { Err(Error::interrupted()) }
    }
}
