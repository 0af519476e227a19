//! Fields that grow otherwise than their scene files say: what experiments change. No random number is drawn for it or left undrawn, so
//! everything else is as it was.

use super::desc::{FieldDesc, SpeciesDesc};

/// What is changed of the scene files after they were read and before anything grows.
#[derive(Clone, Copy, Debug, Default)]
pub struct Growing {
    /// Of the field's scene file.
    pub page: Option<fn(&mut FieldDesc)>,
    /// Of each species file.
    pub species: Option<fn(&mut SpeciesDesc)>,
}
