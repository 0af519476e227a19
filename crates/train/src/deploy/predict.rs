//! Prediction of images: class maps and overlays from a trained model.
//!
//! Reader and writer threads run beside the network, so that it does not wait for input or output. An unreadable image is reported and does
//! not stop the prediction of the others.

use super::input_images::{InputImage, PREDICTION, Prediction, files};
use super::overlay;
use super::plants::{self, Found};
use super::points::Points;
use crate::data::resize::{self, Input};
use crate::enlarge;
use crate::ensemble::Ensemble;
use crate::refine::{Appearance, Evidence, Point, Refine};
use crate::run::ModelCard;
use crate::session::Machine;
use crate::torch::multiscale::{self, Scores};
use crate::torch::{Model, device, guarded};
use furrow_base::supervise::supervised;
use furrow_base::{Error, Result};
use furrow_output::ImageData as Png;
use std::collections::{BTreeMap, BTreeSet};
use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{Builder, Scope, ScopedJoinHandle};
use std::time::Instant;

/// Options of a prediction.
pub struct Options<'a> {
    /// `auto`, `f32` or `bf16`.
    pub precision: &'a str,
    /// Number of compute threads.
    pub threads: usize,
    /// Batch size; ≥ 1.
    pub batch: usize,
    /// Ground sampling distance of the images in millimetres a pixel, if images are resized by it; recorded in `prediction.json`.
    pub pixel_mm: Option<f64>,
    /// Whether plants are written one by one as well; see [`plants`].
    pub plants: bool,
    /// Points on plants of known class; they take part in the refinement `appearance`.
    pub points: &'a Points,
    /// Progress callback: receives the number of finished passes, out of [`passes`].
    pub done: &'a (dyn Fn(usize) + Sync),
    /// Set by the caller to stop early.
    pub stop: &'a AtomicBool,
}

/// Result of [`predict`].
#[derive(Debug, Default)]
pub struct Predictions {
    /// Files written: two per image (three with plants) in the order of the images, then `plants.json`, `prediction.json`.
    pub paths: Vec<PathBuf>,
    /// Number of images with a prediction.
    pub done: usize,
    /// One error for each image that could not be read.
    pub faults: Vec<Error>,
    /// Time spent in the network, seconds.
    pub seconds: f64,
    /// Number of pixels of each class, in the order of the class numbers.
    pub pixels: Vec<u64>,
    /// Changes by refinement in each image, by prediction name; empty without refinement.
    pub evidence: BTreeMap<String, Evidence>,
    /// `true` if an appearance model of crop and weeds was learnt from the images.
    pub appearance: bool,
    /// Number of points on plants that the network found.
    pub points: usize,
}

/// An image that has been read and prepared for the network.
struct PreparedImage<'a> {
    picture: &'a InputImage,
    points: &'a [Point],
    width: u32,
    height: u32,
    rgb: Vec<[u8; 3]>,
    /// Network inputs: the normalized image at one or several sizes.
    inputs: Vec<Input>,
}

/// Returns the number of images that go through the network, of `pictures` images with these points. Images that the appearance features
/// are learnt from count twice.
pub fn passes(card: &ModelCard, pictures: usize, points: &Points) -> usize {
    pictures + training_images(card, pictures, points).len()
}

/// Returns the images that the appearance features are learnt from: some of all, and all with points.
fn training_images(card: &ModelCard, pictures: usize, points: &Points) -> Vec<usize> {
    let marked = points.of.iter().enumerate().filter(|(_, points)| !points.is_empty()).map(|(place, _)| place);
    let all: BTreeSet<usize> = multiscale::training_images(card.refine, pictures).into_iter().chain(marked).collect();
    all.into_iter().collect()
}

/// Capacity of each queue between the network and a reader or writer thread, images.
const AHEAD: usize = 2;

/// Predicts the classes of images. Writes two PNG files per image into `out`, both at the image's original size: the class map (indexed
/// colours) and its overlay on the image. Fails if it would overwrite files that are not predictions of the same images.
pub fn predict(
    trained: &Ensemble,
    pictures: &[InputImage],
    out: &Path,
    machine: &Machine,
    options: &Options<'_>,
) -> Result<Predictions> {
    guarded(|| predict_here(trained, pictures, out, machine, options))
}

