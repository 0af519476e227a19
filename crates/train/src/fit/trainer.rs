//! The training loop: batch, loss, gradients and optimiser step, with a validation pass at regular intervals.

use super::adapt;
use super::checkpoint::{Checkpoint, History, LossPoint, ValidationPass};
use super::class_weights;
use super::ema::Ema;
use super::gradients::Gradients;
use super::hyper::NormalizationMode;
use super::log::TrainingLog;
use super::loss;
use super::optimiser::Optimiser;
use super::plan::Plan;
use crate::data::plants;
use crate::data::{Batch, BatchSettings, Loader, Naming, Normalization, Photos, PixelSizes, Store, Views, augment};
use crate::figure::{Figure, Thumbnails, compose};
use crate::measure::{Confusion, Scores};
use crate::net::plants::is_of_plants;
use crate::net::{Extras, is_encoder};
use crate::torch::{Model, Pass, Placement, classes, failed};
use crate::weights::Array;
use furrow_base::math::{ToFloat, ToInt};
use furrow_base::{Error, Result};
use furrow_dataset::model::sample::IGNORE;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use tch::{Kind, Tensor};

/// Images of a training.
pub struct Data {
    /// Training set; at least one image.
    pub train: Arc<Store>,
    /// Validation set; may be empty.
    pub val: Store,
    /// Photographs without labels, if the plan is a self-training.
    pub photos: Option<Arc<Photos>>,
    /// Pixel sizes of the training images on the ground, if crops are scaled by them.
    pub pixels: Option<PixelSizes>,
    /// Number of loading threads.
    pub loaders: usize,
}

/// Callbacks of a training, and the flag that stops it.
pub struct Callbacks<'a> {
    /// Called after every step with the number of completed steps and the loss, if the batch has a labelled pixel.
    pub step: &'a dyn Fn(u64, Option<f64>),
    /// Called after every validation pass, with `true` if it is the best so far.
    pub validation: &'a dyn Fn(&ValidationPass, bool),
    /// Called with each warning about the plan, before the first step.
    pub warn: &'a dyn Fn(&str),
    /// Set to `true` to stop the training after the current step.
    pub stop: &'a AtomicBool,
}

impl Default for Callbacks<'_> {
    /// Returns callbacks that do nothing, and a flag that is never set.
    fn default() -> Self {
        static NEVER: AtomicBool = AtomicBool::new(false);
        Self { step: &|_, _| {}, validation: &|_, _| {}, warn: &|_| {}, stop: &NEVER }
    }
}

/// Result of a training.
pub struct Outcome {
    /// Weights at the best validation pass, or the last weights if there was no pass.
    pub values: Vec<Array>,
    /// Input normalization.
    pub normalization: Normalization,
    /// Loss curve and validation passes.
    pub history: History,
    /// Number of completed steps.
    pub steps: u64,
    /// Reason for the end: `steps`, `patience` or `time`.
    pub ended: &'static str,
    /// Training time, seconds, summed over interruptions.
    pub seconds: f64,
}

/// Approximate number of points of the loss curve.
const POINTS: u64 = 200;
/// Largest number of validation images in the log.
const SHOWN: usize = 4;
/// Largest width and height of each of these images, pixels.
const LARGEST: u32 = 320;

