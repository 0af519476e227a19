//! Verification of a finished dataset.

pub mod difference;
pub mod listed;
pub mod verify;
