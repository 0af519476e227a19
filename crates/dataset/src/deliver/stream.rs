//! Streams images to another program as a tar archive while they are rendered, without writing a dataset.
//!
//! Files are named as in a dataset's [packs](crate::read::packs). Several workers make images, which are written in the
//! order of their indices. Images that are finished early wait in a bounded queue, and workers pause while it is full,
//! so the reader determines the speed.

use crate::File;
use crate::make::generate::{Shard, Work, fitting, together};
use crate::make::plan::{Order, plan};
use crate::make::render::{CachedField, render, renderer, scene_file};
use crate::model::invariants;
use crate::model::recipe::MOST_IMAGES;
use crate::read::archive::append;
use crate::read::native;
use crate::read::set::Set;
use furrow_base::error::Place;
use furrow_base::math::ToInt;
use furrow_base::supervise::supervised;
use furrow_base::{Error, Result};
use furrow_job::{Renderer, ResultOrder, SceneFile, Schedule, Threads};
use furrow_render::render::RenderMonitor;
use std::collections::BTreeMap;
use std::io::{self, ErrorKind, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Callbacks for warnings and progress of a stream, and a flag that stops it.
pub struct Listener<'a> {
    /// Called with each warning while images are made.
    pub warn: &'a (dyn Fn(&str) + Sync),
    /// Called with the index of each written image.
    pub done: &'a dyn Fn(u64),
    /// Set to `true` to stop at once.
    pub stop: &'a AtomicBool,
}

/// A prepared stream. Its scene is copied to a temporary folder like that of a dataset, so that later changes of the
/// scene file have no effect.
pub struct ImageStream {
    /// Temporary folder of the copied scene, removed with the stream.
    _keep: TempDir,
    set: Set,
    /// The original scene file.
    scene: PathBuf,
    indices: Range<u64>,
    /// Warnings for the user before the first image.
    pub warnings: Vec<String>,
}

impl ImageStream {
    /// Prepares a stream of `order.count` images, starting with image `first`. Only the native format is written.
    pub fn begin(order: &Order, first: u64) -> Result<Self> {
        let end = first.checked_add(order.count).filter(|end| *end <= MOST_IMAGES).ok_or_else(|| {
            Error::misuse(format!("{} images from number {first} on lead past the last image", order.count))
                .help(format!("the last image of a dataset is number {}", MOST_IMAGES - 1))
        })?;
        let keep = tempfile::tempdir().map_err(Error::io(&std::env::temp_dir()))?;
        let order = Order { count: end, formats: Vec::new(), ..order.clone() };
        let (set, warnings) = plan(keep.path(), &order, &Arc::default())?;
        Ok(Self { _keep: keep, set, scene: order.scene, indices: first..end, warnings })
    }

    /// Makes the images of a shard and writes them to `out`. Returns the number of written images, also if the reader
    /// closes the pipe early.
    ///
    /// Fields that cannot be built are skipped, with a warning at once and an error at the end; [`MOST_LEFT_OUT`] of
    /// them in a row end the stream. A stopped stream returns [`furrow_base::error::Kind::Interrupted`].
    pub fn write(&self, work: &Work<'_>, out: impl Write + Send + 'static, listener: &Listener<'_>) -> Result<u64> {
        let set = &self.set;
        let Some(renderer) = renderer(set)? else { return Ok(0) };
        let stop = Arc::<AtomicBool>::default();
        let scene = scene_file(set)?.memory(work.memory).until(&stop);
        let workers = self.workers(work, &scene)?;
        let images = self.wanted(work.shard).map(|index| vec![index]);
        let schedule = Arc::new(Schedule::new(images, ResultOrder::InOrder { ahead: 2 * workers.len() }));
        let (sender, receiver) = channel();
        let to_write = Arc::clone(&schedule);
        // Not a scoped thread: the reader of a pipe may block it forever, and a stop must not wait for it.
        let write = move || {
            let ended = supervised(|| archive(&to_write, out, &sender)).and_then(|ended| ended);
            to_write.end();
            let _ = sender.send(Message::Ended(ended));
        };
        std::thread::Builder::new().name("archive".into()).spawn(write).map_err(Error::no_thread)?;
        let source = Source { set, end: self.indices.end, scene, renderer, stop: &stop };
        let make = |index: &u64, threads: &Threads, kept: &mut CachedField| {
            let made = threads.install(|| source.image(*index, threads, kept)).map_err(|e| self.as_asked(e));
            made.inspect_err(|e| {
                if e.is_of_one_field() {
                    (listener.warn)(&format!("image {} is left out: {e}", Set::name(*index)));
                }
            })
        };
        let stopped = || stop.load(Ordering::Relaxed);
        let Written { images, last, failures, ended } = schedule.run(&workers, stopped, make, || {
            let written = listen(&receiver, listener, &schedule, &stop);
            // Interrupts the workers, whose images are no longer needed.
            stop.store(true, Ordering::Relaxed);
            written
        })?;
        match ended {
            None => {
                let next = last.map_or(self.indices.start, |last| last + 1);
                Err(Error::stopped(format!("stopped: {images} images were written"))
                    .help(format!("--first {next} continues the stream")))
            }
            Some(Err(e)) => Err(e),
            Some(Ok(End::Left)) => Ok(images),
            Some(Ok(End::Last)) if failures.is_empty() => Ok(images),
            Some(Ok(End::Last)) => Err(together(failures)),
        }
    }

