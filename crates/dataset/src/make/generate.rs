//! Makes the missing images of a dataset, several at the same time, until all are complete or the run is stopped.
//!
//! Scene construction, labelling and writing use one core, rendering uses all. Therefore several images are in progress
//! at the same time, each with its own pool of a part of the threads. (In a common pool, a thread that waits for work
//! on its own image may steal work of another image and stay busy with it.) Memory depends on the number of images in
//! progress, not on the size of the dataset.

use crate::make::meter;
use crate::make::pack::store;
use crate::make::push::{Push, Stop, Unit};
use crate::make::render::{CachedField, Times, render, renderer, scene_file};
use crate::make::task::{Task, in_format, task};
use crate::make::time_left::TimeLeft;
use crate::make::timing_log::{End, ImageFailure, ImageTiming, Row, RunEnd, RunStart, TimingLog, now};
use crate::read::checksum::Checksum;
use crate::read::checksum_record::{ChecksumRecord, write_files_beside};
use crate::read::native;
use crate::read::packs::Id;
use crate::read::packs::Packing;
use crate::read::set::Set;
use crate::{File, format};
use furrow_base::error::Kind;
use furrow_base::input::below;
use furrow_base::math::{RoundTo, ToFloat, ToInt};
use furrow_base::{Error, Result};
use furrow_field::assemble::BuildProgress;
use furrow_field::estimate::usual_memory;
use furrow_field::profile::{Phase, Profiler};
use furrow_job::{Renderer, ResultOrder, SceneFile, Schedule, Threads};
use furrow_render::render::RenderMonitor;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::io::ErrorKind;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// The part of a dataset that a run makes: the images whose [unit](crate::Recipe::unit_of) `u` satisfies `u % of ==
/// number`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Number of the shard, from 0.
    pub number: u64,
    /// Number of shards.
    pub of: u64,
}

impl Shard {
    /// A single shard with all images.
    pub const ALL: Self = Self { number: 0, of: 1 };

    /// Returns `true` if a unit belongs to this shard.
    pub fn holds(self, unit: u64) -> bool {
        unit % self.of == self.number
    }

    /// Parses `k/N`, with k from 0 to N − 1.
    pub fn parse(text: &str) -> Result<Self, String> {
        let pair = text.split_once('/').and_then(|(k, n)| Some((k.trim().parse().ok()?, n.trim().parse().ok()?)));
        pair.filter(|(k, n)| k < n)
            .map(|(number, of)| Self { number, of })
            .ok_or_else(|| "write it as k/N with k from 0 to N - 1, such as 0/8".into())
    }
}

/// Settings of a run that do not affect the contents of the dataset.
#[derive(Clone, Copy, Debug)]
pub struct Work<'a> {
    /// The part of the dataset to make.
    pub shard: Shard,
    /// Number of threads; 0 for one per core.
    pub threads: usize,
    /// Number of images in progress at the same time; 0 for one per thread, limited to 16 and to the fields that fit
    /// into `memory`.
    pub at_once: usize,
    /// Memory limit of a field, bytes; `None` for the default fraction of the machine's memory.
    pub memory: Option<u64>,
    /// Command that copies finished files to another place.
    pub push: Option<&'a Push>,
    /// Receives the progress of scene construction.
    pub progress: Option<&'a Arc<BuildProgress>>,
    /// Receives the time that each image takes.
    pub time_left: Option<&'a TimeLeft>,
    /// Measures the CPU time of the phases of images. Images are then made one after another, since phases must not overlap.
    pub profiler: Option<&'a Profiler>,
}

impl Default for Work<'_> {
    /// All images, on all cores, without pushing and progress.
    fn default() -> Self {
        Self {
            shard: Shard::ALL,
            threads: 0,
            at_once: 0,
            memory: None,
            push: None,
            progress: None,
            time_left: None,
            profiler: None,
        }
    }
}

