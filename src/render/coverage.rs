//! What share of a pixel each class covers, from the very samples that its colour was made of: the same footprint, lens and
//! alpha masks. A label tells what lies at a pixel's centre; coverage tells which labels are edges, and how much of one.

use crate::film::{Film, Pixel};
use crate::scene::tag::{Class, Tag};

/// Share of each pixel that each class covers, row by row from the top, in the order of [`Class::ALL`]: in [0, 1], with a sum
/// of 1. `tags` holds one row a part. What met nothing is soil, as in the labels. The shares of an edge are
/// estimates from n samples: their standard deviation is at most 1 / (2 √n), less where samples are stratified.
pub fn coverage(film: &Film, tags: &[Tag]) -> Vec<[f32; Class::ALL.len()]> {
    film.pixels.iter().map(|pixel| shares(pixel, tags)).collect()
}

/// The shares of one pixel.
fn shares(pixel: &Pixel, tags: &[Tag]) -> [f32; Class::ALL.len()] {
    let mut counts = [0u32; Class::ALL.len()];
    for (part, count) in pixel.tally.iter() {
        counts[tags.get(part as usize).copied().unwrap_or_default().class as usize] += count;
    }
    counts[Class::Soil as usize] += pixel.samples.max(1) - counts.iter().sum::<u32>();
    counts.map(|count| (f64::from(count) / f64::from(pixel.samples.max(1))) as f32)
}