/// Trains a plan, resuming from the checkpoint in `folder` if there is one. `hash` is the checksum of the plan; `begin` are the
/// initial weights, or empty for random ones. If [`Callbacks::stop`] is set, it writes a checkpoint and ends with
/// [`Kind::Interrupted`](furrow_base::error::Kind::Interrupted).
pub fn train(
    plan: &Plan,
    hash: &str,
    data: &Data,
    begin: &[Array],
    place: Placement,
    folder: &Path,
    callbacks: &Callbacks<'_>,
) -> Result<Outcome> {
    let (classes, hyper) = (plan.classes.len(), &plan.hyper);
    let trained = plan.adaptation.as_ref().map(|adaptation| &adaptation.normalization).or(plan.plants.as_ref());
    let normalization = match (trained, hyper.normalization) {
        (Some(normalization), _) => normalization.clone(),
        (_, NormalizationMode::Band) => Normalization::Band,
        (_, NormalizationMode::Image) => Normalization::Image,
        (_, NormalizationMode::Fixed) => Normalization::fixed(&data.train)?,
    };
    let mut at = Checkpoint::read(folder, hash)?.unwrap_or_default();
    let (bands, species) = (plan.shape.bands.len(), plan.species.len());
    let extras = Extras { species, plants: plan.plants.is_some() };
    let mut model = Model::with_extras(plan.network, bands, classes, extras, plan.seed, place);
    if at.step > 0 {
        model.load(&at.values)?;
    } else if !begin.is_empty() {
        model.load(begin)?;
    }
    model.check_training(hyper.batch, plan.crop_size())?;
    let mut optimiser = Optimiser::new(hyper.optimiser, hyper.decay, at.step, &at.memory, &model);
    let mut ema = if hyper.ema > 0.0 { Some(Ema::new(hyper.ema, &at.average, &model)?) } else { None };
    let rarities = class_weights::rarities(&data.train, classes)?;
    let order = BatchSettings {
        seed: plan.seed,
        batch: hyper.batch,
        crop_size: plan.crop_size(),
        rare: hyper.rare_crops,
        augment: hyper.augment,
        pixels: data.pixels.clone(),
        naming: (species > 0).then_some(Naming { share: hyper.name_crops, species }),
        normalization: normalization.clone(),
    };
    let mut log = TrainingLog::begin(folder, &plan.classes.names(), &at.history, at.step)?;
    let (first, last) = (at.step * hyper.accumulate, hyper.steps * hyper.accumulate);
    let mut loader = Loader::start(&data.train, &order, first, last, data.loaders)?;
    let photos = data.photos.as_ref();
    let photos = photos.map(|photos| Loader::photos(photos, &order, first, last, data.loaders));
    let mut photos = photos.transpose()?;
    let (begun, before) = (Instant::now(), at.seconds);
    let every = (hyper.steps / POINTS).max(1);
    let out_of_patience = |at: &Checkpoint| at.history.since_best() >= hyper.patience && !data.val.is_empty();
    let ended = loop {
        at.seconds = before + begun.elapsed().as_secs_f64();
        if at.step >= hyper.steps {
            break "steps";
        }
        if out_of_patience(&at) {
            break "patience";
        }
        if plan.seconds.is_some_and(|most| at.seconds >= most.to_f64()) {
            break "time";
        }
        if callbacks.stop.load(Ordering::Relaxed) {
            save(&mut at, &model, ema.as_ref(), &optimiser, folder, hash)?;
            let words = format!("stopped after step {} of {}", at.step, hyper.steps);
            return Err(Error::stopped(words).help("run the same command again to resume").in_file(folder));
        }
        let batches: Vec<Batch> = (0..hyper.accumulate).map(|_| next(&mut loader)).collect::<Result<_>>()?;
        let views = photos.as_mut().map(|p| (0..hyper.accumulate).map(|_| next(p)).collect::<Result<Vec<Views>>>());
        let photographs = match (&plan.adaptation, &ema, views.transpose()?) {
            (Some(adaptation), Some(teacher), Some(views)) => {
                let numbers = at.step * hyper.accumulate..;
                let of =
                    |((views, batch), number)| adapt::batch(teacher.model(), views, batch, adaptation, plan, number);
                views.into_iter().zip(&batches).zip(numbers).map(of).collect::<Result<Vec<_>>>()?
            }
            _ => Vec::new(),
        };
        let in_time = plan.seconds.map_or(0.0, |most| at.seconds / most.to_f64());
        let done = in_time.max(at.step.to_f64() / hyper.steps.to_f64());
        let rate = hyper.rate * hyper.schedule.share(done);
        let weights = Tensor::from_slice(&hyper.class_weights.weights(&rarities, done)).to_device(place.device);
        let encoder = if at.step < hyper.freeze { 0.0 } else { hyper.encoder_rate };
        let loss = step(&model, &mut optimiser, &batches, &photographs, plan, &weights, [rate, encoder])?;
        if loss.is_some_and(|loss| !loss.is_finite()) {
            return Err(diverged(plan, at.step, !begin.is_empty(), folder));
        }
        at.step += 1;
        if let Some(ema) = &mut ema {
            ema.update(&model, at.step);
        }
        if let Some(loss) = loss {
            at.pending = (at.pending.0 + loss, at.pending.1 + 1);
        }
        if at.step % every == 0 && at.pending.1 > 0 {
            let (sum, n) = std::mem::take(&mut at.pending);
            let point = LossPoint { step: at.step, loss: sum / n.to_f64(), rate };
            log.loss(&point)?;
            at.history.losses.push(point);
            log.csv(&at.history)?;
        }
        (callbacks.step)(at.step, loss);
        if at.step % hyper.validate_every == 0 || at.step == hyper.steps {
            let kept = ema.as_ref().map_or(&model, Ema::model);
            if !data.val.is_empty() {
                let (pass, picture) = validate(kept, &data.val, &normalization, plan, &weights, at.step)?;
                log.pass(&pass, Some(&picture))?;
                at.history.validation.push(pass.clone());
                let best = at.history.since_best() == 0;
                if best {
                    at.best = kept.arrays()?;
                }
                (callbacks.validation)(&pass, best);
            }
            log.csv(&at.history)?;
            at.seconds = before + begun.elapsed().as_secs_f64();
            save(&mut at, &model, ema.as_ref(), &optimiser, folder, hash)?;
        }
    };
    let kept = ema.as_ref().map_or(&model, Ema::model);
    let values = if at.best.is_empty() { kept.arrays()? } else { at.best };
    Ok(Outcome { values, normalization, history: at.history, steps: at.step, ended, seconds: at.seconds })
}

