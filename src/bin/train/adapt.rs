//! `train adapt`.

use crate::fit;
use crate::machine::MachineArgs;
use furrow::cli::signal::Signals;
use furrow::train::adapt::Asked;
use furrow::train::data::Selection;
use furrow::train::deploy::pictures;
use furrow::train::run::{self, TrainedModel};
use furrow::train::torch::{Precision, device};
use furrow::{Error, Result, cli};
use std::path::PathBuf;

/// Which network, on which photographs.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the run that it begins with, or the name of a network that ships (`train zoo`).
    run: PathBuf,
    /// PNG or JPEG files of any size, folders of them, or images of a set, whose labels are not read: DIR, DIR@PICK. May be given several
    /// times.
    #[arg(long, value_name = "IMAGES", required = true)]
    images: Vec<PathBuf>,
    /// Labelled images that it goes on learning beside them: the training set of the run unless given. May be given several times.
    #[arg(long = "set", value_name = "DIR[@PICK]", value_parser = Selection::parse)]
    sets: Vec<Selection>,
    /// Validation set: images with labels, whose loss, I/U and predictions are logged while it trains; the best pass is kept, and a training
    /// ends early as that of the run does. Without one the last weights are kept. May be given several times.
    #[arg(long, value_name = "DIR[@PICK]", value_parser = Selection::parse)]
    val: Vec<Selection>,
    /// Folder of the adapted network.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Training steps.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u64).range(1..))]
    steps: u64,
    /// Learning rate at the start; a fifth of the run's unless given.
    #[arg(long, value_name = "RATE")]
    rate: Option<f64>,
    /// Share of the predicted pixels of each class that are taken for labels, the surest first: above 0, at most 1.
    #[arg(long, value_name = "SHARE", default_value_t = 0.5)]
    keep: f64,
    /// Photographs that are used at most, evenly picked.
    #[arg(long, value_name = "N", default_value_t = 400, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    most: u32,
    /// Seed.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    machine: MachineArgs,
    /// Print nothing but errors and the paths of the files.
    #[arg(long)]
    quiet: bool,
}

/// Adapts.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    let trained = TrainedModel::open(&args.run)?;
    cli::check_folder(&args.out)?;
    let pictures = pictures::find(&args.images, &trained.card.input, &[])?;
    let precision = Precision::named(&args.machine.precision, device::find(&args.machine.machine().device)?);
    let asked = Asked {
        run: &args.run,
        sets: &args.sets,
        val: &args.val,
        steps: args.steps,
        rate: args.rate,
        keep: args.keep,
        most: args.most as usize,
        seed: args.seed,
        precision: precision.map_err(Error::input)?.name(),
        threads: args.machine.threads(),
    };
    let results = fit::shown(args.steps, args.quiet, signals, |callbacks| {
        asked.adapt(&pictures, &args.machine.machine(), &args.out, callbacks)
    })?;
    if !args.quiet {
        furrow::tell!("{}: {}", args.out.display(), fit::in_words(&results));
    }
    let mut paths = [run::WEIGHTS, run::MODEL].map(|file| args.out.join(file)).to_vec();
    paths.extend(fit::write_page(&args.out)?);
    Ok(paths)
}
