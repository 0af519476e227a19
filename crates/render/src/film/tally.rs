//! Sample counts per scene part in a pixel: the composition of the pixel, as opposed to the part at its centre.

use smallvec::SmallVec;

/// Exact number of samples per part. Most pixels show one or two parts, which are stored inline without allocation.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// (part, number of samples), sorted by part.
    counts: SmallVec<[(u32, u32); 2]>,
}

impl Tally {
    /// Counts a sample whose first hit is `part`. The order of calls does not matter.
    #[inline]
    pub fn add(&mut self, part: u32) {
        let after = self.counts.iter().position(|(p, _)| *p >= part).unwrap_or(self.counts.len());
        match self.counts.get_mut(after) {
            Some((p, count)) if *p == part => *count += 1,
            _ => self.counts.insert(after, (part, 1)),
        }
    }

    /// Returns (part, number of samples) of the parts that were hit, sorted by part.
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
        /// Expected: the counts of an ordered map, for any order of samples.
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
