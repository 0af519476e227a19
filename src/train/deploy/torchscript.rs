//! A network as TorchScript: what libtorch and PyTorch run, on CPUs and GPUs, without this program's source.
//!
//! The network is traced: what it does to one picture is written down. Height and width are thereby frozen, the number of images is
//! not. Input as of all exports ([`super`]); the output is the first of ONNX's: one value a class and pixel, images × classes ×
//! height × width, single precision. What an ONNX file says about itself stands in a JSON file beside ([`super::Facts`]).

use super::Facts;
use crate::output::place_atomically;
use crate::train::data::Normalization;
use crate::train::data::normalise::LEAST;
use crate::train::run::{TrainedModel, write_json};
use crate::train::torch::{Model, Pass, Precision, Where, failed};
use crate::{Error, Result};
use std::path::{Path, PathBuf};
use tch::{CModule, Device, Kind, Tensor};

/// The file with the words about a traced network.
pub fn facts_path(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".json");
    name.into()
}

/// Writes the network for pictures of so many pixels across and down, atomically, and the words about it.
pub fn write(trained: &TrainedModel, (width, height): (u32, u32), path: &Path) -> Result<()> {
    let card = &trained.card;
    let bands = card.input.bands.len();
    let least = card.network.least_side();
    if width.min(height) < least {
        return Err(Error::misuse(format!(
            "{} needs pictures of {least} pixels at least, down and across, not {width} × {height}",
            card.network.name()
        )));
    }
    let place = Where { device: Device::Cpu, precision: Precision::Single };
    let mut model = Model::with(card.network, bands, card.classes.len(), &trained.values, place)?;
    model.freeze();
    let example = Tensor::zeros([1, i64::from(height), i64::from(width), bands as i64], (Kind::Uint8, Device::Cpu));
    let taken_out = TakenOut::of(&card.normalization);
    let mut forward = |x: &[Tensor]| vec![model.walk(&taken_out.from(&x[0]), Pass::Inference)];
    let module = tch::no_grad(|| CModule::create_by_tracing("furrow", "forward", &[example], &mut forward));
    let module = module.map_err(|e| failed(&e))?;
    place_atomically(path, |path| module.save(path).map_err(|e| failed(&e)))?;
    write_json(&facts_path(path), &Facts::of(card, (width, height)))
}

/// Mean and standard deviation of the input normalization. Constants are tensors before the tracing begins: of one that is made meanwhile the trace keeps
/// the shape, not the values.
enum TakenOut<'a> {
    /// Means and deviations of the bands.
    Fixed(Tensor, Tensor),
    /// The picture's own, over these axes.
    Own(&'a [i64]),
}

impl TakenOut<'_> {
    fn of(how: &Normalization) -> Self {
        match how {
            Normalization::Fixed { mean, sd } => {
                let [mean, sd] = [mean, sd].map(|v| Tensor::from_slice(v).view([1, v.len() as i64, 1, 1]));
                Self::Fixed(mean, sd)
            }
            Normalization::Band => Self::Own(&[2, 3]),
            Normalization::Image => Self::Own(&[1, 2, 3]),
        }
    }

    /// From 8-bit pixels, images × height × width × bands, to what the network takes; as [`Normalization::apply`]. Dividing makes
    /// single precision of them; asking for it would write the device into the trace.
    fn from(&self, image: &Tensor) -> Tensor {
        let x = image.permute([0, 3, 1, 2]) / 255.0;
        match self {
            Self::Fixed(mean, sd) => (x - mean) / sd,
            Self::Own(axes) => {
                let less = &x - x.mean_dim(*axes, true, None);
                let sd = (&less * &less).mean_dim(*axes, true, None).sqrt().clamp_min(f64::from(LEAST));
                less / sd
            }
        }
    }
}
