//! Changes that experiments make to a scene description before the field is built. They neither add nor skip a random number, so
//! everything else in the field stays the same.

use super::desc::{FieldDesc, SpeciesDesc};

/// Functions that edit the descriptions after the files were read and before the field is built.
#[derive(Clone, Copy, Debug, Default)]
pub struct SceneEdit {
    /// Edits the description of the scene file.
    pub page: Option<fn(&mut FieldDesc)>,
    /// Edits the description of each species file.
    pub species: Option<fn(&mut SpeciesDesc)>,
}
