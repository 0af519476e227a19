//! Hyper-parameters: how a network is trained. One struct, one set of defaults, one check.
//!
//! `train fit`, experiment files and recorded runs all use these. [`super::settings`] reads what a user gives and leaves the
//! rest as it is here; [`super::plan`] adds the network, the images and the machine.
//!
//! In JSON, fields keep the keys that runs of version 0.1 recorded (`window`, `balance`, `exposure` …), in the same order: a
//! run's checksum is taken over that text, and a run that was begun must be able to go on.

use super::class_weights::ClassWeights;
use super::schedule::Schedule;
use crate::Error;
use crate::train::data::{Augment, AugmentScale, Normalization, Resize, Shape};
use crate::train::net::Pretrained;
use crate::train::refine::Refine;
use serde::{Deserialize, Serialize};

/// The optimiser.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OptimiserKind {
    /// Stochastic gradient descent with momentum 0.9; weight decay joins the gradient.
    Sgd,
    /// Adam with β = (0.9, 0.999); weight decay apart from the gradient (Loshchilov & Hutter 2019, "AdamW").
    Adam,
}

impl OptimiserKind {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Sgd, Self::Adam];

    /// Reads `sgd` or `adam`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|kind| kind.name() == text);
        found.ok_or_else(|| format!("there is no optimiser `{text}`: write sgd or adam"))
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sgd => "sgd",
            Self::Adam => "adam",
        }
    }

    /// The learning rate that a training begins with unless another is given.
    pub fn default_rate(self) -> f64 {
        match self {
            Self::Sgd => 0.05,
            Self::Adam => 1e-3,
        }
    }
}

/// The loss that a training minimises.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LossFunction {
    /// Cross-entropy of the pixels.
    Entropy,
    /// Cross-entropy plus soft Dice loss, the mean over the classes of a batch, rare classes as much as frequent ones. Source:
    /// Isensee et al. 2021 (nnU-Net).
    Dice,
}

impl LossFunction {
    /// Reads `entropy` or `dice`.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text {
            "entropy" => Ok(Self::Entropy),
            "dice" => Ok(Self::Dice),
            _ => Err(format!("there is no loss `{text}`: write entropy or dice")),
        }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Entropy => "entropy",
            Self::Dice => "dice",
        }
    }

    /// What it is, in words.
    pub fn in_words(self) -> &'static str {
        match self {
            Self::Entropy => "cross-entropy",
            Self::Dice => "cross-entropy + soft Dice loss",
        }
    }
}

/// Input normalization: by which mean and standard deviation bands are brought to 0 and 1; see
/// [`crate::train::data::Normalization`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NormalizationMode {
    /// Each band of each image by its own.
    Band,
    /// Each image by its own, all bands alike: colours stay.
    Image,
    /// All images by those of the training set.
    Fixed,
}

impl NormalizationMode {
    /// Reads `band`, `image` or `fixed`.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text {
            "band" => Ok(Self::Band),
            "image" => Ok(Self::Image),
            "fixed" => Ok(Self::Fixed),
            _ => Err(format!("there is no normalization `{text}`: write band, image or fixed")),
        }
    }

    /// That of a trained network.
    pub fn of(normalization: &Normalization) -> Self {
        match normalization {
            Normalization::Band => Self::Band,
            Normalization::Image => Self::Image,
            Normalization::Fixed { .. } => Self::Fixed,
        }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Band => "band",
            Self::Image => "image",
            Self::Fixed => "fixed",
        }
    }
}

