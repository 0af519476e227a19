//! Random numbers: addressed streams, low-discrepancy samples, warps, tabulated distributions and the bootstrap.

pub mod bootstrap;
pub mod distribution;
pub mod rng;
pub mod sampler;
mod sobol;
pub mod warp;

pub use rng::{Purpose, Stream};
pub use sampler::{Points, Sampler, sets};
