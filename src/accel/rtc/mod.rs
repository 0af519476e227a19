//! Embree's C interface, versions 3 and 4, and a safe layer over the few functions that [`super::EmbreeAccel`] needs.
//!
//! This folder and `src/output/denoise/oidn/` hold all `unsafe` of the library. `sys.rs` declares what both versions have in common, `query3.rs` and `query4.rs` how each
//! is asked about rays; the build script says which of the two is linked. Each call's contract, from Embree's manual, stands where it is made.
#![allow(unsafe_code, reason = "calls C")]

mod device;
#[cfg_attr(embree = "3", path = "query3.rs")]
#[cfg_attr(embree = "4", path = "query4.rs")]
mod query;
mod scene;
mod sys;

pub(super) use device::{Device, prepare_thread};
pub(super) use scene::{Filter, Geometry, Hit, Scene};
