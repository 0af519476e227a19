//! Running elsewhere: as a stream to a training program, on a node's own disk, on clusters.

pub mod cluster;
pub mod scratch;
pub mod stream;
