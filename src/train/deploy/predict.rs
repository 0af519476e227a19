//! From pictures to masks.
//!
//! Threads of their own read ahead of the network and write behind it, so that it waits for neither. A picture that cannot be read
//! keeps no other from its prediction.

use super::pictures::{PREDICTION, Picture, Prediction, files};
use super::{enlarge, overlay};
use crate::output::{self, Picture as Png};
use crate::train::data::resize::{self, Input};
use crate::train::ensemble::Ensemble;
use crate::train::refine::{Appearance, Refine};
use crate::train::run::ModelCard;
use crate::train::session::Machine;
use crate::train::torch::multiscale::{self, Scores};
use crate::train::torch::{Model, device};
use crate::{Error, Result};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{Builder, Scope, ScopedJoinHandle};
use std::time::Instant;

/// Options of a prediction.
pub struct Options<'a> {
    /// `auto`, `f32` or `bf16`.
    pub precision: &'a str,
    /// Threads that compute.
    pub threads: usize,
    /// Batch size; ≥ 1.
    pub batch: usize,
    /// Side of the pictures' pixels on the ground, millimetres, where they are brought to the network's by it; it is recorded.
    pub pixel_mm: Option<f64>,
    /// Called with the number of pictures that are done with, of as many as [`passes`] tells.
    pub done: &'a (dyn Fn(usize) + Sync),
    /// Raised by whoever wants it to stop.
    pub stop: &'a AtomicBool,
}

/// Predictions that were made.
#[derive(Debug, Default)]
pub struct Predictions {
    /// The files, two a picture, in the pictures' order; last the one that tells what they are.
    pub paths: Vec<PathBuf>,
    /// Pictures with a prediction.
    pub done: usize,
    /// What kept the others from being read.
    pub faults: Vec<Error>,
    /// Seconds of the network.
    pub seconds: f64,
}

/// A picture as the network takes it.
struct Ready<'a> {
    picture: &'a Picture,
    width: u32,
    height: u32,
    rgb: Vec<[u8; 3]>,
    /// What the network takes: one or several sizes of it.
    inputs: Vec<Input>,
}

/// How many pictures go through the network: those that the appearance of their field is learnt from go twice.
pub fn passes(card: &ModelCard, pictures: usize) -> usize {
    pictures + multiscale::learnt_from(card.refine, pictures).len()
}

/// Pictures that each thread may be ahead, or behind.
const AHEAD: usize = 2;

/// Predicts the classes of pictures: for each, an indexed PNG of its classes and one of them over it, both at its own size.
/// An error where files would be written over that are not predictions of the same pictures.
pub fn predict(
    trained: &Ensemble,
    pictures: &[Picture],
    out: &Path,
    machine: &Machine,
    options: &Options<'_>,
) -> Result<Predictions> {
    let card = &trained.card;
    let place = machine.place(options.precision)?;
    device::set_threads(options.threads);
    let models = trained.models(place)?;
    let prediction = Prediction::claim(out, card, options.pixel_mm, pictures)?;
    let workers = machine.loaders.max(1);
    let failed = AtomicBool::new(false);
    let mut made = Predictions::default();
    let mut unread = Vec::new();
    let (appearance, learnt) = learn(&models, card, pictures, options)?;
    std::thread::scope(|scope| -> Result<()> {
        let readers: Vec<_> =
            (0..workers).map(|w| read(scope, card, pictures.iter().skip(w).step_by(workers))).collect::<Result<_>>()?;
        let begun = (0..workers).map(|_| write(scope, card, out, appearance.as_ref(), &failed));
        let (writers, handles): (Vec<_>, Vec<_>) = begun.collect::<Result<Vec<_>>>()?.into_iter().unzip();
        let mut batch = Vec::new();
        for number in 0..pictures.len() {
            if options.stop.load(Ordering::Relaxed) || failed.load(Ordering::Relaxed) {
                break;
            }
            match readers[number % workers].recv() {
                Ok(Ok(ready)) => batch.push((number, ready)),
                Ok(Err(fault)) => {
                    unread.push(pictures[number].name.as_str());
                    made.faults.push(fault);
                }
                Err(_) => break,
            }
            if batch.len() == options.batch || number + 1 == pictures.len() {
                made.seconds += infer(&models, card.refine, std::mem::take(&mut batch), &writers)?;
                (options.done)(learnt + number + 1);
            }
        }
        drop((readers, writers));
        let mut written = Vec::new();
        for handle in handles {
            written.extend(handle.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))?);
        }
        written.sort();
        made.done = written.len();
        made.paths = written.into_iter().flat_map(|(_, paths)| paths).collect();
        Ok(())
    })?;
    if options.stop.load(Ordering::Relaxed) {
        let words = format!("stopped: {} of {} pictures are predicted", made.done, pictures.len());
        return Err(Error::stopped(words).help("the same command ends with all of them").in_file(out));
    }
    if !unread.is_empty() {
        prediction.forget(out, &unread)?;
    }
    made.paths.push(out.join(PREDICTION));
    Ok(made)
}

