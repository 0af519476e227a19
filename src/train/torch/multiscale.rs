//! Multi-scale inference: one picture at several sizes, and the mean of what one network or several say.

use super::Model;
use crate::train::data::Band;
use crate::train::data::resize::Input;
use crate::train::refine::Refine;
use crate::{Error, Result};

/// What networks make of one picture.
pub struct Scores {
    /// Classes × height × width: the highest wins.
    pub values: Vec<f32>,
    /// Their width and height, pixels.
    pub size: (u32, u32),
    /// Of several inputs, the probabilities of the largest alone.
    pub finest: Option<Vec<f32>>,
    /// Whether the values are logits, of one network and one input; sums of probabilities otherwise.
    pub are_logits: bool,
}

impl Scores {
    /// The values as probabilities.
    fn normalize(&mut self) {
        let n = self.size.0 as usize * self.size.1 as usize;
        let values = &mut self.values;
        for at in 0..n {
            let places = (at..values.len()).step_by(n);
            let highest = places.clone().map(|i| values[i]).fold(f32::NEG_INFINITY, f32::max);
            if self.are_logits {
                places.clone().for_each(|i| values[i] = (values[i] - highest).exp());
            }
            let sum: f32 = places.clone().map(|i| values[i]).sum();
            places.for_each(|i| values[i] /= sum);
        }
    }

    /// Refines them by what the picture says as a whole, where that is asked for: probabilities then.
    pub fn refine(&mut self, refine: Refine, inputs: &[Input], bands: &[Band]) {
        let seen = inputs.iter().find(|input| input.size == self.size);
        if let (false, Some(seen)) = (refine.is_none(), seen) {
            self.normalize();
            refine.apply(&seen.pixels, self.size, bands, &mut self.values, self.finest.as_deref());
        }
    }
}

/// The logits of one model on one input; of several models or inputs, sums of their probabilities at the largest size.
pub fn scores(models: &[Model], inputs: &[Input]) -> Result<Scores> {
    let largest = inputs.iter().map(|input| input.size).max_by_key(|(w, h)| u64::from(*w) * u64::from(*h));
    let size = largest.ok_or_else(|| Error::failed("a picture without an input"))?;
    if let ([model], [input]) = (models, inputs) {
        return Ok(Scores { values: model.scores(&input.pixels, size)?, size, finest: None, are_logits: true });
    }
    let mut values: Vec<f32> = Vec::new();
    let mut finest = None;
    for input in inputs {
        let mut mean: Vec<f32> = Vec::new();
        for model in models {
            add(&mut mean, model.probabilities(&input.pixels, input.size, size)?);
        }
        for sum in &mut mean {
            *sum /= models.len() as f32;
        }
        if input.size == size && inputs.len() > 1 {
            finest = Some(mean.clone());
        }
        add(&mut values, mean);
    }
    Ok(Scores { values, size, finest, are_logits: false })
}

/// Adds values to sums, which begin empty.
fn add(sums: &mut Vec<f32>, values: Vec<f32>) {
    if sums.is_empty() {
        *sums = values;
    } else {
        sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
    }
}
