//! Adds a plant decoder to a trained network: reads a run's folder and writes another. The class scores stay the same.

use super::data::{Augment, AugmentScale, Selection};
use super::fit::class_weights::ClassWeights;
use super::fit::hyper::NormalizationMode;
use super::fit::{Callbacks, Hyperparameters, Plan};
use super::net::{Pretrained, plants};
use super::run::{ModelCard, Results, TrainedModel};
use super::session::{self, Machine};
use furrow_base::{Error, Result};
use std::path::Path;

/// Decay of the moving average of the weights.
const EMA: f64 = 0.99;
/// Largest width and height of the crops, pixels.
const CROP: (u32, u32) = (320, 256);
/// Fraction of the crops around a pixel of a rare class: small plants.
const RARE: f64 = 0.3;

/// Options of the training, as a user gives them.
pub struct PlantOptions<'a> {
    /// Folder of the run whose network gets the decoder.
    pub run: &'a Path,
    /// Training images with plant numbers.
    pub sets: &'a [Selection],
    /// Number of training steps.
    pub steps: u64,
    /// Learning rate at the start.
    pub rate: f64,
    /// Images per batch.
    pub batch: usize,
    /// Seed.
    pub seed: u64,
    /// Precision: `f32` or `bf16`.
    pub precision: &'a str,
    /// Number of compute threads.
    pub threads: usize,
}

impl PlantOptions<'_> {
    /// Returns the plan of the training. Except for the decoder, everything is that of the run.
    fn plan(&self, card: &ModelCard) -> Result<Plan> {
        if plants::plants(card.network, card.input.bands.len(), card.classes.len()).is_empty() {
            return Err(Error::misuse(format!("{} cannot have a plant decoder", card.network.name()))
                .in_file(self.run)
                .help("name a run of a U-Net: unet, lite-unet, vit-unet or tiny-unet"));
        }
        if !card.species.is_empty() {
            return Err(Error::misuse("this network takes the crop as an input: the plant decoder does not")
                .in_file(self.run)
                .help("name an ordinary network, trained without --name-crops"));
        }
        let crop = (CROP.0.min(card.input.width), CROP.1.min(card.input.height));
        let hyper = Hyperparameters {
            steps: self.steps,
            batch: self.batch,
            rate: self.rate,
            crop_size: Some(crop),
            rare_crops: RARE,
            class_weights: ClassWeights::None,
            pretrained: Pretrained::None,
            ema: EMA,
            resize: card.resize.clone(),
            refine: card.refine,
            augment: Augment { erase: true, ..Augment::default() },
            augment_scale: AugmentScale::Relative,
            normalization: NormalizationMode::of(&card.normalization),
            ..Hyperparameters::default()
        };
        hyper.check(&card.input).map_err(|invalid| invalid.of_flag())?;
        Ok(Plan {
            network: card.network,
            classes: card.classes.clone(),
            shape: card.input.clone(),
            train: self.sets.to_vec(),
            val: Vec::new(),
            seed: self.seed,
            hyper,
            precision: self.precision.into(),
            threads: self.threads,
            plants: Some(card.normalization.clone()),
            ..Plan::default()
        })
    }

    /// Trains the decoder and writes the network to `folder`. After an interruption, the same call resumes.
    pub fn train(&self, machine: &Machine, folder: &Path, callbacks: &Callbacks<'_>) -> Result<Results> {
        let TrainedModel { card, .. } = TrainedModel::open(self.run)?;
        let plan = self.plan(&card)?;
        session::train(&plan, &card.crops, Some(self.run), None, machine, folder, callbacks)
    }
}
