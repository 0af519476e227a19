//! How far a dataset is, from what lies in its folder: so it is told while runs are under way, after they were killed, and on any machine
//! that sees the folder.
//!
//! An image counts as done where its checksums name files of the right lengths; [`verify`](crate::check::verify()) reads their bytes too.

use crate::make::push::{self, Unit};
use crate::make::timing_log::{self, End, ImageFailure, ImageTiming, Row, RunLog};
use crate::model::recipe::compact;
use crate::read::checksum_record::ChecksumRecord;
use crate::read::set::{Set, in_parallel};
use crate::read::task::{Task, remaining};
use furrow_base::input::below;
use furrow_base::{Error, Result};
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};

/// Images that are told as the slowest.
const MOST_SLOW: usize = 5;
/// A run that has not ended is silent when it has told nothing for so many times its slowest image …
const SILENT_IMAGES: f64 = 10.0;
/// … and for so many seconds.
const SILENT_SECONDS: f64 = 300.0;

/// How far a dataset is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Status {
    /// Images that it is to have.
    pub images: u64,
    /// Of them, those that are there.
    pub done: u64,
    /// Runs that have begun and not ended, and are not silent.
    pub working: usize,
    /// Images an hour of all runs that work; where none does, of one run as they were.
    pub images_per_hour: Option<f64>,
    /// Seconds until all are there at that rate; of shards that are at work, those of the slowest.
    pub left_s: Option<f64>,
    /// Core seconds of the runs that have ended, where they tell it.
    pub core_s: f64,
    /// Most memory of a run's process, where one tells it.
    pub peak_bytes: Option<u64>,
    /// Shard by shard.
    pub shards: Vec<ShardStatus>,
    /// The images that took longest.
    pub slowest: Vec<SlowImage>,
    /// The images that are not there and could not be made.
    pub failures: Vec<FailedImage>,
}

/// How far a shard is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ShardStatus {
    /// Its number, from 0.
    pub number: u64,
    /// Images that it is to have.
    pub images: u64,
    /// Of them, those that are there.
    pub done: u64,
    /// Of the others, those that could not be made.
    pub failed: u64,
    /// What its last run does.
    pub state: State,
    /// Images an hour of its last run.
    pub images_per_hour: Option<f64>,
    /// Seconds until all are there at that rate.
    pub left_s: Option<f64>,
    /// Seconds since its last run told something.
    pub last_s: Option<f64>,
}

/// What the last run of a shard does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// All images are there.
    Done,
    /// It makes images.
    Working,
    /// It has not ended, but has told nothing for long: it may have been killed.
    Silent,
    /// It was asked to stop.
    Stopped,
    /// It has ended, and some images could not be made.
    Failed,
    /// It has ended or was never begun, and images are missing.
    Missing,
}

/// An image that took long.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SlowImage {
    /// Its number.
    pub index: u64,
    /// Seconds in all.
    pub seconds: f64,
    /// Of them, growing the field.
    pub grow_s: f64,
    /// Drawing.
    pub draw_s: f64,
    /// Labelling.
    pub label_s: f64,
    /// Plants that it shows or hides, where its record is there.
    pub plants: Option<usize>,
}

/// An image that could not be made.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FailedImage {
    /// Its number.
    pub index: u64,
    /// The shard that it belongs to.
    pub shard: u64,
    /// Why.
    pub error: String,
}

