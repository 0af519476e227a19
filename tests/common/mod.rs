//! Helpers shared by several tests.
#![allow(dead_code, unreachable_pub, reason = "each test uses its part")]

pub mod book;
pub mod browser;
pub mod chi2;
pub mod dataset;
pub mod devtools;
pub mod faults;
pub mod layers;
pub mod pictures;
pub mod program;
pub mod python;
pub mod scenes;
pub mod stats;
#[cfg(feature = "train")]
pub mod training;
