//! Pixels of equal colour are rather of equal kind.
//!
//! The share of plant pixels among all pixels of a picture that have nearly the same colour is joined with each pixel's own probability, as
//! a weighted mean of their log odds. This is one mean-field step of a fully connected conditional random field whose kernel is the
//! appearance kernel without its place (Krähenbühl & Koltun 2011, equation 3 with θ_α → ∞), computed in a grid of colours that is
//! blurred as in the bilateral grid (Chen et al. 2007).
//!
//! Colours are opponent colours, (R + 2 G + B) / 4, G − (R + B) / 2 and R − B, each by its own mean and standard deviation in the picture,
//! so neither exposure, white balance nor contrast matters.

/// Bins of the grid along each axis.
const BINS: usize = 24;
/// Standard deviations from the mean to either end of the grid; what lies beyond is counted in its outermost bins.
const REACH: f32 = 3.0;
/// Times that the grid is blurred by 1, 2, 1 along each axis: a standard deviation of one bin, a quarter of that of the colours.
const BLURS: usize = 2;
/// Weight of the pixels of equal colour; the pixel's own is the rest of 1.
const WEIGHT: f64 = 0.7;
/// Probabilities are not nearer to 0 and 1 than this: what is sure stays finite.
const SURE: f64 = 1e-3;

/// Refines the classes' probabilities, one plane a class, soil first, of a picture with `bands` values a pixel; `rgb` are the places of
/// red, green and blue among them. The ratios between plants' classes stay.
pub(super) fn refine(pixels: &[f32], bands: usize, rgb: [usize; 3], probabilities: &mut [f32]) {
    let n = pixels.len() / bands;
    let bins = bins(pixels, bands, rgb);
    let (soil, plants) = probabilities.split_at_mut(n);
    let alike = alike(&bins, soil);
    let classes = plants.len() / n.max(1);
    for (at, soil) in soil.iter_mut().enumerate() {
        // Not 1 − soil, which rounds away what is small.
        let own: f64 = plants.iter().skip(at).step_by(n).map(|p| f64::from(*p)).sum();
        let odds = (1.0 - WEIGHT) * log_odds(own) + WEIGHT * log_odds(alike[usize::from(bins[at])]);
        let plant = 1.0 / (1.0 + (-odds).exp());
        *soil = (1.0 - plant) as f32;
        for p in plants.iter_mut().skip(at).step_by(n) {
            *p = if own > 0.0 { f64::from(*p) * plant / own } else { plant / classes as f64 } as f32;
        }
    }
}

fn log_odds(p: f64) -> f64 {
    let p = p.clamp(SURE, 1.0 - SURE);
    (p / (1.0 - p)).ln()
}

/// The bin of each pixel's colour.
fn bins(pixels: &[f32], bands: usize, rgb: [usize; 3]) -> Vec<u16> {
    let opponent = |pixel: &[f32]| {
        let [r, g, b] = rgb.map(|place| pixel[place]);
        [0.25 * (r + 2.0 * g + b), g - 0.5 * (r + b), r - b]
    };
    let mut sums = [(0.0f64, 0.0f64); 3];
    for pixel in pixels.chunks_exact(bands) {
        for (sum, value) in sums.iter_mut().zip(opponent(pixel).map(f64::from)) {
            *sum = (sum.0 + value, sum.1 + value * value);
        }
    }
    let n = (pixels.len() / bands).max(1) as f64;
    let scales = sums.map(|(sum, squares)| {
        let mean = sum / n;
        (mean as f32, ((squares / n - mean * mean).max(0.0).sqrt() as f32).max(f32::EPSILON))
    });
    let bin = |value: f32, (mean, sd): (f32, f32)| {
        let place = ((value - mean) / sd + REACH) * (BINS as f32 / (2.0 * REACH));
        (place.max(0.0) as usize).min(BINS - 1)
    };
    let of = |pixel: &[f32]| {
        let values = opponent(pixel);
        (0..3).fold(0, |at, axis| at * BINS + bin(values[axis], scales[axis])) as u16
    };
    pixels.chunks_exact(bands).map(of).collect()
}

/// The share of plant pixels among those of each bin and its neighbours.
fn alike(bins: &[u16], soil: &[f32]) -> Vec<f64> {
    let (mut all, mut plants) = (vec![0.0; BINS * BINS * BINS], vec![0.0; BINS * BINS * BINS]);
    for (bin, soil) in bins.iter().zip(soil) {
        all[usize::from(*bin)] += 1.0;
        plants[usize::from(*bin)] += f64::from(u8::from(*soil < 0.5));
    }
    for _ in 0..BLURS {
        for stride in [1, BINS, BINS * BINS] {
            all = blurred(&all, stride);
            plants = blurred(&plants, stride);
        }
    }
    plants.iter().zip(&all).map(|(plants, all)| if *all > 0.0 { plants / all } else { 0.0 }).collect()
}

