//! Multi-scale inference: one picture at several sizes, and the mean of what the network says.

use super::Model;
use crate::train::data::Band;
use crate::train::data::resize::Input;
use crate::train::refine::Refine;
use crate::{Error, Result};

/// What a network makes of one picture.
pub struct Scores {
    /// Classes × height × width: the highest wins. Logits of one input, sums of probabilities of several.
    pub values: Vec<f32>,
    /// Their width and height, pixels.
    pub size: (u32, u32),
    /// Of several inputs, the probabilities of the largest alone.
    pub finest: Option<Vec<f32>>,
}

impl Scores {
    /// The values as probabilities; `inputs` is how many they are of.
    fn normalize(&mut self, inputs: usize) {
        let n = self.size.0 as usize * self.size.1 as usize;
        let values = &mut self.values;
        for at in 0..n {
            let places = (at..values.len()).step_by(n);
            let highest = places.clone().map(|i| values[i]).fold(f32::NEG_INFINITY, f32::max);
            if inputs == 1 {
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
            self.normalize(inputs.len());
            refine.apply(&seen.pixels, self.size, bands, &mut self.values, self.finest.as_deref());
        }
    }
}

/// The values of one input; of several, the mean of their probabilities at the largest size.
pub fn scores(model: &Model, inputs: &[Input]) -> Result<Scores> {
    let largest = inputs.iter().map(|input| input.size).max_by_key(|(w, h)| u64::from(*w) * u64::from(*h));
    let size = largest.ok_or_else(|| Error::failed("a picture without an input"))?;
    if let [input] = inputs {
        return Ok(Scores { values: model.scores(&input.pixels, size)?, size, finest: None });
    }
    let mut values: Vec<f32> = Vec::new();
    let mut finest = None;
    for input in inputs {
        let found = model.probabilities(&input.pixels, input.size, size)?;
        if input.size == size {
            finest = Some(found.clone());
        }
        if values.is_empty() {
            values = found;
        } else {
            values.iter_mut().zip(found).for_each(|(sum, p)| *sum += p);
        }
    }
    Ok(Scores { values, size, finest })
}
