//! A training plan: everything that decides what a training results in.

use super::hyper::Hyperparameters;
use crate::dataset::classes::Classes;
use crate::train::data::{Band, Normalization, Selection, Shape};
use crate::train::net::Network;
use serde::{Deserialize, Serialize};

/// A training.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Which network.
    pub network: Network,
    /// The classes that it tells apart.
    pub classes: Classes,
    /// Its input: bands and size.
    pub shape: Shape,
    /// Training set.
    pub train: Vec<Selection>,
    /// Validation set; with none, a training does not end early.
    pub val: Vec<Selection>,
    /// Seed of initial weights, order of images and data augmentation.
    pub seed: u64,
    /// How it is trained.
    #[serde(flatten)]
    pub hyper: Hyperparameters,
    /// `f32` or `bf16`.
    pub precision: String,
    /// Threads that compute; they decide the last bits.
    pub threads: usize,
    /// SHA-256 of the weights that it begins with, where they are another run's.
    pub begin_with: Option<String>,
    /// Most seconds; with it the end is where the clock says.
    pub seconds: Option<u64>,
    /// Self-training on photographs without labels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub adaptation: Option<Adaptation>,
}

/// What a self-training has beside a training with labels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Adaptation {
    /// Photographs.
    pub photos: usize,
    /// Checksum of their pixels.
    pub photos_sha256: String,
    /// Share of the predicted pixels of each class that are taken for labels, the surest first; above 0, at most 1.
    pub keep: f64,
    /// Input normalization of the network.
    pub normalization: Normalization,
}

impl Plan {
    /// Width and height, pixels, of what a step is trained on: a crop of each image, or all of it.
    pub fn crop_size(&self) -> (u32, u32) {
        self.hyper.crop_size.unwrap_or((self.shape.width, self.shape.height))
    }

    /// What a step is trained on, in words.
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
            seconds: None,
            adaptation: None,
        }
    }
}
