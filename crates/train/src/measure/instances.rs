//! Scores of separated plants: panoptic quality.
//!
//! A predicted and a true plant match if their intersection over union (IoU) is above one half; at most one plant can match another then.
//! The panoptic quality is the sum of the IoU of the pairs over (pairs + half of the predicted plants without a partner + half of the
//! true ones): the product of the mean IoU of the pairs (segmentation quality) and an F-score of detection (recognition quality). Crops
//! and weeds count alike: the classes have scores of their own.
//!
//! Pixels without a label are removed from both. True plants below [`LEAST`] labelled pixels count neither as missed nor as found.
//! Predicted plants below that size, or mostly on such true plants, do not count either.
//!
//! Source: Kirillov et al. 2019, "Panoptic segmentation".

use furrow_base::math::{ToFloat, ToInt};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Smallest plant that counts, pixels of the image.
pub const LEAST: u64 = 20;

/// Counts of one image or several.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Instances {
    /// Number of true plants.
    pub truth: u64,
    /// Number of predicted plants.
    pub predicted: u64,
    /// Number of pairs.
    pub pairs: u64,
    /// Sum of the intersection over union of the pairs.
    pub iou_sum: f64,
}

impl Instances {
    /// Compares two plant maps, 0 for no plant. `labelled` says whether a pixel has a label.
    pub fn of(truth: &[u32], predicted: &[u32], labelled: impl Fn(usize) -> bool) -> Self {
        let mut both: BTreeMap<(u32, u32), u64> = BTreeMap::new();
        for (at, pair) in truth.iter().zip(predicted).enumerate() {
            if (*pair.0, *pair.1) != (0, 0) && labelled(at) {
                *both.entry((*pair.0, *pair.1)).or_default() += 1;
            }
        }
        let (mut true_areas, mut found_areas) = (BTreeMap::new(), BTreeMap::new());
        for ((truth, found), pixels) in &both {
            *true_areas.entry(*truth).or_insert(0u64) += pixels;
            *found_areas.entry(*found).or_insert(0u64) += pixels;
        }
        let is_small = |truth: u32| truth > 0 && true_areas[&truth] < LEAST;
        let mut on_small: BTreeMap<u32, u64> = BTreeMap::new();
        for ((_, found), pixels) in both.iter().filter(|((truth, _), _)| is_small(*truth)) {
            *on_small.entry(*found).or_default() += pixels;
        }
        let counts = |found: u32| {
            let area = found_areas[&found];
            found > 0 && area >= LEAST && 2 * on_small.get(&found).copied().unwrap_or(0) <= area
        };
        let mut sum = Self {
            truth: true_areas.iter().filter(|(plant, area)| **plant > 0 && **area >= LEAST).count().to_u64(),
            predicted: found_areas.keys().filter(|found| counts(**found)).count().to_u64(),
            ..Self::default()
        };
        for ((truth, found), common) in both {
            if truth == 0 || is_small(truth) || !counts(found) {
                continue;
            }
            let union = true_areas[&truth] + found_areas[&found] - common;
            if 2 * common > union {
                sum.pairs += 1;
                sum.iou_sum += common.to_f64() / union.to_f64();
            }
        }
        sum
    }

    /// Adds the counts of another image.
    pub fn merge(&mut self, other: &Self) {
        self.truth += other.truth;
        self.predicted += other.predicted;
        self.pairs += other.pairs;
        self.iou_sum += other.iou_sum;
    }

    /// Returns the panoptic quality; `None` without plants.
    pub fn panoptic_quality(&self) -> Option<f64> {
        ratio(self.iou_sum, 0.5 * (self.truth + self.predicted).to_f64())
    }

    /// Returns the mean intersection over union of the pairs.
    pub fn segmentation_quality(&self) -> Option<f64> {
        ratio(self.iou_sum, self.pairs.to_f64())
    }

    /// Returns the F-score of detection.
    pub fn recognition_quality(&self) -> Option<f64> {
        ratio(self.pairs.to_f64(), 0.5 * (self.truth + self.predicted).to_f64())
    }
}

/// Returns a ratio, or `None` for a whole of 0.
fn ratio(part: f64, whole: f64) -> Option<f64> {
    (whole > 0.0).then(|| part / whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected, by hand: of three true plants of 40 pixels one is found exactly, one with 30 of its pixels and 10 of soil (IoU 30/50), and
    /// one is missed; a fourth region is on soil. (1 + 0.6) / (2 + 0.5 + 0.5). Small plants and pixels without a label do not count.
    #[test]
    fn quality_is_that_of_the_definition() {
        let row = |parts: &[(usize, u32)]| parts.iter().flat_map(|(n, v)| vec![*v; *n]).collect::<Vec<u32>>();
        let truth = row(&[(40, 1), (10, 0), (40, 2), (10, 0), (40, 3), (100, 0), (10, 4), (90, 5)]);
        let found = row(&[(40, 9), (10, 0), (30, 4), (10, 0), (10, 4), (40, 0), (60, 7), (40, 0), (10, 2), (90, 8)]);
        let all = Instances::of(&truth, &found, |at| at < 250);
        assert_eq!((all.truth, all.predicted, all.pairs), (3, 3, 2));
        assert!((all.panoptic_quality().unwrap() - 1.6 / 3.0).abs() < 1e-12);
        assert!((all.segmentation_quality().unwrap() - 0.8).abs() < 1e-12);
        let mut twice = all;
        twice.merge(&all);
        assert_eq!(twice.recognition_quality(), Some(2.0 / 3.0));
        assert_eq!(Instances::of(&[0; 9], &[0; 9], |_| true).panoptic_quality(), None);
    }
}
