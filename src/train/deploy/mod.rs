//! Trained models in use: exported to files that other programs run, and predictions for pictures without labels.
//!
//! | file | idea |
//! |---|---|
//! | `onnx` | the network as an ONNX graph, normalisation inside |
//! | `torchscript` | the same for libtorch and PyTorch |
//! | `pictures` | which pictures are predicted, where their bands lie, and what the files of their predictions are called |
//! | `enlarge` | a network's values at the picture's own size |
//! | `overlay` | a prediction over its picture, for people |
//! | `predict` | from pictures to masks |
//!
//! Exported networks begin where a camera ends, so that nobody who runs them can divide by another number or take out another mean:
//! their input is `image`, 8-bit numbers that lie as images × height × width × bands, in the order of the bands of `model.json`.
//! What is left to whoever runs them is to bring a picture to the network's width and height, antialiased, as
//! [`crate::output::resize_gray`] does here and `PIL.Image.resize(size, PIL.Image.BILINEAR)` in Python.

use super::data::Band;
use super::run::ModelCard;
use serde::Serialize;

pub mod enlarge;
pub mod onnx;
pub mod overlay;
pub mod pictures;
#[cfg(feature = "train")]
pub mod predict;
#[cfg(feature = "train")]
pub mod torchscript;

/// What an exported network says about itself.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Facts {
    /// The bands of its input, in order.
    pub bands: Vec<String>,
    /// Its classes, in the order of their numbers.
    pub classes: Vec<String>,
    /// Pixels down, at which it was trained or for which it was frozen.
    pub height: u32,
    /// The network's name.
    pub network: String,
    /// The program's version.
    pub version: String,
    /// SHA-256 over names, shapes and values of the weights.
    pub weights_sha256: String,
    /// Pixels across.
    pub width: u32,
}

impl Facts {
    /// Of a network at a size.
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
