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
mod slurm;

use super::{File, Set};
use crate::output::write_atomically;
use crate::{Error, Result};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Who starts the shards.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Scheduler {
    /// Slurm: an array, and a job that follows it.
    Slurm,
    /// Kubernetes: an indexed job, and one to be applied when it has ended.
    Kubernetes(Pod),
    /// GNU parallel, or xargs where there is none: a script.
    Parallel,
}

/// Where a pod finds the program and the dataset.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pod {
    /// Container image in which `trace` is on the path.
    pub image: String,
    /// Claim of the volume in which the dataset's folder lies.
    pub claim: String,
}

/// What is asked of a scheduler.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Job {
    /// Who starts the shards.
    pub scheduler: Scheduler,
    /// Into how many parts the dataset is cut.
    pub shards: u64,
    /// Cores of each shard.
    pub cpus: u32,
    /// Memory of each shard, GiB.
    pub memory_gib: u32,
    /// Longest time of a shard before it is stopped and queued again.
    pub time: Duration,
    /// How long before that it is told: longer than an image takes.
    pub grace: Duration,
    /// Images that are rendered again to check them.
    pub again: u64,
    /// The program, as the machines see it.
    pub program: PathBuf,
}

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
    for file in &files {
        let path = folder.join(&file.path);
        if std::fs::read(&path).is_ok_and(|there| there != file.bytes) {
            return Err(Error::misuse("this file is there and says something else: it may have been edited")
                .in_file(path)
                .help("remove it, or give another --out"));
        }
    }
    let mut paths = Vec::new();
    for file in &files {
        let path = folder.join(&file.path);
        write_atomically(&path, &file.bytes)?;
        paths.push(path);
    }
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
    if job.shards > set.recipe.count {
        let words = format!("{} shards of {} images: some would be empty", job.shards, set.recipe.count);
        return fault(words, "give fewer --shards; a shard should last minutes");
    }
    if job.grace >= job.time {
        let words = format!("--grace {} leaves nothing of --time {} s", job.grace.as_secs(), job.time.as_secs());
        return fault(words, "--grace is how long before the end of --time a shard is told to stop");
    }
    Ok(())
}

/// A path as it may stand in a script, comments included.
fn plain(path: &Path) -> Result<String> {
    path.to_str().filter(|p| !p.contains(char::is_control)).map(str::to_owned).ok_or_else(|| {
        Error::misuse("this path cannot be written into a script")
            .in_file(path)
            .help("use a folder whose name has no control characters and is UTF-8")
    })
}

/// What the files of a dataset are called by: its folder's name in lower-case letters, digits and hyphens, at most 40 of them.
fn name(dir: &str) -> String {
    let last = dir.rsplit('/').next().unwrap_or_default().to_lowercase();
    let plain: String = last.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).take(40).collect();
    let plain = plain.trim_matches('-');
    if plain.is_empty() { "furrow".into() } else { format!("furrow-{plain}") }
}

/// A word of a shell script, whatever it holds.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+:,".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

/// A template with its names filled in.
fn fill(path: &str, template: &str, names: &[(&str, String)]) -> File {
    let text = names.iter().fold(template.to_owned(), |text, (name, value)| text.replace(&format!("@{name}@"), value));
    File { path: path.into(), bytes: text.into_bytes() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_survive_a_shell() {
        for word in ["/a/b.c", "it's here", "", "$(rm) \"x\" \\ `y` *", "@x"] {
            let said = std::process::Command::new("sh").arg("-c").arg(format!("printf %s {}", quoted(word))).output();
            assert_eq!(String::from_utf8(said.unwrap().stdout).unwrap(), word);
        }
    }

    #[test]
    fn names_are_what_every_scheduler_takes() {
        assert_eq!(name("/data/Synthetic D"), "furrow-synthetic-d");
        assert_eq!(name("/data/..."), "furrow");
        assert!(name(&"x".repeat(300)).len() < 50);
    }
}