/// Callbacks for progress and warnings of a run, and flags that stop it.
pub struct Callbacks<'a> {
    /// Called before the first image with the number of images to make.
    pub begin: &'a (dyn Fn(usize) + Sync),
    /// Called with each warning before the first image.
    pub warn: &'a (dyn Fn(&str) + Sync),
    /// Called with the index of each completed image, on the calling thread.
    pub done: &'a (dyn Fn(u64) + Sync),
    /// Set to `true` to stop once the images in progress are complete.
    pub soon: &'a AtomicBool,
    /// Set to `true` to stop at once.
    pub now: &'a Arc<AtomicBool>,
}

impl Callbacks<'_> {
    /// Flags for pushes.
    pub(crate) fn stop(&self) -> Stop<'_> {
        Stop { soon: self.soon, now: self.now }
    }
}

/// Destination of the finished images of a run.
pub(crate) struct Delivery<'a> {
    /// Returns `true` if an image is already at the destination.
    pub(crate) has: &'a (dyn Fn(u64) -> bool + Sync),
    /// Called for each finished unit, including units that earlier runs finished.
    pub(crate) deliver: &'a (dyn Fn(Unit) -> Result<()> + Sync),
    /// The dataset's folder, which receives the timing log and is named in messages; the run itself may work in another
    /// folder.
    pub(crate) home: &'a Path,
}

/// Default limit of the number of images in progress: more would need much memory and save little time.
pub(crate) const MOST_AT_ONCE: usize = 16;

/// Returns how many fields like field `index` fit into memory, from 1 to [`MOST_AT_ONCE`]. Returns 1 if the estimate
/// fails; building the field then reports the error.
pub(crate) fn fitting(scene: &SceneFile, index: u64, memory: Option<u64>) -> usize {
    let memory = memory.unwrap_or_else(usual_memory).to_f64();
    let one = scene.estimate(index).map_or(memory, |estimate| estimate.total().bytes);
    (memory / one).trunc_to::<usize>().clamp(1, MOST_AT_ONCE)
}

/// Makes the missing images of a shard. A stopped run returns [`Kind::Interrupted`] with the number of complete images;
/// the same call continues later.
///
/// An error of a single field ([`Error::is_of_one_field`]) is returned after all other images are made; any other
/// error, such as a full disk, ends the run at once. Completed images are kept in all cases.
pub fn generate(set: &Set, work: &Work<'_>, callbacks: &Callbacks<'_>) -> Result<()> {
    work.push.map_or(Ok(()), |push| push.clear(set))?;
    let deliver = |unit: Unit| work.push.map_or(Ok(()), |push| push.unit(set, unit, callbacks.stop()));
    deliver(Unit::Recipe)?;
    generate_for(set, work, callbacks, &Delivery { has: &|_| false, deliver: &deliver, home: &set.folder })
}

