//! Multi-scale inference: averages the probabilities of one or more networks over several sizes of an image.

use super::{Model, values};
use crate::data::Band;
use crate::data::resize::Input;
use crate::refine::{Appearance, Evidence, Examples, Features, Refine, Seen};
use furrow_base::math::{ToFloat, ToInt};
use furrow_base::{Error, Result};
use tch::Kind;

/// Largest number of images that the appearance model of a field is learnt from.
const LEARNT: usize = 64;

/// Scores of the classes for one image.
pub struct Scores {
    /// Scores, classes × height × width. The class with the highest score is predicted.
    pub values: Vec<f32>,
    /// Width and height of the scores, pixels.
    pub size: (u32, u32),
    /// Probabilities of the largest input alone, if there are several inputs.
    pub finest: Option<Vec<f32>>,
    /// Encoder features of the first network for the largest input, if requested.
    pub features: Option<Features>,
    /// `true` if the values are logits (one network and one input); otherwise they are sums of probabilities.
    pub are_logits: bool,
}

impl Scores {
    /// Converts the values to probabilities.
    fn normalize(&mut self) {
        let n = self.size.0.to_usize() * self.size.1.to_usize();
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

    /// Applies the refinement, if there is one; the values are probabilities afterwards. `inputs` are the network's inputs for the image.
    /// Returns what changed, `None` without refinement.
    pub fn refine(
        &mut self,
        refine: Refine,
        inputs: &[Input],
        bands: &[Band],
        appearance: Option<&Appearance>,
    ) -> Option<Evidence> {
        let input = inputs.iter().find(|input| input.size == self.size).filter(|_| !refine.is_none())?;
        self.normalize();
        let (seen, probabilities) = self.seen(input, bands);
        Some(refine.apply(&seen, probabilities, appearance))
    }

    /// Returns the plants of the image as examples for the appearance model of its field.
    fn examples(mut self, refine: Refine, inputs: &[Input], bands: &[Band]) -> Option<Examples> {
        let input = inputs.iter().find(|input| input.size == self.size)?;
        self.normalize();
        let (seen, probabilities) = self.seen(input, bands);
        refine.examples(&seen, probabilities)
    }

    /// Returns the input of refinement: the image at the largest size, and the values to refine.
    fn seen<'a>(&'a mut self, input: &'a Input, bands: &'a [Band]) -> (Seen<'a>, &'a mut [f32]) {
        let (finest, features) = (self.finest.as_deref(), self.features.as_ref());
        (Seen { pixels: &input.pixels, size: self.size, bands, finest, features }, &mut self.values)
    }
}

/// Returns the indices of the images that the appearance model is learnt from: at most 64 of `pictures`, at even intervals. The list is
/// empty if the refinement does not use appearance.
pub fn training_images(refine: Refine, pictures: usize) -> Vec<usize> {
    let used = if refine.appearance { pictures.min(LEARNT) } else { 0 };
    (0..used).map(|k| k * pictures / used).collect()
}

/// Learns the appearance model of crop and weeds from the inputs of images of one field. Returns `None` if the images are not
/// sufficient.
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

/// Computes the scores of an image. For one model and one input they are logits; otherwise the sum over inputs of the mean
/// probabilities of the models, at the size of the largest input.
pub fn scores(models: &[Model], refine: Refine, inputs: &[Input]) -> Result<Scores> {
    let largest = inputs.iter().map(|input| input.size).max_by_key(|(w, h)| u64::from(*w) * u64::from(*h));
    let size = largest.ok_or_else(|| Error::failed("the image has no input sizes"))?;
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
            *sum /= models.len().to_f32();
        }
        if input.size == size && inputs.len() > 1 {
            finest = Some(mean.clone());
        }
        add(&mut sums, mean);
    }
    Ok(Scores { values: sums, size, finest, features, are_logits: false })
}

/// Adds values to sums; empty sums are replaced by the values.
fn add(sums: &mut Vec<f32>, values: Vec<f32>) {
    if sums.is_empty() {
        *sums = values;
    } else {
        sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
    }
}
