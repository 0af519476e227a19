//! How batches are drawn from images.

use super::augment::Augment;
use super::ground::PixelSizes;
use super::normalise::Normalization;

/// How batches are drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Order {
    /// Decides the order and every variation.
    pub seed: u64,
    /// Images of a batch; ≥ 1.
    pub batch: usize,
    /// Width and height of the crop of each image, pixels.
    pub crop_size: (u32, u32),
    /// Share of the crops that are centred on rare-class pixels; see [`super::Crop::rare`].
    pub rare: f64,
    /// Data augmentation.
    pub augment: Augment,
    /// Pixels on the ground of the images, where crops are scaled by them.
    pub pixels: Option<PixelSizes>,
    /// Input normalization, after that.
    pub normalization: Normalization,
}
