//! `train plants`.

use crate::fit;
use crate::machine::MachineArgs;
use furrow_base::{Error, Result};
use furrow_cli::cli;
use furrow_cli::cli::signal::Signals;
use furrow_train::data::Selection;
use furrow_train::plants::PlantOptions;
use furrow_train::torch::{Precision, device};
use std::path::PathBuf;

/// Arguments of `train plants`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the run whose network gets the decoder, or name of a network that ships (`train zoo`).
    run: PathBuf,
    /// Images with plant numbers, rendered or imported: a dataset with all images of its training set, or DIR@PICK. May be given several
    /// times.
    #[arg(long = "set", value_name = "DIR[@PICK]", required = true, value_parser = Selection::parse)]
    sets: Vec<Selection>,
    /// Folder of the network with the decoder.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Number of training steps.
    #[arg(long, value_name = "N", default_value_t = 800, value_parser = clap::value_parser!(u64).range(1..))]
    steps: u64,
    /// Learning rate at the start.
    #[arg(long, value_name = "RATE", default_value_t = 0.002)]
    rate: f64,
    /// Batch size: images per step, 1 to 1024.
    #[arg(long, value_name = "N", default_value_t = 4)]
    batch: usize,
    /// Seed of the initial weights, the order of images and data augmentation.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    machine: MachineArgs,
    /// Print nothing but errors and the paths of the files.
    #[arg(long)]
    quiet: bool,
}

/// Trains the decoder; returns the paths of the files written.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    cli::check_folder(&args.out)?;
    let precision = Precision::named(&args.machine.precision, device::find(&args.machine.machine().device)?);
    let asked = PlantOptions {
        run: &args.run,
        sets: &args.sets,
        steps: args.steps,
        rate: args.rate,
        batch: args.batch,
        seed: args.seed,
        precision: precision.map_err(Error::input)?.name(),
        threads: args.machine.threads(),
    };
    let results = fit::shown(args.steps, args.quiet, signals, |callbacks| {
        asked.train(&args.machine.machine(), &args.out, callbacks)
    })?;
    fit::written(&args.out, args.quiet, &results)
}
