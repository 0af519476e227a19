//! Part of the refinement step `colour`: a colour classifier that learns from the network's own predictions in the image.
//!
//! Under light or in growth stages that it was not trained on, a network finds only some plants, and the pixels that it misses differ in
//! colour from those that it finds: then the fraction of found pixels of the same colour is low as well. A logistic regression on three
//! opponent colours extrapolates from the found pixels to the others. Its labels are incomplete, so its probabilities are divided by the
//! probability that it gives to the found pixels (Elkan & Noto 2008, equation 1 and estimator e1, with the median instead of the
//! mean). What it then classifies as plant is its training set for the next round (self-training, Scudder 1965).
//!
//! Colours do not separate plants from soil in every image, and self-training amplifies errors. The result is used only if few pixels
//! are ambiguous, the added pixels are clearly greener than the rest, and the plants grow at most [`MOST_GROWTH`] times.

use furrow_base::math::ToFloat;
use nalgebra::{Matrix4, Vector4};

/// Number of rounds of self-training.
const ROUNDS: usize = 6;
/// Largest number of pixels that the classifier is fitted to, at even intervals.
const SAMPLES: usize = 20_000;
/// Newton steps of a fit.
const STEPS: usize = 12;
/// Ridge penalty on the weights of the colours, per pixel.
const RIDGE: f64 = 1e-3;
/// Smallest fraction of found pixels in the image: fewer define no colour.
const LEAST_FOUND: f64 = 1e-3;
/// Lower bound on the divisor, the median probability of found pixels.
const LEAST_RECALL: f64 = 0.05;
/// Found pixels with a probability below this are taken out of the training set.
const KEPT: f64 = 0.2;
/// Probabilities in this range are ambiguous.
const AMBIGUOUS: std::ops::Range<f64> = 0.2..0.8;
/// Maximum ratio of ambiguous pixels to plant pixels.
const MOST_AMBIGUOUS: f64 = 0.5;
/// Minimum difference in greenness between added pixels and the remaining soil, in standard deviations of the soil.
const LEAST_CONTRAST: f64 = 3.0;
/// Maximum ratio of plant pixels after to those before. Beyond it the classifier has taken soil for plants, and only the least green
/// soil remains.
const MOST_GROWTH: f64 = 4.0;
/// Standardized colours are clamped to this range, so that highlights do not dominate the fit.
const REACH: f32 = 4.0;

/// Returns the probability of plant of each pixel by its colour. `colours` holds opponent colours, standardized over the image, with
/// greenness second; `own` is the network's probability of plant. Returns `None` if the network finds hardly any plants or no fit exists.
pub(super) fn probabilities(colours: &[[f32; 3]], own: &[f64]) -> Option<Vec<f64>> {
    let found: Vec<bool> = own.iter().map(|p| *p > 0.5).collect();
    let count = found.iter().filter(|f| **f).count();
    if count.to_f64() < LEAST_FOUND * own.len().to_f64() || count == 0 || count == own.len() {
        return None;
    }
    let step = colours.len().div_ceil(SAMPLES);
    let (mut labels, mut plants) = (found.clone(), vec![0.0; own.len()]);
    for _ in 0..ROUNDS {
        let weights = fit(colours, &labels, step)?;
        for (p, colour) in plants.iter_mut().zip(colours) {
            *p = logistic(weights.dot(&features(colour)));
        }
        let mut of_found: Vec<f64> = plants.iter().zip(&found).filter(|(_, f)| **f).map(|(p, _)| *p).collect();
        let (_, recall, _) = of_found.select_nth_unstable_by(count / 2, f64::total_cmp);
        let recall = recall.max(LEAST_RECALL);
        for ((p, label), found) in plants.iter_mut().zip(&mut labels).zip(&found) {
            *p = (*p / recall).min(1.0);
            *label = *p > if *found { KEPT } else { 0.5 };
        }
    }
    let ambiguous = plants.iter().filter(|p| AMBIGUOUS.contains(p)).count();
    let sure = plants.iter().filter(|p| **p > 0.5).count();
    (ambiguous.to_f64() < MOST_AMBIGUOUS * sure.to_f64()).then_some(plants)
}

/// Returns `true` if the pixels of `after` that are not in `before` are clearly greener than those in neither, and the plants
/// neither shrink nor take over the image.
pub(super) fn separates(colours: &[[f32; 3]], before: &[bool], after: &[bool]) -> bool {
    let plants = |mask: &[bool]| mask.iter().filter(|plant| **plant).count();
    // Number, sum and sum of squares of the greenness of added pixels and of soil.
    let (mut added, mut soil) = ([0.0f64; 3], [0.0f64; 3]);
    for ((colour, before), after) in colours.iter().zip(before).zip(after) {
        let sums = match (before, after) {
            (false, true) => &mut added,
            (false, false) => &mut soil,
            _ => continue,
        };
        let green = f64::from(colour[1]);
        sums.iter_mut().zip([1.0, green, green * green]).for_each(|(sum, value)| *sum += value);
    }
    if added[0] == 0.0 || soil[0] == 0.0 {
        return false;
    }
    let [added, mean] = [added, soil].map(|[n, sum, _]| sum / n);
    let deviation = (soil[2] / soil[0] - mean * mean).max(0.0).sqrt();
    let growth = plants(after).to_f64() / plants(before).max(1).to_f64();
    growth > 1.0 && growth <= MOST_GROWTH && added - mean > LEAST_CONTRAST * deviation
}

