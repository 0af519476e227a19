//! All of an experiment, as far as it is missing: sets, then row after row training and evaluations, then tables.

use super::against;
use super::evaluation::{self, BASELINE, Evaluated, Known, StoredEvaluation};
use super::experiment::{Experiment, Part, TrainSet};
use super::print;
use super::rows::{self, Learner, Row};
use super::sets::Bound;
use crate::dataset::generate::Shard;
use crate::output::{remove_unfinished, remove_unfinished_in, write_atomically};
use crate::train::baseline::{Baseline, Kind, files};
use crate::train::data::{Pick, Selection, Shape, Store};
use crate::train::fit::Plan;
use crate::train::measure::Report;
use crate::train::net::Network;
use crate::train::run::{self, Identity, Results, TrainedModel};
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Report of a training, below its folder.
pub const PAGE: &str = "report.html";

/// A part of the work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Only {
    /// The sets.
    Sets,
    /// The tables, of what is there.
    Tables,
}

/// What is to be done.
#[derive(Clone, Copy, Debug)]
pub struct Order<'a> {
    /// The experiment and its images.
    pub bound: &'a Bound,
    /// Its folder.
    pub out: &'a Path,
    /// The experiment file's text, to be kept beside the tables.
    pub page: &'a str,
    /// Every so many-th row.
    pub shard: Shard,
    /// A part of the work; all of it with none.
    pub only: Option<Only>,
    /// Most seconds of a training.
    pub seconds: Option<u64>,
    /// Threads that compute, for trainings that are not begun yet; others keep theirs.
    pub threads: usize,
    /// Precision, for the same.
    pub precision: &'a str,
}

/// What the work calls: trainings and evaluations, which need libtorch, and messages.
pub struct Callbacks<'a> {
    /// Trains a plan into a folder, or goes on with it.
    pub fit: &'a dyn Fn(&Plan, &Path) -> Result<Results>,
    /// Writes the report of a training, from what lies in its folder.
    pub page: &'a dyn Fn(&Path) -> Result<()>,
    /// Evaluates a predictor on images, and leaves a figure of some of them.
    pub evaluate: &'a dyn Fn(&Predictor<'_>, &Selection, &Path) -> Result<Report>,
    /// Called before each training: what it is, and how far the experiment is.
    pub training: &'a dyn Fn(&str, &State),
    /// Called with a message about other work.
    pub tell: &'a (dyn Fn(&str) + Sync),
    /// Called with a warning.
    pub warn: &'a (dyn Fn(&str) + Sync),
    /// Raised by whoever wants it to stop.
    pub stop: &'a Arc<AtomicBool>,
}

/// What predicts.
pub enum Predictor<'a> {
    /// A trained model, to be computed with a precision and so many threads.
    Network(&'a TrainedModel, &'a str, usize),
    /// A baseline, on images of this shape.
    Baseline(&'a Baseline, &'a Shape),
}

/// How far the trainings of a shard are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// The training at hand, from 1.
    pub number: usize,
    /// Trainings of the shard.
    pub of: usize,
    /// Seconds that this one and those to come will take, by those of the experiment that are done.
    pub left: Option<f64>,
}

/// Does what is missing; returns the paths of the tables.
pub fn run(order: &Order<'_>, callbacks: &Callbacks<'_>) -> Result<Vec<PathBuf>> {
    let Order { bound, out, .. } = *order;
    if order.only == Some(Only::Tables) {
        return tables(order, callbacks);
    }
    bound.check()?;
    alone(out, || write_atomically(&out.join("experiment.ron"), order.page.as_bytes()))?;
    let rows = rows::of_shard(&bound.experiment, order.shard);
    if order.only.is_none() {
        check_pretrained(&bound.experiment, &rows)?;
    }
    for set in bound.used() {
        bound.make(set, callbacks.tell, callbacks.warn, callbacks.stop)?;
    }
    if order.only == Some(Only::Sets) {
        return Ok(bound.used().into_iter().map(|set| bound.folder(set).join(crate::dataset::recipe::FILE)).collect());
    }
    // Before hours are spent on the first row, the last one is checked.
    let mut todo = Vec::new();
    for (_, row) in &rows {
        let work = Work { order, callbacks, row: *row, folder: row.folder(&bound.experiment, out) };
        work.check()?;
        todo.push(work);
    }
    let trainings: Vec<&Work<'_>> = todo.iter().filter(|w| w.network().is_some()).collect();
    let mut number = 0;
    for work in &todo {
        if work.network().is_some() {
            number += 1;
        }
        if work.folder.exists() {
            remove_unfinished(&work.folder)?;
        }
        let made = work.train(number, &trainings)? | work.evaluate()?;
        if made {
            // What is left out of them is reported once, at the end.
            tables(order, &Callbacks { warn: &|_| (), ..*callbacks })?;
        }
    }
    tables(order, callbacks)
}

