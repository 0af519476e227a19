//! Verification of a finished dataset.

pub mod difference;
pub mod manifest_check;
pub mod verify;
