//! Random numbers: addressed streams, what a page may draw, low-discrepancy samples, warps and tables with their densities, resamples.

pub mod bootstrap;
pub mod distribution;
pub mod fault;
pub mod place;
pub mod rng;
pub mod sampler;
pub mod vary;
pub mod warp;

pub use rng::{Purpose, Stream};
pub use sampler::{Points, Sampler, sets};
