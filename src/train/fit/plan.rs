//! Everything that decides what a training learns.

use super::balance::Balance;
use super::schedule::Schedule;
use crate::train::classes::Classes;
use crate::train::data::{Augment, Selection, Shape};
use crate::train::net::Network;
use serde::{Deserialize, Serialize};

/// How gradients become steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Stochastic gradient descent with momentum 0.9; weight decay joins the gradient.
    Sgd,
    /// Adam with β = (0.9, 0.999); weight decay apart from the gradient (Loshchilov & Hutter 2019, "AdamW").
    Adam,
}

impl Method {
    /// Reads `sgd` or `adam`.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text {
            "sgd" => Ok(Self::Sgd),
            "adam" => Ok(Self::Adam),
            _ => Err(format!("there is no optimiser `{text}`: write sgd or adam")),
        }
    }

    /// A first learning rate that suits it.
    pub fn usual_rate(self) -> f64 {
        match self {
            Self::Sgd => 0.05,
            Self::Adam => 1e-3,
        }
    }
}

/// What is made small.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Objective {
    /// Cross-entropy of the pixels.
    Entropy,
    /// That and what each class lacks of a full Dice overlap, rare classes as much as frequent ones. Source: Isensee et al. 2021
    /// (nnU-Net).
    Dice,
}

impl Objective {
    /// Reads `entropy` or `dice`.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text {
            "entropy" => Ok(Self::Entropy),
            "dice" => Ok(Self::Dice),
            _ => Err(format!("there is no loss `{text}`: write entropy or dice")),
        }
    }
}

/// How bands are brought to mean 0 and deviation 1; see [`crate::train::data::Normalisation`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Exposure {
    /// Each band of each image by its own.
    Band,
    /// Each image by its own, colours stay.
    Image,
    /// All images by those of the training images.
    Fixed,
}

impl Exposure {
    /// Reads `band`, `image` or `fixed`.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text {
            "band" => Ok(Self::Band),
            "image" => Ok(Self::Image),
            "fixed" => Ok(Self::Fixed),
            _ => Err(format!("images are not normalised by `{text}`: write band, image or fixed")),
        }
    }
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks by reference")]
fn is_none(images: &u64) -> bool {
    *images == 0
}

/// A training.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Which network.
    pub network: Network,
    /// What it tells apart.
    pub classes: Classes,
    /// What it takes in.
    pub shape: Shape,
    /// What it learns from.
    pub train: Vec<Selection>,
    /// What it is watched by; none for no early end.
    pub val: Vec<Selection>,
    /// Decides first values, order and variations.
    pub seed: u64,
    /// Most steps.
    pub steps: u64,
    /// Images a step; ≥ 1.
    pub batch: usize,
    /// Width and height of the part of each image that a step learns from, somewhere in it; all of it with none. Small windows
    /// make a step as cheap as small images would, and what is seen stays sharp.
    pub window: Option<(u32, u32)>,
    /// Share of the windows that are laid about a pixel of a rare class, 0 to 1; see [`crate::train::data::View::rare`].
    #[serde(default)]
    pub rare: f64,
    /// How gradients become steps.
    pub method: Method,
    /// First learning rate.
    pub rate: f64,
    /// Share of each weight that is taken away, per step and learning rate.
    pub decay: f64,
    /// The learning rate over time.
    pub schedule: Schedule,
    /// What is made small.
    pub loss: Objective,
    /// What a pixel of each class weighs.
    pub balance: Balance,
    /// Images to learn from on which, when all steps are done, it is set how readily each class is answered; 0 for none. See `calibrate`.
    #[serde(default, skip_serializing_if = "is_none")]
    pub calibrate: u64,
    /// What is varied.
    pub augment: Augment,
    /// What is taken out.
    pub exposure: Exposure,
    /// Steps between two looks at the validation images, and between two checkpoints.
    pub watch_every: u64,
    /// Looks without a better result after which it ends.
    pub patience: u64,
    /// `f32` or `bf16`.
    pub precision: String,
    /// Threads that compute; they decide the last bits.
    pub threads: usize,
    /// SHA-256 of the values that it begins with, where they are another run's.
    pub begin_with: Option<String>,
    /// Most seconds; with it the end is where the clock says.
    pub seconds: Option<u64>,
}

impl Plan {
    /// Pixels that a step sees of an image: width, height.
    pub fn window(&self) -> (u32, u32) {
        let Shape { width, height, .. } = self.shape;
        self.window.map_or((width, height), |(w, h)| (w.min(width), h.min(height)))
    }

    /// What a step sees, in words.
    pub fn batch_told(&self) -> String {
        let (width, height) = self.window();
        if (width, height) == (self.shape.width, self.shape.height) {
            return format!("{} images", self.batch);
        }
        format!("{} windows of {width} × {height}", self.batch)
    }
}

impl Default for Plan {
    fn default() -> Self {
        let method = Method::Adam;
        Self {
            network: Network::BasicSegnet,
            classes: Classes::default(),
            shape: Shape { bands: crate::train::data::Band::RGB.to_vec(), width: 480, height: 360 },
            train: Vec::new(),
            val: Vec::new(),
            seed: 1,
            steps: 2000,
            batch: 4,
            window: None,
            rare: 0.0,
            method,
            rate: method.usual_rate(),
            decay: 5e-4,
            schedule: Schedule::Poly,
            loss: Objective::Dice,
            balance: Balance::None,
            calibrate: 0,
            augment: Augment::default(),
            exposure: Exposure::Band,
            watch_every: 100,
            patience: 10,
            precision: "f32".into(),
            threads: 1,
            begin_with: None,
            seconds: None,
        }
    }
}
