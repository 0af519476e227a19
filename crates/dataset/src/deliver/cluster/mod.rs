//! Job files for those who have more than one machine: for Slurm, for Kubernetes, for GNU parallel.
//!
//! A scheduler's part is small, since image k is the same wherever it is made and what is done is read off the disk: start
//! `trace dataset render --shard k/N` for every k, again where one was cut off; then `finish` and `verify`. Exit codes say what to
//! do: 0 done, 75 start again, 2 never, 1 look.
//!
//! Files are written for people: they are read, and edited, since partitions, accounts and images are a site's own. So they are
//! templates with names between @ signs, one file beside this each; what was edited is never overwritten.

mod kubernetes;
mod parallel;
mod request;
mod script;
mod slurm;

pub use request::{Job, Pod, Scheduler};
pub(super) use script::quoted;

use crate::Set;
use furrow_base::input::{refuse_links, tidy};
use furrow_base::{Error, Result};
use furrow_output::write_together;
use script::plain;
use std::path::{Path, PathBuf};

/// More tasks than this Slurm takes only where its `MaxArraySize` was raised.
const SLURM_ARRAY: u64 = 1001;

/// Writes the job files of a dataset into `folder`; files there that say something else are left alone, with an error. Returns the
/// files, the one to begin with first, and what the user should know.
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
            return Err(Error::misuse("this file is there and says something else: it may have been edited")
                .in_file(path)
                .help("remove it, or give another --out"));
        }
    }
    let paths = write_together(folder, |together| {
        files.iter().try_for_each(|file| together.add(&folder.join(&file.path), &file.bytes))
    })?;
    let mut told = Vec::new();
    if job.scheduler == Scheduler::Slurm && job.shards > SLURM_ARRAY {
        told.push(format!(
            "{} shards: Slurm refuses arrays of more than {SLURM_ARRAY} tasks where its MaxArraySize was not raised",
            job.shards
        ));
    }
    Ok((paths, told))
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
    if let Some(push) = &job.push {
        push.check()?;
        if push.free {
            return fault("--push-free leaves nothing for the job that finishes".into(), "leave it out here");
        }
        if matches!(job.scheduler, Scheduler::Kubernetes(_)) {
            let help = "write --push into the command of render.yaml by hand";
            return fault("--push is for slurm and parallel".into(), help);
        }
    }
    if let Some(scratch) = &job.scratch {
        if scratch.is_empty() || scratch.contains(char::is_control) {
            return fault(format!("--scratch {scratch:?} is no folder"), "name one, as --scratch '$TMPDIR/furrow'");
        }
        if matches!(job.scheduler, Scheduler::Kubernetes(_)) {
            let help = "write --scratch into the command of render.yaml by hand, with a folder of the container";
            return fault("--scratch is for slurm and parallel".into(), help);
        }
    }
    // Job files are in whole seconds.
    let (grace, time) = (job.grace.as_secs(), job.time.as_secs());
    if grace >= time {
        let words = format!("--grace {grace} leaves nothing of --time {time} s");
        return fault(words, "--grace is how long before the end of --time a shard is told to stop");
    }
    Ok(())
}
