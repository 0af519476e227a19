//! Export of a network as TorchScript, which libtorch and PyTorch run on CPUs and GPUs without this program's source.
//!
//! The network is traced: the operations that it runs on one example image are recorded. Tracing fixes the height and width; the
//! number of images stays free. The input is that of all exports ([`super`]). The output is one score per class and pixel, images ×
//! classes × height × width, single precision. The metadata that an ONNX file contains are written to a JSON file beside it
//! ([`super::ExportMetadata`]).

use super::ExportMetadata;
use crate::data::Normalization;
use crate::data::normalise::LEAST;
use crate::run::{TrainedModel, write_json};
use crate::torch::{Model, Pass, Placement, Precision, failed, guarded};
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use furrow_output::place_atomically;
use std::path::{Path, PathBuf};
use tch::{CModule, Device, Kind, Tensor};

/// Returns the path of the metadata file of a TorchScript file: its name with `.json` appended.
pub fn facts_path(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".json");
    name.into()
}

/// Traces the network for images of this width and height in pixels and writes it atomically, together with its metadata file. Fails if the
/// images are smaller than the network allows.
pub fn write(trained: &TrainedModel, size: (u32, u32), path: &Path) -> Result<()> {
    guarded(|| trace(trained, size, path))
}

fn trace(trained: &TrainedModel, (width, height): (u32, u32), path: &Path) -> Result<()> {
    let card = &trained.card;
    let bands = card.input.bands.len();
    let least = card.network.least_side();
    if width.min(height) < least {
        return Err(Error::misuse(format!(
            "{} needs images of at least {least} × {least} pixels, not {width} × {height}",
            card.network.name()
        )));
    }
    let place = Placement { device: Device::Cpu, precision: Precision::Single };
    let mut model = Model::with(card.network, bands, card.classes.len(), &trained.values, place)?;
    model.check_inference(1, (width, height))?;
    model.freeze();
    let example = Tensor::zeros([1, i64::from(height), i64::from(width), bands.to_i64()], (Kind::Uint8, Device::Cpu));
    let taken_out = InputNormalization::of(&card.normalization);
    let mut forward = |x: &[Tensor]| vec![model.walk(&taken_out.from(&x[0]), Pass::Inference)];
    let module = tch::no_grad(|| CModule::create_by_tracing("furrow", "forward", &[example], &mut forward));
    let module = module.map_err(|e| failed(&e))?;
    place_atomically(path, |path| module.save(path).map_err(|e| failed(&e)))?;
    write_json(&facts_path(path), &ExportMetadata::of(card, (width, height)))
}

/// Mean and standard deviation of the input normalization. The constants are created before tracing starts: of a tensor created during
/// tracing, the trace keeps only the shape, not the values.
enum InputNormalization<'a> {
    /// Fixed means and standard deviations, one per band.
    Fixed(Tensor, Tensor),
    /// Computed from each image, over these axes.
    Own(&'a [i64]),
}

impl InputNormalization<'_> {
    fn of(how: &Normalization) -> Self {
        match how {
            Normalization::Fixed { mean, sd } => {
                let [mean, sd] = [mean, sd].map(|v| Tensor::from_slice(v).view([1, v.len().to_i64(), 1, 1]));
                Self::Fixed(mean, sd)
            }
            Normalization::Band => Self::Own(&[2, 3]),
            Normalization::Image => Self::Own(&[1, 2, 3]),
        }
    }

    /// Converts 8-bit pixels (images × height × width × bands) into the normalized network input, as [`Normalization::apply`] does.
    /// The division converts to single precision; an explicit conversion would record the device in the trace.
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