fn features(colour: &[f32; 3]) -> Vector4<f64> {
    let [light, green, red] = colour.map(|value| f64::from(value.clamp(-REACH, REACH)));
    Vector4::new(1.0, light, green, red)
}

fn logistic(odds: f64) -> f64 {
    1.0 / (1.0 + (-odds.clamp(-30.0, 30.0)).exp())
}

/// Fits a logistic regression to every `step`-th pixel by Newton's method; the constant term is not penalized. Source: Hastie, Tibshirani &
/// Friedman 2009, section 4.4.1. Returns `None` if the system has no solution.
fn fit(colours: &[[f32; 3]], labels: &[bool], step: usize) -> Option<Vector4<f64>> {
    let mut weights = Vector4::zeros();
    let ridge = RIDGE * colours.len().div_ceil(step).to_f64();
    let penalty = Vector4::new(0.0, ridge, ridge, ridge);
    for _ in 0..STEPS {
        let (mut gradient, mut hessian) = (penalty.component_mul(&weights), Matrix4::from_diagonal(&penalty));
        for (colour, label) in colours.iter().zip(labels).step_by(step) {
            let x = features(colour);
            let p = logistic(weights.dot(&x));
            gradient += x * (p - f64::from(u8::from(*label)));
            hessian += x * x.transpose() * (p * (1.0 - p));
        }
        let move_by = hessian.cholesky()?.solve(&gradient);
        weights -= move_by;
        if move_by.amax() < 1e-4 {
            break;
        }
    }
    weights.iter().all(|w: &f64| w.is_finite()).then_some(weights)
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::sampling::{Purpose, Stream};

    /// Builds the standardized colours of an image with leaves in every tenth pixel, of `green` ± 1 where soil is 0 ± 1, and the
    /// probabilities of a network that finds the leaves above `green`, and `taken` of the soil. Also returns which pixels are leaves.
    fn image(green: f64, taken: f64) -> (Vec<[f32; 3]>, Vec<f64>, Vec<bool>) {
        let mut stream = Stream::of(11, 0, Purpose::Test, 0);
        let leaf = |at: usize| at.is_multiple_of(10);
        let mut colours = Vec::new();
        let mut own = Vec::new();
        for at in 0..30_000 {
            let own_green = stream.normal() + if leaf(at) { green } else { 0.0 };
            colours.push([stream.normal(), own_green, stream.normal()].map(ToFloat::to_f32));
            let found = if leaf(at) { own_green > green } else { stream.chance(taken) };
            own.push(if found { 0.9 } else { 0.1 });
        }
        (colours, own, (0..30_000).map(leaf).collect())
    }

    fn masks(own: &[f64], plants: &[f64]) -> (Vec<bool>, Vec<bool>) {
        let mask = |p: &[f64]| p.iter().map(|p| *p > 0.5).collect();
        (mask(own), mask(plants))
    }

    /// Expected: of leaves whose greener half was found, at least 95 % are found, with at most 1 % of the soil, and the result is accepted.
    #[test]
    fn paler_leaves_are_found_by_the_colour_of_the_greener_ones() {
        let (colours, own, leaves) = image(6.0, 0.0);
        let (before, after) = masks(&own, &probabilities(&colours, &own).unwrap());
        let count = |leaf: bool| after.iter().zip(&leaves).filter(|(a, l)| **a && **l == leaf).count();
        assert!(count(true) * 100 >= 95 * 3_000 && count(false) * 100 <= 27_000, "{} {}", count(true), count(false));
        assert!(separates(&colours, &before, &after));
    }

    /// Expected: where colours of plants and soil overlap, or the network finds soil at random, the result is refused; so it is without
    /// plants, without soil, and without pixels.
    #[test]
    fn overlapping_colours_are_refused() {
        for (green, taken) in [(1.0, 0.0), (0.0, 0.0), (0.0, 0.03)] {
            let (colours, own, _) = image(green, taken);
            let accepted = probabilities(&colours, &own).is_some_and(|plants| {
                let (before, after) = masks(&own, &plants);
                separates(&colours, &before, &after)
            });
            assert!(!accepted, "{green} {taken}");
        }
        let (colours, own, _) = image(6.0, 0.0);
        for p in [0.0, 1.0] {
            assert!(probabilities(&colours, &vec![p; own.len()]).is_none());
        }
        assert!(probabilities(&[], &[]).is_none());
        assert!(!separates(&[], &[], &[]));
        let few: Vec<f64> = (0..own.len()).map(|at| if at < own.len() / 2000 { 0.9 } else { 0.1 }).collect();
        assert!(probabilities(&colours, &few).is_none());
    }
}