/// How a network is trained.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hyperparameters {
    /// Most steps; ≥ 1.
    pub steps: u64,
    /// Images of a batch; 1 to 1024.
    pub batch: usize,
    /// Batches of a step, whose gradients are averaged; 1 to 1024. See `gradients`.
    #[serde(default = "single", skip_serializing_if = "is_single")]
    pub accumulate: u64,
    /// Width and height, pixels, of the random crop of each image that a step is trained on; whole images with none. Crops make a
    /// step as cheap as small images would, and plants stay as large as they are. Not larger than the images.
    #[serde(rename = "window")]
    pub crop_size: Option<(u32, u32)>,
    /// Share of the crops that are centred on rare-class pixels, 0 to 1; see [`crate::train::data::Crop::rare`].
    #[serde(rename = "rare", default)]
    pub rare_crops: f64,
    /// The optimiser.
    #[serde(rename = "method")]
    pub optimiser: OptimiserKind,
    /// Learning rate at the start; above 0, below 100.
    pub rate: f64,
    /// Weight decay: share of each weight that is taken away, per step and learning rate; from 0 to below 1.
    pub decay: f64,
    /// The learning rate over time.
    pub schedule: Schedule,
    /// The loss that is minimised.
    pub loss: LossFunction,
    /// Class weights of the loss.
    #[serde(rename = "balance")]
    pub class_weights: ClassWeights,
    /// Training images on which class biases are calibrated in the end; 0 for none. See `calibrate`.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub calibrate: u64,
    /// Post-hoc logit adjustment by τ times the logarithm of the first class's frequency over the others', 0 to 2; 0 for none. See `logits`.
    #[serde(default, skip_serializing_if = "is_nothing")]
    pub logit_adjustment: f64,
    /// What the encoder begins with.
    #[serde(default, skip_serializing_if = "Pretrained::is_none")]
    pub pretrained: Pretrained,
    /// Steps in which the encoder stays as it is, its batch norms' statistics too; the decoder alone learns.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub freeze: u64,
    /// Learning rate of the encoder as a share of [`Self::rate`], 0 to 1: what was learnt from many photographs is changed less than
    /// what begins at random (Howard & Ruder 2018, "discriminative fine-tuning").
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub encoder_rate: f64,
    /// Decay of the exponential moving average of the weights, which then is what is validated and kept; 0 for none. See `ema`.
    #[serde(default, skip_serializing_if = "is_nothing")]
    pub ema: f64,
    /// The sizes that pictures are brought to once the network is trained; of no effect on training and validation.
    #[serde(default, skip_serializing_if = "Resize::is_stretch")]
    pub resize: Resize,
    /// How predictions are refined once the network is trained; of no effect on training and validation.
    #[serde(default, skip_serializing_if = "Refine::is_none")]
    pub refine: Refine,
    /// Data augmentation.
    pub augment: Augment,
    /// By what the augmentation `scale` enlarges crops.
    #[serde(default, skip_serializing_if = "AugmentScale::is_relative")]
    pub augment_scale: AugmentScale,
    /// Input normalization.
    #[serde(rename = "exposure")]
    pub normalization: NormalizationMode,
    /// Steps between two validation passes, each with a checkpoint; ≥ 1.
    #[serde(rename = "watch_every")]
    pub validate_every: u64,
    /// Validation passes without a better result after which a training ends early; ≥ 1.
    pub patience: u64,
}

