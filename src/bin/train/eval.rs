//! `train eval`.

use crate::inference::{AFTER, InferenceArgs};
use crate::machine::MachineArgs;
use crate::report;
use furrow_base::Result;
use furrow_cli::cli;
use furrow_cli::cli::signal::Signals;
use furrow_train::crop::with_crops;
use furrow_train::data::{Pick, Resize, Selection};
use furrow_train::ensemble::Ensemble;
use furrow_train::{session, zoo};
use std::path::{Path, PathBuf};

/// Arguments of `train eval`.
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(crate) struct Args {
    /// Folder of a run, name of a network that ships (`train zoo`), or folder of runs with several seeds, whose probabilities are averaged.
    run: PathBuf,
    /// Test set: images with labels; all images of the dataset, or those that DIR@PICK selects.
    #[arg(long = "set", value_name = "DIR[@PICK]", value_parser = Selection::parse)]
    set: Selection,
    /// Folder for the report; by default `eval/NAME` in the run's folder, named after the dataset and its pick. Required for a network that
    /// ships.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Crop of the test set, by any name of its species; may be given several times. As for `train predict`.
    #[arg(long = "crop", value_name = "NAME")]
    crops: Vec<String>,
    #[command(flatten)]
    inference: InferenceArgs,
    #[command(flatten)]
    machine: MachineArgs,
}

/// Evaluates, and writes the report.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    let (mut trained, warnings) = with_crops(Ensemble::open(&args.run)?, &args.crops)?;
    for warning in warnings {
        furrow_cli::message!("warning: {warning}");
    }
    args.inference.apply(&mut trained.card)?;
    let set = args.set.folder.file_name().unwrap_or_default();
    if args.out.is_none() {
        zoo::needs_out(&args.run, "report")?;
    }
    let name = args.set.to_string();
    let pick = name.strip_prefix(&*args.set.folder.to_string_lossy()).filter(|pick| *pick != "@all");
    let pick = pick.unwrap_or_default().replace('/', "-");
    let out = args.out.clone().unwrap_or_else(|| {
        let mut name = set.to_owned();
        name.push(pick);
        args.run.join("eval").join(name)
    });
    cli::check_folder(&out)?;
    evaluate(&trained, &args.run, &args.set, &out, &args.machine, signals)
}

/// Evaluates a trained model of the folder `run` on a set, prints the scores, and writes the report to `out`.
pub(crate) fn evaluate(
    trained: &Ensemble,
    run: &Path,
    set: &Selection,
    out: &Path,
    machine: &MachineArgs,
    signals: &Signals,
) -> Result<Vec<PathBuf>> {
    let card = &trained.card;
    let (_, images) = set.open(Pick::All, 0)?;
    let mut thumbnails = report::thumbnails(images.len(), &card.input.bands, card.classes.len());
    let mut see = |seen: &session::Predicted<'_>| thumbnails.see(seen.example, seen.size, seen.predicted);
    let (precision, threads) = (&machine.precision, machine.threads());
    let report = session::evaluate(trained, set, precision, threads, &machine.machine(), signals.catch(), &mut see)?;
    signals.release()?;
    let title = format!("{} on {set}", run.display());
    let lead = format!(
        "{}, {} parameters, {}{}{}.",
        card.network.about().trim_end_matches('.'),
        card.parameters,
        match card.resize {
            Resize::Stretch => format!("at {} × {} pixels", card.input.width, card.input.height),
            Resize::LongSides(_) => format!("at long sides of {} pixels", card.resize.name()),
            Resize::Scale(_) => format!("at the images' size {}", card.resize.name()),
        },
        if card.refine.is_none() { ", not refined".into() } else { format!(", refined by {}", card.refine.name()) },
        if trained.size() > 1 { format!("; the mean of {} runs", trained.size()) } else { String::new() }
    );
    let paths = report::write(out, &title, &lead, &report, &thumbnails.kept(), &card.classes.colors())?;
    furrow_cli::message!("{}", report.summary().markdown().trim_end());
    Ok(paths)
}
