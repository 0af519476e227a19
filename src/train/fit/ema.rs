//! EMA: an exponential moving average of the weights, steadier than the last step's.
//!
//! After step t the average a becomes a + (1 − d)(w − a), with d the smaller of the decay asked for and (1 + t) / (10 + t): so the
//! random beginning is soon forgotten. Running means and variances of batch norms are averaged with the weights that they belong to.
//! Sources: Polyak & Juditsky 1992; Tan & Le 2019 (decay 0.9999); the warm-up is TensorFlow's `ExponentialMovingAverage`.

use crate::Result;
use crate::train::torch::Model;
use crate::train::weights::Array;

/// The averaged network beside the one that learns.
pub struct Ema {
    decay: f64,
    model: Model,
}

impl Ema {
    /// An average with this decay: of a checkpoint's values, or at the beginning of a training of the network's own.
    pub fn new(decay: f64, saved: &[Array], model: &Model) -> Result<Self> {
        let own = if saved.is_empty() { model.arrays()? } else { saved.to_vec() };
        let model = Model::with(model.network, model.bands, model.classes, &own, model.place)?;
        Ok(Self { decay, model })
    }

    /// Takes in the weights after `step` steps.
    pub fn update(&mut self, model: &Model, step: u64) {
        self.model.approach(model, 1.0 - decay(self.decay, step));
    }

    /// The network with the averaged weights.
    pub fn model(&self) -> &Model {
        &self.model
    }
}

/// The decay of a step, smaller at first.
fn decay(most: f64, step: u64) -> f64 {
    most.min((1.0 + step as f64) / (10.0 + step as f64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::net::Network;
    use crate::train::torch::{Precision, Where};
    use tch::Device;

    const SINGLE: Where = Where { device: Device::Cpu, precision: Precision::Single };

    /// Expected: with weights w₁ … wₙ the average is w₀ Π dₖ + Σ wₖ (1 − dₖ) Πⱼ dⱼ, j after k, for trained weights and running statistics
    /// alike; one that is read back in the middle ends with the same bits. Source: the recursion, unrolled.
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
