//! `train predict`.

use crate::inference::InferenceArgs;
use crate::machine::MachineArgs;
use furrow_base::{Error, Result};
use furrow_cli::cli;
use furrow_cli::cli::signal::Signals;
use furrow_train::data::Band;
use furrow_train::deploy::input_images;
use furrow_train::deploy::predict::{self, Options, Predictions};
use furrow_train::ensemble::Ensemble;
use indicatif::{ProgressBar, ProgressStyle};
use std::path::PathBuf;

/// Arguments of `train predict`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of a run, name of a network that ships (`train zoo`), or folder of runs with several seeds, whose probabilities are averaged.
    run: PathBuf,
    /// PNG or JPEG files of any size, folders of them, or images of a dataset: DIR, DIR@PICK.
    #[arg(required = true, value_name = "IMAGES")]
    images: Vec<PathBuf>,
    /// Folder for the predictions: NAME.png (class numbers), NAME.overlay.png (classes over the image), and prediction.json (metadata).
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Folder of a band other than red, green and blue: gray images with the names of the colour images. By default the band nir of
    /// a.jpg is a.nir.png beside it, and that of rgb_1.png is nir_1.png.
    #[arg(long = "band", value_name = "NAME=DIR", value_parser = band)]
    bands: Vec<(Band, PathBuf)>,
    /// Batch size: images that are predicted at once.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u16).range(1..=1024))]
    batch: u16,
    #[command(flatten)]
    inference: InferenceArgs,
    #[command(flatten)]
    machine: MachineArgs,
    /// Print nothing but errors and the paths of the files.
    #[arg(long)]
    quiet: bool,
}

fn band(text: &str) -> Result<(Band, PathBuf), String> {
    let (name, folder) = text.split_once('=').ok_or("write it as nir=DIR")?;
    match Band::parse(name)? {
        band if band.is_color() => Err(format!("`{}` is read from the image itself", band.name())),
        band => Ok((band, folder.into())),
    }
}

/// Predicts the images; returns the paths of the files written.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    let mut trained = Ensemble::open(&args.run)?;
    args.inference.apply(&mut trained.card)?;
    cli::check_folder(&args.out)?;
    let pictures = input_images::find(&args.images, &trained.card.input, &args.bands)?;
    let passes = predict::passes(&trained.card, pictures.len());
    let bar = if args.quiet { ProgressBar::hidden() } else { ProgressBar::new(passes as u64) };
    let style = ProgressStyle::with_template("{bar:30} {pos} of {len} images, {eta} left");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    let how = Options {
        precision: &args.machine.precision,
        threads: args.machine.threads(),
        batch: args.batch.into(),
        pixel_mm: args.inference.pixel_mm(),
        done: &|done| bar.set_position(done as u64),
        stop: signals.catch(),
    };
    let predicted = predict::predict(&trained, &pictures, &args.out, &args.machine.machine(), &how);
    bar.finish_and_clear();
    let predicted = predicted?;
    if !args.quiet && predicted.done > 0 {
        let each = predicted.seconds / predicted.done as f64;
        let pictures = if predicted.done == 1 { "image" } else { "images" };
        furrow_cli::message!("{} {pictures}, {each:.3} s in the network per image", predicted.done);
    }
    outcome(predicted, pictures.len())
}

/// Returns the paths of the files, or an error that lists the images that could not be read; `asked` is the number of images.
fn outcome(mut predicted: Predictions, asked: usize) -> Result<Vec<PathBuf>> {
    match predicted.faults.len() {
        0 => Ok(predicted.paths),
        1 if asked == 1 => Err(predicted.faults.remove(0)),
        n => {
            let faults: Vec<String> = predicted.faults.iter().map(ToString::to_string).collect();
            Err(Error::input(format!(
                "{n} of {asked} images could not be read; the others have predictions:\n{}",
                faults.join("\n")
            )))
        }
    }
}
