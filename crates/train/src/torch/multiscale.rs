//! Multi-scale inference: averages the probabilities of one or more networks over several sizes of an image.

use super::{Model, Outputs, Wanted, values};
use crate::data::Band;
use crate::data::example::nearest;
use crate::data::resize::Input;
use crate::enlarge::classes_at;
use crate::net::plants::{CHANNELS, UNIT};
use crate::refine::{Appearance, Evidence, Examples, Features, Point, Refine, Seen, Vectors, fill, instances};
use furrow_base::math::{ToFloat, ToInt};
use furrow_base::{Error, Result};
use tch::{Kind, Tensor};

/// Largest number of images that the appearance model of a field is learnt from.
const LEARNT: usize = 64;
/// Largest logarithm of a plant's radius that is used: 8,000 pixels.
const LARGEST: f32 = 9.0;
/// Radius of plants whose vectors have half of the weight, pixels of the input.
const RELIABLE: f32 = 40.0;

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
    /// Vectors of the plant decoder at this size, if they are wanted and the first network has one: the mean over the inputs.
    pub vectors: Option<Vectors>,
    /// Points on plants of known class.
    pub points: Vec<Point>,
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

    /// Returns the plant of each pixel of the image at the size `to`, numbered from 1, 0 for none: those that the plant decoder separates, or
    /// connected regions without one. `predicted` holds the class of each pixel, 0 for soil.
    pub fn plants(&self, predicted: &[u8], to: (u32, u32)) -> Vec<u32> {
        let extent = (self.size.0.to_usize(), self.size.1.to_usize());
        let own = classes_at(&self.values, self.size, self.size);
        let found = instances(extent, &own, self.vectors.as_ref());
        let mut plants = nearest(self.size, &found.labels, to);
        fill(&mut plants, predicted, to);
        plants
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
        let (finest, features, vectors) = (self.finest.as_deref(), self.features.as_ref(), self.vectors.as_ref());
        let (pixels, size, points) = (&input.pixels, self.size, &self.points);
        (Seen { pixels, size, bands, finest, features, vectors, points }, &mut self.values)
    }
}

/// Returns the indices of the images that the appearance model is learnt from: at most 64 of `pictures`, at even intervals. The list is
/// empty if the refinement does not use appearance.
pub fn training_images(refine: Refine, pictures: usize) -> Vec<usize> {
    let used = if refine.appearance { pictures.min(LEARNT) } else { 0 };
    (0..used).map(|k| k * pictures / used).collect()
}

/// Learns the appearance model of crop and weeds from the inputs of images of one field, and from points on plants of known class, if
/// there are any. Returns `None` if the images are not sufficient.
pub fn learn(
    models: &[Model],
    refine: Refine,
    bands: &[Band],
    pictures: impl Iterator<Item = Result<(Vec<Input>, Vec<Point>)>>,
) -> Result<Option<Appearance>> {
    let mut examples = Vec::new();
    for inputs in pictures {
        let (inputs, points) = inputs?;
        let seen = Scores { points, ..scores(models, refine, false, &inputs)? };
        examples.extend(seen.examples(refine, &inputs, bands));
    }
    Ok(Appearance::learn(&examples))
}

