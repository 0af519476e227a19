//! The images of an experiment: bound to folders, rendered or imported where they are missing.

use super::experiment::{Experiment, Part, Source};
use super::names::unknown;
use crate::ablation::{Edit, FULL};
use crate::dataset::generate::{Callbacks, Work};
use crate::dataset::import::masks::{Folders, Masks};
use crate::dataset::import::{self, Source as _};
use crate::dataset::set::Set;
use crate::dataset::split::Shares;
use crate::dataset::status::Status;
use crate::dataset::{self, recipe};
use crate::error::Kind;
use crate::job::Threads;
use crate::output::Lock;
use crate::report::{Cell, Table};
use crate::settings::{Quality, RenderOptions};
use crate::train::data::Selection;
use crate::{Error, Result};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Where a real set lies: `NAME=DIR` on the command line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Real {
    /// The set's name in the experiment file.
    pub name: String,
    /// A dataset, or a folder with `images/` and `labels/`.
    pub folder: PathBuf,
}

impl Real {
    /// Reads `NAME=DIR`.
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

/// How a set comes to its folder.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Origin {
    /// It is rendered.
    Rendered,
    /// It is imported from here.
    Imported(PathBuf),
    /// It is a dataset already, and stays as it is.
    There,
    /// Nobody has said where it lies.
    Unknown,
}

/// An experiment whose sets have folders.
#[derive(Clone, Debug, PartialEq)]
pub struct Bound {
    /// The experiment, without what was left out.
    pub experiment: Experiment,
    /// Names of what was left out: training sets, then test sets.
    pub left_out: Vec<String>,
    /// Folder and origin of each set.
    sets: Vec<(PathBuf, Origin)>,
}

impl Bound {
    /// Binds the sets of an experiment that lies in `out`. Training and test sets that need one of `without` are left out.
    pub fn new(mut experiment: Experiment, reals: &[Real], without: &[String], out: &Path) -> Result<Self> {
        let names: Vec<&str> = experiment.sets.iter().map(|(name, _)| name.as_str()).collect();
        let wrong = |(what, help): (String, String)| Error::input(what).help(help);
        if let Some(name) = without.iter().find(|w| !names.contains(&w.as_str())) {
            return Err(wrong(unknown("set", &names, name)));
        }
        let is_real =
            |name: &str| experiment.sets.iter().any(|(n, source)| n == name && matches!(source, Source::Real { .. }));
        for (i, Real { name, .. }) in reals.iter().enumerate() {
            if !is_real(name) {
                let real: Vec<&str> = names.iter().copied().filter(|n| is_real(n)).collect();
                return Err(wrong(unknown("real set", &real, name)));
            }
            if reals[..i].iter().any(|r| r.name == *name) {
                return Err(wrong((format!("--real {name}=… is there twice"), "keep one of them".into())));
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
        let out = |part: &Part| without.contains(&experiment.sets[part.set].0);
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

    /// A set's folder.
    pub fn folder(&self, set: usize) -> &Path {
        &self.sets[set].0
    }

    /// Whether the images of a set are imported, from files that tell no cameras.
    pub(super) fn is_imported(&self, set: usize) -> bool {
        matches!(self.sets[set].1, Origin::Imported(_))
    }

    /// Images of a set as a training or an evaluation opens them.
    pub fn selection(&self, part: &Part) -> Selection {
        let Part { set, pick, margin, repeat } = *part;
        Selection { folder: self.folder(set).into(), pick: Some(pick), margin, repeat }
    }

    /// Sets that are used by what is left, by place.
    pub fn used(&self) -> Vec<usize> {
        let all = self.experiment.train.iter().flat_map(|t| self.experiment.sets_of(t));
        let mut all: Vec<usize> = all.chain(self.experiment.test.iter().map(|t| t.part.set)).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// Checks that somebody has said where the real sets are that are used.
    pub fn check(&self) -> Result<()> {
        let missing: Vec<_> = self.used().into_iter().filter(|i| self.sets[*i].1 == Origin::Unknown).collect();
        let Some(first) = missing.first() else { return Ok(()) };
        let told = |i: &usize| match &self.experiment.sets[*i] {
            (name, Source::Real { about }) if !about.is_empty() => format!("`{name}` ({about})"),
            (name, _) => format!("`{name}`"),
        };
        let name = &self.experiment.sets[*first].0;
        Err(Error::input(format!(
            "nobody has said where the images of {} lie",
            missing.iter().map(told).collect::<Vec<_>>().join(" and of ")
        ))
        .help(format!("--real {name}=DIR leads to them, --without {name} leaves out what needs them")))
    }

    /// The sets that are used and how far they are.
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
            table.push([name, from, size, Cell::number(images.map(|n| n as f64), 0), Cell::Count(done)]);
        }
        Ok(table)
    }

    /// Makes what is missing of a set: renders or imports it. Waits where another process is at it.
    pub(super) fn make(
        &self,
        set: usize,
        tell: &(dyn Fn(&str) + Sync),
        warn: &(dyn Fn(&str) + Sync),
        stop: &Arc<AtomicBool>,
    ) -> Result<()> {
        let (folder, origin) = &self.sets[set];
        let (name, source) = &self.experiment.sets[set];
        if !matches!(origin, Origin::Rendered | Origin::Imported(_)) {
            return Ok(());
        }
        let _lock = lock(folder, name, tell, stop)?;
        if !folder.join(dataset::recipe::MANIFEST).exists() {
            tell(&format!("making the set `{name}`"));
        }
        let progress = Progress::new(name, tell);
        let made = match (source, origin) {
            (Source::Scene { file, count, size, spp, seed, edit, split }, _) => {
                let order = dataset::Order {
                    seed: *seed,
                    width: Some(size.0),
                    height: Some(size.1),
                    split: *split,
                    edit: edit.map_or(Ok(&FULL), Edit::named)?,
                    options: RenderOptions::path_traced(Quality::spp(*spp)),
                    ..dataset::Order::new(file, *count)
                };
                let callbacks = Callbacks {
                    begin: &|total| progress.expect(total),
                    warn,
                    done: &|_| progress.add(),
                    soon: stop,
                    now: stop,
                };
                dataset::make_watched(folder, &order, &Work::default(), &callbacks)
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
                if known { error } else { error.help("the same command goes on with it") }
            }
        })
    }
}

/// Brings masks of a real set in.
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
    let order = import::Order { split: Shares::default(), licence: dataset::Order::NO_LICENCE.into() };
    let done = |_| progress.add();
    let set = Threads::all()?.install(|| import::import(folder, &source, &order, &done, stop))?;
    dataset::finish::finish(&set, None)
}

