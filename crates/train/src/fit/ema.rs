//! EMA: exponential moving average of the weights, which fluctuates less than the weights of single steps.
//!
//! After step t with weights w, the average a becomes a + (1 − d)(w − a). The decay d is the smaller of the requested decay and
//! (1 + t) / (10 + t), so that the random initial weights soon lose their influence. Running means and variances of batch norms are
//! averaged as well.
//! Sources: Polyak & Juditsky 1992; Tan & Le 2019 (decay 0.9999); the warm-up is TensorFlow's `ExponentialMovingAverage`.

use crate::torch::Model;
use crate::weights::Array;
use furrow_base::Result;
use furrow_base::math::ToFloat;

/// Network with averaged weights, next to the network that is trained.
pub struct Ema {
    decay: f64,
    model: Model,
}

impl Ema {
    /// Returns an average with this decay, initialised with `saved` from a checkpoint, or with the weights of `model` if `saved` is
    /// empty.
    pub fn new(decay: f64, saved: &[Array], model: &Model) -> Result<Self> {
        let own = if saved.is_empty() { model.arrays()? } else { saved.to_vec() };
        let model = Model::with(model.network, model.bands, model.classes, &own, model.place)?;
        Ok(Self { decay, model })
    }

    /// Updates the average with the weights after `step` steps.
    pub fn update(&mut self, model: &Model, step: u64) {
        self.model.approach(model, 1.0 - decay(self.decay, step));
    }

    /// Returns the network with the averaged weights.
    pub fn model(&self) -> &Model {
        &self.model
    }
}

/// Returns the decay of a step: at most `most`, smaller in the first steps.
fn decay(most: f64, step: u64) -> f64 {
    most.min((1.0 + step.to_f64()) / (10.0 + step.to_f64()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::net::Network;
    use crate::torch::{Placement, Precision};
    use tch::Device;

    const SINGLE: Placement = Placement { device: Device::Cpu, precision: Precision::Single };

    /// Expected: with weights w₁ … wₙ the average is w₀ Π dₖ + Σ wₖ (1 − dₖ) Πⱼ dⱼ with j > k, for trained weights and running
    /// statistics; an average that is saved and restored after each step ends with the same bits. Source: the unrolled recursion.
    #[test]
    fn an_average_is_the_sum_of_what_it_took_in() {
        let at = |seed| Model::new(Network::BasicSegnet, 3, 2, seed, SINGLE);
        let (most, steps) = (0.6, 6);
        let values =
            |model: &Model| -> Vec<f32> { model.arrays().unwrap().iter().flat_map(|a| a.values.clone()).collect() };
        let mut ema = Ema::new(most, &[], &at(0)).unwrap();
        let mut again = Ema::new(most, &[], &at(0)).unwrap();
        for step in 1..=steps {
            ema.update(&at(step), step);
            again.update(&at(step), step);
            again = Ema::new(most, &again.model().arrays().unwrap(), &at(99)).unwrap();
        }
        assert_eq!(values(ema.model()), values(again.model()));
        let decays: Vec<f64> = (0..=steps).map(|t| if t == 0 { 0.0 } else { decay(most, t) }).collect();
        let left = |k: usize| (1.0 - decays[k]) * decays[k + 1..].iter().product::<f64>();
        let all: Vec<Vec<f32>> = (0..=steps).map(|t| values(&at(t))).collect();
        for (i, found) in values(ema.model()).into_iter().enumerate() {
            let expected: f64 = (0..all.len()).map(|k| left(k) * f64::from(all[k][i])).sum();
            assert!((f64::from(found) - expected).abs() < 1e-5, "{i}: {found} for {expected}");
        }
        assert_eq!(decay(0.998, 1), 2.0 / 11.0);
        assert_eq!(decay(0.998, 100_000), 0.998);
    }
}
