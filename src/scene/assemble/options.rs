//! What is asked of a field beyond its scene file.

use super::preview::Preview;
use crate::{Error, Result};

/// What the command line adds to a scene file.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Instead of the scene file's seed.
    pub seed: Option<u64>,
    /// Which field.
    pub index: u64,
    /// Image width; the field of view stays.
    pub width: Option<u32>,
    /// Image height.
    pub height: Option<u32>,
    /// Most bytes that a field may take; [`usual_memory`](crate::scene::estimate::usual_memory) unless given. Nothing of a field depends on it, but whether it is
    /// made.
    pub memory: Option<u64>,
    /// Given for a preview: meshes are as coarse as its pixels, where its flag is raised the field is given up, and what did not change since the
    /// field before is taken from there.
    pub preview: Option<Preview>,
}

impl Options {
    /// An interruption, where a preview is not wanted any more.
    pub(super) fn wanted(&self) -> Result<()> {
        let wanted = self.preview.as_ref().is_none_or(Preview::wanted);
        if wanted { Ok(()) } else { Err(Error::interrupted()) }
    }
}