impl Status {
    /// Looks at a dataset as one of so many shards: as many as its last run had, unless given.
    pub fn of(set: &Set, shards: Option<u64>, stop: &AtomicBool) -> Result<Self> {
        let logs = timing_log::runs(&set.folder)?;
        let runs: Vec<Run<'_>> = logs.iter().map(Run::of).collect();
        let of = shards.unwrap_or_else(|| last_shards(&runs)).max(1);
        let there = there(set, stop)?;
        let shard_of = |index: u64| set.recipe.unit_of(index) % of;
        let lacks = |index: u64| there.get(usize::try_from(index).unwrap_or(usize::MAX)) == Some(&false);
        let failures: Vec<FailedImage> = failures(&logs)
            .into_values()
            .filter(|failure| lacks(failure.index))
            .map(|f| FailedImage { index: f.index, shard: shard_of(f.index), error: f.error.clone() })
            .collect();
        let now = timing_log::now();
        // More shards than images are named by nobody, and would fill the memory.
        let mut all: Vec<ShardStatus> = (0..of.min(set.recipe.count.max(1))).map(ShardStatus::empty).collect();
        for (index, done) in (0..).zip(&there) {
            if let Some(shard) = all.get_mut(shard_of(index) as usize) {
                shard.images += 1;
                shard.done += u64::from(*done);
            }
        }
        for shard in &mut all {
            shard.failed = failures.iter().filter(|failure| failure.shard == shard.number).count() as u64;
            let own = runs.iter().filter(|run| run.shard == Some((shard.number, of)));
            shard.follow(own.max_by(|a, b| a.last.total_cmp(&b.last)), now);
        }
        let done = there.iter().filter(|done| **done).count() as u64;
        let (working, images_per_hour) = rate(&runs, now);
        let left = |done: u64, rate: Option<f64>| left(set.recipe.count - done, rate);
        let lacking = || all.iter().filter(|shard| shard.done < shard.images);
        let left_s = if of > 1 && lacking().all(|shard| shard.state == State::Working && shard.left_s.is_some()) {
            lacking().filter_map(|shard| shard.left_s).max_by(f64::total_cmp).or(Some(0.0))
        } else {
            left(done, images_per_hour)
        };
        Ok(Self {
            images: set.recipe.count,
            done,
            working,
            images_per_hour,
            left_s,
            core_s: runs.iter().filter_map(|run| run.core_s).sum(),
            peak_bytes: runs.iter().filter_map(|run| run.peak_bytes).max(),
            shards: all,
            slowest: slowest(set, &logs),
            failures,
        })
    }

    /// Whether nothing is missing.
    pub fn is_done(&self) -> bool {
        self.done == self.images
    }

    /// All of it as one line of JSON.
    pub fn json(&self) -> Result<String> {
        Ok(String::from_utf8_lossy(&compact(self)?).trim_end().to_owned())
    }
}

impl ShardStatus {
    fn empty(number: u64) -> Self {
        Self {
            number,
            images: 0,
            done: 0,
            failed: 0,
            state: State::Missing,
            images_per_hour: None,
            left_s: None,
            last_s: None,
        }
    }

    /// Takes over what its last run tells.
    fn follow(&mut self, run: Option<&Run<'_>>, now: f64) {
        self.images_per_hour = run.and_then(Run::images_per_hour);
        self.last_s = run.filter(|run| run.last > 0.0).map(|run| (now - run.last).max(0.0));
        self.left_s = left(self.images - self.done, self.images_per_hour);
        self.state = match run.map(|run| run.state(now)) {
            _ if self.done == self.images => State::Done,
            None | Some(State::Done) => State::Missing,
            Some(state) => state,
        };
    }
}

/// One run, as far as its file tells.
struct Run<'a> {
    shard: Option<(u64, u64)>,
    images: Vec<&'a ImageTiming>,
    began: Option<f64>,
    end: Option<End>,
    core_s: Option<f64>,
    peak_bytes: Option<u64>,
    /// When it last told something, seconds since 1970; 0 in files of before.
    last: f64,
}

impl<'a> Run<'a> {
    fn of(log: &'a RunLog) -> Self {
        let last = log.rows.iter().filter_map(Row::time).fold(0.0, f64::max);
        let mut run =
            Self { shard: log.shard, images: Vec::new(), began: None, end: None, core_s: None, peak_bytes: None, last };
        for row in &log.rows {
            match row {
                Row::Image(image) => run.images.push(image),
                Row::Failure(_) => {}
                Row::Began(began) => run.began = Some(began.began_s),
                Row::Ended(ended) => {
                    (run.end, run.core_s, run.peak_bytes) = (Some(ended.end), ended.cpu_s, ended.peak_bytes);
                }
            }
        }
        run
    }

