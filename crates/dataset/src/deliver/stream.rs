//! Streams images to another program as a tar archive while they are rendered, without writing a dataset.
//!
//! Files are named as in a dataset's [packs](crate::read::packs). Several workers make images, which are written in the
//! order of their indices. Images that are finished early wait in a bounded queue, and workers pause while it is full,
//! so the reader determines the speed.

use crate::File;
use crate::make::generate::{Shard, Work, fitting, share, together};
use crate::make::plan::{Order, plan};
use crate::make::render::{LastField, render, renderer, scene_file};
use crate::model::invariants;
use crate::model::recipe::MOST_IMAGES;
use crate::read::archive::append;
use crate::read::native;
use crate::read::set::Set;
use furrow_base::error::{Kind, Place};
use furrow_base::{Error, Result};
use furrow_job::{Renderer, SceneFile, Threads};
use furrow_render::render::Watch;
use std::collections::BTreeMap;
use std::io::{self, ErrorKind, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
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
    /// them in a row end the stream. A stopped stream returns [`Kind::Interrupted`].
    pub fn write(&self, work: &Work<'_>, out: impl Write + Send + 'static, listener: &Listener<'_>) -> Result<u64> {
        let set = &self.set;
        let Some(renderer) = renderer(set)? else { return Ok(0) };
        let stop = Arc::<AtomicBool>::default();
        let scene = scene_file(set)?.memory(work.memory).until(&stop);
        let workers = self.workers(work, &scene)?;
        let queue = Arc::new(Queue::new(self.wanted(work.shard), 2 * workers.len()));
        let (tell, told) = channel();
        let to_write = Arc::clone(&queue);
        // Not a scoped thread: the reader of a pipe may block it forever, and a stop must not wait for it.
        let write = move || {
            let ended = archive(&to_write, out, &tell);
            to_write.end();
            let _ = tell.send(Said::Ended(ended));
        };
        std::thread::Builder::new().name("archive".into()).spawn(write).map_err(Error::no_thread)?;
        let failures: Mutex<BTreeMap<u64, Error>> = Mutex::default();
        let source = Source { set, scene, renderer, stop: &stop };
        let warn = listener.warn;
        let mut refused = None;
        let (written, ended) = std::thread::scope(|scope| {
            for worker in &workers {
                let work = || self.serve(&queue, &source, worker, warn, &failures);
                if let Err(e) = std::thread::Builder::new().name("images".into()).spawn_scoped(scope, work) {
                    refused = Some(Error::no_thread(e));
                    queue.end();
                    break;
                }
            }
            let ends = listen(&told, listener, &queue, &stop);
            // Stops the workers, whose images are no longer needed.
            stop.store(true, Ordering::Relaxed);
            ends
        });
        let failures = failures.into_inner().unwrap_or_else(PoisonError::into_inner);
        if let Some(refused) = refused {
            return Err(refused);
        }
        match ended {
            _ if failures.values().any(|e| !e.is_of_one_field()) => Err(together(failures)),
            None => {
                let next = written.last.map_or(self.indices.start, |last| last + 1);
                Err(Error::stopped(format!("stopped: {} images were written", written.images))
                    .help(format!("--first {next} continues the stream")))
            }
            Some(Err(e)) if e.kind() == ErrorKind::BrokenPipe => Ok(written.images),
            Some(Err(e)) => Err(Error::io(Path::new("stdout"))(e)),
            Some(Ok(())) if failures.is_empty() => Ok(written.images),
            Some(Ok(())) => Err(together(failures)),
        }
    }

    /// Divides the threads among the images that are in progress at the same time.
    fn workers(&self, work: &Work<'_>, scene: &SceneFile) -> Result<Vec<Threads>> {
        let threads = Threads::new(work.threads)?.count();
        let (first, _) = self.set.recipe.field_of(self.indices.start);
        let at_once = match work.at_once {
            0 => threads.min(fitting(scene, first, work.memory)),
            given => given,
        };
        let at_once = at_once.min((self.indices.end - self.indices.start) as usize).max(1);
        (0..at_once).map(|worker| Threads::new(share(threads, at_once, worker))).collect()
    }

    /// Makes images one after another until the queue has no more.
    fn serve(
        &self,
        queue: &Queue,
        source: &Source<'_>,
        threads: &Threads,
        warn: &(dyn Fn(&str) + Sync),
        failures: &Mutex<BTreeMap<u64, Error>>,
    ) {
        let _guard = EndOnPanic(queue);
        // Each worker builds the field of its images itself; waiting for another worker to build it would take the same
        // time.
        let mut kept = LastField::default();
        while let Some(index) = queue.begin() {
            match threads.install(|| source.image(index, threads, &mut kept)) {
                Ok(files) => queue.finish(index, State::Made(files)),
                Err(e) if e.kind() == Kind::Interrupted => queue.end(),
                Err(e) => {
                    let e = self.as_asked(e);
                    let of_one = e.is_of_one_field();
                    if of_one {
                        warn(&format!("image {} is left out: {e}", Set::name(index)));
                    }
                    lock(failures).insert(index, e);
                    if of_one { queue.finish(index, State::LeftOut) } else { queue.end() }
                }
            }
        }
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
    scene: SceneFile,
    renderer: Renderer,
    stop: &'a Arc<AtomicBool>,
}

impl Source<'_> {
    /// Makes an image and returns its files as in a dataset.
    fn image(&self, index: u64, threads: &Threads, kept: &mut LastField) -> Result<Vec<File>> {
        let watch = Watch { done: &|_| (), stop: self.stop };
        let made = render(self.set, &self.scene.clone().threads(threads), index, &self.renderer, watch, kept)?;
        invariants::check(&self.set.recipe, &made.sample)?;
        native::files(&self.set.recipe, &made.sample, &made.text)
    }
}