/// Computes the scores of an image. For one model and one input they are logits; otherwise the sum over inputs of the mean
/// probabilities of the models, at the size of the largest input. With `plants` or the refinement `separate`, the plant decoder is applied.
pub fn scores(models: &[Model], refine: Refine, plants: bool, inputs: &[Input]) -> Result<Scores> {
    let plants = plants || refine.separate;
    let largest = inputs.iter().map(|input| input.size).max_by_key(|(w, h)| u64::from(*w) * u64::from(*h));
    let size = largest.ok_or_else(|| Error::failed("the image has no input sizes"))?;
    if let ([model], [input]) = (models, inputs) {
        let wanted = Wanted { features: refine.appearance, plants };
        let Outputs { scores, features, plants: found } = model.outputs(&input.pixels, size, wanted)?;
        let vectors = found.map(|plants| -> Result<_> {
            let mut sum = WeightedSum::new(size);
            sum.add(&plants, size, size)?;
            Ok(sum.mean())
        });
        let vectors = vectors.transpose()?;
        let values = values(&scores)?;
        return Ok(Scores { values, size, finest: None, features, vectors, points: Vec::new(), are_logits: true });
    }
    let mut sums: Vec<f32> = Vec::new();
    let (mut finest, mut features, mut summed) = (None, None, None::<WeightedSum>);
    for input in inputs {
        let mut mean: Vec<f32> = Vec::new();
        for (k, model) in models.iter().enumerate() {
            let first = refine.appearance && input.size == size && features.is_none();
            let found =
                model.outputs(&input.pixels, input.size, Wanted { features: first, plants: plants && k == 0 })?;
            features = features.or(found.features);
            if let Some(plants) = &found.plants {
                summed.get_or_insert_with(|| WeightedSum::new(size)).add(plants, input.size, size)?;
            }
            add(&mut mean, values(&resized(&found.scores.softmax(1, Kind::Float), input.size, size))?);
        }
        for sum in &mut mean {
            *sum /= models.len().to_f32();
        }
        if input.size == size && inputs.len() > 1 {
            finest = Some(mean.clone());
        }
        add(&mut sums, mean);
    }
    let vectors = summed.map(WeightedSum::mean);
    Ok(Scores { values: sums, size, finest, features, vectors, points: Vec::new(), are_logits: false })
}

/// Weighted sum of the plant decoder's outputs for inputs of several sizes. The weight falls with the radius of the plant in the pixels
/// of the input: training crops contain few plants that are much larger than [`RELIABLE`], and vectors across them are too short.
struct WeightedSum {
    planes: Vec<f32>,
    weights: Vec<f32>,
}

impl WeightedSum {
    fn new(size: (u32, u32)) -> Self {
        let n = size.0.to_usize() * size.1.to_usize();
        Self { planes: vec![0.0; CHANNELS * n], weights: vec![0.0; n] }
    }

    /// Adds the output for an input of the size `from`, converted to pixels of the size `to`.
    fn add(&mut self, plants: &Tensor, from: (u32, u32), to: (u32, u32)) -> Result<()> {
        let n = self.weights.len();
        let found = values(&resized(plants, from, to))?;
        let scale = to.0.to_f32() / from.0.to_f32();
        for at in 0..n {
            let radius = found[2 * n + at].clamp(0.0, LARGEST).exp();
            let weight = 1.0 / (1.0 + (radius / RELIABLE).powi(4));
            self.weights[at] += weight;
            self.planes[at] += weight * UNIT.to_f32() * scale * found[at];
            self.planes[n + at] += weight * UNIT.to_f32() * scale * found[n + at];
            self.planes[2 * n + at] += weight * radius * scale;
        }
        Ok(())
    }

    fn mean(mut self) -> Vectors {
        for plane in self.planes.chunks_exact_mut(self.weights.len().max(1)) {
            plane.iter_mut().zip(&self.weights).for_each(|(sum, weight)| *sum /= weight);
        }
        Vectors { planes: self.planes }
    }
}

/// Resizes maps bilinearly; sample points are pixel centres.
fn resized(maps: &Tensor, from: (u32, u32), to: (u32, u32)) -> Tensor {
    if from == to {
        return maps.shallow_clone();
    }
    tch::no_grad(|| maps.upsample_bilinear2d([i64::from(to.1), i64::from(to.0)], false, None, None))
}

/// Adds values to sums; empty sums are replaced by the values.
fn add(sums: &mut Vec<f32>, values: Vec<f32>) {
    if sums.is_empty() {
        *sums = values;
    } else {
        sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
    }
}
