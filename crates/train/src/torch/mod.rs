//! Computes networks with libtorch.
//!
//! Images and weights are stored as height × width × bands ("channels last"), with which convolutions are faster on CPUs and GPUs.

mod compute;
pub mod device;
mod guard;
mod memory;
pub mod multiscale;

use super::net::{Extras, Network, Parameter, film, matching};
use super::refine::Features;
use super::weights::Array;
use compute::Compute;
use furrow_base::math::{ToFloat, ToInt};
use furrow_base::{Error, Result};
use std::collections::BTreeMap;
/// The bindings of libtorch that networks are computed with.
pub use tch;
use tch::{Device, Kind, Tensor};

pub use compute::Pass;
pub use device::{Placement, Precision};
pub use guard::guarded;

/// Number of times the finer encoder features are halved: cells of 8 pixels.
const FINE: usize = 3;

/// Outputs of a network besides the scores.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Wanted {
    /// Encoder features.
    pub features: bool,
    /// The plant decoder's, if there is one.
    pub plants: bool,
}

/// Outputs of a network for one image.
pub(super) struct Outputs {
    /// Logits, 1 × classes × height × width.
    pub scores: Tensor,
    /// Encoder features.
    pub features: Option<Features>,
    /// Output of the plant decoder, 1 × [`CHANNELS`](crate::net::plants::CHANNELS) × height × width.
    pub plants: Option<Tensor>,
}

/// Network with its parameters on a device.
pub struct Model {
    /// Network.
    pub network: Network,
    /// Number of input bands.
    pub bands: usize,
    /// Number of classes.
    pub classes: usize,
    /// Whether it has a plant decoder.
    pub has_plants: bool,
    /// Device and precision.
    pub place: Placement,
    list: Vec<Parameter>,
    tensors: BTreeMap<String, Tensor>,
}

impl Model {
    /// Returns a network with random initial values, which depend only on the seed.
    pub fn new(network: Network, bands: usize, classes: usize, seed: u64, place: Placement) -> Self {
        Self::with_extras(network, bands, classes, Extras::default(), seed, place)
    }

    /// Like [`Self::new`], for a network with these optional parts.
    pub fn with_extras(
        network: Network,
        bands: usize,
        classes: usize,
        extras: Extras,
        seed: u64,
        place: Placement,
    ) -> Self {
        let list = extras.parameters(network, bands, classes);
        let tensors =
            list.iter().enumerate().map(|(i, p)| (p.name.clone(), tensor(p, &p.begin(seed, i), place.device)));
        let tensors = tensors.collect();
        Self { network, bands, classes, has_plants: extras.plants, place, list, tensors }
    }

    /// Returns a network with these values and the optional parts that they contain. An error names the array that does not match.
    pub fn with(network: Network, bands: usize, classes: usize, arrays: &[Array], place: Placement) -> Result<Self> {
        let mut model = Self::with_extras(network, bands, classes, Extras::of(arrays), 0, place);
        model.load(arrays)?;
        Ok(model)
    }

    /// Replaces the values by name. All parameters must be present in their shapes; other arrays are ignored.
    pub fn load(&mut self, arrays: &[Array]) -> Result<()> {
        let found = matching(&self.list, arrays).map_err(|what| {
            let Self { bands, classes, .. } = self;
            let network = self.network.name();
            Error::input(format!(
                "these weights are not those of {network} with {bands} bands and {classes} classes: {what}"
            ))
        })?;
        for (parameter, array) in self.list.iter().zip(found) {
            self.tensors.insert(parameter.name.clone(), tensor(parameter, &array.values, self.place.device));
        }
        Ok(())
    }

    /// Returns all values, including running means and variances, in the order of the network.
    pub fn arrays(&self) -> Result<Vec<Array>> {
        self.list
            .iter()
            .map(|p| {
                Ok(Array { name: p.name.clone(), shape: p.shape.clone(), values: values(&self.tensors[&p.name])? })
            })
            .collect()
    }

    /// Interpolates all values, including running means and variances, by the fraction `share` towards another model of the same
    /// network.
    pub fn approach(&mut self, other: &Self, share: f64) {
        tch::no_grad(|| {
            for (name, tensor) in &mut self.tensors {
                let _ = tensor.lerp_(&other.tensors[name], share);
            }
        });
    }

