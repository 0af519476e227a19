//! Gradient accumulation: the gradients of one or more micro-batches for one step of the optimiser.
//!
//! A step uses the mean gradient of several micro-batches, which are computed one after the other in the memory of one. If each
//! has the same number of labelled pixels, this equals the gradient of one large batch, except that the statistics of batch norms
//! and the soft Dice loss are those of a micro-batch.

use crate::torch::Model;
use furrow_base::math::ToFloat;
use tch::Tensor;

/// Sums of gradients over micro-batches, for each parameter.
pub struct Gradients {
    /// Name of each parameter, whether it belongs to the encoder, and its tensor.
    pub(super) parameters: Vec<(String, bool, Tensor)>,
    /// Sum of the gradients of each parameter; undefined if no loss depends on the parameter.
    pub(super) sums: Vec<Tensor>,
    batches: u64,
}

impl Gradients {
    /// Returns gradients of no batch yet, for the trainable parameters of the model whose names `learns` accepts.
    pub fn new(model: &Model, learns: impl Fn(&str) -> bool) -> Self {
        let learning = model.trainable().filter(|(p, _)| learns(&p.name));
        let parameters = learning.map(|(p, t)| (p.name.clone(), p.is_encoder(), t.shallow_clone())).collect();
        Self { parameters, sums: Vec::new(), batches: 0 }
    }

    /// Computes the gradients of a loss and adds them.
    pub fn add(&mut self, loss: &Tensor) {
        let tensors: Vec<&Tensor> = self.parameters.iter().map(|(_, _, tensor)| tensor).collect();
        let found = Tensor::run_backward(&[loss], &tensors, false, false);
        self.batches += 1;
        if self.sums.is_empty() {
            self.sums = found;
            return;
        }
        tch::no_grad(|| {
            for (sum, more) in self.sums.iter_mut().zip(found).filter(|(_, more)| more.defined()) {
                if sum.defined() {
                    let _ = sum.g_add_(&more);
                } else {
                    *sum = more;
                }
            }
        });
    }

    /// Divides the sums by the number of batches.
    #[must_use]
    pub fn mean(mut self) -> Self {
        if self.batches > 1 {
            let share = 1.0 / self.batches.to_f64();
            tch::no_grad(|| {
                for sum in self.sums.iter_mut().filter(|sum| sum.defined()) {
                    let _ = sum.g_mul_scalar_(share);
                }
            });
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::net::Network;
    use crate::torch::{Pass, Placement, Precision};
    use furrow_base::math::ToInt;
    use furrow_base::sampling::{Purpose, Stream};
    use tch::{Device, Kind, Reduction};

    const SINGLE: Placement = Placement { device: Device::Cpu, precision: Precision::Single };

    /// Expected: with batch norms at their running statistics and equal numbers of labelled pixels, three batches of one image give
    /// the gradients of one batch of all three images, up to rounding. Source: linearity of the mean.
    #[test]
    fn small_batches_one_after_the_other_are_a_large_one() {
        let model = Model::new(Network::BasicSegnet, 3, 2, 4, SINGLE);
        let mut stream = Stream::of(3, 0, Purpose::Test, 0);
        let pixels: Vec<f32> = (0..3 * 32 * 32 * 3).map(|_| stream.normal().to_f32()).collect();
        let labels: Vec<i64> = (0..3 * 32 * 32).map(|_| i64::from(stream.chance(0.3))).collect();
        let loss = |range: std::ops::Range<usize>| {
            let x = model.images(&pixels[range.start * 3072..range.end * 3072], (32, 32));
            let y =
                Tensor::from_slice(&labels[range.start * 1024..range.end * 1024]).view([range.len().to_i64(), 32, 32]);
            let none: Option<Tensor> = None;
            model.forward(&x, Pass::Inference).cross_entropy_loss(&y, none, Reduction::Mean, 255, 0.0)
        };
        let mut whole = Gradients::new(&model, |_| true);
        whole.add(&loss(0..3));
        let mut parts = Gradients::new(&model, |_| true);
        (0..3).for_each(|k| parts.add(&loss(k..k + 1)));
        let (whole, parts) = (whole.mean(), parts.mean());
        assert_eq!(whole.sums.len(), model.trainable().count());
        for ((name, _, _), (a, b)) in whole.parameters.iter().zip(whole.sums.iter().zip(&parts.sums)) {
            assert_eq!(a.defined(), b.defined(), "{name}");
            if a.defined() {
                let (size, off) = ((a * a).sum(Kind::Float), ((a - b) * (a - b)).sum(Kind::Float));
                let (size, off) = (size.double_value(&[]).sqrt(), off.double_value(&[]).sqrt());
                assert!(off <= 1e-4 * size + 1e-7, "{name}: {off} of {size}");
            }
        }
    }
}
