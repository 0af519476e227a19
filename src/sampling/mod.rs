//! Random numbers: addressed streams, low-discrepancy samples, warps and tables with their densities, resamples.

pub mod bootstrap;
pub mod distribution;
pub mod rng;
pub mod sampler;
mod sobol;
pub mod warp;

pub use rng::{Purpose, Stream};
pub use sampler::{Points, Sampler, sets};
