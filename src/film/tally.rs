//! How many of a pixel's samples met each part of the scene: what a pixel shows, in shares, rather than at its centre.

use smallvec::SmallVec;

/// Numbers of samples by part, exact. Most pixels show one part or two, which need no memory of their own.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Part and number of samples, by rising part.
    counts: SmallVec<[(u32, u32); 2]>,
}

impl Tally {
    /// Counts a sample that met `part` first. The order of calls makes no difference.
    #[inline]
    pub fn add(&mut self, part: u32) {
        let after = self.counts.iter().position(|(p, _)| *p >= part).unwrap_or(self.counts.len());
        match self.counts.get_mut(after) {
            Some((p, count)) if *p == part => *count += 1,
            _ => self.counts.insert(after, (part, 1)),
        }
    }

    /// Indices of the parts that were met, rising, and how many samples met each.
    pub fn iter(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        self.counts.iter().copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    proptest! {
        /// Expected: the counts of an ordered map, whatever the order of the samples.
        #[test]
        fn a_tally_counts_every_part_in_order(parts in prop::collection::vec(0u32..9, 0..60)) {
            let (mut tally, mut expected) = (Tally::default(), BTreeMap::new());
            for part in &parts {
                tally.add(*part);
                *expected.entry(*part).or_insert(0) += 1;
            }
            prop_assert!(tally.iter().eq(expected));
        }
    }
}