/// Checks the weights that networks begin with, each file once, before anything is rendered.
fn check_pretrained(experiment: &Experiment, rows: &[(usize, Row)]) -> Result<()> {
    let mut seen = BTreeSet::new();
    for (_, row) in rows {
        let Learner::Network(network, seed) = row.learner else { continue };
        let plan = &experiment.train[row.train].plan;
        let pretrained = &plan.hyper.pretrained;
        if !pretrained.is_none() && seen.insert((network, pretrained.name())) {
            let begun = pretrained.begin(network, &plan.shape.bands, plan.classes.len(), seed);
            begun.map_err(|error| error.within(row.in_words(experiment)))?;
        }
    }
    Ok(())
}

/// Checks the weights that networks begin with.
///
/// # Errors
/// The first that are missing or wrong.
pub fn check_weights(bound: &Bound) -> Result<()> {
    check_pretrained(&bound.experiment, &rows::of_shard(&bound.experiment, Shard::ALL))
}

/// Writes the tables of what is there.
fn tables(order: &Order<'_>, callbacks: &Callbacks<'_>) -> Result<Vec<PathBuf>> {
    // Shards would all measure the same, each after each of its rows; whoever writes the tables of all does it once.
    if order.shard == Shard::ALL {
        against::measure(order.bound, order.out)?;
    }
    let (tables, told) = print::tables(order.bound, order.out)?;
    for words in told {
        (callbacks.warn)(&words);
    }
    alone(order.out, || {
        let mut paths = tables.write(order.out)?;
        paths.push(print::page(order.bound, &tables, order.out)?);
        Ok(paths)
    })
}

/// Writes files that all shards write, one shard at a time, after those that a killed one has left half-written. Where the file system
/// knows no locks they stay: nobody can tell whose they are.
fn alone<T>(out: &Path, write: impl FnOnce() -> Result<T>) -> Result<T> {
    std::fs::create_dir_all(out).map_err(Error::io(out))?;
    // The lock goes with the open folder.
    let held = File::open(out).and_then(|folder| folder.lock().map(|()| folder));
    if held.is_ok() {
        remove_unfinished_in(out)?;
    }
    write()
}

/// One row's work.
struct Work<'a> {
    order: &'a Order<'a>,
    callbacks: &'a Callbacks<'a>,
    row: Row,
    folder: PathBuf,
}

/// A baseline and what it is fitted to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Fitted {
    /// Fingerprint of each set, and the numbers of its images.
    from: Vec<(String, Vec<u64>)>,
    /// What they were brought to, pixels.
    size: (u32, u32),
    #[serde(flatten)]
    baseline: Baseline,
}

