//! Progress of a dataset, computed from the files in its folder. It is therefore available during runs, after a kill,
//! and on any machine that can read the folder.
//!
//! An image counts as complete if the files of its checksum record exist and have the recorded lengths;
//! [`verify`](crate::verify()) also checks their contents.

use crate::make::push::{self, Unit};
use crate::make::task::{Task, remaining};
use crate::make::timing_log::{self, End, ImageFailure, ImageTiming, Row, RunLog};
use crate::model::recipe::compact;
use crate::read::checksum_record::ChecksumRecord;
use crate::read::set::{Set, in_parallel};
use furrow_base::input::below;
use furrow_base::math::{ToFloat, ToInt};
use furrow_base::{Error, Result};
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};

/// Number of images that are listed as the slowest.
const MOST_SLOW: usize = 5;
/// A run without an end row is silent after a pause in its log of this multiple of its slowest image's time …
const SILENT_IMAGES: f64 = 10.0;
/// … and of at least this number of seconds.
const SILENT_SECONDS: f64 = 300.0;

/// Progress of a dataset.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Status {
    /// Number of images of the complete dataset.
    pub images: u64,
    /// Number of complete images.
    pub done: u64,
    /// Number of runs that have started, have not ended and are not silent.
    pub working: usize,
    /// Images per hour of all working runs together; if no run is working, the mean rate of a single earlier run.
    pub images_per_hour: Option<f64>,
    /// Estimated seconds until all images are complete: of the slowest shard if all incomplete shards are working, or
    /// else at `images_per_hour`.
    pub left_s: Option<f64>,
    /// Total core seconds of the ended runs that recorded them.
    pub core_s: f64,
    /// Largest peak memory of a run's process, bytes, if any run recorded it.
    pub peak_bytes: Option<u64>,
    /// Status of each shard.
    pub shards: Vec<ShardStatus>,
    /// The slowest images.
    pub slowest: Vec<SlowImage>,
    /// Missing images whose last attempt failed.
    pub failures: Vec<FailedImage>,
}

/// Progress of a shard.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ShardStatus {
    /// Number of the shard, from 0.
    pub number: u64,
    /// Number of images of the complete shard.
    pub images: u64,
    /// Number of complete images.
    pub done: u64,
    /// Number of missing images whose last attempt failed.
    pub failed: u64,
    /// State of its last run.
    pub state: State,
    /// Images per hour of its last run.
    pub images_per_hour: Option<f64>,
    /// Estimated seconds until all images are complete at that rate.
    pub left_s: Option<f64>,
    /// Seconds since the last entry in its last run's log.
    pub last_s: Option<f64>,
}

/// State of a shard, from its images and the log of its last run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// All images are complete.
    Done,
    /// The run is making images.
    Working,
    /// The run has no end row and has logged nothing for a long time: it may have been killed.
    Silent,
    /// The run was stopped.
    Stopped,
    /// The run has ended, and some images could not be made.
    Failed,
    /// Images are missing, and the shard has no run, or its last run ended without an error.
    Missing,
}

/// One of the slowest images.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SlowImage {
    /// Index of the image.
    pub index: u64,
    /// Total seconds.
    pub seconds: f64,
    /// Seconds of scene construction.
    pub grow_s: f64,
    /// Seconds of rendering.
    pub draw_s: f64,
    /// Seconds of labelling.
    pub label_s: f64,
    /// Number of plants in view, visible or occluded; `None` if its record cannot be read.
    pub plants: Option<usize>,
}

/// An image that could not be made.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FailedImage {
    /// Index of the image.
    pub index: u64,
    /// The shard that it belongs to.
    pub shard: u64,
    /// The error message.
    pub error: String,
}

impl Status {
    /// Computes the progress of a dataset of `shards` shards; `None` takes the number of shards of its last run.
    /// Raising `stop` ends it with an error.
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
        // Shards beyond the number of images are empty; without the limit a huge number would exhaust memory.
        let mut all: Vec<ShardStatus> = (0..of.min(set.recipe.count.max(1))).map(ShardStatus::empty).collect();
        for (index, done) in (0..).zip(&there) {
            if let Some(shard) = all.get_mut(shard_of(index).to_usize()) {
                shard.images += 1;
                shard.done += u64::from(*done);
            }
        }
        for shard in &mut all {
            shard.failed = failures.iter().filter(|failure| failure.shard == shard.number).count().to_u64();
            let own = runs.iter().filter(|run| run.shard == Some((shard.number, of)));
            shard.follow(own.max_by(|a, b| a.last.total_cmp(&b.last)), now);
        }
        let done = there.iter().filter(|done| **done).count().to_u64();
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

