//! Datasets of an experiment: bound to folders, and rendered or imported if they are missing.

use super::experiment::{Experiment, ImageSelection, Source};
use super::names::unknown;
use crate::data::Selection;
use furrow_base::error::Kind;
use furrow_base::math::ToFloat;
use furrow_base::{Error, Result};
use furrow_dataset::import::masks::{Folders, Masks};
use furrow_dataset::import::{self, Source as _};
use furrow_dataset::make::generate::{Callbacks, Work};
use furrow_dataset::make::status::Status;
use furrow_dataset::model::recipe;
use furrow_dataset::model::split::Shares;
use furrow_dataset::read::set::Set;
use furrow_field::ablation::{Edit, FULL};
use furrow_job::Threads;
use furrow_output::Lock;
use furrow_render::settings::{Quality, RenderOptions};
use furrow_report::{Cell, Table};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Folder of a real dataset: `NAME=DIR` on the command line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RealSet {
    /// The set's name in the experiment file.
    pub name: String,
    /// A dataset, or a folder with `images/` and `labels/`.
    pub folder: PathBuf,
}

impl RealSet {
    /// Parses `NAME=DIR`.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text.split_once('=') {
            Some((name, folder)) if !name.is_empty() && !folder.is_empty() => {
                Ok(Self { name: name.into(), folder: folder.into() })
            }
            _ => {
                Err("write the set's name in the experiment file and its folder, such as jai=real/sugarbeet_jai".into())
            }
        }
    }
}

/// Origin of the images of a dataset.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Origin {
    /// Rendered by this program.
    Rendered,
    /// Imported from this folder.
    Imported(PathBuf),
    /// An existing dataset, used in place.
    There,
    /// A real dataset without a folder: `--real` is missing.
    Unknown,
}

/// Experiment whose datasets are bound to folders.
#[derive(Clone, Debug, PartialEq)]
pub struct BoundExperiment {
    /// The experiment, without the training and test sets that were left out.
    pub experiment: Experiment,
    /// Names of the training sets, then of the test sets, that were left out.
    pub left_out: Vec<String>,
    /// Folder and origin of each dataset.
    sets: Vec<(PathBuf, Origin)>,
}

impl BoundExperiment {
    /// Binds the datasets of an experiment in the folder `out`. Training and test sets that need a dataset in `without` are left
    /// out. Fails on unknown names, or if no training set or no test set is left.
    pub fn new(mut experiment: Experiment, reals: &[RealSet], without: &[String], out: &Path) -> Result<Self> {
        let names: Vec<&str> = experiment.sets.iter().map(|(name, _)| name.as_str()).collect();
        let wrong = |(what, help): (String, String)| Error::input(what).help(help);
        if let Some(name) = without.iter().find(|w| !names.contains(&w.as_str())) {
            return Err(wrong(unknown("set", &names, name)));
        }
        let is_real =
            |name: &str| experiment.sets.iter().any(|(n, source)| n == name && matches!(source, Source::Real { .. }));
        for (i, RealSet { name, .. }) in reals.iter().enumerate() {
            if !is_real(name) {
                let real: Vec<&str> = names.iter().copied().filter(|n| is_real(n)).collect();
                return Err(wrong(unknown("real set", &real, name)));
            }
            if reals[..i].iter().any(|r| r.name == *name) {
                return Err(wrong((format!("--real {name}=… is given twice"), "keep one of them".into())));
            }
        }
        let mut sets = Vec::new();
        for (name, source) in &experiment.sets {
            let own = out.join("sets").join(name);
            sets.push(match (source, reals.iter().find(|r| r.name == *name)) {
                (Source::Scene { .. }, _) => (own, Origin::Rendered),
                (Source::Dataset { folder, .. }, _) => (folder.clone(), Origin::There),
                (Source::Real { .. }, None) => (own, Origin::Unknown),
                (Source::Real { .. }, Some(real)) => real_set(real, own)?,
            });
        }
        let out = |part: &ImageSelection| without.contains(&experiment.sets[part.set].0);
        let mut left_out = Vec::new();
        experiment.train =
            split(&experiment.train, &mut left_out, |t| t.from.iter().chain(&t.validation).any(out), |t| &t.name);
        experiment.test = split(&experiment.test, &mut left_out, |t| out(&t.part), |t| &t.name);
        if experiment.train.is_empty() || experiment.test.is_empty() {
            let what = if experiment.train.is_empty() { "training" } else { "test" };
            return Err(Error::input(format!("without {} there is no {what} set left", without.join(", ")))
                .help("bind it instead with --real NAME=DIR"));
        }
        Ok(Self { experiment, left_out, sets })
    }

