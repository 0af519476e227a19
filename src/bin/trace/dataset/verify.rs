//! Integrity check of a dataset: `trace dataset verify`.

use super::progress::Progress;
use crate::field::MemoryArgs;
use crate::quality::threads;
use furrow_base::Result;
use furrow_cli::cli::signal::Signals;
use furrow_dataset::Set;
use furrow_dataset::check::verify::{self, OtherKernels, Rerender};
use furrow_dataset::make::render;
use furrow_job::Threads;
use std::path::PathBuf;
use std::time::Instant;

/// The dataset, and options.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the dataset.
    dir: PathBuf,
    /// Number of shards; missing images are then also reported as shards, in the syntax of Slurm's --array.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    shards: Option<u64>,
    /// Render N images again and compare their bytes; with another version of Embree, report how far they differ.
    #[arg(long, value_name = "N", default_value_t = 0)]
    rerender: u64,
    #[command(flatten)]
    memory: MemoryArgs,
    /// Number of threads; 0 for one per core.
    #[arg(long, default_value_t = 0, value_parser = threads)]
    threads: usize,
    /// Print nothing but errors.
    #[arg(long)]
    quiet: bool,
}

/// Checks the dataset and prints the result.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    let set = Set::open(&args.dir)?;
    let renderer = if args.rerender > 0 { render::near_renderer(&set)? } else { None };
    let again = Rerender { images: args.rerender, renderer: renderer.as_ref(), memory: args.memory.bytes };
    let progress = Progress::new(Instant::now(), args.quiet);
    progress.expect(set.recipe.count);
    let done = |_| progress.add();
    let threads = Threads::new(args.threads)?;
    let found = verify::verify(&set, &again, &threads, &done, signals.catch())?;
    progress.finish();
    if !args.quiet {
        let again = match &found.kernels {
            None => "and the same".to_owned(),
            Some(OtherKernels { there, here, most }) => {
                format!("by {here} instead of {there}, and nearly the same: they differ in at most {most}")
            }
        };
        furrow_cli::message!(
            "{}: {} of {} images checked, {} rendered again {again}; {} faults",
            set.folder.display(),
            found.checked,
            set.recipe.count,
            found.rendered,
            found.faults.len()
        );
        if let Some(unchecked) = &found.unchecked {
            furrow_cli::message!("not checked: {unchecked}");
        }
    }
    found.verdict(&set, args.shards)?;
    Ok(Vec::new())
}
