//! Networks computed by libtorch.
//!
//! Images lie as height × width × bands ("channels last"), in which convolutions are faster on CPUs and GPUs alike; weights follow.

mod compute;
pub mod device;
pub mod multiscale;

use super::net::{Network, Parameter, fitting, parameters};
use super::refine::Features;
use super::weights::Array;
use crate::{Error, Result};
use compute::Compute;
use std::collections::BTreeMap;
use tch::{Device, Kind, Tensor};

pub use compute::Pass;
pub use device::{Precision, Where};

/// Halvings of an image that the finer features have: cells of 8 pixels.
const FINE: usize = 3;

/// A network with its parameters, on a device.
pub struct Model {
    /// Which network.
    pub network: Network,
    /// Bands of its input.
    pub bands: usize,
    /// Its classes.
    pub classes: usize,
    /// Where and how it is computed.
    pub place: Where,
    list: Vec<Parameter>,
    tensors: BTreeMap<String, Tensor>,
}

impl Model {
    /// A network with its first values, which the seed decides.
    pub fn new(network: Network, bands: usize, classes: usize, seed: u64, place: Where) -> Self {
        let list = parameters(network, bands, classes);
        let tensors =
            list.iter().enumerate().map(|(i, p)| (p.name.clone(), tensor(p, &p.begin(seed, i), place.device)));
        let tensors = tensors.collect();
        Self { network, bands, classes, place, list, tensors }
    }

    /// A network with these values. An error that names what does not fit.
    pub fn with(network: Network, bands: usize, classes: usize, arrays: &[Array], place: Where) -> Result<Self> {
        let mut model = Self::new(network, bands, classes, 0, place);
        model.load(arrays)?;
        Ok(model)
    }

    /// Takes over values by name; all parameters must be there in their shapes, others may be there too.
    pub fn load(&mut self, arrays: &[Array]) -> Result<()> {
        for (parameter, array) in self.list.iter().zip(fitting(self.network, self.bands, self.classes, arrays)?) {
            self.tensors.insert(parameter.name.clone(), tensor(parameter, &array.values, self.place.device));
        }
        Ok(())
    }

    /// All values, running means and variances among them, in the order of the network.
    pub fn arrays(&self) -> Result<Vec<Array>> {
        self.list
            .iter()
            .map(|p| {
                Ok(Array { name: p.name.clone(), shape: p.shape.clone(), values: values(&self.tensors[&p.name])? })
            })
            .collect()
    }

    /// Moves all values, running means and variances among them, by this share of the way to another model's of the same network.
    pub fn approach(&mut self, other: &Self, share: f64) {
        tch::no_grad(|| {
            for (name, tensor) in &mut self.tensors {
                let _ = tensor.lerp_(&other.tensors[name], share);
            }
        });
    }

    /// The trainable parameters, by name.
    pub fn trainable(&self) -> impl Iterator<Item = (&Parameter, &Tensor)> {
        self.list.iter().filter(|p| p.role.is_trainable()).map(|p| (p, &self.tensors[&p.name]))
    }

    /// From images × bands × height × width to images × classes × height × width.
    pub fn forward(&self, x: &Tensor, pass: Pass) -> Tensor {
        self.walk(x, pass).to_kind(Kind::Float)
    }

    /// The same in the precision of the last convolution.
    pub(super) fn walk(&self, x: &Tensor, pass: Pass) -> Tensor {
        let mut compute = Compute { tensors: &self.tensors, precision: self.place.precision, pass, features: None };
        self.network.walk(&mut compute, x, self.bands, self.classes)
    }

    /// The class of each pixel of images that lie as `height × width × bands`, one after the other.
    pub fn predict(&self, pixels: &[f32], (width, height): (u32, u32)) -> Result<Vec<u8>> {
        let x = self.images(pixels, (width, height));
        classes(&tch::no_grad(|| self.forward(&x, Pass::Inference)))
    }

    /// The values of the classes: images × classes × height × width; images lie as in [`Self::predict`].
    pub fn scores(&self, pixels: &[f32], size: (u32, u32)) -> Result<Vec<f32>> {
        values(&tch::no_grad(|| self.forward(&self.images(pixels, size), Pass::Inference)))
    }

    /// The probabilities of the classes of one image, in straight lines between its pixels' centres brought to another size.
    pub fn probabilities(&self, pixels: &[f32], size: (u32, u32), to: (u32, u32)) -> Result<Vec<f32>> {
        values(&tch::no_grad(|| {
            let found = self.forward(&self.images(pixels, size), Pass::Inference).softmax(1, Kind::Float);
            if size == to {
                return found;
            }
            found.upsample_bilinear2d([i64::from(to.1), i64::from(to.0)], false, None, None)
        }))
    }

