//! Selects the bank plant that a plant is an instance of.

use furrow_base::math::{RoundTo, ToFloat, ToInt};
use furrow_base::sampling::{Purpose, Stream};
use std::f32::consts::TAU;

/// Number of plants in a bank.
const MEMBERS: usize = 64;
/// Address of the plant's random stream for the choice of the bank plant; the next two are for rotation and size.
const CHOICE: u64 = 1 << 22;
/// Standard deviation of the logarithm of an instance's size: that of the default `vigour` of a species, 0.94 to 1.06. The bank plant
/// has its own vigour in addition.
const SIZE_SD: f64 = 0.035;

/// A bank plant, meshed for one pixel size.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Member {
    /// Address of the population's random streams.
    pub(super) population: u64,
    pub(super) number: u64,
    /// Binary logarithm of the minimum cell length of its mesh in metres, rounded down.
    octave: i32,
}

impl Member {
    /// Returns the bank plant for a plant with this random stream and a minimum cell length of `cell` metres.
    pub(super) fn of(population: u64, stream: &Stream, cell: f32) -> Self {
        let number = stream.child(Purpose::Plant, CHOICE).index(MEMBERS).to_u64();
        Self { population, number, octave: cell.log2().floor_to::<i32>() }
    }

    /// Returns the minimum cell length of the mesh, metres.
    pub(super) fn cell(self) -> f32 {
        self.octave.to_f32().exp2()
    }

    /// Returns the rotation of an instance with this random stream, radians.
    pub(super) fn turn(stream: &Stream) -> f32 {
        stream.child(Purpose::Plant, CHOICE + 1).range32(0.0, TAU)
    }

    /// Returns the scale of an instance with this random stream: log-normal, truncated at three standard deviations. The mean of its
    /// square is 1, so that leaf area and cover of the field are preserved.
    pub(super) fn size(stream: &Stream) -> f32 {
        let deviation = stream.child(Purpose::Plant, CHOICE + 2).normal().clamp(-3.0, 3.0);
        (SIZE_SD * (deviation - SIZE_SD)).exp().to_f32()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: the plants of a population are spread over its bank about evenly. A plant's choice does not depend on the cell length,
    /// and the member's cell length is at most that of the plant and more than half of it.
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
            chosen[near.0.number.to_usize()] += 1;
        }
        // 100 each on average; the bounds are six standard deviations.
        assert!(chosen.iter().all(|n| (40..160).contains(n)), "{chosen:?}");
    }

    /// Expected: the mean square of 6400 sizes is 1 within six standard errors; all are within three standard deviations; the first
    /// hundred are distinct.
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
