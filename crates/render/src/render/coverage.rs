//! Class coverage of a pixel, computed from the same samples as its colour: same footprint, lens and alpha masks. A
//! label gives the class at the pixel centre; coverage shows which pixels are edges and the fraction of each class in
//! them.

use crate::film::{Film, Pixel};
use crate::scene::tag::{Class, Tag};
use furrow_base::math::{ToFloat, ToInt};

/// Returns the fraction of each pixel covered by each class, row-major from the top, in the order of [`Class::ALL`]: in
/// [0, 1], with a sum of 1. `tags` holds one tag per part. Samples without a hit count as soil, as in the labels.
/// Fractions at edges are estimates from n samples, with a standard deviation of at most 1 / (2 √n), less with
/// stratified samples.
pub fn coverage(film: &Film, tags: &[Tag]) -> Vec<[f32; Class::ALL.len()]> {
    film.pixels.iter().map(|pixel| shares(pixel, tags)).collect()
}

/// Computes the fractions of one pixel.
fn shares(pixel: &Pixel, tags: &[Tag]) -> [f32; Class::ALL.len()] {
    let mut counts = [0u32; Class::ALL.len()];
    for (part, count) in pixel.tally.iter() {
        counts[tags.get(part.to_usize()).copied().unwrap_or_default().class as usize] += count;
    }
    counts[Class::Soil as usize] += pixel.samples.max(1) - counts.iter().sum::<u32>();
    counts.map(|count| (f64::from(count) / f64::from(pixel.samples.max(1))).to_f32())
}
