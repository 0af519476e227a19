//! How large a green region is, and from which size on it is what.

use crate::dataset::sample::IGNORE;
use crate::train::measure::components::Components;
use crate::train::measure::{Confusion, Scores};
use serde::{Deserialize, Serialize};

pub(super) const SOIL: u8 = 0;
pub(super) const CROP: u8 = 1;
const WEED: u8 = 2;
/// Number of classes.
pub(super) const CLASSES: usize = 3;
/// Sizes told apart in a doubling of a region's share of the image.
const PER_DOUBLING: f64 = 8.0;
/// Bins of sizes: shares from 2⁻³² to 1.
const SIZES: usize = 32 * PER_DOUBLING as usize + 1;

/// Which green regions are what, by their share of the image's pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SizeRule {
    /// From here on crop.
    pub crop_from: f64,
    /// From here to `crop_from` weed; below soil.
    pub weed_from: f64,
}

impl SizeRule {
    /// Classes of the pixels of an image, by which of them are green.
    pub(super) fn classes(&self, width: u32, height: u32, green: &[bool]) -> Vec<u8> {
        let regions = regions(width, height, green);
        let class = |area: &u32| {
            let share = f64::from(*area) / green.len() as f64;
            if share >= self.crop_from {
                CROP
            } else if share >= self.weed_from {
                WEED
            } else {
                SOIL
            }
        };
        let classes: Vec<u8> = regions.areas.iter().map(class).collect();
        let of = |label: &u32| label.checked_sub(1).map_or(SOIL, |k| classes[k as usize]);
        regions.labels.iter().map(of).collect()
    }
}

fn regions(width: u32, height: u32, green: &[bool]) -> Components {
    Components::of(width as usize, height as usize, |at| green[at].then_some(()))
}

/// What the training images hold in green regions of each size.
pub(super) struct Sizes {
    /// Pixels of each true class that are not green.
    bare: [u64; CLASSES],
    /// The same in green regions, by their size.
    sized: Vec<[u64; CLASSES]>,
}

impl Sizes {
    pub(super) fn new() -> Self {
        Self { bare: [0; CLASSES], sized: vec![[0; CLASSES]; SIZES] }
    }

    /// Counts an image.
    pub(super) fn add(&mut self, width: u32, height: u32, green: &[bool], truth: &[u8]) {
        let regions = regions(width, height, green);
        let bin = |area: &u32| bin(f64::from(*area) / green.len() as f64);
        let bins: Vec<usize> = regions.areas.iter().map(bin).collect();
        for (label, truth) in regions.labels.iter().zip(truth).filter(|(_, truth)| **truth != IGNORE) {
            let counts = label.checked_sub(1).map_or(&mut self.bare, |k| &mut self.sized[bins[k as usize]]);
            counts[usize::from(*truth)] += 1;
        }
    }

    /// The rule of the largest mean I/U, of all pairs of sizes; of equals that of the smallest.
    pub(super) fn best(&self) -> SizeRule {
        // Sums of all smaller regions.
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
            let matrix = Confusion::from_rows(&[row(0), row(1), row(2)]).expect("three classes");
            Scores::of(&matrix, &[false, true, true]).mean_iou.unwrap_or(0.0)
        };
        let pairs = (0..=SIZES).flat_map(|weed| (weed..=SIZES).map(move |crop| (weed, crop)));
        let scored = pairs.map(|(weed, crop)| (score(weed, crop), weed, crop));
        let (_, weed, crop) = scored.reduce(|a, b| if b.0 > a.0 { b } else { a }).unwrap_or_default();
        SizeRule { crop_from: begin(crop), weed_from: begin(weed) }
    }
}

/// The bin of a share of the image.
fn bin(share: f64) -> usize {
    let guess = ((share.log2() + 32.0) * PER_DOUBLING).floor().clamp(0.0, SIZES as f64 - 1.0) as usize;
    // A share that begins a bin belongs to it whatever the logarithm's last bit says.
    if guess + 1 < SIZES && share >= begin(guess + 1) {
        guess + 1
    } else if guess > 0 && share < begin(guess) {
        guess - 1
    } else {
        guess
    }
}

/// The share with which a bin begins; that after the last begins above 1.
fn begin(bin: usize) -> f64 {
    (bin as f64 / PER_DOUBLING - 32.0).exp2()
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
