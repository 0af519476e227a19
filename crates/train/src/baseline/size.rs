//! Classification of green regions by area.

use crate::measure::components::Components;
use crate::measure::{Confusion, Scores};
use furrow_base::math::{RoundTo, ToFloat, ToInt};
use furrow_dataset::model::sample::IGNORE;
use serde::{Deserialize, Serialize};

pub(super) const SOIL: u8 = 0;
pub(super) const CROP: u8 = 1;
const WEED: u8 = 2;
/// Number of classes.
pub(super) const CLASSES: usize = 3;
/// Number of area bins per doubling of a region's fraction of the image.
const PER_DOUBLING: f64 = 8.0;
/// Number of area bins: fractions from 2⁻³² to 1.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small positive integer")]
const SIZES: usize = 32 * PER_DOUBLING as usize + 1;

/// Rule that classifies green regions by area, as a fraction of the image's pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SizeRule {
    /// Minimum area of crop.
    pub crop_from: f64,
    /// Minimum area of weed; smaller regions are soil.
    pub weed_from: f64,
}

impl SizeRule {
    /// Returns the class of each pixel of an image with the vegetation mask `green`.
    pub(super) fn classes(&self, width: u32, height: u32, green: &[bool]) -> Vec<u8> {
        let regions = regions(width, height, green);
        let class = |area: &u32| {
            let share = f64::from(*area) / green.len().to_f64();
            if share >= self.crop_from {
                CROP
            } else if share >= self.weed_from {
                WEED
            } else {
                SOIL
            }
        };
        let classes: Vec<u8> = regions.areas.iter().map(class).collect();
        let of = |label: &u32| label.checked_sub(1).map_or(SOIL, |k| classes[k.to_usize()]);
        regions.labels.iter().map(of).collect()
    }
}

fn regions(width: u32, height: u32, green: &[bool]) -> Components {
    Components::of(width.to_usize(), height.to_usize(), |at| green[at].then_some(()))
}

/// Pixel counts of the training images by region area and true class.
pub(super) struct Sizes {
    /// Pixels of each true class outside green regions.
    bare: [u64; CLASSES],
    /// Pixels of each true class in green regions, by area bin.
    sized: Vec<[u64; CLASSES]>,
}

impl Sizes {
    pub(super) fn new() -> Self {
        Self { bare: [0; CLASSES], sized: vec![[0; CLASSES]; SIZES] }
    }

    /// Adds the counts of an image with the vegetation mask `green` and the true classes `truth`.
    pub(super) fn add(&mut self, width: u32, height: u32, green: &[bool], truth: &[u8]) {
        let regions = regions(width, height, green);
        let bin = |area: &u32| bin(f64::from(*area) / green.len().to_f64());
        let bins: Vec<usize> = regions.areas.iter().map(bin).collect();
        for (label, truth) in regions.labels.iter().zip(truth).filter(|(_, truth)| **truth != IGNORE) {
            let counts = label.checked_sub(1).map_or(&mut self.bare, |k| &mut self.sized[bins[k.to_usize()]]);
            counts[usize::from(*truth)] += 1;
        }
    }

    /// Returns the rule with the largest mean I/U among all pairs of areas; ties go to the smallest areas.
    pub(super) fn best(&self) -> SizeRule {
        // Cumulative counts of all smaller regions.
        let mut below = vec![[0_u64; CLASSES]];
        for counts in &self.sized {
            let sum = below[below.len() - 1];
            below.push(std::array::from_fn(|class| sum[class] + counts[class]));
        }
        let score = |weed: usize, crop: usize| {
            let row = |class: usize| {
                let soil = self.bare[class] + below[weed][class];
                vec![soil, below[SIZES][class] - below[crop][class], below[crop][class] - below[weed][class]]
            };
            let matrix = Confusion::from_rows(&[row(0), row(1), row(2)])
                .expect("three rows of three counts are a square matrix");
            Scores::of(&matrix, &[false, true, true]).mean_iou.unwrap_or(0.0)
        };
        let pairs = (0..=SIZES).flat_map(|weed| (weed..=SIZES).map(move |crop| (weed, crop)));
        let scored = pairs.map(|(weed, crop)| (score(weed, crop), weed, crop));
        let (_, weed, crop) = scored.reduce(|a, b| if b.0 > a.0 { b } else { a }).unwrap_or_default();
        SizeRule { crop_from: begin(crop), weed_from: begin(weed) }
    }
}

/// Returns the bin of an area, as a fraction of the image.
fn bin(share: f64) -> usize {
    let guess = ((share.log2() + 32.0) * PER_DOUBLING).floor().clamp(0.0, SIZES.to_f64() - 1.0).trunc_to::<usize>();
    // Correct for rounding of the logarithm at the start of a bin.
    if guess + 1 < SIZES && share >= begin(guess + 1) {
        guess + 1
    } else if guess > 0 && share < begin(guess) {
        guess - 1
    } else {
        guess
    }
}

/// Returns the start of a bin, as a fraction of the image; above 1 for `SIZES`.
fn begin(bin: usize) -> f64 {
    (bin.to_f64() / PER_DOUBLING - 32.0).exp2()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_lies_between_the_ends_of_its_bin() {
        for k in 0..SIZES {
            assert_eq!(bin(begin(k)), k);
        }
        for k in 1..=5000 {
            let share = f64::from(k) / 5000.0;
            let bin = bin(share);
            assert!(begin(bin) <= share && share < begin(bin + 1), "{share}");
        }
        assert!(begin(SIZES) > 1.0 && bin(1.0) == SIZES - 1);
    }
}