/// Like [`generate`], with a custom destination for the finished images.
pub(crate) fn generate_for(
    set: &Set,
    work: &Work<'_>,
    callbacks: &Callbacks<'_>,
    delivery: &Delivery<'_>,
) -> Result<()> {
    let renderer = renderer(set)?;
    let all = Threads::new(work.threads)?;
    let threads = all.count();
    let shard = work.shard;
    let held = |k: &u64| shard.holds(set.recipe.unit_of(*k));
    let wanted: Vec<u64> = (0..set.recipe.count).filter(held).collect();
    let open = all.install(|| OpenPacks::of(set, shard))?;
    let is_freed = |k: u64| set.recipe.pack.is_none() && Unit::Image(k).is_freed(set);
    let is_there = |k: u64| (delivery.has)(k) || open.is_settled(set, k) || is_freed(k);
    let look = |k: u64| Ok((k, if is_there(k) { Task::Done } else { task(set, k)? }));
    let tasks: Vec<(u64, Task)> = all.install(|| wanted.into_par_iter().map(look).collect::<Result<Vec<_>>>())?;
    let wanted = tasks.len();
    let tasks: Vec<(u64, Task)> = tasks.into_iter().filter(|(_, t)| *t != Task::Done).collect();
    (callbacks.begin)(tasks.len());
    open.expect(set, &tasks)?;
    // Delivers the units that are already complete, since an earlier run may have stopped before delivering them.
    let lacking: BTreeSet<String> = tasks.iter().map(|(index, _)| Unit::of(set, *index).name()).collect();
    let mut units: Vec<Unit> = held_units(set, shard);
    units.retain(|unit| !lacking.contains(&unit.name()));
    let sent = delivery.deliver;
    units.into_iter().try_for_each(|unit| if callbacks.soon.load(Ordering::Relaxed) { Ok(()) } else { sent(unit) })?;
    // One worker renders all images of a field and day one after another, under all lights, and builds the scene once.
    let of_one_field = |a: &(u64, Task), b: &(u64, Task)| set.recipe.growing_of(a.0) == set.recipe.growing_of(b.0);
    let fields: Vec<Vec<(u64, Task)>> = tasks.chunk_by(of_one_field).map(<[_]>::to_vec).collect();
    if let Some(time_left) = work.time_left {
        let grows = |field: &&Vec<(u64, Task)>| field.iter().any(|(_, task)| *task == Task::All);
        time_left.expect(tasks.len(), fields.iter().filter(grows).count());
    }
    let rendered = tasks.iter().find(|(_, task)| *task == Task::All).map(|(index, _)| *index);
    let source = match (rendered, &renderer) {
        (Some(index), Some(renderer)) => {
            let scene = scene_file(set)?.memory(work.memory).until(callbacks.now);
            let scene = match work.progress {
                Some(progress) => scene.progress(progress),
                None => scene,
            };
            let scene = match work.profiler {
                Some(profiler) => scene.profiled(profiler),
                None => scene,
            };
            Some((scene, index, renderer))
        }
        _ => None,
    };
    let most = source
        .as_ref()
        .map_or(MOST_AT_ONCE, |(scene, index, _)| fitting(scene, set.recipe.field_of(*index).0, work.memory));
    let at_once = match work.at_once {
        _ if work.profiler.is_some() => 1,
        0 => threads.min(most),
        at_once => at_once,
    };
    let at_once = at_once.min(fields.len()).max(1);
    let workers = Threads::divided(threads, at_once)?;
    let run = Run {
        set,
        rendered: tasks.iter().filter(|(_, task)| *task == Task::All).map(|(index, _)| *index).collect(),
        source: source.map(|(scene, _, renderer)| (scene, renderer)),
        callbacks,
        threads,
        at_once,
        timing_log: TimingLog::new(delivery.home, &format!("{}-of-{}", shard.number, shard.of)),
        time_left: work.time_left,
        profiler: work.profiler.cloned().unwrap_or_default(),
    };
    let cpu_before = meter::cpu();
    if !tasks.is_empty() {
        run.timing_log.add(&Row::RunStart(RunStart { began_s: now(), images: tasks.len(), at_once, threads }))?;
    }
    let (mut made, mut failures) = (0, BTreeMap::new());
    // Images that are complete, of which some may not be delivered yet.
    let complete = AtomicUsize::new(0);
    let make = |(index, task): &(u64, Task), threads: &Threads, kept: &mut CachedField| {
        threads.install(|| run.image(*index, *task, threads, kept))?;
        complete.fetch_add(1, Ordering::Relaxed);
        if open.made(set, *index)? { sent(Unit::of(set, *index)) } else { Ok(()) }
    };
    let schedule = Schedule::new(fields.into_iter(), ResultOrder::AsFinished);
    let stopped = || callbacks.soon.load(Ordering::Relaxed) || callbacks.now.load(Ordering::Relaxed);
    let refused = schedule.run(&workers, stopped, make, || {
        while let Some(((index, _), result)) = schedule.take() {
            match result {
                Ok(()) => {
                    made += 1;
                    (callbacks.done)(index);
                }
                Err(e) if e.kind() == Kind::Interrupted => {}
                Err(e) => {
                    let failure = ImageFailure { index, error: e.to_string(), failed_s: now() };
                    // If this write fails too, for example on a full disk, the original error is still returned.
                    let _ = run.timing_log.add(&Row::Failure(failure));
                    failures.insert(index, e);
                }
            }
        }
    });
    // A stop may arrive after the last image; the run is complete then.
    let lacking = tasks.len() - made;
    let end = match lacking {
        _ if !failures.is_empty() => End::Failed,
        0 => End::Done,
        _ => End::Stopped,
    };
    let noted = if tasks.is_empty() { Ok(()) } else { run.ended(end, cpu_before) };
    if !failures.is_empty() {
        return Err(together(failures));
    }
    noted?;
    refused?;
    let there = wanted - tasks.len() + complete.into_inner();
    match lacking {
        0 => Ok(()),
        _ if there == wanted => Err(Error::stopped("stopped: all images are complete, but not all are copied")
            .help("the same command copies the rest")
            .in_file(delivery.home)),
        _ => Err(interrupted(delivery.home, there, wanted)),
    }
}

