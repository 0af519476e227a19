//! Class-bias calibration: the biases of the last convolution, set anew after training.
//!
//! Losses that serve small plants, and crops centred on rare-class pixels, make a network over-predict plants: their predicted outlines
//! lie outside of the labels'. So the bias of each class is set again on some labelled images, for the best mean intersection over
//! union. All other weights stay, and so does the file's form.

use crate::dataset::sample::IGNORE;
use crate::train::data::{Normalization, Store, augment};
use crate::train::torch::Model;
use crate::train::weights::Array;
use crate::{Error, Result};

/// The biases that are set.
pub(super) const HEAD: &str = "head.conv.bias";
/// One of so many pixels is used: a prime, so that columns take turns.
const THINNED: usize = 5;
/// Most that a bias changes, either way: odds of fifty to one.
const MOST: f32 = 4.0;
/// The biases depend on each other; so many rounds of coordinate ascent settle that.
const ROUNDS: usize = 3;

/// The weights of a model with calibrated class biases: those of the best mean I/U over the classes that occur, on `images` images of
/// the store, evenly picked. The bias of the first class stays as it is, and so do those of classes that none of the images has.
pub fn calibrate(model: &Model, store: &Store, normalization: &Normalization, images: u64) -> Result<Vec<Array>> {
    let shape = store.shape();
    let (mut values, mut labels) = (Vec::new(), Vec::new());
    let images = (images as usize).min(store.len());
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
    let head = head.ok_or_else(|| Error::input(format!("this network has no `{HEAD}` to set")))?;
    head.values.iter_mut().zip(offsets(&values, &labels, model.classes)).for_each(|(bias, offset)| *bias += offset);
    Ok(arrays)
}

/// What is added to the classes' biases for the best overlap with the labels, at most [`MOST`] either way. `values` are the scores of
/// all classes of a pixel, pixel after pixel. Class by class: in the order of its margin over the others, pixels change to it from the
/// class that they are predicted to be without it, and the best of all these states is kept.
fn offsets(values: &[f32], labels: &[u8], classes: usize) -> Vec<f32> {
    let mut offsets = vec![0.0f32; classes];
    let mut counts = vec![0; classes];
    for label in labels {
        counts[usize::from(*label)] += 1;
    }
    for _ in 0..ROUNDS {
        for class in (1..classes).filter(|class| counts[*class] > 0) {
            let mut overlap = Overlap { labelled: &counts, predicted: vec![0; classes], correct: vec![0; classes] };
            // How far the class leads over the highest other, that one, and the label.
            let mut leads: Vec<(f32, u8, u8)> = Vec::with_capacity(labels.len());
            for (pixel, label) in values.chunks_exact(classes).zip(labels) {
                let others =
                    (0..classes).filter(|other| *other != class).map(|other| (pixel[other] + offsets[other], other));
                let (value, other) =
                    others.fold((f32::NEG_INFINITY, 0), |best, next| if next.0 > best.0 { next } else { best });
                overlap.count(other, usize::from(*label), true);
                leads.push((pixel[class] - value, other as u8, *label));
            }
            leads.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
            let mut best = (f64::NEG_INFINITY, offsets[class]);
            for (k, (lead, other, label)) in leads.iter().enumerate() {
                overlap.count(usize::from(*other), usize::from(*label), false);
                overlap.count(class, usize::from(*label), true);
                // Half way to the next, so that rounding changes no prediction.
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

/// Pixels of each class: labelled, predicted, and both.
struct Overlap<'a> {
    labelled: &'a [u64],
    predicted: Vec<u64>,
    correct: Vec<u64>,
}

impl Overlap<'_> {
    /// Counts a prediction, or takes it out again.
    fn count(&mut self, prediction: usize, label: usize, more: bool) {
        let change = |n: &mut u64| if more { *n += 1 } else { *n -= 1 };
        change(&mut self.predicted[prediction]);
        if prediction == label {
            change(&mut self.correct[prediction]);
        }
    }

    /// Mean I/U of the classes that have labels.
    fn mean(&self) -> f64 {
        let held = (0..self.labelled.len()).filter(|class| self.labelled[*class] > 0);
        let each =
            held.map(|c| self.correct[c] as f64 / (self.labelled[c] + self.predicted[c] - self.correct[c]) as f64);
        let (sum, n) = each.fold((0.0, 0.0f64), |(sum, n), value| (sum + value, n + 1.0));
        sum / n.max(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Purpose, Stream};

    /// Rationale: a network that over-predicts a class draws it too wide. Expected: scores of three classes with noise, to two of which
    /// a bias was added: calibration undoes it, to a quarter. Without the third class its bias stays. Source: the scores' construction.
    #[test]
    fn calibration_undoes_a_class_bias() {
        let mut stream = Stream::of(7, 0, Purpose::Test, 0);
        let labels: Vec<u8> = (0..40_000).map(|k| if k % 10 == 0 { 1 } else { 2 * u8::from(k % 25 == 3) }).collect();
        let draw = |added: [f32; 3], stream: &mut Stream| -> Vec<f32> {
            let of = |class: usize, label: u8, noise: f64| {
                let logarithm: f32 = [0.86f32, 0.1, 0.04][class].ln();
                logarithm + added[class] + if usize::from(label) == class { 4.0 } else { 0.0 } + noise as f32
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
