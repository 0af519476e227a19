//! Training plan: everything that determines the trained weights.

use super::hyper::Hyperparameters;
use crate::data::{Band, Normalization, Selection, Shape};
use crate::net::Network;
use furrow_dataset::model::classes::Classes;
use serde::{Deserialize, Serialize};

/// Training plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Network.
    pub network: Network,
    /// Classes that the network predicts.
    pub classes: Classes,
    /// Bands and size of the input.
    pub shape: Shape,
    /// Training set.
    pub train: Vec<Selection>,
    /// Validation set; if empty, training does not end early.
    pub val: Vec<Selection>,
    /// Seed of the initial weights, the order of images and data augmentation.
    pub seed: u64,
    /// Hyper-parameters.
    #[serde(flatten)]
    pub hyper: Hyperparameters,
    /// Precision: `f32` or `bf16`.
    pub precision: String,
    /// Number of compute threads; it affects the last bits of results.
    pub threads: usize,
    /// SHA-256 of the initial weights, if they are another run's or pretrained.
    pub begin_with: Option<String>,
    /// English names of the species that the network takes as the crop, in the order of its embeddings; empty for an ordinary network.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub species: Vec<String>,
    /// Time limit, seconds. With a limit, the last step depends on the speed of the machine.
    pub seconds: Option<u64>,
    /// Input normalization of the trained network, if only a plant decoder is trained, which is added to it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plants: Option<Normalization>,
    /// Self-training on photographs without labels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub adaptation: Option<Adaptation>,
}

/// Additional parameters of a self-training.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Adaptation {
    /// Number of photographs.
    pub photos: usize,
    /// SHA-256 of their pixels.
    pub photos_sha256: String,
    /// Fraction of the predicted pixels of each class that become labels, the most confident first; above 0, at most 1.
    pub keep: f64,
    /// Input normalization of the trained network.
    pub normalization: Normalization,
}

impl Plan {
    /// Returns width and height, pixels, of the part of each image that a step is trained on: a crop or the whole image.
    pub fn crop_size(&self) -> (u32, u32) {
        self.hyper.crop_size.unwrap_or((self.shape.width, self.shape.height))
    }

    /// Describes the input of a step for reports, such as `4 crops of 320 × 256`.
    pub fn batch_in_words(&self) -> String {
        let (width, height) = self.crop_size();
        let batches = if self.hyper.accumulate > 1 { format!("{} × ", self.hyper.accumulate) } else { String::new() };
        if (width, height) == (self.shape.width, self.shape.height) {
            return format!("{batches}{} images", self.hyper.batch);
        }
        format!("{batches}{} crops of {width} × {height}", self.hyper.batch)
    }
}

impl Default for Plan {
    fn default() -> Self {
        Self {
            network: Network::BasicSegnet,
            classes: Classes::default(),
            shape: Shape { bands: Band::RGB.to_vec(), width: 480, height: 360 },
            train: Vec::new(),
            val: Vec::new(),
            seed: 1,
            hyper: Hyperparameters::default(),
            precision: "f32".into(),
            threads: 1,
            begin_with: None,
            species: Vec::new(),
            seconds: None,
            plants: None,
            adaptation: None,
        }
    }
}
