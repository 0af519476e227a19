//! Deployment of trained models: export to files that other programs run, and prediction on unlabelled images.
//!
//! | module | contents |
//! |---|---|
//! | `onnx` | export as an ONNX graph that includes the input normalization |
//! | `torchscript` | export for libtorch and PyTorch, with the same input |
//! | `pictures` | input images, the files of their bands, and the names of the prediction files |
//! | `guard` | predictions of a network for a named crop that can hardly be right |
//! | `enlarge` | scores resized to the image's original size, and their argmax |
//! | `overlay` | prediction blended over its image |
//! | `plants` | plants of predictions, one by one |
//! | `points` | table of points on plants of known class |
//! | `predict` | prediction of images with a trained model |
//!
//! Exported networks include the input normalization, so that callers cannot apply a different mean or scale. The input `image` holds
//! unsigned 8-bit values, images × height × width × bands, in the order of the bands of `model.json`. The caller only resizes the image to
//! the network's width and height, antialiased: [`furrow_output::resize_gray`] here, `PIL.Image.resize(size, PIL.Image.BILINEAR)` in
//! Python.

use super::data::Band;
use super::run::ModelCard;
use serde::Serialize;

pub mod guard;
pub mod input_images;
pub mod onnx;
pub mod overlay;
pub mod plants;
pub mod points;
#[cfg(feature = "torch")]
pub mod predict;
#[cfg(feature = "torch")]
pub mod torchscript;

/// Metadata of an exported network.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ExportMetadata {
    /// Bands of the input, in order.
    pub bands: Vec<String>,
    /// Class names, in the order of the class numbers.
    pub classes: Vec<String>,
    /// Image height in pixels: the training size (ONNX) or the fixed input size (TorchScript).
    pub height: u32,
    /// Name of the network architecture.
    pub network: String,
    /// Version of the program that trained it.
    pub version: String,
    /// SHA-256 over names, shapes and values of the weights.
    pub weights_sha256: String,
    /// Image width in pixels; see `height`.
    pub width: u32,
}

impl ExportMetadata {
    /// Returns the metadata of the model `card` for images of this width and height.
    pub fn of(card: &ModelCard, (width, height): (u32, u32)) -> Self {
        Self {
            bands: card.input.bands.iter().map(Band::name).map(str::to_owned).collect(),
            classes: card.classes.names(),
            height,
            network: card.network.name().into(),
            version: card.furrow.clone(),
            weights_sha256: card.weights_sha256.clone(),
            width,
        }
    }
}
