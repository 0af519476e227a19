//! The steps of a training: a batch, its loss, its gradients, a step; now and then a look at the validation images.

use super::balance;
use super::checkpoint::{Checkpoint, History, Look, Loss};
use super::objective;
use super::optimiser::Optimiser;
use super::plan::{Exposure, Plan};
use crate::dataset::sample::IGNORE;
use crate::train::data::{Batch, Loader, Normalisation, Order, Store, augment};
use crate::train::engine::{Model, Where, failed};
use crate::train::measure::{Confusion, Scores};
use crate::train::weights::Array;
use crate::{Error, Result};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use tch::{Kind, Tensor};

/// What a training reads.
pub struct Data {
    /// To learn from; at least one image.
    pub train: Arc<Store>,
    /// To be watched by; may be empty.
    pub val: Store,
    /// Threads that load.
    pub loaders: usize,
}

/// What a training tells and heeds while it goes on.
pub struct Watch<'a> {
    /// After every step: steps done, its loss.
    pub step: &'a dyn Fn(u64, f64),
    /// After every look at the validation images, and whether it is the best so far.
    pub look: &'a dyn Fn(&Look, bool),
    /// Raised by whoever wants it to stop.
    pub stop: &'a AtomicBool,
}

/// What came out.
pub struct Outcome {
    /// The values at the best look, or the last where there were no looks.
    pub values: Vec<Array>,
    /// What was taken out of images.
    pub normalisation: Normalisation,
    /// What was seen.
    pub history: History,
    /// Steps done.
    pub steps: u64,
    /// Why it ended: `steps`, `patience` or `time`.
    pub ended: &'static str,
    /// Seconds of work, over all sittings.
    pub seconds: f64,
}

/// Points of the loss curve.
const POINTS: u64 = 200;

/// Trains a plan, from its checkpoint in `folder` where there is one. `hash` is the plan's; `begin` the values to begin with where
/// they are another run's. Told to stop, it leaves a checkpoint and ends with [`Kind::Interrupted`](crate::error::Kind::Interrupted).
pub fn teach(
    plan: &Plan,
    hash: &str,
    data: &Data,
    begin: &[Array],
    place: Where,
    folder: &Path,
    watch: &Watch<'_>,
) -> Result<Outcome> {
    let classes = plan.classes.len();
    let normalisation = match plan.exposure {
        Exposure::Band => Normalisation::Band,
        Exposure::Image => Normalisation::Image,
        Exposure::Fixed => Normalisation::fixed(&data.train)?,
    };
    let mut at = Checkpoint::read(folder, hash)?.unwrap_or_default();
    let mut model = Model::new(plan.network, plan.shape.bands.len(), classes, plan.seed, place);
    if at.step > 0 {
        model.load(&at.values)?;
    } else if !begin.is_empty() {
        model.load(begin)?;
    }
    let mut optimiser = Optimiser::new(plan.method, plan.decay, at.step, &at.memory, &model);
    let rarities = balance::rarities(&data.train, classes)?;
    let order = Order {
        seed: plan.seed,
        batch: plan.batch,
        window: plan.window(),
        rare: plan.rare,
        augment: plan.augment,
        normalisation: normalisation.clone(),
    };
    let mut loader = Loader::start(&data.train, &order, at.step, plan.steps, data.loaders);
    let (begun, before) = (Instant::now(), at.seconds);
    let every = (plan.steps / POINTS).max(1);
    let out_of_patience = |at: &Checkpoint| at.history.since_best() >= plan.patience && !data.val.is_empty();
    let ended =
        loop {
            at.seconds = before + begun.elapsed().as_secs_f64();
            if at.step >= plan.steps {
                break "steps";
            }
            if out_of_patience(&at) {
                break "patience";
            }
            if plan.seconds.is_some_and(|most| at.seconds >= most as f64) {
                break "time";
            }
            if watch.stop.load(Ordering::Relaxed) {
                save(&mut at, &model, &optimiser, folder, hash)?;
                let words = format!("stopped after step {} of {}, where it goes on", at.step, plan.steps);
                return Err(Error::stopped(words).help("the same command goes on with it").in_file(folder));
            }
            let batch = loader.next().unwrap_or_else(|| Err(Error::failed("the loading threads have ended")))?;
            let in_time = plan.seconds.map_or(0.0, |most| at.seconds / most as f64);
            let done = in_time.max(at.step as f64 / plan.steps as f64);
            let rate = plan.rate * plan.schedule.share(done);
            let weights = Tensor::from_slice(&plan.balance.weights(&rarities, done)).to_device(place.device);
            let loss = step(&model, &mut optimiser, &batch, plan, &weights, rate)?;
            if !loss.is_finite() {
                return Err(Error::input(format!("the loss of step {} is no number any more", at.step + 1)).help(
                    format!("a smaller --rate than {} (this training lies in {})", plan.rate, folder.display()),
                ));
            }
            at.step += 1;
            at.pending = (at.pending.0 + loss, at.pending.1 + 1);
            if at.step % every == 0 {
                let (sum, n) = std::mem::take(&mut at.pending);
                at.history.losses.push(Loss { step: at.step, loss: sum / n as f64, rate });
            }
            (watch.step)(at.step, loss);
            if at.step % plan.watch_every == 0 || at.step == plan.steps {
                if !data.val.is_empty() {
                    let look = look(&model, &data.val, &normalisation, at.step)?;
                    at.history.looks.push(look.clone());
                    let best = at.history.since_best() == 0;
                    if best {
                        at.best = model.arrays()?;
                    }
                    (watch.look)(&look, best);
                }
                at.seconds = before + begun.elapsed().as_secs_f64();
                save(&mut at, &model, &optimiser, folder, hash)?;
            }
        };
    let values = if at.best.is_empty() { model.arrays()? } else { at.best };
    Ok(Outcome { values, normalisation, history: at.history, steps: at.step, ended, seconds: at.seconds })
}