    /// The values of the classes of one image, and what the encoder makes of it: its features of 8 and of 16 pixels, in cells of 8.
    pub(super) fn scores_and_features(&self, pixels: &[f32], size: (u32, u32)) -> Result<(Tensor, Features)> {
        let features = Some(BTreeMap::new());
        let mut compute =
            Compute { tensors: &self.tensors, precision: self.place.precision, pass: Pass::Inference, features };
        let x = self.images(pixels, size);
        let scores = tch::no_grad(|| self.network.walk(&mut compute, &x, self.bands, self.classes));
        let features = compute.features.unwrap_or_default();
        let (Some(fine), Some(coarse)) = (features.get(&FINE), features.get(&(FINE + 1))) else {
            return Err(Error::failed(format!("{} tells of no features of its encoder", self.network.name())));
        };
        let (height, width) = (fine.size()[2], fine.size()[3]);
        let all = tch::no_grad(|| Tensor::cat(&[fine, &coarse.upsample_nearest2d([height, width], None, None)], 1));
        let planes = values(&all)?.chunks_exact((width * height) as usize).map(<[f32]>::to_vec).collect();
        Ok((scores.to_kind(Kind::Float), Features { size: (width as usize, height as usize), planes }))
    }

    /// The class of each pixel as in [`Self::predict`], and its probability.
    pub fn predict_with_probability(&self, pixels: &[f32], size: (u32, u32)) -> Result<(Vec<u8>, Vec<f32>)> {
        let scores = tch::no_grad(|| self.forward(&self.images(pixels, size), Pass::Inference));
        let (highest, _) = scores.softmax(1, Kind::Float).max_dim(1, false);
        Ok((classes(&scores)?, values(&highest)?))
    }

    /// Has gradients change nothing any more: only so can its values become constants of a graph.
    pub(super) fn freeze(&mut self) {
        for tensor in self.tensors.values_mut() {
            *tensor = tensor.detach();
        }
    }

    /// Images that lie as `height × width × bands` as libtorch sees them: images × bands × height × width, on the device.
    pub fn images(&self, pixels: &[f32], (width, height): (u32, u32)) -> Tensor {
        let bands = self.bands as i64;
        let images = pixels.len() as i64 / (bands * i64::from(width) * i64::from(height));
        let lying = Tensor::from_slice(pixels).view([images, i64::from(height), i64::from(width), bands]);
        lying.to_device(self.place.device).permute([0, 3, 1, 2])
    }
}

/// The class with the highest value at each pixel.
pub(super) fn classes(scores: &Tensor) -> Result<Vec<u8>> {
    let classes = scores.argmax(1, false).to_kind(Kind::Uint8).to_device(Device::Cpu);
    Vec::<u8>::try_from(classes.contiguous().view(-1)).map_err(|e| failed(&e))
}

/// A tensor's values in single precision, row by row.
pub(super) fn values(tensor: &Tensor) -> Result<Vec<f32>> {
    let flat = tensor.detach().to_device(Device::Cpu).to_kind(Kind::Float).contiguous().view(-1);
    Vec::try_from(flat).map_err(|e| failed(&e))
}

/// An error of libtorch, without the stack of its calls.
pub(super) fn failed(e: &tch::TchError) -> Error {
    let words = e.to_string();
    Error::failed(format!("libtorch: {}", words.lines().next().unwrap_or_default()))
}

fn tensor(parameter: &Parameter, values: &[f32], device: Device) -> Tensor {
    laid(&parameter.shape, values, device).detach().set_requires_grad(parameter.role.is_trainable())
}

/// Values on a device, laid out as weights are.
pub(super) fn laid(shape: &[usize], values: &[f32], device: Device) -> Tensor {
    let shape: Vec<i64> = shape.iter().map(|n| *n as i64).collect();
    let plain = Tensor::from_slice(values).view(shape.as_slice()).to_device(device);
    if shape.len() == 4 { channels_last(&plain) } else { plain }
}

/// The same values, channels beside each other in memory; tch has no name for this.
fn channels_last(x: &Tensor) -> Tensor {
    x.permute([0, 2, 3, 1]).contiguous().permute([0, 3, 1, 2])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: of every network features of 8 and of 16 pixels in cells of 8, as many as its encoder has there, and the scores that it has
    /// without them. Source: the networks' tables of channels.
    #[test]
    fn every_network_tells_of_its_encoder() {
        let place = Where { device: Device::Cpu, precision: Precision::Single };
        let (size, channels) = ((96u32, 64u32), [64 + 64, 512 + 512, 40 + 112, 128 + 256, 384 + 384]);
        let pixels: Vec<f32> = (0..96 * 64 * 3).map(|i| (i % 17) as f32 / 17.0).collect();
        for (network, channels) in Network::ALL.iter().zip(channels) {
            let model = Model::new(*network, 3, 3, 1, place);
            let (scores, features) = model.scores_and_features(&pixels, size).unwrap();
            assert_eq!((features.size, features.planes.len()), ((12, 8), channels), "{}", network.name());
            assert!(features.planes.iter().all(|plane| plane.len() == 96));
            assert_eq!(values(&scores).unwrap(), model.scores(&pixels, size).unwrap(), "{}", network.name());
        }
    }
}