    /// Returns the trainable parameters and their tensors, in the order of the network.
    pub fn trainable(&self) -> impl Iterator<Item = (&Parameter, &Tensor)> {
        self.list.iter().filter(|p| p.role.is_trainable()).map(|p| (p, &self.tensors[&p.name]))
    }

    /// Computes logits: images × bands × height × width to images × classes × height × width, in single precision.
    pub fn forward(&self, x: &Tensor, pass: Pass) -> Tensor {
        self.walk(x, pass).to_kind(Kind::Float)
    }

    /// Computes logits like [`Self::forward`], with these species as the crops of each image; an image without any has crops of any
    /// kind.
    pub fn forward_named(&self, x: &Tensor, pass: Pass, crops: &[Vec<u8>]) -> Tensor {
        let mut compute = Compute { crops: self.embeddings(crops), ..self.compute(pass) };
        self.network.walk(&mut compute, x, self.bands, self.classes).to_kind(Kind::Float)
    }

    /// Computes logits like [`Self::forward`], in the precision of the last convolution.
    pub(super) fn walk(&self, x: &Tensor, pass: Pass) -> Tensor {
        self.network.walk(&mut self.compute(pass), x, self.bands, self.classes)
    }

    fn compute(&self, pass: Pass) -> Compute<'_> {
        let (tensors, precision) = (&self.tensors, self.place.precision);
        let (features, crops, plants) = (None, None, None);
        Compute { tensors, precision, pass, features, crops, wants_plants: false, plants, wants_classes: true }
    }

    /// Applies the plant decoder alone: images × bands × height × width to images × [`CHANNELS`](crate::net::plants::CHANNELS) × height ×
    /// width, in single precision.
    ///
    /// # Errors
    /// If the network has no plant decoder.
    pub fn forward_plants(&self, x: &Tensor, pass: Pass) -> Result<Tensor> {
        if !self.has_plants {
            return Err(Error::failed("this network has no plant decoder"));
        }
        let mut compute = Compute { wants_plants: true, wants_classes: false, ..self.compute(pass) };
        Ok(self.network.walk(&mut compute, x, self.bands, self.classes).to_kind(Kind::Float))
    }

    /// Returns the mean embedding of each image's crops, images × [`film::WIDTH`]; zero for an image without a named crop. `None` if no
    /// image has one, or if the network does not take the crop as an input.
    fn embeddings(&self, crops: &[Vec<u8>]) -> Option<Tensor> {
        let embedding = self.tensors.get(film::EMBEDDING).filter(|_| crops.iter().any(|crops| !crops.is_empty()))?;
        let species = embedding.size()[0];
        let mut shares = vec![0.0; crops.len() * species.to_usize()];
        for (row, crops) in shares.chunks_exact_mut(species.to_usize()).zip(crops) {
            for crop in crops {
                row[usize::from(*crop)] += 1.0 / crops.len().to_f32();
            }
        }
        let shares = Tensor::from_slice(&shares).view([crops.len().to_i64(), species]);
        Some(shares.to_device(self.place.device).matmul(embedding))
    }

    /// Predicts the class of each pixel of one or more images, stored as images × height × width × bands.
    pub fn predict(&self, pixels: &[f32], (width, height): (u32, u32)) -> Result<Vec<u8>> {
        let x = self.input(pixels, (width, height))?;
        classes(&tch::no_grad(|| self.forward(&x, Pass::Inference)))
    }

    /// Returns the logits as images × classes × height × width. Images are stored as in [`Self::predict`].
    pub fn scores(&self, pixels: &[f32], size: (u32, u32)) -> Result<Vec<f32>> {
        let x = self.input(pixels, size)?;
        values(&tch::no_grad(|| self.forward(&x, Pass::Inference)))
    }

    /// Returns the class probabilities of one image, resized bilinearly to the size `to`; sample points are pixel centres.
    pub fn probabilities(&self, pixels: &[f32], size: (u32, u32), to: (u32, u32)) -> Result<Vec<f32>> {
        let x = self.input(pixels, size)?;
        values(&tch::no_grad(|| {
            let found = self.forward(&x, Pass::Inference).softmax(1, Kind::Float);
            if size == to {
                return found;
            }
            found.upsample_bilinear2d([i64::from(to.1), i64::from(to.0)], false, None, None)
        }))
    }

    /// Returns the logits of one image and, of the further outputs, those that are `wanted`.
    pub(super) fn outputs(&self, pixels: &[f32], size: (u32, u32), wanted: Wanted) -> Result<Outputs> {
        let mut compute = self.compute(Pass::Inference);
        compute.features = wanted.features.then(BTreeMap::new);
        compute.wants_plants = wanted.plants && self.has_plants;
        let x = self.input(pixels, size)?;
        let scores = tch::no_grad(|| self.network.walk(&mut compute, &x, self.bands, self.classes));
        let features = compute.features.map(|features| self.features(&features)).transpose()?;
        let plants = compute.plants.map(|plants| plants.to_kind(Kind::Float));
        Ok(Outputs { scores: scores.to_kind(Kind::Float), features, plants })
    }

    /// Joins encoder features with cells of 8 and of 16 pixels, both in cells of 8.
    fn features(&self, features: &BTreeMap<usize, Tensor>) -> Result<Features> {
        let (Some(fine), Some(coarse)) = (features.get(&FINE), features.get(&(FINE + 1))) else {
            return Err(Error::failed(format!("{} gives no features of its encoder", self.network.name())));
        };
        let (height, width) = (fine.size()[2], fine.size()[3]);
        let all = tch::no_grad(|| Tensor::cat(&[fine, &coarse.upsample_nearest2d([height, width], None, None)], 1));
        let planes = values(&all)?.chunks_exact((width * height).to_usize()).map(<[f32]>::to_vec).collect();
        Ok(Features { size: (width.to_usize(), height.to_usize()), planes })
    }

    /// Predicts the class of each pixel like [`Self::predict`], and returns its probability as well.
    pub fn predict_with_probability(&self, pixels: &[f32], size: (u32, u32)) -> Result<(Vec<u8>, Vec<f32>)> {
        let x = self.input(pixels, size)?;
        let scores = tch::no_grad(|| self.forward(&x, Pass::Inference));
        let (highest, _) = scores.softmax(1, Kind::Float).max_dim(1, false);
        Ok((classes(&scores)?, values(&highest)?))
    }

    /// Excludes all parameters from gradients, so that they can become constants of a traced graph.
    pub(super) fn freeze(&mut self) {
        for tensor in self.tensors.values_mut() {
            *tensor = tensor.detach();
        }
    }

    /// Returns images like [`Self::images`], or an error if the network would take more memory for them than the machine has.
    fn input(&self, pixels: &[f32], size: (u32, u32)) -> Result<Tensor> {
        let images = pixels.len() / (self.bands * size.0.to_usize() * size.1.to_usize()).max(1);
        self.check_inference(images, size)?;
        Ok(self.images(pixels, size))
    }

    /// Returns images (stored as in [`Self::predict`]) as a tensor of images × bands × height × width on the device.
    pub fn images(&self, pixels: &[f32], (width, height): (u32, u32)) -> Tensor {
        let bands = self.bands.to_i64();
        let images = pixels.len().to_i64() / (bands * i64::from(width) * i64::from(height));
        let lying = Tensor::from_slice(pixels).view([images, i64::from(height), i64::from(width), bands]);
        lying.to_device(self.place.device).permute([0, 3, 1, 2])
    }
}

