//! Parameters of batch sampling.

use super::augment::Augment;
use super::ground::PixelSizes;
use super::naming::Naming;
use super::normalise::Normalization;

/// Parameters that determine the batches of a training, together with the images.
#[derive(Clone, Debug, PartialEq)]
pub struct BatchSettings {
    /// Seed of the order of images and of data augmentation.
    pub seed: u64,
    /// Images per batch; ≥ 1.
    pub batch: usize,
    /// Width and height of the crop of each image, pixels.
    pub crop_size: (u32, u32),
    /// Fraction of crops that are placed around rare-class pixels; see [`super::Crop::rare`].
    pub rare: f64,
    /// Data augmentation.
    pub augment: Augment,
    /// Pixel sizes of the images on the ground, if crops are scaled by them.
    pub pixels: Option<PixelSizes>,
    /// Naming of crops, if the network takes the crop as an input.
    pub naming: Option<Naming>,
    /// Input normalization, applied after augmentation.
    pub normalization: Normalization,
}
