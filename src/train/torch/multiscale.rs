//! Multi-scale inference: one picture at several sizes, and the mean of what one network or several say.

use super::{Model, values};
use crate::train::data::Band;
use crate::train::data::resize::Input;
use crate::train::refine::{Appearance, Examples, Features, Refine, Seen};
use crate::{Error, Result};
use tch::Kind;

/// Pictures that the appearance of a field is learnt from at most.
const LEARNT: usize = 64;

/// What networks make of one picture.
pub struct Scores {
    /// Classes × height × width: the highest wins.
    pub values: Vec<f32>,
    /// Their width and height, pixels.
    pub size: (u32, u32),
    /// Of several inputs, the probabilities of the largest alone.
    pub finest: Option<Vec<f32>>,
    /// What the encoder of the first network makes of the largest input, where it is asked for.
    pub features: Option<Features>,
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
    pub fn refine(&mut self, refine: Refine, inputs: &[Input], bands: &[Band], appearance: Option<&Appearance>) {
        if let (false, Some(input)) = (refine.is_none(), inputs.iter().find(|input| input.size == self.size)) {
            self.normalize();
            let (seen, probabilities) = self.seen(input, bands);
            refine.apply(&seen, probabilities, appearance);
        }
    }

    /// The plants of the picture as examples to learn the appearance of its field from.
    fn examples(mut self, refine: Refine, inputs: &[Input], bands: &[Band]) -> Option<Examples> {
        let input = inputs.iter().find(|input| input.size == self.size)?;
        self.normalize();
        let (seen, probabilities) = self.seen(input, bands);
        refine.examples(&seen, probabilities)
    }

    /// The picture at the largest size, and the values.
    fn seen<'a>(&'a mut self, input: &'a Input, bands: &'a [Band]) -> (Seen<'a>, &'a mut [f32]) {
        let (finest, features) = (self.finest.as_deref(), self.features.as_ref());
        (Seen { pixels: &input.pixels, size: self.size, bands, finest, features }, &mut self.values)
    }
}

/// The places of the pictures that the appearance of a field is learnt from, evenly picked among so many; none unless it is asked for.
pub fn learnt_from(refine: Refine, pictures: usize) -> Vec<usize> {
    let used = if refine.appearance { pictures.min(LEARNT) } else { 0 };
    (0..used).map(|k| k * pictures / used).collect()
}

/// What crop and weeds look like on the field that these pictures show; none where they say too little.
pub fn learn(
    models: &[Model],
    refine: Refine,
    bands: &[Band],
    pictures: impl Iterator<Item = Result<Vec<Input>>>,
) -> Result<Option<Appearance>> {
    let mut examples = Vec::new();
    for inputs in pictures {
        let inputs = inputs?;
        examples.extend(scores(models, refine, &inputs)?.examples(refine, &inputs, bands));
    }
    Ok(Appearance::learn(&examples))
}

/// The logits of one model on one input; of several models or inputs, sums of their probabilities at the largest size.
pub fn scores(models: &[Model], refine: Refine, inputs: &[Input]) -> Result<Scores> {
    let largest = inputs.iter().map(|input| input.size).max_by_key(|(w, h)| u64::from(*w) * u64::from(*h));
    let size = largest.ok_or_else(|| Error::failed("a picture without an input"))?;
    if let ([model], [input]) = (models, inputs) {
        let (values, features) = if refine.appearance {
            let (scores, features) = model.scores_and_features(&input.pixels, size)?;
            (values(&scores)?, Some(features))
        } else {
            (model.scores(&input.pixels, size)?, None)
        };
        return Ok(Scores { values, size, finest: None, features, are_logits: true });
    }
    let mut sums: Vec<f32> = Vec::new();
    let (mut finest, mut features) = (None, None);
    for input in inputs {
        let mut mean: Vec<f32> = Vec::new();
        for model in models {
            let found = if refine.appearance && input.size == size && features.is_none() {
                let (scores, found) = model.scores_and_features(&input.pixels, size)?;
                features = Some(found);
                values(&scores.softmax(1, Kind::Float))?
            } else {
                model.probabilities(&input.pixels, input.size, size)?
            };
            add(&mut mean, found);
        }
        for sum in &mut mean {
            *sum /= models.len() as f32;
        }
        if input.size == size && inputs.len() > 1 {
            finest = Some(mean.clone());
        }
        add(&mut sums, mean);
    }
    Ok(Scores { values: sums, size, finest, features, are_logits: false })
}

/// Adds values to sums, which begin empty.
fn add(sums: &mut Vec<f32>, values: Vec<f32>) {
    if sums.is_empty() {
        *sums = values;
    } else {
        sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
    }
}