    /// Seconds from its beginning to its last image; of a file of before, from how long its images took.
    fn seconds(&self) -> f64 {
        let done = self.images.iter().filter_map(|image| image.done_s).fold(0.0, f64::max);
        match self.began {
            Some(began) => done - began,
            None => self.images.iter().map(|image| image.seconds / image.at_once.max(1) as f64).sum(),
        }
    }

    fn images_per_hour(&self) -> Option<f64> {
        per_hour(self.images.len(), self.seconds())
    }

    fn state(&self, now: f64) -> State {
        let slowest = self.images.iter().map(|image| image.seconds).fold(0.0, f64::max);
        match (self.end, self.began) {
            (Some(End::Done), _) => State::Done,
            (Some(End::Stopped), _) => State::Stopped,
            (Some(End::Failed), _) => State::Failed,
            (None, Some(_)) if now - self.last <= SILENT_SECONDS.max(SILENT_IMAGES * slowest) => State::Working,
            (None, Some(_)) => State::Silent,
            // Of before: nothing tells whether it goes on.
            (None, None) => State::Missing,
        }
    }
}

fn per_hour(images: usize, seconds: f64) -> Option<f64> {
    (images > 0 && seconds > 0.0).then(|| 3600.0 * images as f64 / seconds)
}

/// Seconds for so many images.
fn left(images: u64, per_hour: Option<f64>) -> Option<f64> {
    if images == 0 { Some(0.0) } else { per_hour.map(|rate| 3600.0 * images as f64 / rate) }
}

