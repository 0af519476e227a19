//! Brightness and colour statistics of a sample of the images.

use crate::Set;
use crate::read::native;
use furrow_base::Result;
use furrow_base::math::{RoundTo, ToFloat, ToInt};
use furrow_report::Tally;
use rayon::prelude::*;

/// Largest number of measured images, spread over the dataset: decoding a hundred thousand would take an hour.
const MOST: u64 = 240;

/// Statistics of the measured images.
pub(super) struct Photographs {
    /// Number of measured images.
    pub(super) measured: u64,
    /// Mean of R, G, B of each image, from 0 to 255.
    pub(super) brightness: Tally,
    /// Mean near infrared of each image, from 0 to 255.
    pub(super) nir: Tally,
    /// Percentage of pixels of each image with a channel at 255.
    pub(super) clipped: Tally,
    /// Mean colour of each image, darkest first.
    pub(super) colors: Vec<[u8; 3]>,
}

/// Means of one image: R, G, B; fraction of clipped pixels; near infrared.
struct Means([f64; 3], f64, Option<f64>);

/// Measures images of a dataset.
pub(super) fn measure(set: &Set) -> Result<Photographs> {
    let count = if set.recipe.labels_only() { 0 } else { set.recipe.count };
    let measured = count.min(MOST);
    // Indices of the measured images, spread evenly.
    let places: Vec<u64> =
        (0..measured).map(|k| (u128::from(k) * u128::from(count) / u128::from(measured)).to_u64()).collect();
    let all: Vec<Means> = places.par_iter().map(|k| means(set, &Set::name(*k))).collect::<Result<_>>()?;
    let mut found = Photographs {
        measured,
        brightness: Tally::linear(0.0, 256.0, 0.5),
        nir: Tally::linear(0.0, 256.0, 0.5),
        clipped: Tally::linear(0.0, 100.0, 0.01),
        colors: Vec::new(),
    };
    for Means(rgb, clipped, nir) in &all {
        found.brightness.add(rgb.iter().sum::<f64>() / 3.0);
        found.clipped.add(100.0 * clipped);
        if let Some(nir) = nir {
            found.nir.add(*nir);
        }
        found.colors.push(rgb.map(RoundTo::round_to::<u8>));
    }
    found.colors.sort_by_key(|c| (c.iter().map(|x| u32::from(*x)).sum::<u32>(), *c));
    Ok(found)
}

fn means(set: &Set, name: &str) -> Result<Means> {
    let image = native::Image::of(set, name);
    let (_, _, rgb) = image.photograph()?;
    let n = rgb.len().max(1).to_f64();
    let mut sums = [0_u64; 3];
    let mut clipped = 0_u64;
    for pixel in &rgb {
        for (sum, value) in sums.iter_mut().zip(pixel) {
            *sum += u64::from(*value);
        }
        clipped += u64::from(pixel.contains(&255));
    }
    let mean = |gray: &[u8]| gray.iter().map(|x| u64::from(*x)).sum::<u64>().to_f64() / n;
    let nir = image.band("nir")?.map(|file| mean(&file.values));
    Ok(Means(sums.map(|s| s.to_f64() / n), clipped.to_f64() / n, nir))
}
