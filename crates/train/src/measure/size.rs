//! Scores of plants by size.
//!
//! A plant consists of the pixels of one class with one number in the truth's plant map. Plant pixels without a number, or of a dataset
//! without a plant map, form one plant for each connected region of a class. The size of a plant is its number of labelled pixels. Bin k
//! contains plants of 4^k to 4^(k+1) − 1 pixels, so the width of plants doubles from bin to bin.
//!
//! For each bin:
//! - recall is the fraction of its plants' pixels that have the plant's class in the prediction;
//! - detected plants have at least half of their pixels predicted correctly;
//! - I/U is `found / (pixels + false positives)`.
//!
//! A false positive is a pixel that is wrongly predicted as the class. All false positives of a connected region of the prediction belong
//! to one bin: that of the plant of the class with which the region shares most pixels (the first of equals), or, if it covers none, that
//! of the region's own size.
//!
//! So an inaccurate edge counts against its own plant, and a small region in bare soil against small plants. COCO's detection scores by
//! size follow the same rule: a matched detection has its object's size, an unmatched one its own (Lin et al. 2014, `pycocotools`).
//!
//! Summed over bins, found, pixels and false positives are T_p, T_p + F_n and F_p of the class's I/U.

use super::components::Components;
use super::scores::ratio;
use furrow_base::math::ToInt;
use furrow_dataset::model::sample::IGNORE;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// Number of bins, enough for an image of 2³² pixels.
const BINS: usize = 16;

/// Returns the bin of a size of at least 1 pixel.
fn bin(pixels: u32) -> usize {
    pixels.max(1).ilog2().to_usize() / 2
}

/// Counts of the plants of a class in a bin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Tally {
    plants: u64,
    detected: u64,
    pixels: u64,
    found: u64,
    false_positives: u64,
}

/// Counts of the plants of all classes by size, summed over images.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sizes {
    /// One row for each class; rows of other classes than plants stay zero.
    tallies: Vec<[Tally; BINS]>,
}

/// Scores of the plants of one class in one range of sizes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SizeBin {
    /// Smallest size, pixels.
    pub from_pixels: u64,
    /// Largest size, pixels.
    pub to_pixels: u64,
    /// Number of plants.
    pub plants: u64,
    /// Number of plants with at least half of their pixels predicted correctly.
    pub detected: u64,
    /// Pixels of these plants in the truth.
    pub pixels: u64,
    /// Pixels that are predicted correctly.
    pub found: u64,
    /// Pixels that are wrongly predicted as the class, by the rule above.
    pub false_positives: u64,
    /// Recall: `found / pixels`.
    pub recall: Option<f64>,
    /// Intersection over union.
    pub iou: Option<f64>,
}

/// Plant of the truth.
struct Plant {
    class: u8,
    pixels: u32,
    found: u32,
}

impl Sizes {
    /// Returns empty counts for this number of classes.
    pub fn new(classes: usize) -> Self {
        Self { tallies: vec![[Tally::default(); BINS]; classes] }
    }