    /// Returns `true` if all images are complete.
    pub fn is_done(&self) -> bool {
        self.done == self.images
    }

    /// Returns the status as one line of JSON.
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

    /// Sets rate, times and state from the log of its last run.
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

/// Summary of a run's log.
struct Run<'a> {
    shard: Option<(u64, u64)>,
    images: Vec<&'a ImageTiming>,
    began: Option<f64>,
    end: Option<End>,
    core_s: Option<f64>,
    peak_bytes: Option<u64>,
    /// Time of its last row, seconds since 1970; 0 in logs of older versions, which have no times.
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
                Row::RunStart(began) => run.began = Some(began.began_s),
                Row::RunEnd(ended) => {
                    (run.end, run.core_s, run.peak_bytes) = (Some(ended.end), ended.cpu_s, ended.peak_bytes);
                }
            }
        }
        run
    }

    /// Returns the seconds from its start to its last image. For logs of older versions, they are estimated from the
    /// images' times.
    fn seconds(&self) -> f64 {
        let done = self.images.iter().filter_map(|image| image.done_s).fold(0.0, f64::max);
        match self.began {
            Some(began) => done - began,
            None => self.images.iter().map(|image| image.seconds / image.at_once.max(1).to_f64()).sum(),
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
            // A log of an older version does not show whether the run is still working.
            (None, None) => State::Missing,
        }
    }
}

fn per_hour(images: usize, seconds: f64) -> Option<f64> {
    (images > 0 && seconds > 0.0).then(|| 3600.0 * images.to_f64() / seconds)
}

/// Returns the seconds for `images` images at a rate per hour.
fn left(images: u64, per_hour: Option<f64>) -> Option<f64> {
    if images == 0 { Some(0.0) } else { per_hour.map(|rate| 3600.0 * images.to_f64() / rate) }
}