impl Work<'_> {
    fn network(&self) -> Option<(Network, u64)> {
        match self.row.learner {
            Learner::Network(network, seed) => Some((network, seed)),
            Learner::Baseline(_) => None,
        }
    }

    /// Seed of random picks.
    fn seed(&self) -> u64 {
        self.network().map_or(self.order.bound.experiment.seeds[0], |(_, seed)| seed)
    }

    fn set(&self) -> &TrainSet {
        &self.order.bound.experiment.train[self.row.train]
    }

    fn told(&self) -> String {
        self.row.in_words(&self.order.bound.experiment)
    }

    fn selections(&self) -> (Vec<Selection>, Vec<Selection>) {
        let bound = self.order.bound;
        let of = |parts: &[Part]| parts.iter().map(|p| bound.selection(p)).collect();
        (of(&self.set().from), of(&self.set().validation))
    }

    /// The training of a network; one that was begun keeps what the machine gave it, which decides the last bits.
    fn plan(&self, network: Network) -> Result<Plan> {
        let path = self.folder.join(run::PLAN);
        let before: Option<Identity> = path.exists().then(|| run::read_json(&path)).transpose()?;
        let (train, val) = self.selections();
        let Order { threads, precision, seconds, .. } = *self.order;
        let (threads, precision) = match before {
            Some(Identity { plan, .. }) => (plan.threads, plan.precision),
            None => (threads, precision.to_owned()),
        };
        let plan = self.set().plan.clone();
        Ok(Plan { network, train, val, seed: self.seed(), threads, precision, seconds, ..plan })
    }

    /// Whether all that is needed is there, test images are no training images, and nothing else lies in the folder.
    fn check(&self) -> Result<()> {
        let bound = self.order.bound;
        let (train, validation) = self.selections();
        let mut seen = BTreeSet::new();
        for selection in train.iter().chain(&validation) {
            let (set, numbers) = selection.open(Pick::All, self.seed())?;
            seen.extend(numbers.into_iter().map(|n| (set.folder.clone(), n)));
        }
        for test in &bound.experiment.test {
            let (set, numbers) = bound.selection(&test.part).open(Pick::All, 0)?;
            if let Some(n) = numbers.into_iter().find(|n| seen.contains(&(set.folder.clone(), *n))) {
                return Err(Error::input(format!(
                    "image {n} of `{1}` is in the test set `{0}` and in the training or validation set of `{2}`",
                    test.name,
                    bound.experiment.sets[test.part.set].0,
                    self.set().name
                ))
                .help("a test set must be unseen; give them other images of the file"));
            }
        }
        let Some((network, _)) = self.network() else { return Ok(()) };
        if !self.folder.join(run::PLAN).exists() {
            return Ok(());
        }
        let plan = self.plan(network)?;
        let open = |selections: &[Selection]| {
            Store::open(selections, Pick::All, plan.seed, &plan.classes, &plan.shape, false, 0)
        };
        Identity::of(&plan, &open(&train)?, &open(&validation)?)?.claim(&self.folder)
    }

    /// Trains the row where it is not done; says whether it was not.
    fn train(&self, number: usize, all: &[&Work<'_>]) -> Result<bool> {
        let network = match self.row.learner {
            Learner::Baseline(kind) => return self.fit_baseline(kind),
            Learner::Network(network, _) => network,
        };
        let missing = !self.is_done();
        if missing {
            let state = State { number, of: all.len(), left: left(all, self.order)? };
            (self.callbacks.training)(&self.told(), &state);
            (self.callbacks.fit)(&self.plan(network)?, &self.folder)?;
        }
        if missing || !self.folder.join(PAGE).exists() {
            (self.callbacks.page)(&self.folder)?;
        }
        Ok(missing)
    }

    fn is_done(&self) -> bool {
        self.folder.join(run::RESULT).exists()
    }

    fn fit_baseline(&self, kind: Kind) -> Result<bool> {
        let like = &self.order.bound.experiment.plan.shape;
        let (from, _) = self.selections();
        let path = self.folder.join(BASELINE);
        let size = (like.width, like.height);
        let prints = from.iter().map(|s| s.identity(Pick::All, self.seed())).collect::<Result<Vec<_>>>()?;
        if path.exists() {
            match run::read_json::<Fitted>(&path) {
                Ok(there) if there.from == prints && there.size == size && there.baseline.kind == kind => {
                    return Ok(false);
                }
                Ok(_) => self.again(&format!("{}: this was fitted to other images", path.display())),
                Err(e) => self.again(&short(&e)),
            }
        }
        let baseline = files::fit(kind, &from, self.seed(), like, self.callbacks.stop)?;
        run::write_json(&path, &Fitted { from: prints, size, baseline })?;
        Ok(true)
    }

    /// Evaluates the row on the test sets where that is missing; says whether it was.
    fn evaluate(&self) -> Result<bool> {
        let Order { bound, .. } = *self.order;
        let Some(of) = evaluation::who(&self.folder)? else {
            return Err(evaluation::foreign(&self.folder, "there is no trained model in this folder"));
        };
        let mut trained = None;
        let mut made = false;
        for test in &bound.experiment.test {
            let selection = bound.selection(&test.part);
            let on = selection.identity(Pick::All, 0)?;
            match StoredEvaluation::find(&evaluation::path(&self.folder, &test.slug), &of, test.part.pick, Some(&on)) {
                Known::Here(_) => continue,
                Known::Wrong(why) => self.again(&why),
                Known::Missing => {}
            }
            if self.callbacks.stop.load(Ordering::Relaxed) {
                let words = "stopped before all rows of the table were there";
                return Err(Error::stopped(words).help("the same command goes on with it"));
            }
            let predictor = match &of {
                Evaluated::Baseline(baseline) => Predictor::Baseline(baseline, &bound.experiment.plan.shape),
                Evaluated::Network { .. } => {
                    if trained.is_none() {
                        let Identity { plan, .. } = run::read_json(&self.folder.join(run::PLAN))?;
                        trained = Some((TrainedModel::open(&self.folder)?, plan));
                    }
                    let Some((trained, plan)) = &trained else { continue };
                    Predictor::Network(trained, &plan.precision, plan.threads)
                }
            };
            let picture = evaluation::path(&self.folder, &test.slug).with_extension("png");
            let report = (self.callbacks.evaluate)(&predictor, &selection, &picture)?;
            let stored = StoredEvaluation { of: of.clone(), images: test.part.pick, on, report };
            StoredEvaluation::keep(&self.folder, &test.slug, stored)?;
            made = true;
        }
        Ok(made)
    }

    fn again(&self, why: &str) {
        (self.callbacks.warn)(&format!("{why}; it is made again"));
    }
}

/// An error's first line.
fn short(e: &Error) -> String {
    e.to_string().lines().next().unwrap_or_default().to_owned()
}

/// Seconds that the trainings that are not done will take: each what those of its network took in the mean, or else what all did.
/// None before the first is done.
fn left(all: &[&Work<'_>], order: &Order<'_>) -> Result<Option<f64>> {
    let mut known: Vec<(Network, f64)> = Vec::new();
    for row in rows::rows(&order.bound.experiment) {
        if let Learner::Network(network, _) = row.learner
            && let Some(results) = run::results(&row.folder(&order.bound.experiment, order.out))?
        {
            known.push((network, results.seconds));
        }
    }
    let mean = |of: &dyn Fn(Network) -> bool| {
        let some: Vec<f64> = known.iter().filter(|(n, _)| of(*n)).map(|(_, s)| *s).collect();
        (!some.is_empty()).then(|| some.iter().sum::<f64>() / some.len() as f64)
    };
    let open = all.iter().filter(|w| !w.is_done()).filter_map(|w| w.network());
    Ok(open.map(|(network, _)| mean(&|n| n == network).or_else(|| mean(&|_| true))).sum())
}
