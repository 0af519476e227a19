//! Making the images: `trace dataset render`.

use super::progress::Progress;
use crate::field::MemoryArgs;
use crate::quality::threads;
use furrow::cli::signal::Signals;
use furrow::dataset::generate::{self, Callbacks, Shard, Work};
use furrow::dataset::push::Push;
use furrow::dataset::{Set, scratch};
use furrow::{Error, Result, cli};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Which images.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the dataset.
    dir: PathBuf,
    /// Render the images whose number leaves k when divided by N.
    #[arg(long, value_name = "k/N", default_value = "0/1", value_parser = Shard::parse)]
    shard: Shard,
    /// Make images in a folder of their own below this one, on a disk of this machine, and bring them to the dataset's folder as they are
    /// finished; with packs whole archives. Stopped, it brings what there is of a pack.
    #[arg(long, value_name = "DIR")]
    scratch: Option<PathBuf>,
    #[command(flatten)]
    memory: MemoryArgs,
    #[command(flatten)]
    work: WorkArgs,
    #[command(flatten)]
    push: PushArgs,
}

/// How what is finished is sent elsewhere.
#[derive(clap::Args)]
pub(crate) struct PushArgs {
    /// Run this shell command for each finished image or pack: {dir} is a folder with its files by their paths in the dataset, such as
    /// 'rclone copy {dir} remote:set' or 'cp -a {dir}/. /mnt/set/'. What was pushed is noted, and not pushed again.
    #[arg(long, value_name = "COMMAND")]
    push: Option<String>,
    /// Run this after it; where it fails, the push counts as failed. Such as 'rclone check --one-way {dir} remote:set'.
    #[arg(long, value_name = "COMMAND", requires = "push")]
    push_check: Option<String>,
    /// Remove images here once they are pushed; `finish` is for the other place then.
    #[arg(long, requires = "push")]
    push_free: bool,
    /// How often a push is tried, with longer and longer pauses, before the run ends.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=10), requires = "push")]
    push_tries: u32,
    /// End a push that takes longer, with what it has started; it then counts as failed.
    #[arg(long, value_name = "SECONDS", value_parser = clap::value_parser!(u64).range(1..), requires = "push")]
    push_timeout: Option<u64>,
}

impl PushArgs {
    /// What they ask for.
    pub(crate) fn push(&self) -> Result<Option<Push>> {
        let Self { push, push_check: check, push_free: free, push_tries: tries, push_timeout } = self;
        let timeout = push_timeout.map(Duration::from_secs);
        let push =
            push.clone().map(|command| Push { command, check: check.clone(), free: *free, tries: *tries, timeout });
        push.as_ref().map_or(Ok(()), Push::check)?;
        Ok(push)
    }

    /// Whether what belongs to all images is made at the other place.
    pub(crate) fn frees(&self) -> bool {
        self.push_free
    }
}

/// How they are made; none of it changes a byte.
#[derive(clap::Args)]
pub(crate) struct WorkArgs {
    /// Threads; 0 for one on each core.
    #[arg(long, default_value_t = 0, value_parser = threads)]
    pub(crate) threads: usize,
    /// Images under way at once, which share the threads; each takes the memory of a field. 0 for one a thread, 16 at most, and no more
    /// than the memory is for.
    #[arg(long, default_value_t = 0, value_parser = threads)]
    at_once: usize,
    /// Print nothing but errors, warnings and the paths of the files.
    #[arg(long)]
    pub(crate) quiet: bool,
}

impl WorkArgs {
    /// The work of a shard.
    pub(crate) fn of(&self, shard: Shard, memory: Option<u64>) -> Work<'static> {
        Work { shard, threads: self.threads, at_once: self.at_once, memory, ..Work::default() }
    }
}

/// Makes the images of a shard.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    let set = Set::open(&args.dir)?;
    let push = args.push.push()?;
    if let Some(scratch) = &args.scratch {
        check_scratch(scratch, &args.dir)?;
        let help = "give --scratch a folder on a disk of this machine; it is made where it is missing";
        cli::check_folder(scratch).map_err(|e| e.help(help))?;
    }
    let work = Work { push: push.as_ref(), ..args.work.of(args.shard, args.memory.bytes) };
    generate_in(&set, args.scratch.as_deref(), &work, args.work.quiet, signals)?;
    Ok(Vec::new())
}

/// Makes the images of a dataset that are missing.
pub(crate) fn generate(set: &Set, args: &WorkArgs, shard: Shard, memory: Option<u64>, signals: &Signals) -> Result<()> {
    generate_and_push(set, args, shard, memory, None, signals)
}

/// The same, and sends them elsewhere.
pub(super) fn generate_and_push(
    set: &Set,
    args: &WorkArgs,
    shard: Shard,
    memory: Option<u64>,
    push: Option<&Push>,
    signals: &Signals,
) -> Result<()> {
    generate_in(set, None, &Work { push, ..args.of(shard, memory) }, args.quiet, signals)
}

/// Refuses a folder that is meant for a shell, or that lies in the dataset.
fn check_scratch(scratch: &Path, dir: &Path) -> Result<()> {
    let words = scratch.to_string_lossy();
    if words.contains('$') || words.starts_with('~') {
        return Err(Error::misuse(format!("--scratch {words}: no shell has filled in this name"))
            .help("leave single quotes out here; `emit` takes variables of the node"));
    }
    let full = |path: &Path| std::path::absolute(path).map_err(Error::io(path));
    if full(scratch)?.starts_with(full(dir)?) {
        return Err(Error::misuse(format!("--scratch {words} lies in the dataset itself"))
            .help("give --scratch a folder on a disk of this machine"));
    }
    Ok(())
}

/// Makes images in the dataset's folder, or elsewhere and brings them there.
fn generate_in(set: &Set, scratch: Option<&Path>, work: &Work<'_>, quiet: bool, signals: &Signals) -> Result<()> {
    let begin = Instant::now();
    let (soon, now) = signals.heed_patiently();
    let (growing, time_left) = (Arc::default(), Arc::default());
    let progress = Progress::of_fields(begin, quiet, &growing, &time_left);
    let total = |n: usize| progress.expect(n as u64);
    let done = |_| progress.add();
    let warn = |words: &str| progress.pause(|| furrow::tell!("warning: {words}"));
    let callbacks = Callbacks { begin: &total, warn: &warn, done: &done, soon, now };
    let work = Work { progress: Some(&growing), time_left: Some(&time_left), ..*work };
    let made = match scratch {
        Some(scratch) => scratch::generate(set, scratch, &work, &callbacks),
        None => generate::generate(set, &work, &callbacks),
    };
    let (images, rate) = progress.finish();
    if !quiet {
        let rate = if images > 0 { format!(": {rate:.0} images an hour") } else { String::new() };
        furrow::tell!("{}: {images} images in {:.1} s{rate}", set.folder.display(), begin.elapsed().as_secs_f64());
    }
    made
}