/// Returns the number of working runs and their images per hour together; if none is working, the mean rate of a single
/// earlier run.
fn rate(runs: &[Run<'_>], now: f64) -> (usize, Option<f64>) {
    let working: Vec<&Run<'_>> = runs.iter().filter(|run| run.state(now) == State::Working).collect();
    let together: f64 = working.iter().filter_map(|run| run.images_per_hour()).sum();
    if together > 0.0 {
        return (working.len(), Some(together));
    }
    let made = runs.iter().map(|run| run.images.len()).sum();
    (working.len(), per_hour(made, runs.iter().map(Run::seconds).filter(|seconds| *seconds > 0.0).sum()))
}

/// Returns the number of shards of the run with the latest log row; 1 if there is none.
fn last_shards(runs: &[Run<'_>]) -> u64 {
    let last = runs.iter().filter(|run| run.shard.is_some()).max_by(|a, b| a.last.total_cmp(&b.last));
    last.and_then(|run| run.shard).map_or(1, |(_, of)| of)
}

/// Returns the number of complete images of a dataset.
pub(crate) fn images_there(set: &Set) -> Result<usize> {
    Ok(there(set, &AtomicBool::new(false))?.into_iter().filter(|there| *there).count())
}

/// Returns for each image whether it is complete.
fn there(set: &Set, stop: &AtomicBool) -> Result<Vec<bool>> {
    let freed = push::freed(set);
    let look = |index: u64| {
        if stop.load(Ordering::Relaxed) {
            return Err(Error::stopped("stopped reading the dataset; nothing was changed"));
        }
        let Some(checksums) = set.checksums(index) else { return Ok(false) };
        let is_there = || has_files(set, &checksums) || freed.contains(&Unit::of(set, index).name());
        Ok(remaining(set, &checksums)? == Task::Done && is_there())
    };
    in_parallel(0..set.recipe.count, look).collect()
}

/// Returns `true` if all files of a checksum record exist with the recorded lengths.
fn has_files(set: &Set, checksums: &ChecksumRecord) -> bool {
    checksums
        .files
        .iter()
        .all(|(path, sum)| below(&set.folder, path).is_ok() && set.length(path).is_ok_and(|length| length == sum.bytes))
}

/// Returns the last failure of each image, by index.
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

/// Returns the images with the longest times; for an image that was made several times, the longest one counts.
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
    let slow_images = all.into_iter().take(MOST_SLOW).map(|image| SlowImage {
        index: image.index,
        seconds: image.seconds,
        grow_s: image.grow_s,
        draw_s: image.draw_s,
        label_s: image.label_s,
        plants: set.record(image.index).ok().map(|record| record.plants.len()),
    });
    slow_images.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::make::timing_log::{RunEnd, RunStart};

    fn image(index: u64, seconds: f64, done_s: Option<f64>) -> Row {
        let (image, grow_s, draw_s, label_s) = (String::new(), 0.0, seconds, 0.0);
        Row::Image(ImageTiming { index, image, seconds, grow_s, draw_s, label_s, at_once: 2, threads: 2, done_s })
    }

    fn log(shard: (u64, u64), rows: Vec<Row>) -> RunLog {
        RunLog { shard: Some(shard), rows }
    }

    fn began(began_s: f64) -> Row {
        Row::RunStart(RunStart { began_s, images: 9, at_once: 2, threads: 2 })
    }

    /// Expected: the rate is images divided by the seconds from the start to the last image; for a log without times,
    /// the seconds are those of its images.
    #[test]
    fn rates_are_images_over_time() {
        let new = log((0, 2), vec![began(100.0), image(0, 9.0, Some(110.0)), image(2, 9.0, Some(120.0))]);
        let old = log((1, 2), vec![image(1, 9.0, None), image(3, 11.0, None)]);
        let runs = [Run::of(&new), Run::of(&old)];
        let rates: Vec<_> = runs.iter().map(|run| run.images_per_hour().unwrap()).collect();
        assert_eq!(rates, [360.0, 720.0]);
        // Only the working run counts; if none is working, both count one after the other: four images in 30 seconds.
        assert_eq!(rate(&runs, 130.0), (1, Some(360.0)));
        assert_eq!(rate(&runs, 1e6), (0, Some(480.0)));
        assert_eq!(rate(&[], 0.0), (0, None));
        assert_eq!((left(10, Some(360.0)), left(10, None), left(0, None)), (Some(100.0), None, Some(0.0)));
    }

    #[test]
    fn a_run_without_log_rows_for_long_is_silent() {
        let state = |rows, now| Run::of(&log((0, 1), rows)).state(now);
        assert_eq!(state(vec![began(100.0)], 399.0), State::Working);
        assert_eq!(state(vec![began(100.0)], 401.0), State::Silent);
        let slow = vec![began(100.0), image(0, 100.0, Some(200.0))];
        assert_eq!((state(slow.clone(), 1199.0), state(slow, 1201.0)), (State::Working, State::Silent));
        let ended = Row::RunEnd(RunEnd {
            ended_s: 120.0,
            end: End::Stopped,
            cpu_s: None,
            peak_bytes: None,
            profile: Vec::new(),
        });
        assert_eq!(state(vec![began(100.0), ended], 1e6), State::Stopped);
    }

    #[test]
    fn the_last_failure_and_the_longest_time_of_an_image_are_reported() {
        let failure = |error: &str, failed_s| Row::Failure(ImageFailure { index: 3, error: error.into(), failed_s });
        let logs = [log((0, 1), vec![failure("late", 7.0)]), log((0, 1), vec![failure("early", 5.0)])];
        let messages: Vec<&str> = failures(&logs).into_values().map(|failure| failure.error.as_str()).collect();
        assert_eq!(messages, ["late"]);
        let runs = [log((0, 3), vec![began(9.0)]), log((0, 8), vec![began(8.0)])];
        let runs: Vec<Run<'_>> = runs.iter().map(Run::of).collect();
        assert_eq!((last_shards(&runs), last_shards(&[])), (3, 1));
    }
}