fn predict_here(
    trained: &Ensemble,
    pictures: &[InputImage],
    out: &Path,
    machine: &Machine,
    options: &Options<'_>,
) -> Result<Predictions> {
    let card = &trained.card;
    let place = machine.place(options.precision)?;
    device::set_threads(options.threads);
    let models = trained.models(place)?;
    let names = pictures.iter().map(|picture| picture.name.as_str());
    let before = options.plants.then(|| plants::claim(out, names)).transpose()?;
    let prediction = Prediction::claim(out, card, options.pixel_mm, options.points.table_sha256.as_deref(), pictures)?;
    // A run that continues this one then knows that the plant maps are its own.
    if let Some(before) = &before {
        plants::write(out, before, &BTreeMap::new(), &card.classes.names())?;
    }
    let workers = machine.loaders.max(1);
    let failed = AtomicBool::new(false);
    let mut made = Predictions::default();
    let mut unread = Vec::new();
    let mut found = BTreeMap::new();
    let (appearance, learnt) = learn(&models, card, pictures, options)?;
    let each = || (0..pictures.len()).map(|place| (&pictures[place], points(options, place)));
    std::thread::scope(|scope| -> Result<()> {
        let readers: Vec<_> =
            (0..workers).map(|w| read(scope, card, each().skip(w).step_by(workers))).collect::<Result<_>>()?;
        let drawing = Drawing { card, out, appearance: appearance.as_ref(), plants: options.plants };
        let begun = (0..workers).map(|_| write(scope, drawing, &failed));
        let (writers, handles): (Vec<_>, Vec<_>) = begun.collect::<Result<Vec<_>>>()?.into_iter().unzip();
        let mut batch = Vec::new();
        for number in 0..pictures.len() {
            if options.stop.load(Ordering::Relaxed) || failed.load(Ordering::Relaxed) {
                break;
            }
            match readers[number % workers].recv() {
                Ok(Ok(Ok(ready))) => batch.push((number, ready)),
                Ok(Err(bug)) => return Err(bug),
                Ok(Ok(Err(fault))) => {
                    unread.push(pictures[number].name.as_str());
                    made.faults.push(fault);
                }
                Err(_) => break,
            }
            if batch.len() == options.batch || number + 1 == pictures.len() {
                made.seconds += infer(&models, card.refine, options.plants, std::mem::take(&mut batch), &writers)?;
                (options.done)(learnt + number + 1);
            }
        }
        drop((readers, writers));
        let mut written = Vec::new();
        for handle in handles {
            written.extend(supervised(|| handle.join().unwrap_or_else(|panic| resume_unwind(panic)))??);
        }
        written.sort_by_key(|(number, _)| *number);
        made.done = written.len();
        made.pixels = vec![0; card.classes.len()];
        for (number, drawn) in written {
            made.paths.extend(drawn.paths);
            if let Some(plants) = drawn.plants {
                found.insert(pictures[number].identity()?, plants);
            }
            made.evidence.extend(drawn.evidence.map(|found| (pictures[number].name.clone(), found)));
            for (sum, pixels) in made.pixels.iter_mut().zip(drawn.pixels) {
                *sum += pixels;
            }
        }
        Ok(())
    })?;
    if options.stop.load(Ordering::Relaxed) {
        let words = format!("stopped: {} of {} images are predicted", made.done, pictures.len());
        return Err(Error::stopped(words).help("run the same command again to predict all of them").in_file(out));
    }
    made.points = appearance.as_ref().map_or(0, |found| found.points);
    made.appearance = appearance.is_some();
    if let Some(before) = before {
        plants::write(out, &before, &found, &card.classes.names())?;
        made.paths.push(out.join(plants::PLANTS));
    }
    prediction.finish(out, &unread, &made.evidence, made.appearance)?;
    made.paths.push(out.join(PREDICTION));
    Ok(made)
}

/// Returns the points in an image.
fn points<'a>(options: &Options<'a>, place: usize) -> &'a [Point] {
    options.points.of.get(place).map_or(&[], Vec::as_slice)
}