fn save(at: &mut Checkpoint, model: &Model, optimiser: &Optimiser, folder: &Path, hash: &str) -> Result<()> {
    at.values = model.arrays()?;
    at.memory = optimiser.arrays()?;
    at.write(folder, hash)
}

/// One step; its loss. A batch without a labelled pixel teaches nothing.
fn step(
    model: &Model,
    optimiser: &mut Optimiser,
    batch: &Batch,
    plan: &Plan,
    weights: &Tensor,
    rate: f64,
) -> Result<f64> {
    if batch.labels.iter().all(|l| *l == IGNORE) {
        return Ok(0.0);
    }
    let size = plan.window();
    let x = model.images(&batch.pixels, size);
    let y = Tensor::from_slice(&batch.labels).to_device(model.place.device).to_kind(Kind::Int64);
    let y = y.view([batch.images as i64, i64::from(size.1), i64::from(size.0)]);
    let loss = objective::loss(plan.loss, &model.forward(&x, true), &y, weights);
    optimiser.step(model, &loss, rate);
    f64::try_from(loss).map_err(|e| failed(&e))
}

/// How well the network does on all validation images together.
fn look(model: &Model, val: &Store, normalisation: &Normalisation, step: u64) -> Result<Look> {
    let shape = val.shape();
    let mut confusion = Confusion::new(model.classes);
    for place in 0..val.len() {
        let example = val.get(place)?;
        let mut pixels = augment::interleave(&example, 1);
        normalisation.apply(&mut pixels, shape.bands.len());
        confusion.add(&example.labels, &model.predict(&pixels, (shape.width, shape.height))?)?;
    }
    let plants: Vec<bool> = (0..model.classes).map(|c| c > 0).collect();
    let scores = Scores::of(&confusion, &plants);
    let number = |v: Option<f64>| v.unwrap_or(0.0);
    let (ga, miou) = (number(scores.global_accuracy), number(scores.mean_iou));
    Ok(Look { step, ga, miou, iou: scores.classes.iter().map(|c| c.iou).collect() })
}
