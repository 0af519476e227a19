//! A training and an evaluation from files to files.

use super::data::{Pick, Selection, Store, augment};
use super::engine::{Model, Precision, Where, device};
use super::fit::calibrate::calibrate;
use super::fit::checkpoint::Checkpoint;
use super::fit::{self, Data, Plan, Watch};
use super::measure::{Answer, Evaluation, Report};
use super::net::{Parameter, parameters};
use super::run::{self, Card, Identity, Learnt, Results};
use super::weights;
use crate::dataset::split::Split;
use crate::output::remove_unfinished;
use crate::{Error, Result};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// What a machine gives: decides no result but for the last bits.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Machine {
    /// `cpu`, `cuda` or `cuda:1`.
    pub device: String,
    /// Threads that load images.
    pub loaders: usize,
    /// Bytes of decoded images that are kept.
    pub memory: u64,
}

impl Machine {
    /// The device and the precision of a plan on it.
    pub fn place(&self, precision: &str) -> Result<Where> {
        let device = device::find(&self.device)?;
        Ok(Where { device, precision: Precision::named(precision, device).map_err(Error::input)? })
    }
}

/// Trains a plan into a folder; goes on where it was left, and does nothing where it is done. `begin` is the folder of a run whose
/// weights it begins with.
pub fn fit(plan: &Plan, begin: Option<&Path>, machine: &Machine, folder: &Path, watch: &Watch<'_>) -> Result<Results> {
    let place = machine.place(&plan.precision)?;
    device::set_threads(plan.threads);
    let open = |selections: &[Selection], otherwise| {
        Store::open(selections, otherwise, plan.seed, &plan.classes, &plan.shape, false, machine.memory)
    };
    let train = open(&plan.train, Pick::Split(Split::Train))?;
    let val = open(&plan.val, Pick::Split(Split::Val))?;
    if train.is_empty() {
        return Err(Error::misuse("there is no image to learn from")
            .help("name sets with --set DIR, or other images of them with DIR@all"));
    }
    let begin = begin.map(Learnt::open).transpose()?.map(|l| l.values).unwrap_or_default();
    let plan = Plan { begin_with: (!begin.is_empty()).then(|| weights::hash(&begin)), ..plan.clone() };
    let identity = Identity::of(&plan, &train, &val)?;
    // A set without the bands is told before a folder is taken for it.
    train.get(0)?;
    if !val.is_empty() {
        val.get(0)?;
    }
    identity.claim(folder)?;
    remove_unfinished(folder)?;
    if let Some(results) = run::results(folder)? {
        return Ok(results);
    }
    let hash = identity.hash()?;
    let data = Data { train: Arc::new(train), val, loaders: machine.loaders };
    let mut outcome = fit::teach(&plan, &hash, &data, &begin, place, folder, watch)?;
    if plan.calibrate > 0 {
        let model = Model::with(plan.network, plan.shape.bands.len(), plan.classes.len(), &outcome.values, place)?;
        outcome.values = calibrate(&model, &data.train, &outcome.normalisation, plan.calibrate)?;
    }
    let learnt = parameters(plan.network, plan.shape.bands.len(), plan.classes.len());
    let card = Card {
        furrow: env!("CARGO_PKG_VERSION").into(),
        network: plan.network,
        parameters: learnt.iter().filter(|p| p.role.is_learnt()).map(Parameter::len).sum(),
        input: plan.shape.clone(),
        normalisation: outcome.normalisation,
        classes: plan.classes.clone(),
        weights: run::WEIGHTS.into(),
        weights_sha256: weights::hash(&outcome.values),
        plan_sha256: hash,
    };
    Learnt { card, values: outcome.values }.write(folder)?;
    let results = Results {
        steps: outcome.steps,
        best_step: outcome.history.best().map(|look| look.step),
        ended: outcome.ended.into(),
        images_per_second: outcome.steps as f64 * plan.batch as f64 / outcome.seconds.max(1e-9),
        history: outcome.history,
        seconds: outcome.seconds,
    };
    run::write_json(&folder.join(run::RESULT), &results)?;
    Checkpoint::remove(folder)?;
    Ok(results)
}

/// What was learnt, each class answered as readily as overlaps best with the labels of `images` images of the selections.
pub fn calibrated(
    learnt: &Learnt,
    on: &[Selection],
    images: u64,
    precision: &str,
    threads: usize,
    machine: &Machine,
) -> Result<Learnt> {
    let card = &learnt.card;
    let place = machine.place(precision)?;
    device::set_threads(threads);
    let model = Model::with(card.network, card.input.bands.len(), card.classes.len(), &learnt.values, place)?;
    let store = Store::open(on, Pick::Split(Split::Train), 0, &card.classes, &card.input, false, 0)?;
    if store.is_empty() {
        return Err(Error::misuse("there is no image to calibrate on").help("name others of the set, such as DIR@all"));
    }
    let values = calibrate(&model, &store, &card.normalisation, images)?;
    let card = Card { weights_sha256: weights::hash(&values), ..card.clone() };
    Ok(Learnt { card, values })
}

/// Which class each pixel of an image is, as [`evaluate`] shows it to whoever wants to keep it.
pub struct Seen<'a> {
    /// Its place in the selection.
    pub place: usize,
    /// The image as the network sees it, before anything is taken out.
    pub example: &'a super::data::Example,
    /// What the network says.
    pub predicted: &'a [u8],
}

/// Judges what was learnt on images of a set, one after the other; each is shown to `seen`.
pub fn evaluate(
    learnt: &Learnt,
    on: &Selection,
    precision: &str,
    threads: usize,
    machine: &Machine,
    stop: &AtomicBool,
    seen: &mut dyn FnMut(&Seen<'_>) -> Result<()>,
) -> Result<Report> {
    let card = &learnt.card;
    let place = machine.place(precision)?;
    device::set_threads(threads);
    let model = Model::with(card.network, card.input.bands.len(), card.classes.len(), &learnt.values, place)?;
    let store = Store::open(std::slice::from_ref(on), Pick::All, 0, &card.classes, &card.input, true, 0)?;
    let (width, height) = (card.input.width, card.input.height);
    let mut evaluation = Evaluation::new(card.classes.names());
    for place in 0..store.len() {
        if stop.load(Ordering::Relaxed) {
            return Err(Error::interrupted());
        }
        let example = store.get(place)?;
        let mut pixels = augment::interleave(&example, 1);
        card.normalisation.apply(&mut pixels, card.input.bands.len());
        let begun = Instant::now();
        let predicted = model.predict(&pixels, (width, height))?;
        let seconds = Some(begun.elapsed().as_secs_f64());
        let plants = example.plants.iter().any(|p| *p > 0).then_some(example.plants.as_slice());
        let (name, truth) = (example.name.as_str(), example.labels.as_slice());
        evaluation.add(&Answer { name, width, height, truth, predicted: &predicted, plants, seconds })?;
        seen(&Seen { place, example: &example, predicted: &predicted })?;
    }
    Ok(evaluation.finish())
}
