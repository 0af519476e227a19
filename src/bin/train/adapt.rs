//! `train adapt`.

use crate::fit;
use crate::machine::MachineArgs;
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use furrow_cli::cli;
use furrow_cli::cli::signal::Signals;
use furrow_train::adapt::AdaptOptions;
use furrow_train::data::Selection;
use furrow_train::deploy::input_images;
use furrow_train::run::TrainedModel;
use furrow_train::torch::{Precision, device};
use std::path::PathBuf;

/// Arguments of `train adapt`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the run to start from, or name of a network that ships (`train zoo`).
    run: PathBuf,
    /// Images without labels: PNG or JPEG files of any size, folders of them, or images of a dataset, DIR or DIR@PICK, whose labels are not
    /// read. May be given several times.
    #[arg(long, value_name = "IMAGES", required = true)]
    images: Vec<PathBuf>,
    /// Labelled images to keep training on as well; by default the training set of the run. May be given several times.
    #[arg(long = "set", value_name = "DIR[@PICK]", value_parser = Selection::parse)]
    sets: Vec<Selection>,
    /// Validation set: labelled images whose loss, I/U and predictions are logged during training. The weights with the best validation score are kept, and
    /// training stops early by the rule of the run. Without it the last weights are kept. May be given several times.
    #[arg(long, value_name = "DIR[@PICK]", value_parser = Selection::parse)]
    val: Vec<Selection>,
    /// Folder of the adapted network.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Number of training steps.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u64).range(1..))]
    steps: u64,
    /// Initial learning rate; by default a fifth of the run's.
    #[arg(long, value_name = "RATE")]
    rate: Option<f64>,
    /// Fraction of the predicted pixels of each class that are used as labels, the most confident first: above 0, at most 1.
    #[arg(long, value_name = "SHARE", default_value_t = 0.5)]
    keep: f64,
    /// Maximum number of images used; they are picked evenly.
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

/// Adapts the network; returns the paths of the files written.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    let trained = TrainedModel::open(&args.run)?;
    cli::check_folder(&args.out)?;
    let pictures = input_images::find(&args.images, &trained.card.input, &[])?;
    let precision = Precision::named(&args.machine.precision, device::find(&args.machine.machine().device)?);
    let asked = AdaptOptions {
        run: &args.run,
        sets: &args.sets,
        val: &args.val,
        steps: args.steps,
        rate: args.rate,
        keep: args.keep,
        most: args.most.to_usize(),
        seed: args.seed,
        precision: precision.map_err(Error::input)?.name(),
        threads: args.machine.threads(),
    };
    let results = fit::shown(args.steps, args.quiet, signals, |callbacks| {
        asked.adapt(&pictures, &args.machine.machine(), &args.out, callbacks)
    })?;
    fit::written(&args.out, args.quiet, &results)
}
