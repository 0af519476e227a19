//! Runs the missing parts of an experiment: datasets, then training and evaluations row by row, then tables.

use super::against;
use super::evaluation::{self, BASELINE, Evaluated, StoredEvaluation, StoredState};
use super::experiment::{Experiment, ImageSelection, TrainSet};
use super::print;
use super::rows::{self, Learner, Row};
use super::sets::BoundExperiment;
use crate::baseline::{Baseline, Kind, files};
use crate::data::{Pick, Selection, Shape, Store};
use crate::fit::Plan;
use crate::measure::Report;
use crate::net::Network;
use crate::run::{self, Identity, Results, TrainedModel};
use furrow_base::math::ToFloat;
use furrow_base::{Error, Result};
use furrow_dataset::make::generate::Shard;
use furrow_output::{remove_unfinished, remove_unfinished_in, write_atomically};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// File name of a training run's report, in the folder of the run.
pub const PAGE: &str = "report.html";

/// A part of the work, to be done alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WorkPart {
    /// The datasets.
    Sets,
    /// The tables of the results so far.
    Tables,
}

/// Options of [`run()`].
#[derive(Clone, Copy, Debug)]
pub struct TableOptions<'a> {
    /// The experiment and its datasets.
    pub bound: &'a BoundExperiment,
    /// Folder of the experiment.
    pub out: &'a Path,
    /// Text of the experiment file, copied into the folder.
    pub page: &'a str,
    /// Shard of the rows to run.
    pub shard: Shard,
    /// Part of the work to do; all of it if `None`.
    pub only: Option<WorkPart>,
    /// Time limit of each training run, seconds.
    pub seconds: Option<u64>,
    /// Number of compute threads of new training runs; a run that was started before keeps its number.
    pub threads: usize,
    /// Precision of new training runs, under the same rule.
    pub precision: &'a str,
}

/// Callbacks of [`run()`]: training and evaluation, which need libtorch, and messages.
pub struct Callbacks<'a> {
    /// Trains a plan in a folder, or resumes its training.
    pub fit: &'a dyn Fn(&Plan, &Path) -> Result<Results>,
    /// Writes the report of the training run in a folder.
    pub page: &'a dyn Fn(&Path) -> Result<()>,
    /// Evaluates a predictor on images, and writes a figure of some of them to the path.
    pub evaluate: &'a dyn Fn(&Predictor<'_>, &Selection, &Path) -> Result<Report>,
    /// Called before each training run with its description and the progress of the experiment.
    pub training: &'a dyn Fn(&str, &State),
    /// Called with a message about other work.
    pub message: &'a (dyn Fn(&str) + Sync),
    /// Called with a warning.
    pub warn: &'a (dyn Fn(&str) + Sync),
    /// Set by the caller to stop early.
    pub stop: &'a Arc<AtomicBool>,
}

/// Predictor to evaluate.
pub enum Predictor<'a> {
    /// Trained model, with its precision and number of threads.
    Network(&'a TrainedModel, &'a str, usize),
    /// Baseline, with the shape of its input images.
    Baseline(&'a Baseline, &'a Shape),
}

/// Progress of the training runs of a shard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Number of the current training run, from 1.
    pub number: usize,
    /// Number of training runs in the shard.
    pub of: usize,
    /// Estimated seconds for this and the remaining runs, from the finished runs of the experiment; `None` before the first.
    pub left: Option<f64>,
}

