//! Optimisers. The state of libtorch's own optimisers cannot be saved, but is needed to resume a training.

use super::gradients::Gradients;
use super::hyper::OptimiserKind;
use crate::torch::{Model, laid, values};
use crate::weights::Array;
use furrow_base::Result;
use furrow_base::math::ToInt;
use std::collections::BTreeMap;
use tch::Tensor;

/// Optimiser with its state.
pub struct Optimiser {
    kind: OptimiserKind,
    decay: f64,
    /// Number of completed steps, for Adam's bias correction.
    steps: i32,
    /// State tensors, named `velocity/NAME`, `first/NAME` or `squares/NAME` for the parameter `NAME`.
    memory: BTreeMap<String, Tensor>,
}

const MOMENTUM: f64 = 0.9;
const SECOND: f64 = 0.999;
const EPSILON: f64 = 1e-8;

impl Optimiser {
    /// Returns an optimiser after `steps` steps with the state `memory` of a checkpoint; empty for a new training.
    pub fn new(kind: OptimiserKind, decay: f64, steps: u64, memory: &[Array], model: &Model) -> Self {
        let laid = |array: &Array| (array.name.clone(), laid(&array.shape, &array.values, model.place.device));
        let all = memory.iter().map(laid).collect();
        Self { kind, decay, steps: steps.to_i32(), memory: all }
    }

    /// Makes one step with the learning rate `rate`; the rate of the encoder is `encoder` times that.
    pub fn step(&mut self, mut gradients: Gradients, rate: f64, encoder: f64) {
        self.steps += 1;
        tch::no_grad(|| {
            for ((name, in_encoder, tensor), gradient) in gradients.parameters.iter_mut().zip(&gradients.sums) {
                if gradient.defined() {
                    let rate = if *in_encoder { rate * encoder } else { rate };
                    self.update(name, tensor, gradient, rate);
                }
            }
        });
    }

    fn remembered(&mut self, what: &str, name: &str, like: &Tensor) -> Tensor {
        self.memory.entry(format!("{what}/{name}")).or_insert_with(|| like.zeros_like()).shallow_clone()
    }

    /// Updates one parameter. Each line below reads and writes a tensor once, and memory bandwidth limits the speed.
    fn update(&mut self, name: &str, weight: &mut Tensor, gradient: &Tensor, rate: f64) {
        match self.kind {
            OptimiserKind::Sgd => {
                let mut velocity = self.remembered("velocity", name, weight);
                let _ = velocity.g_mul_scalar_(MOMENTUM);
                let _ = velocity.g_add_(gradient);
                let _ = velocity.g_add_(&(&*weight * self.decay));
                let _ = weight.g_sub_(&(velocity * rate));
            }
            OptimiserKind::Adam => {
                let mut first = self.remembered("first", name, weight);
                // Σ SECOND^age · gradient²: the second moment without its factor 1 − SECOND.
                let mut squares = self.remembered("squares", name, weight);
                let _ = first.lerp_(gradient, 1.0 - MOMENTUM);
                let _ = squares.g_mul_scalar_(SECOND);
                let _ = squares.addcmul_(gradient, gradient);
                let (c1, c2) = (1.0 - MOMENTUM.powi(self.steps), 1.0 - SECOND.powi(self.steps));
                let root = ((1.0 - SECOND) / c2).sqrt();
                // −(c1 / rate) · (√second moment + EPSILON)
                let mut divisor = squares.sqrt();
                let _ = divisor.g_add_scalar_(EPSILON / root);
                let _ = divisor.g_mul_scalar_(-root * c1 / rate);
                let _ = weight.g_mul_scalar_(1.0 - rate * self.decay);
                let _ = weight.addcdiv_(&first, &divisor);
            }
        }
    }

    /// Returns the state tensors, sorted by name.
    pub fn arrays(&self) -> Result<Vec<Array>> {
        let array = |(name, tensor): (&String, &Tensor)| {
            let shape = tensor.size().iter().map(|n| n.to_usize()).collect();
            Ok(Array { name: name.clone(), shape, values: values(tensor)? })
        };
        self.memory.iter().map(array).collect()
    }
}