/// Number of consecutive skipped images after which the stream ends, since the scene file probably never gives a valid
/// field.
pub const MOST_LEFT_OUT: usize = 20;

/// State of an image in the queue.
enum State {
    UnderWay,
    Made(Vec<File>),
    LeftOut,
}

/// Queue of images from the workers to the archive, ordered by index.
struct Queue {
    inside: Mutex<Inside>,
    changed: Condvar,
    /// Largest number of images that are in progress or waiting.
    most: usize,
}

struct Inside {
    /// Indices of images that no worker has started.
    wanted: Box<dyn Iterator<Item = u64> + Send>,
    images: BTreeMap<u64, State>,
    /// Whether no further image may be started: all are started, or the stream ends.
    ended: bool,
    /// Whether waiting images are discarded too, because the stream ends.
    left: bool,
}

impl Queue {
    fn new(wanted: impl Iterator<Item = u64> + Send + 'static, most: usize) -> Self {
        let inside = Inside { wanted: Box::new(wanted), images: BTreeMap::new(), ended: false, left: false };
        Self { inside: Mutex::new(inside), changed: Condvar::new(), most }
    }

    /// Waits for room in the queue and returns the next image to make; `None` if there is none.
    fn begin(&self) -> Option<u64> {
        let full = |inside: &mut Inside| !inside.ended && inside.images.len() >= self.most;
        let mut inside = self.changed.wait_while(lock(&self.inside), full).unwrap_or_else(PoisonError::into_inner);
        let next = if inside.ended { None } else { inside.wanted.next() };
        match next {
            Some(index) => drop(inside.images.insert(index, State::UnderWay)),
            None => inside.ended = true,
        }
        self.changed.notify_all();
        next
    }

    /// Sets the state of an image that is made or left out.
    fn finish(&self, index: u64, state: State) {
        lock(&self.inside).images.insert(index, state);
        self.changed.notify_all();
    }

    /// Waits for the next image by index and removes it from the queue; returns `None` after the last.
    fn take(&self) -> Option<(u64, State)> {
        let waits = |inside: &mut Inside| {
            !inside.left
                && match inside.images.first_key_value() {
                    Some((_, state)) => matches!(state, State::UnderWay),
                    None => !inside.ended,
                }
        };
        let mut inside = self.changed.wait_while(lock(&self.inside), waits).unwrap_or_else(PoisonError::into_inner);
        let next = if inside.left { None } else { inside.images.pop_first() };
        self.changed.notify_all();
        next
    }

    /// Ends the stream: no image is started or written any more.
    fn end(&self) {
        let mut inside = lock(&self.inside);
        (inside.ended, inside.left) = (true, true);
        self.changed.notify_all();
    }
}