/// Returns the class with the highest score at each pixel.
pub(super) fn classes(scores: &Tensor) -> Result<Vec<u8>> {
    let classes = scores.argmax(1, false).to_kind(Kind::Uint8).to_device(Device::Cpu);
    Vec::<u8>::try_from(classes.contiguous().view(-1)).map_err(|e| failed(&e))
}

/// Returns the values of a tensor in single precision, row-major.
pub(super) fn values(tensor: &Tensor) -> Result<Vec<f32>> {
    let flat = tensor.detach().to_device(Device::Cpu).to_kind(Kind::Float).contiguous().view(-1);
    Vec::try_from(flat).map_err(|e| failed(&e))
}

/// Converts an error of libtorch, without its stack trace.
pub(super) fn failed(e: &tch::TchError) -> Error {
    let words = e.to_string();
    Error::failed(format!("libtorch: {}", words.lines().next().unwrap_or_default()))
}

fn tensor(parameter: &Parameter, values: &[f32], device: Device) -> Tensor {
    laid(&parameter.shape, values, device).detach().set_requires_grad(parameter.role.is_trainable())
}

/// Copies values to a device, in the memory layout of weights.
pub(super) fn laid(shape: &[usize], values: &[f32], device: Device) -> Tensor {
    let shape: Vec<i64> = shape.iter().map(|n| n.to_i64()).collect();
    let plain = Tensor::from_slice(values).view(shape.as_slice()).to_device(device);
    if shape.len() == 4 { channels_last(&plain) } else { plain }
}

