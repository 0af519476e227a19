//! Which plant of a bank a plant is an instance of.

use crate::sampling::{Purpose, Stream};
use std::f32::consts::TAU;

/// Plants of a bank.
const MEMBERS: usize = 64;
/// Which of a plant's streams says what it is an instance of; the next one how it is turned, the one after that how large it is.
const CHOICE: u64 = 1 << 22;
/// Standard deviation of the logarithm of an instance's size: that of `vigour` from 0.94 to 1.06, which species have unless their files say
/// otherwise. The plant that it is an instance of has a vigour of its own.
const SIZE_SD: f64 = 0.035;

/// One plant of a bank, meshed for pixels of one size.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Member {
    /// Address of the population's streams.
    pub(super) population: u64,
    pub(super) number: u64,
    /// Binary logarithm of the shortest cell of its mesh, metres, rounded down.
    octave: i32,
}

impl Member {
    /// That of a plant with this stream, whose cells may be so long, metres.
    pub(super) fn of(population: u64, stream: &Stream, cell: f32) -> Self {
        let number = stream.child(Purpose::Plant, CHOICE).index(MEMBERS) as u64;
        Self { population, number, octave: cell.log2().floor() as i32 }
    }

    /// Shortest cell of its mesh, metres.
    pub(super) fn cell(self) -> f32 {
        (self.octave as f32).exp2()
    }

    /// How an instance whose plant has this stream is turned, radians.
    pub(super) fn turn(stream: &Stream) -> f32 {
        stream.child(Purpose::Plant, CHOICE + 1).range32(0.0, TAU)
    }

    /// Factor on all lengths of an instance whose plant has this stream: log-normal, within three standard deviations, with a square of 1 in the
    /// mean, so that leaf area and cover of a field stay what they are.
    pub(super) fn size(stream: &Stream) -> f32 {
        let deviation = stream.child(Purpose::Plant, CHOICE + 2).normal().clamp(-3.0, 3.0);
        (SIZE_SD * (deviation - SIZE_SD)).exp() as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: a population's plants are spread over all of its bank, about evenly; a plant's choice is its own whatever the cell, and the
    /// cell of a member is at most that of its plant, and more than half of it.
    #[test]
    fn plants_choose_from_the_whole_bank() {
        let mut chosen = [0; MEMBERS];
        for key in 0..6400 {
            let stream = Stream::of(5, 0, Purpose::Plant, 1).child(Purpose::Plant, key);
            let [near, far] = [7.5e-3, 0.02].map(|cell| (Member::of(1, &stream, cell), cell));
            assert_eq!(near.0.number, far.0.number);
            for (member, cell) in [near, far] {
                assert!(member.cell() <= cell && 2.0 * member.cell() > cell, "{member:?} {cell}");
            }
            chosen[near.0.number as usize] += 1;
        }
        // 100 each on the mean; the bounds are six standard deviations.
        assert!(chosen.iter().all(|n| (40..160).contains(n)), "{chosen:?}");
    }

    /// Expected: squares of sizes are 1 in the mean, within six standard errors of 6400; all lie within three deviations; no two of a
    /// hundred are alike.
    #[test]
    fn instances_are_as_large_as_plants_in_the_mean() {
        let stream = |key| Stream::of(5, 0, Purpose::Plant, 1).child(Purpose::Plant, key);
        let sizes: Vec<f64> = (0..6400).map(|key| f64::from(Member::size(&stream(key)))).collect();
        let mean = sizes.iter().map(|size| size * size).sum::<f64>() / 6400.0;
        assert!((mean - 1.0).abs() < 6.0 * 2.0 * SIZE_SD / 80.0, "{mean}");
        assert!(sizes.iter().all(|size| (size.ln() / SIZE_SD).abs() < 3.1));
        let distinct: std::collections::BTreeSet<u64> = sizes[..100].iter().map(|size| size.to_bits()).collect();
        assert_eq!(distinct.len(), 100);
    }
}
