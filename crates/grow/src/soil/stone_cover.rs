//! Fraction of the ground covered by stones. Drawn separately from their placement, because the record needs it.

use super::StonesDesc;
use furrow_base::math::ToInt;
use furrow_base::sampling::{Purpose, Stream};

/// Returns the fraction of the ground covered by each population.
pub(super) fn covers(desc: &[StonesDesc], stream: &Stream) -> Vec<f32> {
    desc.iter().enumerate().map(|(i, population)| cover(population, &own(stream, i))).collect()
}

/// Returns the random stream of a population.
pub(super) fn own(stream: &Stream, i: usize) -> Stream {
    stream.child(Purpose::Debris, 200 + i.to_u64())
}

/// Draws the fraction of the ground covered by a population.
pub(super) fn cover(desc: &StonesDesc, stream: &Stream) -> f32 {
    desc.cover.draw32(&mut stream.child(Purpose::Page, 0))
}
