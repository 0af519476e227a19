//! Verification of a finished dataset, and comparison of two.

pub mod changes;
pub mod difference;
pub mod manifest_check;
pub mod verify;