/// Returns the error for a loss that is not finite after `steps` steps. Before the first step, the learning rate cannot be the
/// cause.
fn diverged(plan: &Plan, steps: u64, begun_with_weights: bool, folder: &Path) -> Error {
    let lies = format!("the folder of this training is {}", folder.display());
    if steps == 0 && begun_with_weights {
        return Error::input("with the initial weights of this training, the first loss is not finite")
            .help(format!("their values are too large: use other weights, or --pretrained none ({lies})"));
    }
    Error::input(format!("the loss of step {} is not finite", steps + 1))
        .help(format!("use a --rate below {} ({lies})", plan.hyper.rate))
}

fn next<T>(loader: &mut Loader<T>) -> Result<T>
where
    Loader<T>: Iterator<Item = Result<T>>,
{
    loader.next().unwrap_or_else(|| Err(Error::failed("the loading threads ended early")))
}

fn save(
    at: &mut Checkpoint,
    model: &Model,
    ema: Option<&Ema>,
    optimiser: &Optimiser,
    folder: &Path,
    hash: &str,
) -> Result<()> {
    at.values = model.arrays()?;
    at.average = ema.map_or_else(|| Ok(Vec::new()), |ema| ema.model().arrays())?;
    at.memory = optimiser.arrays()?;
    at.write(folder, hash)
}

