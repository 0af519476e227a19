//! `train calibrate`.

use crate::machine::MachineArgs;
use furrow::train::data::Selection;
use furrow::train::run::{self, TrainedModel};
use furrow::train::session;
use furrow::{Result, cli};
use std::path::PathBuf;

/// Which network, on which images.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the run, or the name of a network that ships (`train zoo`).
    run: PathBuf,
    /// Images with labels: the training set of a dataset unless it says DIR@PICK. May be given several times.
    #[arg(long = "set", value_name = "DIR[@PICK]", required = true, value_parser = Selection::parse)]
    sets: Vec<Selection>,
    /// Images that are used, evenly picked.
    #[arg(long, value_name = "N", default_value_t = 40, value_parser = clap::value_parser!(u64).range(1..))]
    images: u64,
    /// Folder for the calibrated network.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    machine: MachineArgs,
}

/// Calibrates.
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
