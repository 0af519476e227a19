//! Whether a dataset is whole: `trace dataset verify`.

use super::progress::Progress;
use crate::quality::threads;
use furrow::Result;
use furrow::cli::signal::Signals;
use furrow::dataset::{Set, render, verify};
use furrow::job::Threads;
use std::path::PathBuf;
use std::time::Instant;

/// Which dataset.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the dataset.
    dir: PathBuf,
    /// How many shards it is made in: what is missing is then told as shards too, as Slurm's --array takes them.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    shards: Option<u64>,
    /// Render so many images again and compare their bytes.
    #[arg(long, value_name = "N", default_value_t = 0)]
    rerender: u64,
    /// Threads; 0 for one on each core.
    #[arg(long, default_value_t = 0, value_parser = threads)]
    threads: usize,
    /// Print nothing but errors.
    #[arg(long)]
    quiet: bool,
}

/// Checks; says what was found.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    let set = Set::open(&args.dir)?;
    let renderer = if args.rerender > 0 { render::renderer(&set)? } else { None };
    let progress = Progress::new(Instant::now(), args.quiet);
    progress.expect(set.recipe.count);
    let done = |_| progress.add();
    let threads = Threads::new(args.threads)?;
    let found = verify::verify(&set, args.rerender, renderer.as_ref(), &threads, &done, signals.heed())?;
    progress.finish();
    if !args.quiet {
        furrow::tell!(
            "{}: {} of {} images checked, {} rendered again and the same; {} faults",
            set.folder.display(),
            found.checked,
            set.recipe.count,
            found.rendered,
            found.faults.len()
        );
    }
    found.verdict(&set, args.shards)?;
    Ok(Vec::new())
}
