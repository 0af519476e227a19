//! Job files that render a dataset on several machines: for Slurm, Kubernetes or GNU parallel.
//!
//! The scheduler needs little logic, since image k is the same on every machine and the progress is read from the disk.
//! It starts `trace dataset render --shard k/N` for every k, starts interrupted shards again, and then runs `finish`
//! and `verify`. The exit code decides: 0 is success, 75 means start again, 2 means that a retry cannot help, 1 means
//! that a person has to look at the error.
//!
//! The files are meant to be read and edited by users, since partitions, accounts and container images depend on the
//! site. They are therefore templates with names between @ signs, each in a file in this folder; edited files are never
//! overwritten.

mod kubernetes;
mod parallel;
mod request;
mod script;
mod slurm;

pub use request::{Alerts, Job, Pod, Scheduler};

use crate::Set;
use furrow_base::input::{refuse_links, tidy};
use furrow_base::{Error, Result};
use furrow_output::write_together;
use script::plain;
use std::path::{Path, PathBuf};

/// Default of Slurm's `MaxArraySize`, the largest number of tasks of an array.
const SLURM_ARRAY: u64 = 1001;

/// Writes the job files of a dataset into `folder`. Returns their paths, the one to start with first, and warnings for
/// the user. Returns an error and writes nothing if a file exists with other contents.
pub fn emit(set: &Set, job: &Job, folder: &Path) -> Result<(Vec<PathBuf>, Vec<String>)> {
    check(set, job)?;
    let dir = std::path::absolute(&set.folder).map_err(Error::io(&set.folder))?;
    let dir = plain(&dir)?;
    let files = match &job.scheduler {
        Scheduler::Slurm => slurm::files(&dir, job),
        Scheduler::Kubernetes(pod) => kubernetes::files(&dir, job, pod),
        Scheduler::Parallel => parallel::files(&dir, job),
    }?;
    let asked = tidy(&std::path::absolute(folder).map_err(Error::io(folder))?);
    if let Ok(within) = asked.strip_prefix(tidy(Path::new(&dir))) {
        refuse_links(&set.folder, within)?;
    }
    for file in &files {
        let path = folder.join(&file.path);
        if furrow_base::input::contents(&path).is_ok_and(|there| there != file.bytes) {
            return Err(Error::misuse("this file exists with other contents; it may have been edited")
                .in_file(path)
                .help("remove it, or give another --out"));
        }
    }
    let paths = write_together(folder, |together| {
        files.iter().try_for_each(|file| together.add(&folder.join(&file.path), &file.bytes))
    })?;
    let mut notes = Vec::new();
    if job.scheduler == Scheduler::Slurm && job.shards > SLURM_ARRAY {
        notes.push(format!(
            "{} shards: Slurm refuses arrays of more than {SLURM_ARRAY} tasks unless its MaxArraySize is raised",
            job.shards
        ));
    }
    Ok((paths, notes))
}

fn check(set: &Set, job: &Job) -> Result<()> {
    set.recipe.rendering()?;
    let fault = |words: String, help: &str| Err(Error::misuse(words).help(help));
    let units = set.recipe.units();
    if job.shards > units {
        let what = if set.recipe.pack.is_some() { "packs" } else { "images" };
        let words = format!("{} shards of {units} {what}: some would be empty", job.shards);
        return fault(words, "give fewer --shards; a shard should last minutes");
    }
    if let Scheduler::Kubernetes(pod) = &job.scheduler {
        pod.check()?;
    }
    job.alerts.check()?;
    if job.scheduler != Scheduler::Slurm {
        let is_parallel = job.scheduler == Scheduler::Parallel;
        for (given, words, help) in [
            (job.alerts.mail.is_some(), "--mail is for slurm", "leave it out"),
            (
                job.alerts.on_failure.is_some(),
                "--on-failure is for slurm",
                "leave it out; the script's exit code says it",
            ),
            (
                is_parallel && job.running.is_some(),
                "--max-running is for slurm and kubernetes",
                "run the script with JOBS=N",
            ),
        ] {
            if given {
                return fault(words.into(), help);
            }
        }
    }
    if let Some(push) = &job.push {
        if push.free {
            return fault("--push-free removes the images that the finishing job needs".into(), "leave it out here");
        }
        if matches!(job.scheduler, Scheduler::Kubernetes(_)) {
            let help = "write --push into the command of render.yaml by hand";
            return fault("--push is for slurm and parallel".into(), help);
        }
    }
    if let Some(scratch) = &job.scratch {
        if scratch.is_empty() || scratch.contains(char::is_control) {
            return fault(format!("--scratch {scratch:?} is not a folder"), "for example: --scratch '$TMPDIR/furrow'");
        }
        if matches!(job.scheduler, Scheduler::Kubernetes(_)) {
            let help = "write --scratch into the command of render.yaml by hand, with a folder of the container";
            return fault("--scratch is for slurm and parallel".into(), help);
        }
    }
    // Times in job files are in whole seconds.
    let (grace, time) = (job.grace.as_secs(), job.time.as_secs());
    if grace >= time {
        let words = format!("--grace {grace} s leaves nothing of --time {time} s");
        return fault(words, "--grace is the time before the end of --time when a shard receives the stop signal");
    }
    Ok(())
}
