//! Other ways to make images: as a stream to a training program, on a node's local disk, on clusters.

pub mod cluster;
pub mod scratch;
pub mod stream;