    /// Divides the threads among the images that are in progress at the same time.
    fn workers(&self, work: &Work<'_>, scene: &SceneFile) -> Result<Vec<Threads>> {
        let threads = Threads::new(work.threads)?.count();
        let (first, _) = self.set.recipe.field_of(self.indices.start);
        let at_once = match work.at_once {
            // One worker builds each field once; several would each build it for some of its lights.
            0 if self.set.recipe.lights() > 1 => 1,
            0 => threads.min(fitting(scene, first, work.memory)),
            given => given,
        };
        let at_once = at_once.min((self.indices.end - self.indices.start).to_usize()).max(1);
        Threads::divided(threads, at_once)
    }

    /// Returns the indices of the images of a shard.
    fn wanted(&self, shard: Shard) -> impl Iterator<Item = u64> + Send + use<> {
        let captures = self.set.recipe.captures_a_day();
        self.indices.clone().filter(move |k| shard.holds(k / captures))
    }

    /// Replaces the copied scene file by the original in an error's location.
    fn as_asked(&self, error: Error) -> Error {
        let copy = self.set.recipe.rendering().map(|rendering| self.set.folder.join(&rendering.scene));
        match (error.place(), copy) {
            (Some(Place { file, span }), Ok(copy)) if *file == copy => {
                let place = Place { file: self.scene.clone(), span: span.clone() };
                error.at(place)
            }
            _ => error,
        }
    }
}

/// Scene and renderer of the images.
struct Source<'a> {
    set: &'a Set,
    /// Index after the last image of the stream.
    end: u64,
    scene: SceneFile,
    renderer: Renderer,
    stop: &'a Arc<AtomicBool>,
}

impl Source<'_> {
    /// Makes an image and returns its files as in a dataset.
    fn image(&self, index: u64, threads: &Threads, kept: &mut CachedField) -> Result<Vec<File>> {
        let watch = RenderMonitor { done: &|_| (), stop: self.stop };
        let lights = self.set.recipe.lights();
        // Those of the same view are in the same shard.
        kept.expect((index + 1..self.end.min((index / lights + 1) * lights)).collect());
        let made = render(self.set, &self.scene.clone().threads(threads), index, &self.renderer, watch, kept)?;
        invariants::check(&self.set.recipe, &made.sample)?;
        native::files(&self.set.recipe, &made.sample, &made.text)
    }
}

/// Number of consecutive skipped images after which the stream ends, since the scene file probably never gives a valid
/// field.
pub const MOST_LEFT_OUT: usize = 20;

/// Message of the writing thread.
enum Message {
    /// An image was written.
    Written(u64),
    /// An image could not be made.
    Failed(u64, Error),
    /// The thread has ended.
    Ended(Result<End>),
}

/// Reason for the end of an archive.
#[derive(Debug, PartialEq)]
enum End {
    /// Every image was written or failed, or too many failed in a row, or one failed for a reason that persists.
    Last,
    /// The reader has closed the pipe.
    Left,
}

/// Written and failed images of a stream.
#[derive(Default)]
struct Written {
    /// Number of images.
    images: u64,
    /// Index of the last image.
    last: Option<u64>,
    /// Errors of images that could not be made.
    failures: BTreeMap<u64, Error>,
    /// How the archive ended; `None` after a stop.
    ended: Option<Result<End>>,
}

/// Polling interval for the stop flag.
const EVERY: Duration = Duration::from_millis(50);

/// Time that a stop waits for the image that is being written.
const PATIENCE: Duration = Duration::from_secs(1);

