//! From pictures to masks.
//!
//! Threads of their own read ahead of the network and write behind it, so that it waits for neither. A picture that cannot be read
//! keeps no other from its answer.

use super::pictures::{PREDICTION, Picture, Prediction, answers};
use super::{enlarge, overlay};
use crate::output::{self, Picture as Png};
use crate::train::engine::{Model, device};
use crate::train::run::{Card, Learnt};
use crate::train::session::Machine;
use crate::{Error, Result};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{Scope, ScopedJoinHandle};
use std::time::Instant;

/// How pictures are answered.
pub struct How<'a> {
    /// `auto`, `f32` or `bf16`.
    pub precision: &'a str,
    /// Threads that compute.
    pub threads: usize,
    /// Pictures that the network answers at once; ≥ 1.
    pub batch: usize,
    /// Called with the number of pictures that are done with.
    pub done: &'a (dyn Fn(usize) + Sync),
    /// Raised by whoever wants it to stop.
    pub stop: &'a AtomicBool,
}

/// What came out.
#[derive(Debug, Default)]
pub struct Answered {
    /// The files, two a picture, in the pictures' order; last the one that tells what they are.
    pub paths: Vec<PathBuf>,
    /// Pictures with an answer.
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
    /// Normalised.
    pixels: Vec<f32>,
}

/// Pictures that each thread may be ahead, or behind.
const AHEAD: usize = 2;

/// Answers pictures: for each, an indexed PNG of its classes and one of them over it, both at its own size.
/// An error where files would be written over that are not answers to the same pictures.
pub fn predict(
    learnt: &Learnt,
    pictures: &[Picture],
    out: &Path,
    machine: &Machine,
    how: &How<'_>,
) -> Result<Answered> {
    let card = &learnt.card;
    let place = machine.place(how.precision)?;
    device::set_threads(how.threads);
    let (bands, classes) = (card.input.bands.len(), card.classes.len());
    let model = Model::with(card.network, bands, classes, &learnt.values, place)?;
    let prediction = Prediction::claim(out, card, pictures)?;
    let workers = machine.loaders.max(1);
    let failed = AtomicBool::new(false);
    let mut answered = Answered::default();
    let mut unread = Vec::new();
    std::thread::scope(|scope| -> Result<()> {
        let readers: Vec<_> =
            (0..workers).map(|w| read(scope, card, pictures.iter().skip(w).step_by(workers))).collect();
        let (writers, handles): (Vec<_>, Vec<_>) = (0..workers).map(|_| write(scope, card, out, &failed)).unzip();
        let mut batch = Vec::new();
        for number in 0..pictures.len() {
            if how.stop.load(Ordering::Relaxed) || failed.load(Ordering::Relaxed) {
                break;
            }
            match readers[number % workers].recv() {
                Ok(Ok(ready)) => batch.push((number, ready)),
                Ok(Err(fault)) => {
                    unread.push(pictures[number].name.as_str());
                    answered.faults.push(fault);
                }
                Err(_) => break,
            }
            if batch.len() == how.batch || number + 1 == pictures.len() {
                answered.seconds += answer(&model, card, std::mem::take(&mut batch), &writers)?;
                (how.done)(number + 1);
            }
        }
        drop((readers, writers));
        let mut written = Vec::new();
        for handle in handles {
            written.extend(handle.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))?);
        }
        written.sort();
        answered.done = written.len();
        answered.paths = written.into_iter().flat_map(|(_, paths)| paths).collect();
        Ok(())
    })?;
    if how.stop.load(Ordering::Relaxed) {
        let words = format!("stopped: {} of {} pictures are predicted", answered.done, pictures.len());
        return Err(Error::stopped(words).help("the same command ends with all of them").in_file(out));
    }
    if !unread.is_empty() {
        prediction.forget(out, &unread)?;
    }
    answered.paths.push(out.join(PREDICTION));
    Ok(answered)
}

/// Begins to read pictures.
fn read<'s, 'a: 's>(
    scope: &'s Scope<'s, '_>,
    card: &'a Card,
    pictures: impl Iterator<Item = &'a Picture> + Send + 's,
) -> Receiver<Result<Ready<'a>>> {
    let (sender, receiver) = sync_channel(AHEAD);
    scope.spawn(move || {
        for picture in pictures {
            let ready = picture.read().map(|found| {
                let mut pixels = found.at((card.input.width, card.input.height));
                card.normalisation.apply(&mut pixels, card.input.bands.len());
                Ready { picture, width: found.width, height: found.height, rgb: found.rgb, pixels }
            });
            // Nobody listens any more: it was stopped.
            if sender.send(ready).is_err() {
                return;
            }
        }
    });
    receiver
}

/// Number, picture, and the values of its classes.
type Scored<'a> = (usize, Ready<'a>, Vec<f32>);
/// Number and files of each picture.
type Written = Result<Vec<(usize, [PathBuf; 2])>>;

/// Begins to wait for answers to write; raises `failed` where that cannot be done.
fn write<'s, 'a: 's>(
    scope: &'s Scope<'s, '_>,
    card: &'a Card,
    out: &'a Path,
    failed: &'s AtomicBool,
) -> (SyncSender<Scored<'a>>, ScopedJoinHandle<'s, Written>) {
    let (sender, receiver) = sync_channel::<Scored<'a>>(AHEAD);
    let handle = scope.spawn(move || {
        let mut written = Vec::new();
        for (number, ready, scores) in receiver {
            match draw(card, out, &ready, &scores) {
                Ok(paths) => written.push((number, paths)),
                Err(e) => {
                    failed.store(true, Ordering::Relaxed);
                    return Err(e);
                }
            }
        }
        Ok(written)
    });
    (sender, handle)
}

/// Has the network answer a batch and hands the answers on; seconds of the network.
fn answer<'a>(
    model: &Model,
    card: &Card,
    batch: Vec<(usize, Ready<'a>)>,
    writers: &[SyncSender<Scored<'a>>],
) -> Result<f64> {
    if batch.is_empty() {
        return Ok(0.0);
    }
    let pixels: Vec<f32> = batch.iter().flat_map(|(_, ready)| &ready.pixels).copied().collect();
    let begun = Instant::now();
    let scores = model.scores(&pixels, (card.input.width, card.input.height))?;
    let seconds = begun.elapsed().as_secs_f64();
    let each = card.classes.len() * card.input.pixels();
    for ((number, ready), scores) in batch.into_iter().zip(scores.chunks_exact(each)) {
        // A writer that is gone has told why.
        let _ = writers[number % writers.len()].send((number, ready, scores.to_vec()));
    }
    Ok(seconds)
}

/// Writes the answer to one picture.
fn draw(card: &Card, out: &Path, ready: &Ready<'_>, scores: &[f32]) -> Result<[PathBuf; 2]> {
    let (width, height) = (ready.width, ready.height);
    let colors = card.classes.colors();
    let classes = enlarge::classes_at(scores, (card.input.width, card.input.height), (width, height));
    let over = overlay::draw(&ready.rgb, &classes, width, &colors);
    let text = format!(
        "program: furrow {}\nnetwork: {}\nweights: sha256 {}\nclasses: {}",
        env!("CARGO_PKG_VERSION"),
        card.network.name(),
        card.weights_sha256,
        card.classes.names().join("; ")
    );
    let paths = answers(&ready.picture.name).map(|file| out.join(file));
    output::write_png(&paths[0], width, height, &Png::Indexed(&classes, &colors), &text)?;
    output::write_png(&paths[1], width, height, &Png::Rgb(&over), &text)?;
    Ok(paths)
}