/// Returns the tensor in channels-last memory format, for which tch has no function.
fn channels_last(x: &Tensor) -> Tensor {
    x.permute([0, 2, 3, 1]).contiguous().permute([0, 3, 1, 2])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: every network gives features with cells of 8 and of 16 pixels, in cells of 8, with the channels of its encoder there;
    /// the scores are the same as without features. Source: the networks' tables of channels.
    #[test]
    fn every_network_names_its_encoder() {
        let place = Placement { device: Device::Cpu, precision: Precision::Single };
        let (size, channels) = ((96u32, 64u32), [64 + 64, 512 + 512, 40 + 112, 128 + 256, 384 + 384]);
        let pixels: Vec<f32> = (0..96 * 64 * 3).map(|i| (i % 17).to_f32() / 17.0).collect();
        let wanted = Wanted { features: true, plants: false };
        let shallow = Model::new(Network::TinyUnet, 3, 3, 1, place).outputs(&pixels, size, wanted);
        assert!(shallow.is_err_and(|error| error.to_string().contains("gives no features of its encoder")));
        let deep = Network::ALL.iter().filter(|network| **network != Network::TinyUnet);
        for (network, channels) in deep.zip(channels) {
            let model = Model::new(*network, 3, 3, 1, place);
            let found = model.outputs(&pixels, size, wanted).unwrap();
            let (scores, features) = (found.scores, found.features.unwrap());
            assert_eq!((features.size, features.planes.len()), ((12, 8), channels), "{}", network.name());
            assert!(features.planes.iter().all(|plane| plane.len() == 96));
            assert_eq!(values(&scores).unwrap(), model.scores(&pixels, size).unwrap(), "{}", network.name());
        }
    }

    /// Expected: with crops as an input, each image has the scores of the ordinary network that is folded for its crops, and one without a
    /// named crop those of the network without the input; the gradients of embeddings and maps are there.
    #[test]
    fn a_folded_network_answers_as_the_one_with_the_crop_as_an_input() {
        let place = Placement { device: Device::Cpu, precision: Precision::Single };
        let (network, size) = (Network::TinyUnet, (16u32, 12u32));
        let model = Model::with_extras(network, 3, 3, Extras { species: 4, plants: false }, 1, place);
        let mut arrays = model.arrays().unwrap();
        let maps = arrays.iter_mut().filter(|a| a.name.starts_with("film.") && a.name != film::EMBEDDING);
        for (k, value) in maps.flat_map(|map| &mut map.values).enumerate() {
            *value = ((k * 7) % 11).to_f32() / 11.0 - 0.5;
        }
        let model = Model::with(network, 3, 3, &arrays, place).unwrap();
        let crops = [vec![], vec![2], vec![0, 3]];
        let pixels: Vec<f32> = (0..3 * 16 * 12 * 3).map(|i| (i % 23).to_f32() / 23.0).collect();
        let named = model.forward_named(&model.images(&pixels, size), Pass::Inference, &crops);
        let all = values(&named).unwrap();
        let mut answers = Vec::new();
        for ((crops, pixels), scores) in
            crops.iter().zip(pixels.chunks_exact(16 * 12 * 3)).zip(all.chunks_exact(16 * 12 * 3))
        {
            let crops: Vec<usize> = crops.iter().map(|crop| usize::from(*crop)).collect();
            let plain = film::folded(network, 3, 3, &arrays, &crops).unwrap();
            let plain = Model::with(network, 3, 3, &plain, place).unwrap().scores(pixels, size).unwrap();
            assert!(plain.iter().zip(scores).all(|(a, b)| (a - b).abs() < 1e-4), "{crops:?}");
            let changed = model.scores(pixels, size).unwrap() != plain;
            answers.push(changed);
        }
        assert_eq!(answers, [false, true, true]);
        named.sum(Kind::Float).backward();
        let learns = |name: &str| model.tensors[name].grad().abs().sum(Kind::Float).double_value(&[]) > 0.0;
        assert!(learns(film::EMBEDDING) && learns(&film::map("dec0_1.bn")));
    }
}
