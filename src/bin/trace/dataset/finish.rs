//! What belongs to all images: `trace dataset finish`.

use super::order::{LabelArgs, formats};
use super::render::{PushArgs, WorkArgs, generate_and_push};
use furrow::Result;
use furrow::cli::signal::Signals;
use furrow::dataset::generate::Shard;
use furrow::dataset::labels::LeftOut;
use furrow::dataset::{Set, finish, plan, push};
use furrow::job::Threads;
use std::path::PathBuf;

/// Which dataset.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the dataset.
    dir: PathBuf,
    /// How many shards it is made in: what is missing is then told as shards too, as Slurm's --array takes them.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    shards: Option<u64>,
    /// Further formats, separated by commas; made from the images that are there.
    #[arg(long, value_delimiter = ',', value_name = "FORMAT", value_parser = formats())]
    format: Vec<String>,
    #[command(flatten)]
    labels: LabelArgs,
    #[command(flatten)]
    work: WorkArgs,
    #[command(flatten)]
    push: PushArgs,
}

/// Adds formats, then writes what belongs to all.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    let mut set = Set::open(&args.dir)?;
    let push = args.push.push()?;
    let labelling = args.labels.labelling();
    if !args.format.is_empty() || !labelling.is_usual() {
        for warning in plan::add_formats(&mut set, &args.format, &labelling)? {
            furrow::tell!("warning: {warning}");
        }
        generate_and_push(&set, &args.work, Shard::ALL, None, push.as_ref(), signals)?;
    }
    let threads = Threads::new(args.work.threads)?;
    let files = threads.install(|| {
        let files = finish::finish(&set, args.shards)?;
        tell_left_out(&set)?;
        Ok::<_, furrow::Error>(files)
    })?;
    if let Some(push) = &push {
        push::whole(&set, push, signals.heed())?;
    }
    Ok(files)
}

/// Tells what of the images stands in no list of a format.
pub(super) fn tell_left_out(set: &Set) -> Result<()> {
    if set.recipe.formats.is_empty() {
        return Ok(());
    }
    if let Some(LeftOut { ignored_plants, plants, leaves }) = LeftOut::of(set)? {
        furrow::tell!(
            "left out of the formats' lists: {plants} plants and {leaves} leaves too small or too hidden, {ignored_plants} plants of no class"
        );
    }
    Ok(())
}
