//! Dataset-wide files: `trace dataset finish`.

use super::order::{LabelArgs, formats};
use super::render::{PushArgs, WorkArgs, generate_in};
use furrow_base::Result;
use furrow_cli::cli::signal::Signals;
use furrow_dataset::Set;
use furrow_dataset::format::labels::LeftOut;
use furrow_dataset::make::finish;
use furrow_dataset::make::generate::{Shard, Work};
use furrow_dataset::make::plan;
use furrow_dataset::make::push;
use furrow_job::Threads;
use std::path::PathBuf;

/// The dataset, and options.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the dataset.
    dir: PathBuf,
    /// Number of shards; missing images are then also reported as shards, in the syntax of Slurm's --array.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    shards: Option<u64>,
    /// Additional formats, separated by commas, written from the existing images.
    #[arg(long, value_delimiter = ',', value_name = "FORMAT", value_parser = formats())]
    format: Vec<String>,
    #[command(flatten)]
    labels: LabelArgs,
    #[command(flatten)]
    work: WorkArgs,
    #[command(flatten)]
    push: PushArgs,
}

/// Adds formats, then writes the dataset-wide files.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    let mut set = Set::open(&args.dir)?;
    let push = args.push.push_from_here()?;
    let labelling = args.labels.labelling();
    if !args.format.is_empty() || !labelling.is_usual() {
        for warning in plan::add_formats(&mut set, &args.format, &labelling)? {
            furrow_cli::message!("warning: {warning}");
        }
        let work = Work { push: push.as_ref(), ..args.work.of(Shard::ALL, None) };
        generate_in(&set, None, &work, args.work.quiet, signals)?;
    }
    let threads = Threads::new(args.work.threads)?;
    let files = threads.install(|| {
        let files = finish::finish(&set, args.shards)?;
        print_left_out(&set)?;
        Ok::<_, furrow_base::Error>(files)
    })?;
    if let Some(push) = &push {
        let (soon, now) = signals.catch_graceful();
        push::whole(&set, push, push::Stop { soon, now })?;
    }
    Ok(files)
}

/// Prints how many plants and leaves are left out of the formats' lists.
pub(super) fn print_left_out(set: &Set) -> Result<()> {
    if set.recipe.formats.is_empty() {
        return Ok(());
    }
    if let Some(LeftOut { ignored_plants, plants, leaves }) = LeftOut::of(set)? {
        furrow_cli::message!(
            "left out of the formats' lists: {plants} plants and {leaves} leaves too small or too hidden, {ignored_plants} plants without a class"
        );
    }
    Ok(())
}