/// Ends the stream if a worker panics; otherwise the archive would wait for its image forever.
struct EndOnPanic<'a>(&'a Queue);

impl Drop for EndOnPanic<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.end();
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Message of the writing thread.
enum Said {
    /// An image was written.
    Written(u64),
    /// The thread has ended.
    Ended(io::Result<()>),
}

/// Number of written images and index of the last one.
#[derive(Default)]
struct Written {
    images: u64,
    last: Option<u64>,
}

/// Polling interval for the stop flag.
const EVERY: Duration = Duration::from_millis(50);

/// Time that a stop waits for the image that is being written.
const PATIENCE: Duration = Duration::from_secs(1);

/// Receives messages of the writing thread until it ends, or until [`PATIENCE`] has passed since a stop. The second
/// result is `None` after a stop.
fn listen(
    told: &Receiver<Said>,
    listener: &Listener<'_>,
    queue: &Queue,
    stop: &AtomicBool,
) -> (Written, Option<io::Result<()>>) {
    let mut written = Written::default();
    let mut stopped: Option<Instant> = None;
    loop {
        match told.recv_timeout(EVERY) {
            Ok(Said::Written(index)) => {
                (written.images, written.last) = (written.images + 1, Some(index));
                (listener.done)(index);
            }
            Ok(Said::Ended(ended)) => return (written, Some(ended).filter(|_| stopped.is_none())),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                queue.end();
                return (written, Some(Err(io::Error::other("the thread that writes has failed"))));
            }
        }
        if stopped.is_none() && listener.stop.load(Ordering::Relaxed) {
            stopped = Some(Instant::now());
            stop.store(true, Ordering::Relaxed);
            queue.end();
        }
        if stopped.is_some_and(|since| since.elapsed() > PATIENCE) {
            return (written, None);
        }
    }
}

/// Writes the images of the queue as a tar archive.
fn archive(queue: &Queue, out: impl Write, tell: &Sender<Said>) -> io::Result<()> {
    let mut archive = tar::Builder::new(out);
    let mut left_out = 0;
    while let Some((index, state)) = queue.take() {
        let State::Made(files) = state else {
            left_out += 1;
            if left_out == MOST_LEFT_OUT {
                break;
            }
            continue;
        };
        left_out = 0;
        for file in &files {
            append(&mut archive, &file.path, &file.bytes)?;
        }
        archive.get_mut().flush()?;
        let _ = tell.send(Said::Written(index));
    }
    archive.into_inner()?.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn made(queue: &Queue, index: u64) {
        queue.finish(index, State::Made(vec![File { path: format!("images/{index:06}/rgb.png"), bytes: vec![7; 3] }]));
    }

    #[test]
    fn images_leave_in_order_and_few_wait() {
        let queue = Arc::new(Queue::new(10..14, 2));
        assert_eq!((queue.begin(), queue.begin()), (Some(10), Some(11)));
        made(&queue, 11);
        let third = std::thread::spawn({
            let queue = Arc::clone(&queue);
            move || queue.begin()
        });
        std::thread::sleep(Duration::from_millis(50));
        assert!(!third.is_finished(), "two are under way or wait");
        made(&queue, 10);
        assert_eq!(queue.take().map(|(index, _)| index), Some(10));
        assert_eq!(third.join().unwrap(), Some(12));
        assert_eq!(queue.take().map(|(index, _)| index), Some(11));
        assert_eq!(queue.begin(), Some(13));
        queue.finish(12, State::LeftOut);
        made(&queue, 13);
        assert!(matches!(queue.take(), Some((12, State::LeftOut))));
        assert_eq!(queue.begin(), None);
        assert!(matches!(queue.take(), Some((13, State::Made(_)))));
        assert!(queue.take().is_none());
    }

    #[test]
    fn too_many_left_out_in_a_row_end_the_archive() {
        let queue = Queue::new(0..100, 101);
        while let Some(index) = queue.begin() {
            if index == 5 || index == 30 { made(&queue, index) } else { queue.finish(index, State::LeftOut) }
        }
        let (tell, told) = channel();
        archive(&queue, io::sink(), &tell).unwrap();
        drop(tell);
        assert_eq!(told.iter().count(), 1, "5 is written, 30 comes after more than twenty");
    }
}
