//! `train predict`.

use crate::inference::{AFTER, InferenceArgs};
use crate::machine::MachineArgs;
use furrow_base::math::{ToFloat, ToInt};
use furrow_base::{Error, Result};
use furrow_cli::cli;
use furrow_cli::cli::signal::Signals;
use furrow_train::crop::with_crops;
use furrow_train::data::Band;
use furrow_train::deploy::guard::Implausible;
use furrow_train::deploy::input_images::{self, InputImage, Prediction};
use furrow_train::deploy::points;
use furrow_train::deploy::predict::{self, Options, Predictions};
use furrow_train::ensemble::Ensemble;
use furrow_train::refine::Evidence;
use furrow_train::zoo::ANY_FIELD;
use indicatif::{ProgressBar, ProgressStyle};
use std::path::{Path, PathBuf};

/// Arguments of `train predict`.
#[derive(clap::Args)]
#[command(after_help = AFTER)]
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
    /// Crop that is sown in the images, by any name of its species; may be given several times. A network that takes the crop as an input
    /// then labels this species as crop and all other plants as weeds; without it, or with auto, it labels every crop species as crop.
    /// A network that was trained for other crops is refused; for a network that knows no crop, a warning is printed.
    #[arg(long = "crop", value_name = "NAME")]
    crops: Vec<String>,
    /// Write the plants one by one as well: NAME.plants.png (number of the plant, 0 for none) and plants.json (COCO). A plant decoder
    /// (`train plants`) separates plants that touch; for a network without one, a plant is a connected region of plant pixels.
    #[arg(long)]
    plants: bool,
    /// Table of points on some plants of known class (CSV: image, x, y, class); they correct the classes in all images. About ten crop plants and ten weeds in two or three images are enough. x and y are pixels from the left and the top, class is crop or
    /// weed. Needs the refinement appearance; without --refine it is colour,plants,rows,appearance.
    #[arg(long, value_name = "FILE")]
    like: Option<PathBuf>,
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
    let (mut trained, warnings) = with_crops(Ensemble::open(&args.run)?, &args.crops)?;
    for warning in warnings {
        furrow_cli::message!("warning: {warning}");
    }
    args.inference.apply(&mut trained.card)?;
    if args.like.is_some() && !trained.card.refine.appearance {
        args.inference.with_appearance(&mut trained.card)?;
    }
    cli::check_folder(&args.out)?;
    let job = Job {
        images: &args.images,
        bands: &args.bands,
        batch: args.batch.into(),
        pixel_mm: args.inference.pixel_mm(),
        plants: args.plants,
        like: args.like.as_deref(),
        machine: &args.machine,
        quiet: args.quiet,
        signals,
    };
    job.run(&trained, &args.out)
}

/// Images to predict, and how.
pub(crate) struct Job<'a> {
    /// Image files, folders of them, or images of datasets.
    pub(crate) images: &'a [PathBuf],
    /// Folders of bands.
    pub(crate) bands: &'a [(Band, PathBuf)],
    /// Batch size.
    pub(crate) batch: usize,
    /// Ground sampling distance of the images, if it was given.
    pub(crate) pixel_mm: Option<f64>,
    /// Whether plants are written one by one.
    pub(crate) plants: bool,
    /// Table of points on plants of known class.
    pub(crate) like: Option<&'a Path>,
    /// Device and threads.
    pub(crate) machine: &'a MachineArgs,
    /// Whether progress is hidden.
    pub(crate) quiet: bool,
    /// Signals that stop the prediction.
    pub(crate) signals: &'a Signals,
}

impl Job<'_> {
    /// Predicts the images into `out`. If a network for a named crop finds implausibly little of it, warns, and writes the predictions of
    /// the network for any field beside them. Returns the paths of the files written.
    pub(crate) fn run(&self, trained: &Ensemble, out: &Path) -> Result<Vec<PathBuf>> {
        let pictures = input_images::find(self.images, &trained.card.input, self.bands)?;
        if let [first, others @ ..] = &input_images::passed_over(self.images)[..] {
            let more = if others.is_empty() { String::new() } else { format!(" and {} more", others.len()) };
            furrow_cli::message!(
                "warning: images in subfolders are passed over: {}{more}; name these folders too",
                first.display()
            );
        }
        let predicted = self.predict(trained, &pictures, out)?;
        let found = Implausible::of(&trained.card, &predicted.pixels);
        let mut paths = outcome(predicted, pictures.len())?;
        let Some(found) = found else { return Ok(paths) };
        furrow_cli::message!("warning: {}", found.warning(&trained.card));
        Prediction::note(out, &found)?;
        let other = Ensemble::open(Path::new(ANY_FIELD))?;
        let pictures = input_images::find(self.images, &other.card.input, &[])?;
        let beside = Job { bands: &[], pixel_mm: None, ..*self };
        let predicted = beside.predict(&other, &pictures, &out.join(&found.beside))?;
        paths.extend(outcome(predicted, pictures.len())?);
        Ok(paths)
    }

    /// Predicts the images into `out` and shows the progress.
    fn predict(&self, trained: &Ensemble, pictures: &[InputImage], out: &Path) -> Result<Predictions> {
        let points = self.like.map(|table| points::read(table, pictures)).transpose()?.unwrap_or_default();
        let passes = predict::passes(&trained.card, pictures.len(), &points);
        let bar = if self.quiet { ProgressBar::hidden() } else { ProgressBar::new(passes.to_u64()) };
        let style = ProgressStyle::with_template("{bar:30} {pos} of {len} images, {eta} left");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        let how = Options {
            precision: &self.machine.precision,
            threads: self.machine.threads(),
            batch: self.batch,
            pixel_mm: self.pixel_mm,
            plants: self.plants,
            points: &points,
            done: &|done| bar.set_position(done.to_u64()),
            stop: self.signals.catch(),
        };
        let predicted = predict::predict(trained, pictures, out, &self.machine.machine(), &how);
        bar.finish_and_clear();
        let predicted = predicted?;
        let asked = points.of.iter().map(Vec::len).sum::<usize>();
        if predicted.points < asked {
            let (on, asked) = (predicted.points, asked);
            furrow_cli::message!(
                "warning: {on} of {asked} points are on plants that the network found; the others have no effect"
            );
        }
        if !self.quiet && predicted.done > 0 {
            let each = predicted.seconds / predicted.done.to_f64();
            let pictures = if predicted.done == 1 { "image" } else { "images" };
            furrow_cli::message!("{} {pictures}, {each:.3} s in the network per image", predicted.done);
            let all: Vec<&Evidence> = predicted.evidence.values().collect();
            let refine = trained.card.refine;
            if let Some(words) = Evidence::summary(&all, refine.rows, refine.appearance, predicted.appearance) {
                furrow_cli::message!("{words}");
            }
        }
        Ok(predicted)
    }
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