/// Runs everything that is missing; returns the paths of the tables (with [`WorkPart::Sets`], of the datasets' recipes).
pub fn run(order: &TableOptions<'_>, callbacks: &Callbacks<'_>) -> Result<Vec<PathBuf>> {
    let TableOptions { bound, out, .. } = *order;
    if order.only == Some(WorkPart::Tables) {
        return tables(order, callbacks);
    }
    bound.check()?;
    alone(out, || write_atomically(&out.join("experiment.ron"), order.page.as_bytes()))?;
    let rows = rows::of_shard(&bound.experiment, order.shard);
    if order.only.is_none() {
        check_pretrained(&bound.experiment, &rows)?;
    }
    for set in bound.used() {
        bound.make(set, callbacks.message, callbacks.warn, callbacks.stop)?;
    }
    if order.only == Some(WorkPart::Sets) {
        return Ok(bound
            .used()
            .into_iter()
            .map(|set| bound.folder(set).join(furrow_dataset::model::recipe::FILE))
            .collect());
    }
    // All rows are checked before hours are spent on the first one.
    let mut todo = Vec::new();
    for (_, row) in &rows {
        let work = RowWork { order, callbacks, row: *row, folder: row.folder(&bound.experiment, out) };
        work.check()?;
        todo.push(work);
    }
    let trainings: Vec<&RowWork<'_>> = todo.iter().filter(|w| w.network().is_some()).collect();
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
            // Warnings about results that are left out are reported once, at the end.
            tables(order, &Callbacks { warn: &|_| (), ..*callbacks })?;
        }
    }
    tables(order, callbacks)
}

/// Checks the pretrained weights of the rows, each file once, before anything is rendered.
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

/// Checks the pretrained weights of all rows.
///
/// # Errors
/// Returns an error for the first weights that are missing or do not fit.
pub fn check_weights(bound: &BoundExperiment) -> Result<()> {
    check_pretrained(&bound.experiment, &rows::of_shard(&bound.experiment, Shard::ALL))
}

/// Writes the tables of the results so far; returns their paths.
fn tables(order: &TableOptions<'_>, callbacks: &Callbacks<'_>) -> Result<Vec<PathBuf>> {
    // Every shard would repeat the same measurement after each of its rows: only a run of all rows measures the distances.
    if order.shard == Shard::ALL {
        against::measure(order.bound, order.out)?;
    }
    let (tables, notes) = print::tables(order.bound, order.out)?;
    for words in notes {
        (callbacks.warn)(&words);
    }
    alone(order.out, || {
        let mut paths = tables.write(order.out)?;
        paths.push(print::page(order.bound, &tables, order.out)?);
        Ok(paths)
    })
}

/// Runs `write`, which writes files shared by all shards, while holding a lock on the folder. Removes temporary files of killed processes
/// first. On a file system without locks these stay, because they may belong to a running process.
fn alone<T>(out: &Path, write: impl FnOnce() -> Result<T>) -> Result<T> {
    std::fs::create_dir_all(out).map_err(Error::io(out))?;
    // The lock is released when `held` is closed.
    let held = File::open(out).and_then(|folder| folder.lock().map(|()| folder));
    if held.is_ok() {
        remove_unfinished_in(out)?;
    }
    write()
}

/// Work on one row.
struct RowWork<'a> {
    order: &'a TableOptions<'a>,
    callbacks: &'a Callbacks<'a>,
    row: Row,
    folder: PathBuf,
}

/// Contents of `baseline.json`: a baseline and the images that it was fitted to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Fitted {
    /// Fingerprint of each dataset, and the numbers of its images.
    from: Vec<(String, Vec<u64>)>,
    /// Size that the images were resized to, pixels.
    size: (u32, u32),
    #[serde(flatten)]
    baseline: Baseline,
}