impl<'a> PreparedImage<'a> {
    fn read(picture: &'a InputImage, points: &'a [Point], card: &ModelCard) -> Result<Self> {
        let found = picture.read()?;
        let (size, trained) = ((found.width, found.height), (card.input.width, card.input.height));
        let sizes = card.resize.sizes(trained, size).map_err(|e| e.in_file(picture.photo.clone()))?;
        let inputs = resize::inputs(&found.planes, size, &sizes, &card.normalization);
        Ok(Self { picture, points, width: found.width, height: found.height, rgb: found.rgb, inputs })
    }
}

/// Learns the appearance model of crop and weeds from some of the images, if `--refine appearance` asks for it. Returns the model and the
/// number of images picked for it. Unreadable images are skipped here and reported when they are predicted.
fn learn(
    models: &[Model],
    card: &ModelCard,
    pictures: &[InputImage],
    options: &Options<'_>,
) -> Result<(Option<Appearance>, usize)> {
    let picked = training_images(card, pictures.len(), options.points);
    // After a stop request this ends early; the caller reports the stop.
    let going = |_: &(usize, &usize)| !options.stop.load(Ordering::Relaxed);
    let read = |(k, place): (usize, &usize)| {
        (options.done)(k);
        let ready = PreparedImage::read(&pictures[*place], points(options, *place), card).ok()?;
        Some(Ok((ready.inputs, ready.points.to_vec())))
    };
    let inputs = picked.iter().enumerate().take_while(going).filter_map(read);
    let found = multiscale::learn(models, card.refine, &card.input.bands, inputs)?;
    Ok((found, picked.len()))
}

/// Starts a thread that reads the images and sends them to the returned receiver, or the error of a panic.
fn read<'s, 'a: 's>(
    scope: &'s Scope<'s, '_>,
    card: &'a ModelCard,
    pictures: impl Iterator<Item = (&'a InputImage, &'a [Point])> + Send + 's,
) -> Result<Receiver<Result<Result<PreparedImage<'a>>>>> {
    let (sender, receiver) = sync_channel(AHEAD);
    let work = move || {
        for (picture, points) in pictures {
            let ready =
                supervised(|| PreparedImage::read(picture, points, card)).map_err(|bug| bug.within(&picture.name));
            // The receiver is gone: the prediction was stopped.
            if sender.send(ready).is_err() {
                return;
            }
        }
    };
    Builder::new().name("reader".into()).spawn_scoped(scope, work).map_err(Error::no_thread)?;
    Ok(receiver)
}

/// Index of an image, the image, and its class scores.
type Scored<'a> = (usize, PreparedImage<'a>, Scores);
/// Index of each image and what was written for it.
type Written = Result<Vec<(usize, Drawn)>>;

/// Settings of the writers.
#[derive(Clone, Copy)]
struct Drawing<'a> {
    card: &'a ModelCard,
    out: &'a Path,
    appearance: Option<&'a Appearance>,
    plants: bool,
}

/// Prediction of an image that was written.
struct Drawn {
    paths: Vec<PathBuf>,
    /// Plants, if they were asked for.
    plants: Option<Found>,
    /// Number of pixels of each class.
    pixels: Vec<u64>,
    evidence: Option<Evidence>,
}

/// Starts a thread that writes the predictions sent to it; sets `failed` if a file cannot be written.
fn write<'s, 'a: 's>(
    scope: &'s Scope<'s, '_>,
    drawing: Drawing<'s>,
    failed: &'s AtomicBool,
) -> Result<(SyncSender<Scored<'a>>, ScopedJoinHandle<'s, Written>)> {
    let (sender, receiver) = sync_channel::<Scored<'a>>(AHEAD);
    let work = move || {
        let mut written = Vec::new();
        for (number, ready, mut scores) in receiver {
            let drawn = supervised(|| draw(drawing, &ready, &mut scores));
            match drawn.map_err(|bug| bug.within(&ready.picture.name)).and_then(|drawn| drawn) {
                Ok(drawn) => written.push((number, drawn)),
                Err(e) => {
                    failed.store(true, Ordering::Relaxed);
                    return Err(e);
                }
            }
        }
        Ok(written)
    };
    let handle = Builder::new().name("writer".into()).spawn_scoped(scope, work).map_err(Error::no_thread)?;
    Ok((sender, handle))
}

