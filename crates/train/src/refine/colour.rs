//! Refinement step `colour`: pixels of similar colour tend to be of the same kind, plant or soil.
//!
//! Each pixel's probability of being plant is combined with the fraction of plant pixels among all pixels of nearly the same colour, as a
//! weighted mean of log odds. This is one mean-field step of a fully connected conditional random field with the appearance kernel without
//! its position term (Krähenbühl & Koltun 2011, equation 3 with θ_α → ∞), computed on a grid of colours that is blurred as in the bilateral
//! grid (Chen et al. 2007).
//!
//! Colours are the opponent colours (R + 2 G + B) / 4, G − (R + B) / 2 and R − B, each standardized by its mean and standard
//! deviation in the image, so that exposure, white balance and contrast do not matter.
//!
//! Where colours separate plants from soil, but the network finds only part of the plants, [`super::self_training`] replaces the
//! fraction of plant pixels.

use super::self_training;
use furrow_base::math::{RoundTo, ToFloat, ToInt};

/// Number of bins of the colour grid along each axis.
const BINS: usize = 24;
/// Half width of the grid along each axis, standard deviations; colours beyond it count in the outermost bins.
const REACH: f32 = 3.0;
/// Number of passes of the blur kernel (1, 2, 1) / 4 along each axis. Two passes have a standard deviation of one bin, a quarter of that of
/// the colours.
const BLURS: usize = 2;
/// Weight of the pixels of similar colour; that of the pixel's own probability is 1 − `WEIGHT`.
const WEIGHT: f64 = 0.7;
/// Probabilities are clamped to `SURE` … 1 − `SURE`, so that log odds stay finite.
const SURE: f64 = 1e-3;

/// Refines the class probabilities of an image in place: one plane per class, soil first. `pixels` has `bands` values a pixel; `rgb` holds
/// the indices of red, green and blue among them. The ratios between the plant classes are kept. Returns `true` if self-training was used.
pub(super) fn refine(pixels: &[f32], bands: usize, rgb: [usize; 3], probabilities: &mut [f32]) -> bool {
    let n = pixels.len() / bands;
    let colours = standardized(pixels, bands, rgb);
    let bins: Vec<u16> = colours.iter().map(bin).collect();
    let (soil, plants) = probabilities.split_at_mut(n);
    // Summed instead of 1 − soil, which would round small probabilities away.
    let mut own = vec![0.0f64; n];
    for plane in plants.chunks_exact(n.max(1)) {
        own.iter_mut().zip(plane).for_each(|(own, p)| *own += f64::from(*p));
    }
    let alike = alike(&bins, soil);
    let combined = |own: f64, of_colour: f64| {
        let odds = (1.0 - WEIGHT) * log_odds(own) + WEIGHT * log_odds(of_colour);
        1.0 / (1.0 + (-odds).exp())
    };
    let by_colour = |of_colour: &dyn Fn(usize) -> f64| -> Vec<f64> {
        own.iter().enumerate().map(|(at, own)| combined(*own, of_colour(at))).collect()
    };
    let mut plant = by_colour(&|at| alike[usize::from(bins[at])]);
    let mut is_learnt = false;
    if let Some(learnt) = self_training::probabilities(&colours, &own) {
        let grown = by_colour(&|at| learnt[at]);
        let mask = |p: &[f64]| -> Vec<bool> { p.iter().map(|p| *p > 0.5).collect() };
        if self_training::separates(&colours, &mask(&plant), &mask(&grown)) {
            (plant, is_learnt) = (grown, true);
        }
    }
    let classes = plants.len() / n.max(1);
    for (at, soil) in soil.iter_mut().enumerate() {
        let (own, plant) = (own[at], plant[at]);
        *soil = (1.0 - plant).to_f32();
        for p in plants.iter_mut().skip(at).step_by(n) {
            *p = (if own > 0.0 { f64::from(*p) * plant / own } else { plant / classes.to_f64() }).to_f32();
        }
    }
    is_learnt
}

fn log_odds(p: f64) -> f64 {
    let p = p.clamp(SURE, 1.0 - SURE);
    (p / (1.0 - p)).ln()
}

/// Returns the opponent colours of each pixel, standardized over the image: lightness, greenness, and red against blue.
fn standardized(pixels: &[f32], bands: usize, rgb: [usize; 3]) -> Vec<[f32; 3]> {
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
    let n = (pixels.len() / bands).max(1).to_f64();
    let scales = sums.map(|(sum, squares)| {
        let mean = sum / n;
        (mean.to_f32(), (squares / n - mean * mean).max(0.0).sqrt().to_f32().max(f32::EPSILON))
    });
    let of = |pixel: &[f32]| {
        let values = opponent(pixel);
        std::array::from_fn(|axis| (values[axis] - scales[axis].0) / scales[axis].1)
    };
    pixels.chunks_exact(bands).map(of).collect()
}

/// Returns the grid bin of a standardized colour.
fn bin(colour: &[f32; 3]) -> u16 {
    let along = |value: f32| {
        let place = (value + REACH) * (BINS.to_f32() / (2.0 * REACH));
        place.max(0.0).trunc_to::<usize>().min(BINS - 1)
    };
    colour.iter().fold(0, |at, value| at * BINS + along(*value)).to_u16()
}

/// Returns the fraction of plant pixels among the pixels of each bin and its neighbours, after blurring; 0 in empty bins.
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

/// Blurs the grid along one axis; `stride` is the index distance of neighbouring bins along it.
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
    use furrow_base::sampling::{Purpose, Stream};

    /// Builds a noisy image of brown soil and green leaves, every fifth pixel a leaf, and the output of a network that
    /// finds a fraction `found` of the leaf pixels and takes a fraction `taken` of the soil for leaf. Returns the pixels, the leaf
    /// mask, and the probabilities of soil, crop and weed.
    fn picture(found: f64, taken: f64, exposure: [f32; 3]) -> (Vec<f32>, Vec<bool>, Vec<f32>) {
        let n = 20_000;
        let mut stream = Stream::of(5, 0, Purpose::Test, 0);
        let (mut pixels, mut probabilities) = (Vec::new(), vec![0.0f32; 3 * n]);
        let leaves: Vec<bool> = (0..n).map(|at| at % 5 == 0).collect();
        for (at, leaf) in leaves.iter().enumerate() {
            let color = if *leaf { [0.25f32, 0.45, 0.15] } else { [0.4, 0.33, 0.27] };
            let light = 1.0 + 0.25 * stream.normal().to_f32();
            pixels.extend((0..3).map(|c| exposure[c] * (light * color[c] + 0.02 * stream.normal().to_f32())));
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
        both.to_f64() / either.to_f64()
    }

    /// Rationale: completing partly found leaves is the purpose of the step. Expected: if two thirds of the leaf pixels were found,
    /// the intersection over union rises from below 0.64 to above 0.9 at any exposure and white balance; crop stays three times as
    /// likely as weed; the probabilities sum to 1.
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

    /// Expected: no plants appear where the network predicts soil alone; an image of one colour and certain predictions give finite
    /// numbers.
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
