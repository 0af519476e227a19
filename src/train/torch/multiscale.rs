//! Multi-scale inference: one picture at several sizes, and the mean of what the network says.

use super::Model;
use crate::train::data::resize::Input;
use crate::{Error, Result};

/// What a network makes of one picture.
pub struct Scores {
    /// Classes × height × width: the highest wins.
    pub values: Vec<f32>,
    /// Their width and height, pixels.
    pub size: (u32, u32),
}

/// The values of one input; of several, the mean of their probabilities at the largest size.
pub fn scores(model: &Model, inputs: &[Input]) -> Result<Scores> {
    let largest = inputs.iter().map(|input| input.size).max_by_key(|(w, h)| u64::from(*w) * u64::from(*h));
    let size = largest.ok_or_else(|| Error::failed("a picture without an input"))?;
    if let [input] = inputs {
        return Ok(Scores { values: model.scores(&input.pixels, size)?, size });
    }
    let mut values: Vec<f32> = Vec::new();
    for input in inputs {
        let found = model.probabilities(&input.pixels, input.size, size)?;
        if values.is_empty() {
            values = found;
        } else {
            values.iter_mut().zip(found).for_each(|(sum, p)| *sum += p);
        }
    }
    Ok(Scores { values, size })
}
