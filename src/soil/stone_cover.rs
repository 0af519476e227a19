//! How much of the ground stones cover: drawn before they are laid, since the record tells it.

use super::StonesDesc;
use crate::sampling::{Purpose, Stream};

/// Share of the ground under each population.
pub(super) fn covers(desc: &[StonesDesc], stream: &Stream) -> Vec<f32> {
    desc.iter().enumerate().map(|(i, population)| cover(population, &own(stream, i))).collect()
}

/// The stream of a population.
pub(super) fn own(stream: &Stream, i: usize) -> Stream {
    stream.child(Purpose::Debris, 200 + i as u64)
}

/// Share of the ground under a population.
pub(super) fn cover(desc: &StonesDesc, stream: &Stream) -> f32 {
    desc.cover.draw32(&mut stream.child(Purpose::Page, 0))
}