/// Returns the error of a stopped run, with the number of complete images (`there`) and of requested images (`wanted`).
pub(crate) fn interrupted(folder: &Path, there: usize, wanted: usize) -> Error {
    Error::stopped(format!("stopped: {there} of {wanted} images are complete"))
        .help("the same command continues the dataset")
        .in_file(folder)
}

/// Largest number of failed images that are listed in an error message.
const MOST_LISTED: usize = 20;

/// Combines the errors of a run, by image, into one: an error that ended the run alone, or else the list of errors of
/// single fields.
pub(crate) fn together(failures: BTreeMap<u64, Error>) -> Error {
    let mut words = Vec::new();
    let more = failures.len().saturating_sub(MOST_LISTED);
    let mut input = true;
    for (index, error) in failures {
        let image = format!("image {}", Set::name(index));
        if !error.is_of_one_field() {
            return if error.place().is_none() { error.within(image) } else { error };
        }
        if error.kind() == Kind::Damaged {
            input = false;
            words.push(error.to_string());
        } else {
            words.push(format!("{image}: {error}"));
        }
    }
    words.truncate(MOST_LISTED);
    if more > 0 {
        words.push(format!("{more} more images were not made; correct these errors and run the same command again"));
    }
    let words = words.join("\nerror: ");
    if input { Error::input(words) } else { Error::damaged(words) }
}

/// Returns the units of a shard that are delivered: images or packs.
fn held_units(set: &Set, shard: Shard) -> Vec<Unit> {
    match Packing::of(&set.recipe) {
        Some(packing) => packing.all().filter(|id| shard.holds(packing.place(*id))).map(Unit::Pack).collect(),
        None => (0..set.recipe.count).filter(|k| shard.holds(set.recipe.unit_of(*k))).map(Unit::Image).collect(),
    }
}

/// The incomplete packs of a shard, each with its number of images to make.
pub(crate) struct OpenPacks(BTreeMap<Id, AtomicUsize>);

impl OpenPacks {
    /// Returns the incomplete packs of a shard; none if the dataset stores images in folders.
    pub(crate) fn of(set: &Set, shard: Shard) -> Result<Self> {
        let Some(packing) = Packing::of(&set.recipe) else { return Ok(Self(BTreeMap::new())) };
        let held: Vec<Id> = packing.all().filter(|id| shard.holds(packing.place(*id))).collect();
        let open = held.into_par_iter().map(|id| Ok((id, store::settle(set, id)?))).collect::<Result<Vec<_>>>()?;
        Ok(Self(open.into_iter().filter(|(_, whole)| !whole).map(|(id, _)| (id, AtomicUsize::new(0))).collect()))
    }

    /// Returns `true` if an image belongs to a complete pack.
    pub(crate) fn is_settled(&self, set: &Set, index: u64) -> bool {
        Packing::of(&set.recipe).is_some_and(|packing| !self.0.contains_key(&packing.id(index)))
    }

    /// Counts the remaining images of each pack, and closes the packs that have none.
    fn expect(&self, set: &Set, tasks: &[(u64, Task)]) -> Result<()> {
        let Some(packing) = Packing::of(&set.recipe) else { return Ok(()) };
        for (index, _) in tasks {
            if let Some(left) = self.0.get(&packing.id(*index)) {
                left.fetch_add(1, Ordering::Relaxed);
            }
        }
        let ready = self.0.iter().filter(|(_, left)| left.load(Ordering::Relaxed) == 0);
        ready.map(|(id, _)| *id).try_for_each(|id| store::close(set, id))
    }

