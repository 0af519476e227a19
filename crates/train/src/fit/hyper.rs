//! Hyper-parameters of a training: one struct with one set of defaults and one check.
//!
//! `train fit`, experiment files and recorded runs all use this struct. [`super::settings`] overwrites the defaults with the values
//! that a user gives; [`super::plan`] adds the network, the images and the machine.
//!
//! In JSON, fields keep the keys and the order of version 0.1 (`window`, `balance`, `exposure` …): the checksum of a run is taken
//! over that text, and runs that an earlier version started must be resumable.

use super::class_weights::ClassWeights;
use super::schedule::Schedule;
use crate::data::{Augment, AugmentScale, Normalization, Resize, Shape};
use crate::net::Pretrained;
use crate::refine::Refine;
use furrow_base::Error;
use serde::{Deserialize, Serialize};

/// Optimiser.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OptimiserKind {
    /// Stochastic gradient descent with momentum 0.9; weight decay is added to the gradient.
    Sgd,
    /// Adam with β = (0.9, 0.999) and weight decay decoupled from the gradient (Loshchilov & Hutter 2019, "AdamW").
    Adam,
}

impl OptimiserKind {
    /// All optimisers.
    pub const ALL: [Self; 2] = [Self::Sgd, Self::Adam];

    /// Parses `sgd` or `adam`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|kind| kind.name() == text);
        found.ok_or_else(|| format!("there is no optimiser `{text}`: write sgd or adam"))
    }

    /// Returns the name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sgd => "sgd",
            Self::Adam => "adam",
        }
    }

    /// Returns the default learning rate at the start of a training.
    pub fn default_rate(self) -> f64 {
        match self {
            Self::Sgd => 0.05,
            Self::Adam => 1e-3,
        }
    }
}

/// Loss function of a training.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LossFunction {
    /// Cross-entropy, averaged over pixels.
    Entropy,
    /// Cross-entropy plus soft Dice loss. The Dice loss is the mean over the classes of a batch, so rare classes have the same
    /// weight as frequent ones. Source: Isensee et al. 2021 (nnU-Net).
    Dice,
}

impl LossFunction {
    /// Parses `entropy` or `dice`.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text {
            "entropy" => Ok(Self::Entropy),
            "dice" => Ok(Self::Dice),
            _ => Err(format!("there is no loss `{text}`: write entropy or dice")),
        }
    }

    /// Returns the name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Entropy => "entropy",
            Self::Dice => "dice",
        }
    }

    /// Returns a description for reports.
    pub fn in_words(self) -> &'static str {
        match self {
            Self::Entropy => "cross-entropy",
            Self::Dice => "cross-entropy + soft Dice loss",
        }
    }
}

/// Input normalization: the choice of the mean and standard deviation with which bands are standardised; see
/// [`crate::data::Normalization`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NormalizationMode {
    /// Mean and standard deviation of each band of each image.
    Band,
    /// Mean and standard deviation of all bands of an image together, which keeps colours.
    Image,
    /// Mean and standard deviation of each band over the training set.
    Fixed,
}

impl NormalizationMode {
    /// Parses `band`, `image` or `fixed`.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text {
            "band" => Ok(Self::Band),
            "image" => Ok(Self::Image),
            "fixed" => Ok(Self::Fixed),
            _ => Err(format!("there is no normalization `{text}`: write band, image or fixed")),
        }
    }

    /// Returns the mode of a trained network's normalization.
    pub fn of(normalization: &Normalization) -> Self {
        match normalization {
            Normalization::Band => Self::Band,
            Normalization::Image => Self::Image,
            Normalization::Fixed { .. } => Self::Fixed,
        }
    }

    /// Returns the name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Band => "band",
            Self::Image => "image",
            Self::Fixed => "fixed",
        }
    }
}