/// Runs the networks on a batch and sends the scores to the writers. Returns the time spent in the networks, seconds.
fn infer<'a>(
    models: &[Model],
    refine: Refine,
    plants: bool,
    batch: Vec<(usize, PreparedImage<'a>)>,
    writers: &[SyncSender<Scored<'a>>],
) -> Result<f64> {
    let begun = Instant::now();
    let is_plain = !refine.appearance && !(models[0].has_plants && (plants || refine.separate));
    // Consecutive images go through the network together if there is one network and one input per image, of equal size.
    let alike = |a: &(usize, PreparedImage<'_>), b: &(usize, PreparedImage<'_>)| match (
        a.1.inputs.as_slice(),
        b.1.inputs.as_slice(),
    ) {
        ([a], [b]) => models.len() == 1 && a.size == b.size && is_plain,
        _ => false,
    };
    let mut all = Vec::new();
    for group in batch.chunk_by(alike) {
        match group {
            [(_, ready)] => all.push(multiscale::scores(models, refine, plants, &ready.inputs)?),
            several => {
                let size = several[0].1.inputs[0].size;
                let pixels: Vec<f32> = several.iter().flat_map(|(_, ready)| &ready.inputs[0].pixels).copied().collect();
                let values = models[0].scores(&pixels, size)?;
                let each = values.chunks_exact(values.len() / several.len());
                let whole = |values: &[f32]| Scores {
                    values: values.to_vec(),
                    size,
                    finest: None,
                    features: None,
                    vectors: None,
                    points: Vec::new(),
                    are_logits: true,
                };
                all.extend(each.map(whole));
            }
        }
    }
    let seconds = begun.elapsed().as_secs_f64();
    for ((number, ready), mut scores) in batch.into_iter().zip(all) {
        scores.points = ready.points.to_vec();
        // A writer that has ended returns its error when it is joined.
        let _ = writers[number % writers.len()].send((number, ready, scores));
    }
    Ok(seconds)
}

/// Refines the scores of one image and writes its class map and overlay.
fn draw(drawing: Drawing<'_>, ready: &PreparedImage<'_>, scores: &mut Scores) -> Result<Drawn> {
    let Drawing { card, out, appearance, .. } = drawing;
    let (width, height) = (ready.width, ready.height);
    let evidence = scores.refine(card.refine, &ready.inputs, &card.input.bands, appearance);
    let colors = card.classes.colors();
    let classes = enlarge::classes_at(&scores.values, scores.size, (width, height));
    let over = overlay::draw(&ready.rgb, &classes, width, &colors);
    let text = format!(
        "program: furrow {}\nnetwork: {}\nweights: sha256 {}\nclasses: {}",
        env!("CARGO_PKG_VERSION"),
        card.network.name(),
        card.weights_sha256,
        card.classes.names().join("; ")
    );
    let numbers = drawing.plants.then(|| scores.plants(&classes, (width, height)));
    let plants = numbers.as_deref().map(|numbers| Found::of(numbers, &classes, (width, height)));
    let mut paths = files(&ready.picture.name).map(|file| out.join(file)).to_vec();
    let labels = furrow_output::encode_png(width, height, &Png::Indexed(&classes, &colors), &text)?;
    let over = furrow_output::encode_png(width, height, &Png::Rgb(&over), &text)?;
    let numbers = numbers.map(|numbers| furrow_output::encode_png(width, height, &Png::Numbers(&numbers), &text));
    let numbers = numbers.transpose()?;
    paths.extend(numbers.is_some().then(|| out.join(plants::file(&ready.picture.name))));
    furrow_output::write_together(out, |files| {
        let all = [Some(&labels), Some(&over), numbers.as_ref()].into_iter().flatten();
        paths.iter().zip(all).try_for_each(|(path, bytes)| files.add(path, bytes))
    })?;
    let mut pixels = vec![0; card.classes.len()];
    for class in &classes {
        pixels[usize::from(*class)] += 1;
    }
    Ok(Drawn { paths, plants, pixels, evidence })
}