/// Receives messages of the writing thread until it ends, or until [`PATIENCE`] has passed since a stop.
fn listen(
    receiver: &Receiver<Message>,
    listener: &Listener<'_>,
    schedule: &Schedule<u64, Vec<File>>,
    stop: &AtomicBool,
) -> Written {
    let mut written = Written::default();
    let mut stopped: Option<Instant> = None;
    loop {
        match receiver.recv_timeout(EVERY) {
            Ok(Message::Written(index)) => {
                (written.images, written.last) = (written.images + 1, Some(index));
                (listener.done)(index);
            }
            Ok(Message::Failed(index, error)) => drop(written.failures.insert(index, error)),
            Ok(Message::Ended(ended)) => {
                written.ended = Some(ended).filter(|_| stopped.is_none());
                return written;
            }
            Err(RecvTimeoutError::Timeout) => {}
            // The thread sends its end before it drops the sender.
            Err(RecvTimeoutError::Disconnected) => return written,
        }
        if stopped.is_none() && listener.stop.load(Ordering::Relaxed) {
            stopped = Some(Instant::now());
            stop.store(true, Ordering::Relaxed);
            schedule.end();
        }
        if stopped.is_some_and(|since| since.elapsed() > PATIENCE) {
            return written;
        }
    }
}

/// Writes the images as a tar archive until the last one, [`MOST_LEFT_OUT`] failures in a row, or an error that
/// concerns more than one field.
fn archive(schedule: &Schedule<u64, Vec<File>>, out: impl Write, sender: &Sender<Message>) -> Result<End> {
    write_archive(schedule, out, sender).or_else(|e| match e.kind() {
        ErrorKind::BrokenPipe => Ok(End::Left),
        _ => Err(Error::io(Path::new("stdout"))(e)),
    })
}

fn write_archive(schedule: &Schedule<u64, Vec<File>>, out: impl Write, sender: &Sender<Message>) -> io::Result<End> {
    let mut archive = tar::Builder::new(out);
    let mut left_out = 0;
    while let Some((index, made)) = schedule.take() {
        let files = match made {
            Ok(files) => files,
            Err(e) => {
                left_out += 1;
                let ends = left_out == MOST_LEFT_OUT || !e.is_of_one_field();
                // After a stop, nobody reads the reason.
                let _ = sender.send(Message::Failed(index, e));
                if ends {
                    break;
                }
                continue;
            }
        };
        left_out = 0;
        for file in &files {
            append(&mut archive, &file.path, &file.bytes)?;
        }
        archive.get_mut().flush()?;
        let _ = sender.send(Message::Written(index));
    }
    archive.into_inner()?.flush()?;
    Ok(End::Last)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Archives a hundred images with the result `make`; returns the indices of those written and failed.
    fn archived(make: impl Fn(u64) -> Result<()> + Sync) -> (Vec<u64>, Vec<u64>) {
        let schedule = Schedule::new((0..100).map(|index| vec![index]), ResultOrder::InOrder { ahead: 4 });
        let make = |index: &u64, _: &Threads, (): &mut ()| {
            make(*index).map(|()| vec![File { path: format!("images/{index:06}/rgb.png"), bytes: vec![7; 3] }])
        };
        let (sender, receiver) = channel();
        let workers = Threads::divided(2, 2).unwrap();
        let ended = schedule.run(&workers, || false, make, || archive(&schedule, io::sink(), &sender)).unwrap();
        assert_eq!(ended.unwrap(), End::Last);
        drop(sender);
        let (mut written, mut failed) = (Vec::new(), Vec::new());
        for message in receiver {
            match message {
                Message::Written(index) => written.push(index),
                Message::Failed(index, _) => failed.push(index),
                Message::Ended(_) => {}
            }
        }
        (written, failed)
    }

    #[test]
    fn too_many_left_out_in_a_row_end_the_archive() {
        let made = |index| if index == 5 || index == 30 { Ok(()) } else { Err(Error::input("no sun")) };
        let (written, failed) = archived(made);
        assert_eq!(written, [5], "5 is written, 30 comes after more than twenty");
        assert_eq!(failed.len(), 5 + MOST_LEFT_OUT);
    }

    /// Expected: the images before the one that fails are written, and none after it.
    #[test]
    fn a_panic_ends_the_archive_at_its_image() {
        let (written, failed) = archived(|index| {
            assert_ne!(index, 7, "no sun");
            Ok(())
        });
        assert_eq!((written, failed), ((0..7).collect(), vec![7]));
    }
}