    /// Counts the plants of one image. `plant_classes` is `true` for each class that is a plant. Maps contain `width * height` values;
    /// `numbers` is the plant map, with 0 for no number.
    pub fn of(
        plant_classes: &[bool],
        (width, height): (usize, usize),
        truth: &[u8],
        predicted: &[u8],
        numbers: Option<&[u32]>,
    ) -> Self {
        let is_plant = |class: u8| plant_classes.get(usize::from(class)) == Some(&true);
        let (owners, mut plants) = plants(plant_classes, (width, height), truth, numbers);
        let claim = |at: usize| Some(predicted[at]).filter(|class| is_plant(*class) && truth[at] != IGNORE);
        let regions = Components::of(width, height, claim);
        let mut wrong = vec![0_u32; regions.areas.len()];
        let mut class_of = vec![0_u8; regions.areas.len()];
        // Region and plant of each correctly predicted pixel, to find the plant that each region covers most.
        let mut covers: Vec<(u32, u32)> = Vec::new();
        for (at, region) in regions.labels.iter().enumerate().filter(|(_, region)| **region > 0) {
            let k = region.to_usize() - 1;
            class_of[k] = predicted[at];
            if truth[at] == predicted[at] {
                plants[owners[at].to_usize() - 1].found += 1;
                covers.push((k.to_u32(), owners[at] - 1));
            } else {
                wrong[k] += 1;
            }
        }
        covers.sort_unstable();
        let mut matched: Vec<u32> = regions.areas.clone();
        for of_region in covers.chunk_by(|a, b| a.0 == b.0) {
            let most = of_region.chunk_by(|a, b| a.1 == b.1).reduce(|a, b| if b.len() > a.len() { b } else { a });
            if let Some((region, plant)) = most.and_then(|pairs| pairs.first()) {
                matched[region.to_usize()] = plants[plant.to_usize()].pixels;
            }
        }
        let mut out = Self::new(plant_classes.len());
        for ((wrong, matched), class) in wrong.iter().zip(&matched).zip(&class_of) {
            out.tallies[usize::from(*class)][bin(*matched)].false_positives += u64::from(*wrong);
        }
        for plant in &plants {
            let tally = &mut out.tallies[usize::from(plant.class)][bin(plant.pixels)];
            tally.plants += 1;
            tally.detected += u64::from(2 * u64::from(plant.found) >= u64::from(plant.pixels));
            tally.pixels += u64::from(plant.pixels);
            tally.found += u64::from(plant.found);
        }
        out
    }

    /// Adds the counts of another image.
    pub fn merge(&mut self, other: &Self) {
        for (sum, tally) in self.tallies.as_flattened_mut().iter_mut().zip(other.tallies.as_flattened()) {
            sum.plants += tally.plants;
            sum.detected += tally.detected;
            sum.pixels += tally.pixels;
            sum.found += tally.found;
            sum.false_positives += tally.false_positives;
        }
    }

    /// Returns the bins of a class from small to large, without empty ones.
    pub fn bins(&self, class: usize) -> Vec<SizeBin> {
        let bins = self.tallies[class].iter().enumerate();
        bins.filter(|(_, tally)| **tally != Tally::default())
            .map(|(k, tally)| SizeBin {
                from_pixels: 1 << (2 * k),
                to_pixels: (1 << (2 * k + 2)) - 1,
                plants: tally.plants,
                detected: tally.detected,
                pixels: tally.pixels,
                found: tally.found,
                false_positives: tally.false_positives,
                recall: ratio(tally.found, tally.pixels),
                iou: ratio(tally.found, tally.pixels + tally.false_positives),
            })
            .collect()
    }
}

/// Finds the plants of the truth. Returns the plant of each pixel (numbered from 1, 0 for none) and the plants.
fn plants(
    plant_classes: &[bool],
    (width, height): (usize, usize),
    truth: &[u8],
    numbers: Option<&[u32]>,
) -> (Vec<u32>, Vec<Plant>) {
    let is_plant = |class: u8| plant_classes.get(usize::from(class)) == Some(&true);
    let number = |at: usize| numbers.map_or(0, |numbers| numbers[at]);
    let loose = Components::of(width, height, |at| Some(truth[at]).filter(|c| is_plant(*c) && number(at) == 0));
    let mut plants: Vec<Plant> = Vec::new();
    // One plant for each number and class: imported datasets may use one number for two classes.
    let mut named: HashMap<(u32, u8), u32> = HashMap::new();
    let mut of_region = vec![0_u32; loose.areas.len()];
    let mut owners = vec![0_u32; truth.len()];
    for at in (0..truth.len()).filter(|at| is_plant(truth[*at])) {
        let class = truth[at];
        let owner = match number(at) {
            0 => &mut of_region[loose.labels[at].to_usize() - 1],
            n => named.entry((n, class)).or_default(),
        };
        if *owner == 0 {
            plants.push(Plant { class, pixels: 0, found: 0 });
            *owner = plants.len().to_u32();
        }
        owners[at] = *owner;
        plants[owner.to_usize() - 1].pixels += 1;
    }
    (owners, plants)
}