impl RowWork<'_> {
    fn network(&self) -> Option<(Network, u64)> {
        match self.row.learner {
            Learner::Network(network, seed) => Some((network, seed)),
            Learner::Baseline(_) => None,
        }
    }

    /// Returns the seed for random selections: that of the network, or the experiment's first for a baseline.
    fn seed(&self) -> u64 {
        self.network().map_or(self.order.bound.experiment.seeds[0], |(_, seed)| seed)
    }

    fn set(&self) -> &TrainSet {
        &self.order.bound.experiment.train[self.row.train]
    }

    fn description(&self) -> String {
        self.row.in_words(&self.order.bound.experiment)
    }

    fn selections(&self) -> (Vec<Selection>, Vec<Selection>) {
        let bound = self.order.bound;
        let of = |parts: &[ImageSelection]| parts.iter().map(|p| bound.selection(p)).collect();
        (of(&self.set().from), of(&self.set().validation))
    }

    /// Returns the training plan of a network. A run that was started before keeps its threads and precision, on which the last
    /// bits depend.
    fn plan(&self, network: Network) -> Result<Plan> {
        let path = self.folder.join(run::PLAN);
        let before: Option<Identity> = path.exists().then(|| run::read_json(&path)).transpose()?;
        let (train, val) = self.selections();
        let TableOptions { threads, precision, seconds, .. } = *self.order;
        let (threads, precision) = match before {
            Some(Identity { plan, .. }) => (plan.threads, plan.precision),
            None => (threads, precision.to_owned()),
        };
        let plan = self.set().plan.clone();
        Ok(Plan { network, train, val, seed: self.seed(), threads, precision, seconds, ..plan })
    }

    /// Checks that all images can be opened, that no test image is a training or validation image, and that the row's folder holds no other
    /// training run.
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
                .help("test images must not be trained on: give the two sets different `images`"));
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

    /// Trains the row unless it is done; returns `true` if it was not.
    fn train(&self, number: usize, all: &[&RowWork<'_>]) -> Result<bool> {
        let network = match self.row.learner {
            Learner::Baseline(kind) => return self.fit_baseline(kind),
            Learner::Network(network, _) => network,
        };
        let missing = !self.is_done();
        if missing {
            let state = State { number, of: all.len(), left: left(all, self.order)? };
            (self.callbacks.training)(&self.description(), &state);
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
                Ok(_) => self.again(&format!("{}: this baseline was fitted to other images", path.display())),
                Err(e) => self.again(&short(&e)),
            }
        }
        let baseline = files::fit(kind, &from, self.seed(), like, self.callbacks.stop)?;
        run::write_json(&path, &Fitted { from: prints, size, baseline })?;
        Ok(true)
    }

    /// Evaluates the row on the test sets that have no evaluation yet; returns `true` if there was one.
    fn evaluate(&self) -> Result<bool> {
        let TableOptions { bound, .. } = *self.order;
        let Some(of) = evaluation::who(&self.folder)? else {
            return Err(evaluation::foreign(&self.folder, "there is no trained model in this folder"));
        };
        let mut trained = None;
        let mut made = false;
        for test in &bound.experiment.test {
            let selection = bound.selection(&test.part);
            let on = selection.identity(Pick::All, 0)?;
            match StoredEvaluation::find(&evaluation::path(&self.folder, &test.slug), &of, test.part.pick, Some(&on)) {
                StoredState::Here(_) => continue,
                StoredState::Wrong(why) => self.again(&why),
                StoredState::Missing => {}
            }
            if self.callbacks.stop.load(Ordering::Relaxed) {
                let words = "stopped before all rows of the table were done";
                return Err(Error::stopped(words).help("run the same command again to resume"));
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

/// Returns the first line of an error.
fn short(e: &Error) -> String {
    e.to_string().lines().next().unwrap_or_default().to_owned()
}

/// Estimates the seconds that the unfinished training runs take: each the mean of the finished runs of its network, or of all
/// finished runs if there are none. Returns `None` before the first run is done.
fn left(all: &[&RowWork<'_>], order: &TableOptions<'_>) -> Result<Option<f64>> {
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
        (!some.is_empty()).then(|| some.iter().sum::<f64>() / some.len().to_f64())
    };
    let open = all.iter().filter(|w| !w.is_done()).filter_map(|w| w.network());
    Ok(open.map(|(network, _)| mean(&|n| n == network).or_else(|| mean(&|_| true))).sum())
}