impl<'a> Ready<'a> {
    fn read(picture: &'a Picture, card: &ModelCard) -> Result<Self> {
        let found = picture.read()?;
        let (size, trained) = ((found.width, found.height), (card.input.width, card.input.height));
        let sizes = card.resize.sizes(trained, size).map_err(|e| e.in_file(picture.photo.clone()))?;
        let inputs = resize::inputs(&found.planes, size, &sizes, &card.normalization);
        Ok(Self { picture, width: found.width, height: found.height, rgb: found.rgb, inputs })
    }
}

/// What crop and weeds look like in these pictures, where that is asked for, and how many it was learnt from. Pictures that cannot be read are
/// left out here and told when they are predicted.
fn learn(
    models: &[Model],
    card: &ModelCard,
    pictures: &[Picture],
    options: &Options<'_>,
) -> Result<(Option<Appearance>, usize)> {
    let picked = multiscale::learnt_from(card.refine, pictures.len());
    // Stopped, it ends early, and whoever called tells of it.
    let going = |_: &(usize, &usize)| !options.stop.load(Ordering::Relaxed);
    let read = |(k, place): (usize, &usize)| {
        (options.done)(k);
        Ready::read(&pictures[*place], card).ok().map(|ready| Ok(ready.inputs))
    };
    let inputs = picked.iter().enumerate().take_while(going).filter_map(read);
    let found = multiscale::learn(models, card.refine, &card.input.bands, inputs)?;
    Ok((found, picked.len()))
}

/// Begins to read pictures.
fn read<'s, 'a: 's>(
    scope: &'s Scope<'s, '_>,
    card: &'a ModelCard,
    pictures: impl Iterator<Item = &'a Picture> + Send + 's,
) -> Result<Receiver<Result<Ready<'a>>>> {
    let (sender, receiver) = sync_channel(AHEAD);
    let work = move || {
        for picture in pictures {
            let ready = Ready::read(picture, card);
            // Nobody listens any more: it was stopped.
            if sender.send(ready).is_err() {
                return;
            }
        }
    };
    Builder::new().name("reader".into()).spawn_scoped(scope, work).map_err(Error::no_thread)?;
    Ok(receiver)
}

/// Number, picture, and the values of its classes.
type Scored<'a> = (usize, Ready<'a>, Scores);
/// Number and files of each picture.
type Written = Result<Vec<(usize, [PathBuf; 2])>>;

/// Begins to wait for predictions to write; raises `failed` where that cannot be done.
fn write<'s, 'a: 's>(
    scope: &'s Scope<'s, '_>,
    card: &'a ModelCard,
    out: &'a Path,
    appearance: Option<&'s Appearance>,
    failed: &'s AtomicBool,
) -> Result<(SyncSender<Scored<'a>>, ScopedJoinHandle<'s, Written>)> {
    let (sender, receiver) = sync_channel::<Scored<'a>>(AHEAD);
    let work = move || {
        let mut written = Vec::new();
        for (number, ready, mut scores) in receiver {
            match draw(card, out, &ready, &mut scores, appearance) {
                Ok(paths) => written.push((number, paths)),
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

/// Runs the networks on a batch and hands the scores on; seconds of the network.
fn infer<'a>(
    models: &[Model],
    refine: Refine,
    batch: Vec<(usize, Ready<'a>)>,
    writers: &[SyncSender<Scored<'a>>],
) -> Result<f64> {
    let begun = Instant::now();
    // Pictures that one network takes at one size, and at the same, go through it together.
    let alike = |a: &(usize, Ready<'_>), b: &(usize, Ready<'_>)| match (a.1.inputs.as_slice(), b.1.inputs.as_slice()) {
        ([a], [b]) => models.len() == 1 && a.size == b.size && !refine.appearance,
        _ => false,
    };
    let mut all = Vec::new();
    for group in batch.chunk_by(alike) {
        match group {
            [(_, ready)] => all.push(multiscale::scores(models, refine, &ready.inputs)?),
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
                    are_logits: true,
                };
                all.extend(each.map(whole));
            }
        }
    }
    let seconds = begun.elapsed().as_secs_f64();
    for ((number, ready), scores) in batch.into_iter().zip(all) {
        // A writer that is gone has told why.
        let _ = writers[number % writers.len()].send((number, ready, scores));
    }
    Ok(seconds)
}

/// Writes the prediction of one picture.
fn draw(
    card: &ModelCard,
    out: &Path,
    ready: &Ready<'_>,
    scores: &mut Scores,
    appearance: Option<&Appearance>,
) -> Result<[PathBuf; 2]> {
    let (width, height) = (ready.width, ready.height);
    scores.refine(card.refine, &ready.inputs, &card.input.bands, appearance);
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
    let paths = files(&ready.picture.name).map(|file| out.join(file));
    let labels = output::encode_png(width, height, &Png::Indexed(&classes, &colors), &text)?;
    let over = output::encode_png(width, height, &Png::Rgb(&over), &text)?;
    output::write_together(out, |files| {
        files.add(&paths[0], &labels)?;
        files.add(&paths[1], &over)
    })?;
    Ok(paths)
}
