//! Making the images: `trace dataset render`.

use super::progress::Progress;
use crate::field::MemoryArgs;
use crate::quality::threads;
use furrow::Result;
use furrow::cli::signal::Signals;
use furrow::dataset::Set;
use furrow::dataset::generate::{self, Callbacks, Shard, Work};
use std::path::PathBuf;
use std::time::Instant;

/// Which images.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the dataset.
    dir: PathBuf,
    /// Render the images whose number leaves k when divided by N.
    #[arg(long, value_name = "k/N", default_value = "0/1", value_parser = Shard::parse)]
    shard: Shard,
    #[command(flatten)]
    memory: MemoryArgs,
    #[command(flatten)]
    work: WorkArgs,
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
    pub(crate) fn of(&self, shard: Shard, memory: Option<u64>) -> Work {
        Work { shard, threads: self.threads, at_once: self.at_once, memory }
    }
}

/// Makes the images of a shard.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    let set = Set::open(&args.dir)?;
    generate(&set, &args.work, args.shard, args.memory.bytes, signals)?;
    Ok(Vec::new())
}

/// Makes the images of a dataset that are missing.
pub(crate) fn generate(set: &Set, args: &WorkArgs, shard: Shard, memory: Option<u64>, signals: &Signals) -> Result<()> {
    let begin = Instant::now();
    let (soon, now) = signals.heed_patiently();
    let progress = Progress::new(begin, args.quiet);
    let total = |n: usize| progress.expect(n as u64);
    let done = |_| progress.add();
    let warn = |words: &str| furrow::tell!("warning: {words}");
    let callbacks = Callbacks { begin: &total, warn: &warn, done: &done, soon, now };
    let made = generate::generate(set, &args.of(shard, memory), &callbacks);
    let (images, rate) = progress.finish();
    if !args.quiet {
        let rate = if images > 0 { format!(": {rate:.0} images an hour") } else { String::new() };
        furrow::tell!("{}: {images} images in {:.1} s{rate}", set.folder.display(), begin.elapsed().as_secs_f64());
    }
    made
}
