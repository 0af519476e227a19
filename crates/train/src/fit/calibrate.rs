//! Class-bias calibration: adjusts the biases of the last convolution after training.
//!
//! Losses that favour small plants, and crops around rare-class pixels, make a network over-predict plants: predicted outlines are
//! outside of the labelled ones. Calibration changes the bias of each class for the best mean intersection over union on some
//! labelled images. All other weights and the file format stay unchanged.

use crate::data::{Normalization, Store, augment};
use crate::torch::Model;
use crate::weights::Array;
use furrow_base::math::{ToFloat, ToInt};
use furrow_base::{Error, Result};
use furrow_dataset::model::sample::IGNORE;

/// Name of the array of class biases.
pub(super) const HEAD: &str = "head.conv.bias";
/// Every `THINNED`-th pixel is used. The step is prime, so that the sampled columns differ between rows.
const THINNED: usize = 5;
/// Largest change of a bias in either direction: odds of about fifty to one.
const MOST: f32 = 4.0;
/// Rounds of coordinate ascent over the classes, enough for convergence although the biases depend on each other.
const ROUNDS: usize = 3;

/// Returns the weights of a model with calibrated class biases: those with the best mean I/U over the occurring classes on `images`
/// images of the store, picked at even intervals. The bias of the first class and of classes without labelled pixels stay unchanged.
pub fn calibrate(model: &Model, store: &Store, normalization: &Normalization, images: u64) -> Result<Vec<Array>> {
    let shape = store.shape();
    let (mut values, mut labels) = (Vec::new(), Vec::new());
    let images = images.to_usize().min(store.len());
    for k in 0..images {
        let example = store.get(k * store.len() / images)?;
        let mut pixels = augment::interleave(&example, 1);
        normalization.apply(&mut pixels, shape.bands.len());
        let scores = model.scores(&pixels, (shape.width, shape.height))?;
        for at in (0..shape.pixels()).step_by(THINNED).filter(|at| example.labels[*at] != IGNORE) {
            labels.push(example.labels[at]);
            values.extend((0..model.classes).map(|class| scores[class * shape.pixels() + at]));
        }
    }
    let mut arrays = model.arrays()?;
    let head = arrays.iter_mut().find(|array| array.name == HEAD);
    let head = head.ok_or_else(|| Error::input(format!("this network has no array `{HEAD}`")))?;
    head.values.iter_mut().zip(offsets(&values, &labels, model.classes)).for_each(|(bias, offset)| *bias += offset);
    Ok(arrays)
}

/// Returns the offsets of the class biases with the best mean I/U, at most [`MOST`] in either direction. `values` contains the scores
/// of all classes for each pixel. Each class is optimised in turn: pixels are sorted by the class's lead over the best other class
/// and switched to the class one by one; the threshold with the best mean I/U gives the offset.
fn offsets(values: &[f32], labels: &[u8], classes: usize) -> Vec<f32> {
    let mut offsets = vec![0.0f32; classes];
    let mut counts = vec![0; classes];
    for label in labels {
        counts[usize::from(*label)] += 1;
    }
    for _ in 0..ROUNDS {
        for class in (1..classes).filter(|class| counts[*class] > 0) {
            let mut overlap = Overlap { labelled: &counts, predicted: vec![0; classes], correct: vec![0; classes] };
            // For each pixel: lead of the class over the best other class, that other class, and the label.
            let mut leads: Vec<(f32, u8, u8)> = Vec::with_capacity(labels.len());
            for (pixel, label) in values.chunks_exact(classes).zip(labels) {
                let others =
                    (0..classes).filter(|other| *other != class).map(|other| (pixel[other] + offsets[other], other));
                let (value, other) =
                    others.fold((f32::NEG_INFINITY, 0), |best, next| if next.0 > best.0 { next } else { best });
                overlap.count(other, usize::from(*label), true);
                leads.push((pixel[class] - value, other.to_u8(), *label));
            }
            leads.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
            let mut best = (f64::NEG_INFINITY, offsets[class]);
            for (k, (lead, other, label)) in leads.iter().enumerate() {
                overlap.count(usize::from(*other), usize::from(*label), false);
                overlap.count(class, usize::from(*label), true);
                // Halfway to the next lead, so that rounding does not change a prediction.
                let next = leads.get(k + 1).map_or(-MOST, |next| next.0);
                let offset = -0.5 * (lead + next);
                if next < *lead && offset.abs() <= MOST && overlap.mean() > best.0 {
                    best = (overlap.mean(), offset);
                }
            }
            offsets[class] = best.1;
        }
    }
    offsets
}

/// Number of pixels of each class that are labelled, predicted, and correctly predicted.
struct Overlap<'a> {
    labelled: &'a [u64],
    predicted: Vec<u64>,
    correct: Vec<u64>,
}

impl Overlap<'_> {
    /// Adds a prediction to the counts if `more` is true, or else removes it.
    fn count(&mut self, prediction: usize, label: usize, more: bool) {
        let change = |n: &mut u64| if more { *n += 1 } else { *n -= 1 };
        change(&mut self.predicted[prediction]);
        if prediction == label {
            change(&mut self.correct[prediction]);
        }
    }

    /// Returns the mean I/U of the classes that have labelled pixels.
    fn mean(&self) -> f64 {
        let held = (0..self.labelled.len()).filter(|class| self.labelled[*class] > 0);
        let each =
            held.map(|c| self.correct[c].to_f64() / (self.labelled[c] + self.predicted[c] - self.correct[c]).to_f64());
        let (sum, n) = each.fold((0.0, 0.0f64), |(sum, n), value| (sum + value, n + 1.0));
        sum / n.max(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::sampling::{Purpose, Stream};

    /// Rationale: a network that over-predicts a class makes its regions too wide. Expected: biases that were added to two of three
    /// classes with noisy scores are removed by calibration, to within 0.25; the bias of a class without labels stays. Source: the
    /// construction of the scores.
    #[test]
    fn calibration_undoes_a_class_bias() {
        let mut stream = Stream::of(7, 0, Purpose::Test, 0);
        let labels: Vec<u8> = (0..40_000).map(|k| if k % 10 == 0 { 1 } else { 2 * u8::from(k % 25 == 3) }).collect();
        let draw = |added: [f32; 3], stream: &mut Stream| -> Vec<f32> {
            let of = |class: usize, label: u8, noise: f64| {
                let logarithm: f32 = [0.86f32, 0.1, 0.04][class].ln();
                logarithm + added[class] + if usize::from(label) == class { 4.0 } else { 0.0 } + noise.to_f32()
            };
            labels.iter().flat_map(|l| [0, 1, 2].map(|class| of(class, *l, 1.2 * stream.normal()))).collect()
        };
        let plain = offsets(&draw([0.0; 3], &mut stream), &labels, 3);
        let moved = offsets(&draw([0.0, 1.5, -1.0], &mut Stream::of(8, 0, Purpose::Test, 0)), &labels, 3);
        assert!(
            (plain[1] - moved[1] - 1.5).abs() < 0.25 && (plain[2] - moved[2] + 1.0).abs() < 0.25,
            "{plain:?} {moved:?}"
        );
        let two: Vec<u8> = labels.iter().map(|l| l % 2).collect();
        assert_eq!(offsets(&draw([0.0; 3], &mut stream), &two, 3)[2], 0.0);
        assert_eq!(offsets(&[], &[], 3), [0.0; 3]);
        assert_eq!(offsets(&[3.0, 4.0], &[0, 0], 1), [0.0]);
    }
}