/// Hyper-parameters of a training.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hyperparameters {
    /// Largest number of steps; ≥ 1.
    pub steps: u64,
    /// Images per batch; 1 to 1024.
    pub batch: usize,
    /// Batches per step, whose gradients are averaged; 1 to 1024. See `gradients`.
    #[serde(default = "single", skip_serializing_if = "is_single")]
    pub accumulate: u64,
    /// Width and height, pixels, of the random crop of each training image; `None` for whole images. A crop makes a step as fast
    /// as a downscaled image would, but keeps the size of plants. Not larger than the images.
    #[serde(rename = "window")]
    pub crop_size: Option<(u32, u32)>,
    /// Fraction of crops that are placed around rare-class pixels, 0 to 1; see [`crate::data::Crop::rare`].
    #[serde(rename = "rare", default)]
    pub rare_crops: f64,
    /// Optimiser.
    #[serde(rename = "method")]
    pub optimiser: OptimiserKind,
    /// Learning rate at the start; above 0, below 100.
    pub rate: f64,
    /// Weight decay, 0 to below 1. Adam multiplies weights by 1 − rate · decay in each step; SGD adds decay · weight to the gradient.
    pub decay: f64,
    /// Learning-rate schedule.
    pub schedule: Schedule,
    /// Loss.
    pub loss: LossFunction,
    /// Class weights of the loss.
    #[serde(rename = "balance")]
    pub class_weights: ClassWeights,
    /// Number of training images on which class biases are calibrated after the last step; 0 for none. See `calibrate`.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub calibrate: u64,
    /// Factor τ of post-hoc logit adjustment, 0 to 2; 0 for none. The logits of all classes but the first are raised by τ times the
    /// logarithm of the first class's frequency relative to the others'. See `logits`.
    #[serde(default, skip_serializing_if = "is_nothing")]
    pub logit_adjustment: f64,
    /// Initial weights of the encoder.
    #[serde(default, skip_serializing_if = "Pretrained::is_none")]
    pub pretrained: Pretrained,
    /// Number of steps at the start that train only the decoder; the encoder stays unchanged, including batch-norm statistics.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub freeze: u64,
    /// Learning rate of the encoder as a fraction of [`Self::rate`], 0 to 1. A low fraction changes pretrained weights less than
    /// randomly initialised ones (Howard & Ruder 2018, "discriminative fine-tuning").
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub encoder_rate: f64,
    /// Decay of the exponential moving average of the weights; 0 for none. The averaged weights are validated and kept instead of
    /// the last step's. See `ema`.
    #[serde(default, skip_serializing_if = "is_nothing")]
    pub ema: f64,
    /// Fraction of the training images in which a species is named as the crop, 0 to 1: the network takes the crop as an input. 0 for an
    /// ordinary network. See [`crate::data::Naming`].
    #[serde(default, skip_serializing_if = "is_nothing")]
    pub name_crops: f64,
    /// Sizes that images are resized to for prediction and evaluation; no effect on training and validation.
    #[serde(default, skip_serializing_if = "Resize::is_stretch")]
    pub resize: Resize,
    /// Refinement of predictions after training; no effect on training and validation.
    #[serde(default, skip_serializing_if = "Refine::is_none")]
    pub refine: Refine,
    /// Data augmentation.
    pub augment: Augment,
    /// Range of the augmentation `scale`.
    #[serde(default, skip_serializing_if = "AugmentScale::is_relative")]
    pub augment_scale: AugmentScale,
    /// Input normalization.
    #[serde(rename = "exposure")]
    pub normalization: NormalizationMode,
    /// Steps between two validation passes, each followed by a checkpoint; ≥ 1.
    #[serde(rename = "watch_every")]
    pub validate_every: u64,
    /// Number of validation passes without improvement after which training ends early; ≥ 1.
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
            name_crops: 0.0,
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

/// Hyper-parameter that has an invalid value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Invalid {
    /// Field name in an experiment file; the flag of `train fit` has the same name with `-` for `_`.
    pub field: &'static str,
    /// Description of the fault.
    pub message: String,
    /// Remedy.
    pub help: String,
}

impl Invalid {
    /// Returns it as an error about a flag of `train fit`: [`Kind::Misuse`](furrow_base::error::Kind::Misuse).
    pub fn of_flag(&self) -> Error {
        let flag = self.field.replace('_', "-");
        Error::misuse(format!("--{flag}: {}", self.message)).help(&self.help)
    }
}

/// Valid width and height of images and crops, pixels.
pub const SIDES: std::ops::RangeInclusive<u32> = 32..=8192;

/// Checks the size of images or crops; `field` is the name of the hyper-parameter that an error is about.
pub(super) fn check_size(field: &'static str, (width, height): (u32, u32)) -> Result<(), Invalid> {
    if [width, height].iter().all(|n| SIDES.contains(n)) {
        return Ok(());
    }
    let message = format!("networks do not support {width} × {height} pixels");
    Err(Invalid { field, message, help: format!("write sides from {} to {}", SIDES.start(), SIDES.end()) })
}

impl Hyperparameters {
    /// Checks that all values are in range and that crops are not larger than images of this shape.
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
        let help = "write a fraction from 0 to 1";
        range("rare_crops", (0.0..=1.0).contains(&self.rare_crops), &self.rare_crops, help)?;
        range("name_crops", (0.0..=1.0).contains(&self.name_crops), &self.name_crops, help)?;
        range("encoder_rate", (0.0..=1.0).contains(&self.encoder_rate), &self.encoder_rate, help)?;
        range("decay", (0.0..1.0).contains(&self.decay), &self.decay, "write a fraction from 0 to below 1")?;
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
                    "a crop of {width} × {height} pixels is larger than the images, which are resized to {} × {}",
                    shape.width, shape.height
                ),
                help: "write a smaller crop or a larger size".into(),
            });
        }
        Ok(())
    }
}