    /// Returns the folder of a dataset, by index.
    pub fn folder(&self, set: usize) -> &Path {
        &self.sets[set].0
    }

    /// Returns `true` if the images of a dataset are imported from image and mask files, which record no cameras.
    pub(super) fn is_imported(&self, set: usize) -> bool {
        matches!(self.sets[set].1, Origin::Imported(_))
    }

    /// Returns the selection of images that a training or an evaluation opens.
    pub fn selection(&self, part: &ImageSelection) -> Selection {
        let ImageSelection { set, pick, margin, repeat } = *part;
        Selection { folder: self.folder(set).into(), pick: Some(pick), margin, repeat }
    }

    /// Returns the indices of the datasets that the remaining training and test sets use.
    pub fn used(&self) -> Vec<usize> {
        let all = self.experiment.train.iter().flat_map(|t| self.experiment.sets_of(t));
        let mut all: Vec<usize> = all.chain(self.experiment.test.iter().map(|t| t.part.set)).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// Checks that every real dataset in use has a folder.
    pub fn check(&self) -> Result<()> {
        let missing: Vec<_> = self.used().into_iter().filter(|i| self.sets[*i].1 == Origin::Unknown).collect();
        let Some(first) = missing.first() else { return Ok(()) };
        let described = |i: &usize| match &self.experiment.sets[*i] {
            (name, Source::Real { about }) if !about.is_empty() => format!("`{name}` ({about})"),
            (name, _) => format!("`{name}`"),
        };
        let name = &self.experiment.sets[*first].0;
        Err(Error::input(format!(
            "no folder is given for the images of {}",
            missing.iter().map(described).collect::<Vec<_>>().join(" and of ")
        ))
        .help(format!("give it with --real {name}=DIR, or leave out what needs them with --without {name}")))
    }

    /// Returns a table of the datasets in use with their size and number of images, and how many of these exist.
    pub fn listing(&self) -> Result<Table> {
        let mut table = Table::new("Sets", ["set", "comes from", "size", "images", "there"]);
        for set in self.used() {
            let (folder, origin) = &self.sets[set];
            let (name, source) = &self.experiment.sets[set];
            let begun = folder.join(recipe::FILE).is_file();
            let status = begun.then(|| Status::of(&Set::open(folder)?, None, &AtomicBool::new(false))).transpose()?;
            let images = match source {
                Source::Scene { count, .. } | Source::Dataset { count, .. } => Some(*count),
                Source::Real { .. } => status.as_ref().map(|status| status.images),
            };
            let (from, size) = match (source, origin) {
                (Source::Scene { file, size, spp, edit, .. }, _) => {
                    let edit = edit.map(|name| format!(", {name}")).unwrap_or_default();
                    (format!("{}, {spp} spp{edit}", file.display()), format!("{} × {}", size.0, size.1))
                }
                (_, Origin::Imported(from)) => (from.display().to_string(), String::new()),
                (_, Origin::Unknown) => (format!("--real {name}=DIR"), String::new()),
                _ => (folder.display().to_string(), String::new()),
            };
            let done = status.map_or(0, |status| status.done);
            let [name, from, size] = [name.clone(), from, size].map(Cell::text);
            table.push([name, from, size, Cell::number(images.map(ToFloat::to_f64), 0), Cell::Count(done)]);
        }
        Ok(table)
    }

    /// Renders or imports the missing images of a dataset. Waits if another process is making it.
    pub(super) fn make(
        &self,
        set: usize,
        message: &(dyn Fn(&str) + Sync),
        warn: &(dyn Fn(&str) + Sync),
        stop: &Arc<AtomicBool>,
    ) -> Result<()> {
        let (folder, origin) = &self.sets[set];
        let (name, source) = &self.experiment.sets[set];
        if !matches!(origin, Origin::Rendered | Origin::Imported(_)) {
            return Ok(());
        }
        let _lock = lock(folder, name, message, stop)?;
        if !folder.join(furrow_dataset::model::recipe::MANIFEST).exists() {
            message(&format!("making the set `{name}`"));
        }
        let progress = Progress::new(name, message);
        let made = match (source, origin) {
            (Source::Scene { file, count, size, spp, seed, edit, split }, _) => {
                let order = furrow_dataset::Order {
                    seed: *seed,
                    width: Some(size.0),
                    height: Some(size.1),
                    split: *split,
                    edit: edit.map_or(Ok(&FULL), Edit::named)?,
                    options: RenderOptions::path_traced(Quality::spp(*spp)),
                    ..furrow_dataset::Order::new(file, *count)
                };
                let callbacks = Callbacks {
                    begin: &|total| progress.expect(total),
                    warn,
                    done: &|_| progress.add(),
                    soon: stop,
                    now: stop,
                };
                furrow_dataset::make_watched(folder, &order, &Work::default(), &callbacks)
            }
            (_, Origin::Imported(from)) => import(from, folder, &progress, warn, stop),
            _ => Ok(Vec::new()),
        };
        made.map(drop).map_err(|error| match error.kind() {
            Kind::Interrupted => error,
            _ if error.exit_code() == 2 => error.within(format!("the set `{name}` cannot be made")),
            _ => {
                let known = error.advice().is_some();
                let error = error.within(format!("the set `{name}` was not made"));
                if known { error } else { error.help("run the same command again to resume") }
            }
        })
    }
}

/// Imports the images and masks of a real dataset into `folder`; returns the paths written.
fn import(
    from: &Path,
    folder: &Path,
    progress: &Progress<'_>,
    warn: &(dyn Fn(&str) + Sync),
    stop: &AtomicBool,
) -> Result<Vec<PathBuf>> {
    let source = Masks::open(Folders::new(from.join("images"), from.join("labels")))?;
    for warning in source.warnings() {
        warn(warning);
    }
    progress.expect(source.images().len());
    let order = import::ImportSettings { split: Shares::default(), licence: furrow_dataset::Order::NO_LICENCE.into() };
    let done = |_| progress.add();
    let set = Threads::all()?.install(|| import::import(folder, &source, &order, &done, stop))?;
    furrow_dataset::make::finish::finish(&set, None)
}

/// Progress of making a dataset, reported at intervals.
struct Progress<'a> {
    name: &'a str,
    message: &'a (dyn Fn(&str) + Sync),
    total: AtomicUsize,
    done: AtomicUsize,
    last: Mutex<Instant>,
}

