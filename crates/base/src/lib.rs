//! Foundations of Furrow: numbers, sampling, geometry, scene-file syntax and errors.
//!
//! | module | contents |
//! |---|---|
//! | [`math`] | vectors, frames, four-band spectra, conversions between number types |
//! | [`sampling`] | seeded streams, Sobol points, warps, tabulated distributions |
//! | [`geometry`] | rays, hits, meshes, alpha masks |
//! | [`ron_file`] | RON files whose errors name line and column; numbers with bounds and distributions |
//! | [`input`] | reading user-supplied files safely |
//! | [`atomic_file`] | files that appear complete or not at all, also several together |
//! | [`mod@dispatch`] | enums of types that implement a common trait |
//! | [`error`] | the error type of all crates |
//! | [`shell`] | words of shell commands |
//! | [`supervise`] | panics of worker threads as errors |

pub mod atomic_file;
pub mod dispatch;
pub mod error;
pub mod geometry;
pub mod input;
pub mod math;
pub mod ron_file;
pub mod sampling;
pub mod shell;
pub mod supervise;

pub use error::{Error, Result};
