//! Self-training of a trained network on photographs without labels: reads a run's folder and writes another.

use super::data::{Augment, AugmentScale, Photos, Selection};
use super::deploy::input_images::InputImage;
use super::fit::class_weights::ClassWeights;
use super::fit::hyper::NormalizationMode;
use super::fit::{Adaptation, Callbacks, Hyperparameters, Plan};
use super::net::Pretrained;
use super::run::{self, Identity, ModelCard, Results, TrainedModel};
use super::session::{self, Machine};
use furrow_base::{Error, Result};
use std::path::Path;

/// Decay of the moving average of the weights that labels the photographs, if the run was trained without one.
const EMA: f64 = 0.99;
/// Largest width and height of the crops, pixels, if the run's folder has no plan.
const CROP: (u32, u32) = (320, 256);

/// Options of a self-training, as a user gives them.
pub struct AdaptOptions<'a> {
    /// Folder of the run whose weights the training starts from.
    pub run: &'a Path,
    /// Labelled training images; if empty, the training set of the run.
    pub sets: &'a [Selection],
    /// Labelled validation images; if empty, the last weights are kept.
    pub val: &'a [Selection],
    /// Number of training steps.
    pub steps: u64,
    /// Learning rate; by default a fifth of the run's.
    pub rate: Option<f64>,
    /// Fraction of the predicted pixels of each class that become labels, the most confident first; above 0, at most 1.
    pub keep: f64,
    /// Largest number of photographs to use; they are picked at even intervals.
    pub most: usize,
    /// Seed.
    pub seed: u64,
    /// Precision: `f32` or `bf16`.
    pub precision: &'a str,
    /// Number of compute threads.
    pub threads: usize,
}

impl AdaptOptions<'_> {
    /// Returns the plan of the training, without its photographs ([`Plan::adaptation`]).
    fn plan(&self, card: &ModelCard) -> Result<Plan> {
        let path = self.run.join(run::PLAN);
        let before = path.exists().then(|| run::read_json::<Identity>(&path)).transpose()?.map(|i| i.plan);
        let crop = (CROP.0.min(card.input.width), CROP.1.min(card.input.height));
        let hyper = before.as_ref().map_or_else(
            || Hyperparameters { crop_size: Some(crop), augment: Augment::default(), ..Hyperparameters::default() },
            |before| before.hyper.clone(),
        );
        let train = match (self.sets, &before) {
            ([], Some(before)) => before.train.clone(),
            ([], None) => {
                return Err(Error::misuse("this folder has no record of the images that the network was trained on")
                    .in_file(self.run)
                    .help("name labelled images with --set DIR: without them a network confirms its own errors"));
            }
            (sets, _) => sets.to_vec(),
        };
        let hyper = Hyperparameters {
            steps: self.steps,
            rate: self.rate.unwrap_or(0.2 * hyper.rate),
            class_weights: ClassWeights::None,
            calibrate: 0,
            logit_adjustment: 0.0,
            name_crops: 0.0,
            pretrained: Pretrained::None,
            freeze: 0,
            encoder_rate: if hyper.encoder_rate > 0.0 { hyper.encoder_rate } else { 1.0 },
            ema: if hyper.ema > 0.0 { hyper.ema } else { EMA },
            resize: card.resize.clone(),
            refine: card.refine,
            normalization: NormalizationMode::of(&card.normalization),
            // Other images may not record the size of their pixels.
            augment_scale: if self.sets.is_empty() { hyper.augment_scale } else { AugmentScale::Relative },
            ..hyper
        };
        // Checked before any photograph is read.
        hyper.check(&card.input).map_err(|invalid| invalid.of_flag())?;
        Ok(Plan {
            network: card.network,
            classes: card.classes.clone(),
            shape: card.input.clone(),
            train,
            val: self.val.to_vec(),
            seed: self.seed,
            hyper,
            precision: self.precision.into(),
            threads: self.threads,
            ..Plan::default()
        })
    }

    /// Continues the training of the run on the photographs `pictures` and writes the result to `folder`. After an
    /// interruption, the same call resumes.
    pub fn adapt(
        &self,
        pictures: &[InputImage],
        machine: &Machine,
        folder: &Path,
        callbacks: &Callbacks<'_>,
    ) -> Result<Results> {
        if !(self.keep > 0.0 && self.keep <= 1.0) {
            return Err(Error::misuse(format!("--keep: {} is out of range", self.keep))
                .help("write a fraction above 0 and at most 1, such as 0.5"));
        }
        let TrainedModel { card, .. } = TrainedModel::open(self.run)?;
        let plan = self.plan(&card)?;
        let mut photos = Photos::new(&card.input.bands, (card.input.width, card.input.height), card.resize);
        let used = pictures.len().min(self.most.max(1));
        for picture in (0..used).map(|k| &pictures[k * pictures.len() / used]) {
            let found = picture.read()?;
            photos.add((found.width, found.height), &found.planes).map_err(|e| e.in_file(picture.photo.clone()))?;
        }
        if photos.is_empty() {
            return Err(Error::misuse("there is no photograph to train on"));
        }
        let adaptation = Adaptation {
            photos: photos.len(),
            photos_sha256: photos.checksum(),
            keep: self.keep,
            normalization: card.normalization,
        };
        let plan = Plan { adaptation: Some(adaptation), ..plan };
        session::train(&plan, &card.crops, Some(self.run), Some(photos), machine, folder, callbacks)
    }
}