/// How far a set is, told now and then.
struct Progress<'a> {
    name: &'a str,
    tell: &'a (dyn Fn(&str) + Sync),
    total: AtomicUsize,
    done: AtomicUsize,
    last: Mutex<Instant>,
}

impl<'a> Progress<'a> {
    /// Between two words on it.
    const EVERY: Duration = Duration::from_secs(30);

    fn new(name: &'a str, tell: &'a (dyn Fn(&str) + Sync)) -> Self {
        Self { name, tell, total: AtomicUsize::new(0), done: AtomicUsize::new(0), last: Mutex::new(Instant::now()) }
    }

    fn expect(&self, total: usize) {
        self.total.store(total, Ordering::Relaxed);
    }

    fn add(&self) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if last.elapsed() >= Self::EVERY {
            *last = Instant::now();
            (self.tell)(&format!("set `{}`: {done} of {} images", self.name, self.total.load(Ordering::Relaxed)));
        }
    }
}

/// Keeps what is not out; the names of the rest go to `left_out`.
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

/// A real set in its folder.
fn real_set(real: &Real, own: PathBuf) -> Result<(PathBuf, Origin)> {
    let Real { name, folder } = real;
    if folder.join(recipe::FILE).is_file() {
        return Ok((folder.clone(), Origin::There));
    }
    if folder.join("images").is_dir() && folder.join("labels").is_dir() {
        return Ok((own, Origin::Imported(folder.clone())));
    }
    let what = if folder.is_dir() { "in this folder are no labelled images" } else { "there is no such folder" };
    Err(Error::input(format!("--real {name}={}: {what}", folder.display())).help("name a dataset (`trace dataset import` makes one), or a folder with images/ and with masks of the same names in labels/"))
}

/// Takes a set for this process, and waits where another makes it.
fn lock(folder: &Path, name: &str, tell: &(dyn Fn(&str) + Sync), stop: &AtomicBool) -> Result<Lock> {
    let waits = || tell(&format!("waiting for another process that makes the set `{name}`"));
    let path = folder.with_file_name(format!("{name}.lock"));
    Lock::wait(&path, waits, || stop.load(Ordering::Relaxed))?.ok_or_else(|| {
        Error::stopped(format!("stopped before the set `{name}` was there")).help("the same command goes on with it")
    })
}