    /// Counts an image as complete, and closes its pack after the last one. Returns `true` if the image's unit is now
    /// finished.
    fn made(&self, set: &Set, index: u64) -> Result<bool> {
        let Some(id) = Packing::of(&set.recipe).map(|packing| packing.id(index)) else { return Ok(true) };
        let is_last = self.0.get(&id).is_some_and(|left| left.fetch_sub(1, Ordering::AcqRel) == 1);
        if is_last {
            store::close(set, id)?;
        }
        Ok(is_last)
    }
}

/// A run of a shard.
struct Run<'a> {
    set: &'a Set,
    /// Images that this run renders.
    rendered: BTreeSet<u64>,
    /// Scene file and renderer; `None` if no image has to be rendered.
    source: Option<(SceneFile, &'a Renderer)>,
    callbacks: &'a Callbacks<'a>,
    threads: usize,
    at_once: usize,
    timing_log: TimingLog,
    time_left: Option<&'a TimeLeft>,
    profiler: Profiler,
}

impl Run<'_> {
    /// Makes one image, or only its formats, and writes its checksum record.
    fn image(&self, index: u64, task: Task, threads: &Threads, kept: &mut CachedField) -> Result<()> {
        let begin = Instant::now();
        let Set { folder, recipe, .. } = self.set;
        // Another run may have made the image in the meantime.
        if self::task(self.set, index)? == Task::Done {
            self.tell_time(begin, Duration::ZERO);
            return Ok(());
        }
        let (files, times) = if task == Task::Formats {
            (derived(self.set, index)?, Times::default())
        } else {
            let (scene, renderer) = self.source.as_ref().ok_or_else(|| lost(self.set, index))?;
            let watch = RenderMonitor { done: &|_| (), stop: self.callbacks.now };
            kept.expect(self.rendered.range(index + 1..).take(recipe.lights().to_usize()).copied().collect());
            let made = render(self.set, &scene.clone().threads(threads), index, renderer, watch, kept)?;
            self.profiler.enter(Phase::Files);
            crate::model::invariants::check(recipe, &made.sample)?;
            let mut files = native::files(recipe, &made.sample, &made.text)?;
            files.extend(formatted(self.set, &made.sample)?);
            (files, made.times)
        };
        if self.callbacks.now.load(Ordering::Relaxed) {
            return Err(Error::interrupted());
        }
        let old = ChecksumRecord::read(folder, index);
        let before = old.clone().filter(|_| task == Task::Formats);
        let mut there = before.as_ref().map(|before| before.files.clone()).unwrap_or_default();
        there.extend(self.of_first_light(index));
        there.retain(|path, _| native::is_native(path));
        write_files_beside(folder, &files, &there)?;
        let mut checksums = ChecksumRecord::of(index, recipe, &files)?;
        if let Some(before) = before {
            // Keeps the checksums of native files and of formats that need the film: these are intact, or the task
            // would be `All`.
            let films: Vec<&str> =
                format::all(recipe)?.into_iter().filter(|(_, f)| f.needs_film()).map(|(name, _)| name).collect();
            let kept = |path: &str| path.starts_with("images/") || films.iter().any(|name| in_format(path, name));
            checksums.files.extend(before.files.into_iter().filter(|(path, _)| kept(path)));
        }
        checksums.write(folder)?;
        if let Some(old) = old {
            self.remove_stale(&old, &checksums)?;
        }
        self.profiler.enter(Phase::Other);
        let seconds = self.tell_time(begin, times.grow);
        let hash = checksums.image_hash()?;
        self.timing_log.add(&Row::Image(ImageTiming::new(index, hash, seconds, &times, self.at_once, self.threads)))
    }

    /// Removes the files of formats that an image had and no longer has, such as masks of plants below a new limit.
    fn remove_stale(&self, old: &ChecksumRecord, new: &ChecksumRecord) -> Result<()> {
        let Set { folder, recipe, .. } = self.set;
        let is_stale = |path: &&String| {
            !new.files.contains_key(*path) && recipe.formats.iter().any(|format| in_format(path, format))
        };
        for path in old.files.keys().filter(is_stale) {
            let path = below(folder, path)?;
            match std::fs::remove_file(&path) {
                Err(e) if e.kind() != ErrorKind::NotFound => return Err(Error::io(&path)(e)),
                _ => {}
            }
        }
        Ok(())
    }

    /// Returns the files of the image that shows the same view under the field's own light; none if it is this image or does not
    /// exist yet. Their label maps are equal, and become hard links to one file.
    fn of_first_light(&self, index: u64) -> BTreeMap<String, Checksum> {
        let Set { folder, recipe, .. } = self.set;
        match recipe.light_of(index) {
            0 => BTreeMap::new(),
            light => ChecksumRecord::read(folder, index - light).map(|record| record.files).unwrap_or_default(),
        }
    }

    /// Adds an image's time to the remaining-time estimate, with the time `grow` of scene construction. Returns the
    /// image's time, seconds.
    fn tell_time(&self, begin: Instant, grow: Duration) -> f64 {
        let seconds = begin.elapsed().as_secs_f64();
        if let Some(time_left) = self.time_left {
            time_left.add(seconds, grow);
        }
        seconds
    }

    /// Writes the last row of the timing log: the reason for the end, the CPU time since `cpu_before`, and the peak
    /// memory.
    fn ended(&self, end: End, cpu_before: Option<Duration>) -> Result<()> {
        let taken = meter::cpu().zip(cpu_before).map(|(now, before)| now.saturating_sub(before));
        self.timing_log.add(&Row::RunEnd(RunEnd {
            ended_s: now(),
            end,
            cpu_s: taken.map(|taken| taken.as_secs_f64()),
            peak_bytes: meter::peak_memory(),
            profile: self.profiler.times(),
        }))
    }
}