/// Makes one step with the learning rates `rate` and `encoder` and returns the mean loss of the batches. The losses of
/// `photographs` are multiplied by their weights. Batches without a labelled pixel are skipped; if all are, the weights stay
/// unchanged and the result is `None`.
fn step(
    model: &Model,
    optimiser: &mut Optimiser,
    batches: &[Batch],
    photographs: &[(Batch, f64)],
    plan: &Plan,
    weights: &Tensor,
    [rate, encoder]: [f64; 2],
) -> Result<Option<f64>> {
    let size = plan.crop_size();
    let pass = match (encoder > 0.0, photographs.is_empty()) {
        _ if plan.plants.is_some() => Pass::Plants,
        (false, _) => Pass::Decoder,
        (true, true) => Pass::Training,
        (true, false) => Pass::Batch,
    };
    let batches = batches.iter().map(|batch| (batch, pass, 1.0));
    let photographs = photographs.iter().map(|(batch, share)| (batch, Pass::Training, *share));
    let learns = |name: &str| {
        let of_plants = is_of_plants(name);
        if plan.plants.is_some() { of_plants } else { !of_plants && (encoder > 0.0 || !is_encoder(name)) }
    };
    let mut gradients = Gradients::new(model, learns);
    let mut losses: Vec<f64> = Vec::new();
    for (batch, pass, weight) in batches.chain(photographs) {
        if batch.labels.iter().all(|l| *l == IGNORE) {
            continue;
        }
        let x = model.images(&batch.pixels, size);
        let loss = if plan.plants.is_some() {
            let targets = planes(model, &batch.plants, batch.images, size);
            let Some(loss) = loss::plants(&model.forward_plants(&x, pass)?, &targets) else { continue };
            loss
        } else {
            let y = labels(model, &batch.labels, batch.images, size);
            loss::loss(plan.hyper.loss, &model.forward_named(&x, pass, &batch.crops), &y, weights) * weight
        };
        gradients.add(&loss);
        losses.push(f64::try_from(loss).map_err(|e| failed(&e))?);
    }
    if losses.is_empty() {
        return Ok(None);
    }
    optimiser.step(gradients.mean(), rate, encoder);
    Ok(Some(losses.iter().sum::<f64>() / losses.len().to_f64()))
}

/// Converts labels to the tensor that the loss expects: images × height × width, 64-bit integers.
fn labels(model: &Model, labels: &[u8], images: usize, (width, height): (u32, u32)) -> Tensor {
    let flat = Tensor::from_slice(labels).to_device(model.place.device).to_kind(Kind::Int64);
    flat.view([images.to_i64(), i64::from(height), i64::from(width)])
}

/// Converts the targets of the plant decoder to a tensor of images × planes × height × width.
fn planes(model: &Model, values: &[f32], images: usize, (width, height): (u32, u32)) -> Tensor {
    let flat = Tensor::from_slice(values).to_device(model.place.device);
    flat.view([images.to_i64(), plants::PLANES.to_i64(), i64::from(height), i64::from(width)])
}

/// Makes a validation pass: computes the scores of the network on all validation images together, and an image of some
/// predictions.
fn validate(
    model: &Model,
    val: &Store,
    normalization: &Normalization,
    plan: &Plan,
    weights: &Tensor,
    step: u64,
) -> Result<(ValidationPass, Figure)> {
    let shape = val.shape();
    let size = (shape.width, shape.height);
    let mut confusion = Confusion::new(model.classes);
    let mut losses = Vec::new();
    let mut thumbnails = Thumbnails::new(val.len(), SHOWN, LARGEST, &shape.bands);
    for place in 0..val.len() {
        let example = val.get(place)?;
        let mut pixels = augment::interleave(&example, 1);
        normalization.apply(&mut pixels, shape.bands.len());
        model.check_inference(1, size)?;
        let scores = tch::no_grad(|| model.forward(&model.images(&pixels, size), Pass::Inference));
        if example.labels.iter().any(|label| *label != IGNORE) {
            let truth = labels(model, &example.labels, 1, size);
            let loss = tch::no_grad(|| loss::loss(plan.hyper.loss, &scores, &truth, weights));
            losses.push(f64::try_from(loss).map_err(|e| failed(&e))?);
        }
        let predicted = classes(&scores)?;
        confusion.add(&example.labels, &predicted)?;
        thumbnails.see(&example, size, &predicted)?;
    }
    let plants: Vec<bool> = (0..model.classes).map(|c| c > 0).collect();
    let scores = Scores::of(&confusion, &plants);
    let number = |v: Option<f64>| v.unwrap_or(0.0);
    let (ga, miou) = (number(scores.global_accuracy), number(scores.mean_iou));
    let iou = scores.classes.iter().map(|c| c.iou).collect();
    let loss = (!losses.is_empty()).then(|| losses.iter().sum::<f64>() / losses.len().to_f64());
    Ok((ValidationPass { step, ga, miou, iou, loss }, compose(&thumbnails.kept(), &plan.classes.colors(), false)))
}
