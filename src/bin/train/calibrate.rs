//! `train calibrate`.

use crate::machine::MachineArgs;
use furrow_base::Result;
use furrow_cli::cli;
use furrow_train::data::Selection;
use furrow_train::run::{self, TrainedModel};
use furrow_train::session;
use std::path::PathBuf;

/// Arguments of `train calibrate`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of a run, or name of a network that ships (`train zoo`).
    run: PathBuf,
    /// Images with labels: the training set of a dataset, or the images that DIR@PICK selects. May be given several times.
    #[arg(long = "set", value_name = "DIR[@PICK]", required = true, value_parser = Selection::parse)]
    sets: Vec<Selection>,
    /// Number of images used; they are picked evenly.
    #[arg(long, value_name = "N", default_value_t = 40, value_parser = clap::value_parser!(u64).range(1..))]
    images: u64,
    /// Folder for the calibrated network.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    machine: MachineArgs,
}

/// Calibrates the network; returns the paths of the files written.
pub(crate) fn run(args: &Args) -> Result<Vec<PathBuf>> {
    let trained = TrainedModel::open(&args.run)?;
    cli::check_folder(&args.out)?;
    run::check_untaken(&args.out)?;
    let MachineArgs { precision, .. } = &args.machine;
    let machine = args.machine.machine();
    let calibrated =
        session::calibrated(&trained, &args.sets, args.images, precision, args.machine.threads(), &machine)?;
    calibrated.write(&args.out)?;
    Ok([run::WEIGHTS, run::MODEL].map(|file| args.out.join(file)).to_vec())
}
