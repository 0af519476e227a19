//! Loss functions of training.

use super::hyper::LossFunction;
use crate::net::plants;
use furrow_base::math::ToInt;
use furrow_dataset::model::sample::IGNORE;
use tch::{Kind, Reduction, Tensor};

/// Error of a vector that does not matter, pixels: the plant decoder has half of the resolution, and plants of few pixels would have
/// large errors relative to their radius.
const BLUR: f64 = 4.0;

/// Returns the loss of a batch. `logits` is images × classes × height × width, `labels` images × height × width of integers, and
/// `weights` one weight per class. At least one pixel must have a label.
pub(super) fn loss(of: LossFunction, logits: &Tensor, labels: &Tensor, weights: &Tensor) -> Tensor {
    let entropy = logits.cross_entropy_loss(labels, Some(weights), Reduction::Mean, i64::from(IGNORE), 0.0);
    match of {
        LossFunction::Entropy => entropy,
        LossFunction::Dice => entropy + (1.0 - dice(logits, labels)),
    }
}

/// Returns the loss of the plant decoder: the weighted mean over plant pixels of the distance between the vectors relative to the
/// plant's radius and [`BLUR`], and of the difference between the logarithms of the radii. `found` is images × [`plants::CHANNELS`] ×
/// height × width; `targets` has one plane more, the weights. Both are in the units of the decoder. `None` without a plant pixel.
pub(super) fn plants(found: &Tensor, targets: &Tensor) -> Option<Tensor> {
    let weights = targets.narrow(1, plants::CHANNELS.to_i64(), 1);
    let sum = weights.sum(Kind::Float);
    if sum.double_value(&[]) <= 0.0 {
        return None;
    }
    let difference = found - targets.narrow(1, 0, plants::CHANNELS.to_i64());
    let radius = (targets.narrow(1, 2, 1).exp() + BLUR) / plants::UNIT;
    let vectors = difference.narrow(1, 0, 2).abs().sum_dim_intlist(1, true, Kind::Float) / radius;
    let radii = difference.narrow(1, 2, 1).abs();
    Some(((vectors + radii) * weights).sum(Kind::Float) / sum)
}

/// Returns the soft Dice overlap 2 Σ p t / Σ (p + t) over all labelled pixels of a batch, averaged over the classes in its labels.
fn dice(logits: &Tensor, labels: &Tensor) -> Tensor {
    let classes = logits.size()[1];
    let known = labels.ne(i64::from(IGNORE)).unsqueeze(1).to_kind(Kind::Float);
    let truth = labels.clamp_max(classes - 1).one_hot(classes).permute([0, 3, 1, 2]).to_kind(Kind::Float) * &known;
    let found = logits.softmax(1, Kind::Float) * &known;
    let sum = |x: &Tensor| x.sum_dim_intlist([0i64, 2, 3].as_slice(), false, Kind::Float);
    let there = sum(&truth);
    let overlap = sum(&(&found * &truth)) * 2.0 / (sum(&found) + &there).clamp_min(1.0);
    let held = there.gt(0.0).to_kind(Kind::Float);
    (overlap * &held).sum(Kind::Float) / held.sum(Kind::Float)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four pixels, three classes: probabilities (0.5, 0.25, 0.25) everywhere; labels 0, 0, 1 and none. By hand: class 0 has
    /// 2·1 / (1.5 + 2), class 1 has 2·0.25 / (0.75 + 1), with sums of at least 1 in both; no label has class 2.
    #[test]
    fn overlap_is_that_of_the_labelled_pixels_and_the_classes_that_are_held() {
        let logits = Tensor::from_slice(&[0.5f32, 0.25, 0.25]).log().view([1, 3, 1, 1]).expand([1, 3, 2, 2], false);
        let labels = Tensor::from_slice(&[0i64, 0, 1, i64::from(IGNORE)]).view([1, 2, 2]);
        let overlap = 1.0 / 3.5 + 0.25 / 1.75;
        assert!((dice(&logits, &labels).double_value(&[]) - overlap).abs() < 1e-6);
        let entropy = (2.0 * 2.0f64.ln() + 3.0 * 4.0f64.ln()) / 5.0;
        let weights = Tensor::from_slice(&[1.0f32, 3.0, 1.0]);
        let value = |of| loss(of, &logits, &labels, &weights).double_value(&[]);
        assert!((value(LossFunction::Entropy) - entropy).abs() < 1e-6);
        assert!((value(LossFunction::Dice) - (entropy + 1.0 - overlap)).abs() < 1e-6);
    }
}