impl<'a> Progress<'a> {
    /// Interval between two progress messages.
    const EVERY: Duration = Duration::from_secs(30);

    fn new(name: &'a str, message: &'a (dyn Fn(&str) + Sync)) -> Self {
        Self { name, message, total: AtomicUsize::new(0), done: AtomicUsize::new(0), last: Mutex::new(Instant::now()) }
    }

    fn expect(&self, total: usize) {
        self.total.store(total, Ordering::Relaxed);
    }

    fn add(&self) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if last.elapsed() >= Self::EVERY {
            *last = Instant::now();
            (self.message)(&format!("set `{}`: {done} of {} images", self.name, self.total.load(Ordering::Relaxed)));
        }
    }
}

/// Returns the items that are not `is_out`; appends the names of the others to `left_out`.
fn split<T: Clone>(
    all: &[T],
    left_out: &mut Vec<String>,
    is_out: impl Fn(&T) -> bool,
    name: impl Fn(&T) -> &String,
) -> Vec<T> {
    let (out, kept): (Vec<&T>, Vec<&T>) = all.iter().partition(|t| is_out(t));
    left_out.extend(out.into_iter().map(|t| name(t).clone()));
    kept.into_iter().cloned().collect()
}

/// Returns the folder and origin of a real dataset: a dataset is used in place, images and masks are imported into `own`.
fn real_set(real: &RealSet, own: PathBuf) -> Result<(PathBuf, Origin)> {
    let RealSet { name, folder } = real;
    if folder.join(recipe::FILE).is_file() {
        return Ok((folder.clone(), Origin::There));
    }
    if folder.join("images").is_dir() && folder.join("labels").is_dir() {
        return Ok((own, Origin::Imported(folder.clone())));
    }
    let what = if folder.is_dir() { "this folder holds no labelled images" } else { "there is no such folder" };
    Err(Error::input(format!("--real {name}={}: {what}", folder.display())).help("give a dataset (`trace dataset import` makes one), or a folder with images/ and with masks of the same names in labels/"))
}

/// Locks a dataset for this process; waits while another process makes it.
fn lock(folder: &Path, name: &str, message: &(dyn Fn(&str) + Sync), stop: &AtomicBool) -> Result<Lock> {
    let waits = || message(&format!("waiting for another process that is making the set `{name}`"));
    let path = folder.with_file_name(format!("{name}.lock"));
    Lock::wait(&path, waits, || stop.load(Ordering::Relaxed))?.ok_or_else(|| {
        Error::stopped(format!("stopped before the set `{name}` was made")).help("run the same command again to resume")
    })
}
