//! Rendering of a dataset: `trace dataset render`.

use super::progress::Progress;
use crate::field::MemoryArgs;
use crate::profile::{self, ProfileArgs};
use crate::quality::threads;
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use furrow_cli::cli;
use furrow_cli::cli::signal::Signals;
use furrow_dataset::Set;
use furrow_dataset::deliver::scratch;
use furrow_dataset::make::generate::{self, Callbacks, Shard, Work};
use furrow_dataset::make::push::{Destination, Push};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Images to render, and options.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the dataset.
    dir: PathBuf,
    /// Render the images whose number modulo N equals k.
    #[arg(long, value_name = "k/N", default_value = "0/1", value_parser = Shard::parse)]
    shard: Shard,
    /// Render images in a separate folder below this one, on a local disk, and move them to the dataset's folder as
    /// they are finished; with packs, whole archives. When stopped, the finished part of a pack is moved.
    #[arg(long, value_name = "DIR")]
    scratch: Option<PathBuf>,
    #[command(flatten)]
    memory: MemoryArgs,
    #[command(flatten)]
    work: WorkArgs,
    #[command(flatten)]
    push: PushArgs,
    #[command(flatten)]
    profile: ProfileArgs,
}

/// Transfer of finished images to another place.
#[derive(clap::Args)]
pub(crate) struct PushArgs {
    /// Upload each finished image or pack to a bucket, s3://BUCKET/FOLDER, or run a shell command for it. {dir} in the
    /// command is a folder with its files under their paths in the dataset, such as 'rclone copy {dir} remote:set' or
    /// 'cp -a {dir}/. /mnt/set/'. Pushed images are recorded, and not pushed again.
    #[arg(long, value_name = "TO")]
    push: Option<String>,
    /// Run this command after that of `--push`, such as 'rclone check --one-way {dir} remote:set'. If it fails, the push
    /// counts as failed.
    #[arg(long, value_name = "COMMAND", requires = "push")]
    push_check: Option<String>,
    /// Remove images here once they are pushed. Run `finish` at the other place then.
    #[arg(long, requires = "push")]
    push_free: bool,
    /// Number of attempts per push, with increasing pauses, before the run ends.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=10), requires = "push")]
    push_tries: u32,
    /// Time limit of a push. After it, the command and its children are terminated, and the push counts as failed.
    #[arg(long, value_name = "SECONDS", value_parser = clap::value_parser!(u64).range(1..), requires = "push")]
    push_timeout: Option<u64>,
}

impl PushArgs {
    /// Returns the selected push options.
    pub(crate) fn push(&self) -> Result<Option<Push>> {
        let Some(to) = &self.push else { return Ok(None) };
        let to = Destination::parse(to, self.push_check.as_deref())?;
        let timeout = self.push_timeout.map(Duration::from_secs);
        Ok(Some(Push { to, free: self.push_free, tries: self.push_tries, timeout }))
    }

    /// Like [`PushArgs::push`], for pushes from this machine: fails if it cannot push.
    pub(crate) fn push_from_here(&self) -> Result<Option<Push>> {
        let push = self.push()?;
        push.as_ref().map_or(Ok(()), Push::check_machine)?;
        Ok(push)
    }

    /// Returns `true` if images are removed after a push, so that the dataset-wide files are written at the other
    /// place.
    pub(crate) fn frees(&self) -> bool {
        self.push_free
    }
}

/// Options that do not change any byte of the files.
#[derive(clap::Args)]
pub(crate) struct WorkArgs {
    /// Number of threads; 0 for one per core.
    #[arg(long, default_value_t = 0, value_parser = threads)]
    pub(crate) threads: usize,
    /// Number of images rendered concurrently. They share the threads, and each needs the memory of a field. 0 for one
    /// per thread, at most 16, limited by memory.
    #[arg(long, default_value_t = 0, value_parser = threads)]
    at_once: usize,
    /// Print nothing but errors, warnings and the paths of the files.
    #[arg(long)]
    pub(crate) quiet: bool,
}

impl WorkArgs {
    /// Work for a shard.
    pub(crate) fn of(&self, shard: Shard, memory: Option<u64>) -> Work<'static> {
        Work { shard, threads: self.threads, at_once: self.at_once, memory, ..Work::default() }
    }
}

/// Renders the images of a shard.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    let set = Set::open(&args.dir)?;
    let push = args.push.push_from_here()?;
    if let Some(scratch) = &args.scratch {
        check_scratch(scratch, &args.dir)?;
        let help = "give --scratch a folder on a disk of this machine; it is created if it does not exist";
        cli::check_folder(scratch).map_err(|e| e.help(help))?;
    }
    let profiler = args.profile.profiler();
    let of_shard = args.work.of(args.shard, args.memory.bytes);
    let work = Work { push: push.as_ref(), profiler: Some(&profiler).filter(|p| p.is_on()), ..of_shard };
    generate_in(&set, args.scratch.as_deref(), &work, args.work.quiet, signals)?;
    Ok(Vec::new())
}

/// Renders the missing images of a dataset.
pub(crate) fn generate(set: &Set, args: &WorkArgs, shard: Shard, memory: Option<u64>, signals: &Signals) -> Result<()> {
    generate_in(set, None, &args.of(shard, memory), args.quiet, signals)
}

/// Returns an error for a folder with unexpanded shell variables, or inside the dataset.
fn check_scratch(scratch: &Path, dir: &Path) -> Result<()> {
    let words = scratch.to_string_lossy();
    if words.contains('$') || words.starts_with('~') {
        return Err(Error::misuse(format!("--scratch {words}: this name contains an unexpanded shell variable"))
            .help("omit single quotes here; `emit` accepts variables of the node"));
    }
    let full = |path: &Path| std::path::absolute(path).map_err(Error::io(path));
    if full(scratch)?.starts_with(full(dir)?) {
        return Err(Error::misuse(format!("--scratch {words} is inside the dataset"))
            .help("give --scratch a folder on a disk of this machine"));
    }
    Ok(())
}

/// Renders images in the dataset's folder, or in a scratch folder and moves them there.
pub(super) fn generate_in(
    set: &Set,
    scratch: Option<&Path>,
    work: &Work<'_>,
    quiet: bool,
    signals: &Signals,
) -> Result<()> {
    let begin = Instant::now();
    let (soon, now) = signals.catch_graceful();
    let (growing, time_left) = (Arc::default(), Arc::default());
    let progress = Progress::of_fields(begin, quiet, &growing, &time_left);
    let total = |n: usize| progress.expect(n.to_u64());
    let done = |_| progress.add();
    let warn = |words: &str| progress.pause(|| furrow_cli::message!("warning: {words}"));
    let callbacks = Callbacks { begin: &total, warn: &warn, done: &done, soon, now };
    let work = Work { progress: Some(&growing), time_left: Some(&time_left), ..*work };
    let made = match scratch {
        Some(scratch) => scratch::generate(set, scratch, &work, &callbacks),
        None => generate::generate(set, &work, &callbacks),
    };
    let (images, rate) = progress.finish();
    if !quiet {
        let rate = if images > 0 { format!(": {rate:.0} images per hour") } else { String::new() };
        furrow_cli::message!(
            "{}: {images} images in {:.1} s{rate}",
            set.folder.display(),
            begin.elapsed().as_secs_f64()
        );
    }
    work.profiler.into_iter().for_each(profile::print);
    made.map_err(|error| set.blame(error))
}