/// The grid blurred along one axis; `stride` is how far neighbours lie apart.
fn blurred(grid: &[f64], stride: usize) -> Vec<f64> {
    let value = |at: usize| {
        let place = at / stride % BINS;
        let before = if place > 0 { grid[at - stride] } else { 0.0 };
        let behind = if place + 1 < BINS { grid[at + stride] } else { 0.0 };
        0.25 * (before + 2.0 * grid[at] + behind)
    };
    (0..grid.len()).map(value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Purpose, Stream};

    /// A picture of brown soil and green leaves with noise, every fifth pixel a leaf, and a network that finds `found` of the leaves and
    /// takes `taken` of the soil for leaves: the picture, what is a leaf, and the probabilities of soil, crop and weed.
    fn picture(found: f64, taken: f64, exposure: [f32; 3]) -> (Vec<f32>, Vec<bool>, Vec<f32>) {
        let n = 20_000;
        let mut stream = Stream::of(5, 0, Purpose::Test, 0);
        let (mut pixels, mut probabilities) = (Vec::new(), vec![0.0f32; 3 * n]);
        let leaves: Vec<bool> = (0..n).map(|at| at % 5 == 0).collect();
        for (at, leaf) in leaves.iter().enumerate() {
            let color = if *leaf { [0.25f32, 0.45, 0.15] } else { [0.4, 0.33, 0.27] };
            let light = 1.0 + 0.25 * stream.normal() as f32;
            pixels.extend((0..3).map(|c| exposure[c] * (light * color[c] + 0.02 * stream.normal() as f32)));
            let plant = if stream.chance(if *leaf { found } else { taken }) { 0.9 } else { 0.2 };
            probabilities[at] = 1.0 - plant;
            probabilities[n + at] = 0.75 * plant;
            probabilities[2 * n + at] = 0.25 * plant;
        }
        (pixels, leaves, probabilities)
    }

    fn iou(leaves: &[bool], soil: &[f32]) -> f64 {
        let both = leaves.iter().zip(soil).filter(|(leaf, soil)| **leaf && **soil < 0.5).count();
        let either = leaves.iter().zip(soil).filter(|(leaf, soil)| **leaf || **soil < 0.5).count();
        both as f64 / either as f64
    }

    /// Rationale: what it is for. Expected: of leaves that were found in two thirds nine in ten are, the noise being what it is, and soil taken for leaves is soil
    /// again, whatever exposure and white balance; crop stays three times as likely as weed; probabilities have the sum 1.
    #[test]
    fn leaves_found_in_part_are_found_whole() {
        for exposure in [[1.0; 3], [0.3, 0.35, 0.2]] {
            let (pixels, leaves, mut probabilities) = picture(0.66, 0.02, exposure);
            let n = leaves.len();
            let before = iou(&leaves, &probabilities[..n]);
            refine(&pixels, 3, [0, 1, 2], &mut probabilities);
            let after = iou(&leaves, &probabilities[..n]);
            assert!(before < 0.64 && after > 0.9, "{before} {after}");
            for at in 0..n {
                let [soil, crop, weed] = [0, 1, 2].map(|class| probabilities[class * n + at]);
                assert!(
                    (crop - 3.0 * weed).abs() < 1e-5 && (soil + crop + weed - 1.0).abs() < 1e-5,
                    "{soil} {crop} {weed}"
                );
            }
        }
    }

    /// Expected: nothing is invented where a network sees soil alone, and nothing but finite numbers comes of one colour, or of what is sure.
    #[test]
    fn pictures_of_one_kind_or_colour_stay_what_they_are() {
        let (pixels, leaves, mut probabilities) = picture(0.0, 0.0, [1.0; 3]);
        refine(&pixels, 3, [0, 1, 2], &mut probabilities);
        assert!(probabilities[..leaves.len()].iter().all(|soil| *soil > 0.5));
        let gray = vec![0.0f32; 300];
        for sure in [0.0f32, 1.0] {
            let mut probabilities: Vec<f32> = [vec![1.0 - sure; 100], vec![sure; 100]].concat();
            refine(&gray, 3, [0, 1, 2], &mut probabilities);
            assert!((0..100).all(|at| (probabilities[at] + probabilities[100 + at] - 1.0).abs() < 1e-5));
            assert!(probabilities[..100].iter().all(|soil| (*soil < 0.5) == (sure > 0.5)));
        }
        refine(&[], 3, [0, 1, 2], &mut []);
    }
}