fn single() -> u64 {
    1
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks by reference")]
fn is_single(number: &u64) -> bool {
    *number == 1
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks by reference")]
fn is_nothing(share: &f64) -> bool {
    *share == 0.0
}

fn one() -> f64 {
    1.0
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks by reference")]
fn is_one(share: &f64) -> bool {
    *share == 1.0
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks by reference")]
fn is_zero(number: &u64) -> bool {
    *number == 0
}

impl Default for Hyperparameters {
    fn default() -> Self {
        let optimiser = OptimiserKind::Adam;
        Self {
            steps: 2000,
            batch: 4,
            accumulate: 1,
            crop_size: None,
            rare_crops: 0.0,
            optimiser,
            rate: optimiser.default_rate(),
            decay: 5e-4,
            schedule: Schedule::Poly,
            loss: LossFunction::Dice,
            class_weights: ClassWeights::None,
            calibrate: 0,
            logit_adjustment: 0.0,
            pretrained: Pretrained::None,
            freeze: 0,
            encoder_rate: 1.0,
            ema: 0.0,
            resize: Resize::Stretch,
            refine: Refine::default(),
            augment: Augment::default(),
            augment_scale: AugmentScale::Relative,
            normalization: NormalizationMode::Band,
            validate_every: 100,
            patience: 10,
        }
    }
}

/// A value that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Invalid {
    /// The field's name in an experiment file; `train fit` has a flag of the same name with `-` for `_`.
    pub field: &'static str,
    /// What is wrong.
    pub message: String,
    /// What to do.
    pub help: String,
}

impl Invalid {
    /// As an error about a flag of `train fit`: [`Kind::Misuse`](crate::error::Kind::Misuse).
    pub fn of_flag(&self) -> Error {
        let flag = self.field.replace('_', "-");
        Error::misuse(format!("--{flag}: {}", self.message)).help(&self.help)
    }
}

/// Sides of images and crops that networks take, pixels.
pub const SIDES: std::ops::RangeInclusive<u32> = 32..=8192;

/// Whether images of this size can be trained on; `field` is what the size is of.
pub(super) fn check_size(field: &'static str, (width, height): (u32, u32)) -> Result<(), Invalid> {
    if [width, height].iter().all(|n| SIDES.contains(n)) {
        return Ok(());
    }
    let message = format!("networks do not see {width} × {height} pixels");
    Err(Invalid { field, message, help: format!("write sides from {} to {}", SIDES.start(), SIDES.end()) })
}

impl Hyperparameters {
    /// Whether all values are in range and crops fit into images of this shape.
    pub fn check(&self, shape: &Shape) -> Result<(), Invalid> {
        let range = |field, good: bool, value: &dyn std::fmt::Display, help: &str| {
            let message = format!("{value} is out of range");
            if good { Ok(()) } else { Err(Invalid { field, message, help: help.into() }) }
        };
        let whole = "write a whole number above 0";
        range("steps", (1..=100_000_000).contains(&self.steps), &self.steps, whole)?;
        range("batch", (1..=1024).contains(&self.batch), &self.batch, "write a number from 1 to 1024")?;
        let help = "write a number from 1 to 1024";
        range("accumulate", (1..=1024).contains(&self.accumulate), &self.accumulate, help)?;
        range("ema", (0.0..1.0).contains(&self.ema), &self.ema, "write a decay such as 0.998, or 0 for none")?;
        range("rate", self.rate > 0.0 && self.rate < 100.0, &self.rate, "write a number above 0 such as 0.001")?;
        let help = "write a share from 0 to 1";
        range("rare_crops", (0.0..=1.0).contains(&self.rare_crops), &self.rare_crops, help)?;
        range("encoder_rate", (0.0..=1.0).contains(&self.encoder_rate), &self.encoder_rate, help)?;
        range("decay", (0.0..1.0).contains(&self.decay), &self.decay, "write a share from 0 to below 1")?;
        let help = "write a number from 0 to 2, such as 0.5";
        range("logit_adjustment", (0.0..=2.0).contains(&self.logit_adjustment), &self.logit_adjustment, help)?;
        if self.logit_adjustment > 0.0 && self.calibrate > 0 {
            return Err(Invalid {
                field: "logit_adjustment",
                message: "calibration sets the same biases".into(),
                help: "leave one of the two out".into(),
            });
        }
        if !self.augment_scale.is_relative() && !self.augment.scale {
            return Err(Invalid {
                field: "augment_scale",
                message: format!("`scale` is not among the augmentations, which are {}", self.augment),
                help: "name scale among them, or leave this out".into(),
            });
        }
        range("validate_every", self.validate_every > 0, &self.validate_every, whole)?;
        range("patience", self.patience > 0, &self.patience, whole)?;
        let Some((width, height)) = self.crop_size else { return Ok(()) };
        check_size("crop_size", (width, height))?;
        if width > shape.width || height > shape.height {
            return Err(Invalid {
                field: "crop_size",
                message: format!(
                    "a crop of {width} × {height} pixels is larger than the images, which are brought to {} × {}",
                    shape.width, shape.height
                ),
                help: "write a smaller crop or a larger size".into(),
            });
        }
        Ok(())
    }
}