/// Returns the files of all formats of an image.
pub(crate) fn formatted(set: &Set, sample: &crate::Sample) -> Result<Vec<File>> {
    let mut files = Vec::new();
    for (_, format) in format::all(&set.recipe)? {
        files.extend(format.image(&set.recipe, sample)?);
    }
    Ok(files)
}

/// Returns the files of the formats that can be made from the native files, without rendering.
fn derived(set: &Set, index: u64) -> Result<Vec<File>> {
    let sample = set.sample(index)?;
    let mut files = Vec::new();
    for (_, format) in format::all(&set.recipe)?.into_iter().filter(|(_, format)| !format.needs_film()) {
        files.extend(format.image(&set.recipe, &sample)?);
    }
    Ok(files)
}

/// Returns the error for a damaged image that was imported and so cannot be rendered again.
fn lost(set: &Set, index: u64) -> Error {
    Error::damaged(format!("image {index} is damaged, and an imported image cannot be rendered again"))
        .in_file(&set.folder)
        .help("import the images again")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lasting_cause_is_reported_alone_and_faults_of_fields_together() {
        let field = |index| (index, Error::input("no sun").help("wait"));
        let all = together(BTreeMap::from([field(1), field(4)]));
        assert_eq!(all.to_string(), "image 000001: no sun\n help: wait\nerror: image 000004: no sun\n help: wait");
        assert_eq!(all.kind(), Kind::Input);
        let with = |error: Error| together(BTreeMap::from([field(1), (3, error)]));
        assert_eq!(with(Error::damaged("image 3: x")).kind(), Kind::Damaged);
        for lasting in [Error::failed("cannot encode a PNG"), Error::missing("no denoiser")] {
            let (kind, words) = (lasting.kind(), format!("image 000003: {lasting}"));
            let combined = with(lasting);
            assert_eq!((combined.kind(), combined.to_string()), (kind, words));
        }
        let full = with(Error::io("a/b.png".as_ref())(std::io::ErrorKind::StorageFull.into()));
        assert!(full.to_string().starts_with("a/b.png: "), "{full}");
    }

    #[test]
    fn shards_are_read_as_they_are_written() {
        assert_eq!(Shard::parse("2/5"), Ok(Shard { number: 2, of: 5 }));
        for bad in ["5/5", "1", "-1/2", "a/b", "0/0"] {
            assert!(Shard::parse(bad).is_err(), "{bad}");
        }
    }
}
