//! The images of an experiment: bound to folders, and made by the program `trace` where they are missing.

use super::experiment::{Experiment, Part, Source};
use super::names::unknown;
use crate::dataset::recipe;
use crate::train::data::Selection;
use crate::train::memory;
use crate::{Error, Result};
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Where a real set lies: `NAME=DIR` on the command line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Real {
    /// The set's name in the page.
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
            _ => Err("write the set's name in the page and its folder, such as jai=real/sugarbeet_jai".into()),
        }
    }
}

/// How a set comes to its folder.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Origin {
    /// `trace dataset` renders it.
    Rendered,
    /// `trace dataset import` brings it in from here.
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
        let wrong = |(what, help): (String, String)| Error::Training(format!("{what}\n help: {help}"));
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
            split(&experiment.train, &mut left_out, |t| t.from.iter().chain(&t.watch).any(out), |t| &t.name);
        experiment.test = split(&experiment.test, &mut left_out, |t| out(&t.part), |t| &t.name);
        if experiment.train.is_empty() || experiment.test.is_empty() {
            let what = if experiment.train.is_empty() { "training" } else { "test" };
            return Err(Error::Training(format!(
                "without {} there is no {what} set left\n help: bind it instead with --real NAME=DIR",
                without.join(", ")
            )));
        }
        Ok(Self { experiment, left_out, sets })
    }

    /// A set's folder.
    pub fn folder(&self, set: usize) -> &Path {
        &self.sets[set].0
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
        Err(Error::Training(format!(
            "nobody has said where the images of {} lie\n help: --real {name}=DIR leads to them, --without {name} leaves out what needs them",
            missing.iter().map(told).collect::<Vec<_>>().join(" and of ")
        )))
    }

    /// What makes a set, or makes what is missing of it; none where that is not for us to do.
    fn command(&self, set: usize, trace: &Path) -> Option<Command> {
        let (folder, origin) = &self.sets[set];
        let mut command = Command::new(trace);
        command.arg("dataset");
        match (&self.experiment.sets[set].1, origin) {
            (Source::Scene { page, count, size, spp, seed, split }, Origin::Rendered) => {
                command.arg("--scene").arg(page).args(["--count", &count.to_string(), "--spp", &spp.to_string()]);
                command.args(["--width", &size.0.to_string(), "--height", &size.1.to_string()]);
                command.args(["--split", &split.0.map(|n| n.to_string()).join(",")]);
                if let Some(seed) = seed {
                    command.args(["--seed", &seed.to_string()]);
                }
            }
            (_, Origin::Imported(from)) => {
                command.args(["import", "--format", "masks"]);
                command.arg("--images").arg(from.join("images")).arg("--masks").arg(from.join("labels"));
            }
            _ => return None,
        }
        command.arg("--out").arg(folder);
        Some(command)
    }

    /// Makes what is missing of a set, by the program `trace`; waits where another process is at it.
    pub(super) fn make(
        &self,
        set: usize,
        trace: &Path,
        quiet: bool,
        tell: &dyn Fn(&str),
        stop: &AtomicBool,
    ) -> Result<()> {
        let name = &self.experiment.sets[set].0;
        let Some(mut command) = self.command(set, trace) else { return Ok(()) };
        if quiet {
            command.arg("--quiet");
        }
        let lock = lock(self.folder(set), name, tell, stop)?;
        if !self.folder(set).join(crate::dataset::finish::MANIFEST).exists() {
            tell(&format!("making the set `{name}`"));
        }
        // The lock goes with the open file, which the child holds as well: where this process is killed, the set stays locked until
        // its orphan is done.
        command.stdin(lock.map_or_else(Stdio::null, Stdio::from)).stdout(Stdio::null());
        let child = memory::as_usual(&mut command).spawn().map_err(|e| Error::Io { path: trace.into(), source: e })?;
        let status = wait(child, trace, stop)?;
        match status.code() {
            Some(0) => Ok(()),
            Some(75) => Err(Error::Interrupted),
            Some(2) => Err(Error::Training(format!(
                "the set `{name}` cannot be made: `trace dataset` has refused, for the reason above\n help: set right what it names; what is done is kept"
            ))),
            _ => Err(Error::Damaged(format!(
                "the set `{name}` was not made: `trace dataset` ended with {status}\n help: the same command goes on with it"
            ))),
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
    Err(Error::Training(format!(
        "--real {name}={}: {what}\n help: name a dataset (`trace dataset import` makes one), or a folder with images/ and with masks of the same names in labels/",
        folder.display()
    )))
}

/// Between two looks at what is waited for.
const LOOK: Duration = Duration::from_millis(50);
/// How long a child may take to end by itself: a terminal's Ctrl-C reaches it as well.
const GRACE: Duration = Duration::from_secs(2);

/// Waits for `trace`; told to stop, ends it. It can be killed at any moment, and goes on where it was.
fn wait(mut child: Child, trace: &Path, stop: &AtomicBool) -> Result<ExitStatus> {
    let failed = |e| Error::Io { path: trace.into(), source: e };
    let mut asked: Option<Instant> = None;
    loop {
        if let Some(status) = child.try_wait().map_err(failed)? {
            return if asked.is_some() { Err(Error::Interrupted) } else { Ok(status) };
        }
        if stop.load(Ordering::Relaxed) && asked.get_or_insert_with(Instant::now).elapsed() > GRACE {
            child.kill().map_err(failed)?;
            child.wait().map_err(failed)?;
            return Err(Error::Interrupted);
        }
        std::thread::sleep(LOOK);
    }
}

/// Takes a set for this process; none where the file system knows no locks, on which `trace` alone keeps its files whole.
fn lock(folder: &Path, name: &str, tell: &dyn Fn(&str), stop: &AtomicBool) -> Result<Option<File>> {
    let path = folder.with_file_name(format!("{name}.lock"));
    let sets = folder.parent().unwrap_or(Path::new("."));
    std::fs::create_dir_all(sets).map_err(Error::io(sets))?;
    let file =
        File::options().create(true).truncate(false).read(true).write(true).open(&path).map_err(Error::io(&path))?;
    let mut told = false;
    loop {
        match file.try_lock() {
            Ok(()) => return Ok(Some(file)),
            Err(TryLockError::Error(_)) => return Ok(None),
            Err(TryLockError::WouldBlock) => {}
        }
        if stop.load(Ordering::Relaxed) {
            return Err(Error::Interrupted);
        }
        if !std::mem::replace(&mut told, true) {
            tell(&format!("waiting for another process that makes the set `{name}`"));
        }
        std::thread::sleep(LOOK);
    }
}