/// How many runs work, and how many images they make in an hour together; where none does, how many one of those before made.
fn rate(runs: &[Run<'_>], now: f64) -> (usize, Option<f64>) {
    let working: Vec<&Run<'_>> = runs.iter().filter(|run| run.state(now) == State::Working).collect();
    let together: f64 = working.iter().filter_map(|run| run.images_per_hour()).sum();
    if together > 0.0 {
        return (working.len(), Some(together));
    }
    let made = runs.iter().map(|run| run.images.len()).sum();
    (working.len(), per_hour(made, runs.iter().map(Run::seconds).filter(|seconds| *seconds > 0.0).sum()))
}

/// Into how many shards the run that told something last cuts the dataset.
fn last_shards(runs: &[Run<'_>]) -> u64 {
    let last = runs.iter().filter(|run| run.shard.is_some()).max_by(|a, b| a.last.total_cmp(&b.last));
    last.and_then(|run| run.shard).map_or(1, |(_, of)| of)
}

/// How many images of a dataset are there.
pub(crate) fn images_there(set: &Set) -> Result<usize> {
    Ok(there(set, &AtomicBool::new(false))?.into_iter().filter(|there| *there).count())
}

/// Of each image, whether it is there.
fn there(set: &Set, stop: &AtomicBool) -> Result<Vec<bool>> {
    let freed = push::freed(set);
    let look = |index: u64| {
        if stop.load(Ordering::Relaxed) {
            return Err(Error::stopped("stopped looking; nothing was changed"));
        }
        let Some(checksums) = set.checksums(index) else { return Ok(false) };
        let is_there = || has_files(set, &checksums) || freed.contains(&Unit::of(set, index).name());
        Ok(remaining(set, &checksums)? == Task::Done && is_there())
    };
    in_parallel(0..set.recipe.count, look).collect()
}

/// Whether the files that checksums name are there, as long as they say.
fn has_files(set: &Set, checksums: &ChecksumRecord) -> bool {
    checksums
        .files
        .iter()
        .all(|(path, sum)| below(&set.folder, path).is_ok() && set.length(path).is_ok_and(|length| length == sum.bytes))
}

/// What each image last failed of.
fn failures(logs: &[RunLog]) -> BTreeMap<u64, &ImageFailure> {
    let mut last: BTreeMap<u64, &ImageFailure> = BTreeMap::new();
    for row in logs.iter().flat_map(|log| &log.rows) {
        if let Row::Failure(failure) = row
            && last.get(&failure.index).is_none_or(|before| before.failed_s <= failure.failed_s)
        {
            last.insert(failure.index, failure);
        }
    }
    last
}

/// The images that took longest; one that was made several times counts by its longest.
fn slowest(set: &Set, logs: &[RunLog]) -> Vec<SlowImage> {
    let mut longest: BTreeMap<u64, &ImageTiming> = BTreeMap::new();
    for row in logs.iter().flat_map(|log| &log.rows) {
        if let Row::Image(image) = row
            && longest.get(&image.index).is_none_or(|before| before.seconds < image.seconds)
        {
            longest.insert(image.index, image);
        }
    }
    let mut all: Vec<&ImageTiming> = longest.into_values().collect();
    all.sort_by(|a, b| b.seconds.total_cmp(&a.seconds));
    let told = all.into_iter().take(MOST_SLOW).map(|image| SlowImage {
        index: image.index,
        seconds: image.seconds,
        grow_s: image.grow_s,
        draw_s: image.draw_s,
        label_s: image.label_s,
        plants: set.record(image.index).ok().map(|record| record.plants.len()),
    });
    told.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::make::timing_log::{Began, Ended};

    fn image(index: u64, seconds: f64, done_s: Option<f64>) -> Row {
        let (image, grow_s, draw_s, label_s) = (String::new(), 0.0, seconds, 0.0);
        Row::Image(ImageTiming { index, image, seconds, grow_s, draw_s, label_s, at_once: 2, threads: 2, done_s })
    }

    fn log(shard: (u64, u64), rows: Vec<Row>) -> RunLog {
        RunLog { shard: Some(shard), rows }
    }

    fn began(began_s: f64) -> Row {
        Row::Began(Began { began_s, images: 9, at_once: 2, threads: 2 })
    }

    /// Expected: images over seconds from the beginning to the last image; of a file without times, from the seconds of its images.
    #[test]
    fn rates_are_images_over_time() {
        let new = log((0, 2), vec![began(100.0), image(0, 9.0, Some(110.0)), image(2, 9.0, Some(120.0))]);
        let old = log((1, 2), vec![image(1, 9.0, None), image(3, 11.0, None)]);
        let runs = [Run::of(&new), Run::of(&old)];
        let rates: Vec<_> = runs.iter().map(|run| run.images_per_hour().unwrap()).collect();
        assert_eq!(rates, [360.0, 720.0]);
        // One that works decides; without it, both one after the other: four images in 30 seconds.
        assert_eq!(rate(&runs, 130.0), (1, Some(360.0)));
        assert_eq!(rate(&runs, 1e6), (0, Some(480.0)));
        assert_eq!(rate(&[], 0.0), (0, None));
        assert_eq!((left(10, Some(360.0)), left(10, None), left(0, None)), (Some(100.0), None, Some(0.0)));
    }

    #[test]
    fn a_run_that_tells_nothing_for_long_is_silent() {
        let state = |rows, now| Run::of(&log((0, 1), rows)).state(now);
        assert_eq!(state(vec![began(100.0)], 399.0), State::Working);
        assert_eq!(state(vec![began(100.0)], 401.0), State::Silent);
        let slow = vec![began(100.0), image(0, 100.0, Some(200.0))];
        assert_eq!((state(slow.clone(), 1199.0), state(slow, 1201.0)), (State::Working, State::Silent));
        let ended = Row::Ended(Ended { ended_s: 120.0, end: End::Stopped, cpu_s: None, peak_bytes: None });
        assert_eq!(state(vec![began(100.0), ended], 1e6), State::Stopped);
    }

    #[test]
    fn the_last_failure_and_the_longest_time_of_an_image_are_told() {
        let failure = |error: &str, failed_s| Row::Failure(ImageFailure { index: 3, error: error.into(), failed_s });
        let logs = [log((0, 1), vec![failure("late", 7.0)]), log((0, 1), vec![failure("early", 5.0)])];
        let told: Vec<&str> = failures(&logs).into_values().map(|failure| failure.error.as_str()).collect();
        assert_eq!(told, ["late"]);
        let runs = [log((0, 3), vec![began(9.0)]), log((0, 8), vec![began(8.0)])];
        let runs: Vec<Run<'_>> = runs.iter().map(Run::of).collect();
        assert_eq!((last_shards(&runs), last_shards(&[])), (3, 1));
    }
}
