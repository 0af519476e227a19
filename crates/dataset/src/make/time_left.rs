//! Remaining-time estimate of a run. Scene construction counts once per field, whatever the number of its images.
//!
//! The work of a run is the sum of its images' times. The part for scene construction is proportional to the number of
//! constructions, the rest to the number of images. Several images are in progress at the same time; therefore
//! remaining time = elapsed time × remaining work / completed work.

use furrow_base::math::ToFloat;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Receives the time of each completed image and estimates the time of the remaining ones.
#[derive(Debug, Default)]
pub struct TimeLeft(Mutex<Option<Run>>);

/// Planned and completed work of a run.
#[derive(Clone, Copy, Debug)]
struct Run {
    begin: Instant,
    images: usize,
    /// Planned number of scene constructions.
    growings: usize,
    done: usize,
    grown: usize,
    /// Sum of the images' times, seconds.
    work_s: f64,
    /// Part of `work_s` for scene construction.
    grow_s: f64,
}

impl TimeLeft {
    /// Starts a run of `images` images with `growings` scene constructions.
    pub(crate) fn expect(&self, images: usize, growings: usize) {
        let run = Run { begin: Instant::now(), images, growings, done: 0, grown: 0, work_s: 0.0, grow_s: 0.0 };
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(run);
    }

    /// Adds a completed image: its time, and the part of it for scene construction, which is zero if the field was
    /// reused.
    pub(crate) fn add(&self, seconds: f64, grow: Duration) {
        if let Some(run) = self.0.lock().unwrap_or_else(PoisonError::into_inner).as_mut() {
            run.add(seconds, grow);
        }
    }

    /// Returns the estimated time until all images are complete; `None` before the first image.
    pub fn left(&self) -> Option<Duration> {
        let run = *self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let left = run.and_then(|run| run.left(run.begin.elapsed().as_secs_f64()))?;
        Duration::try_from_secs_f64(left).ok()
    }
}

impl Run {
    fn add(&mut self, seconds: f64, grow: Duration) {
        self.done += 1;
        self.grown += usize::from(grow > Duration::ZERO);
        self.work_s += seconds;
        self.grow_s += grow.as_secs_f64();
    }

    /// Returns the estimated seconds until all images are complete, after `elapsed_s` seconds of work.
    fn left(&self, elapsed_s: f64) -> Option<f64> {
        if self.done == 0 || self.work_s <= 0.0 {
            return None;
        }
        let all =
            |work_s: f64, done: usize, of: usize| work_s * of.saturating_sub(done).to_f64() / done.max(1).to_f64();
        let images = all(self.work_s - self.grow_s, self.done, self.images);
        let growings = all(self.grow_s, self.grown, self.growings);
        Some(elapsed_s * (images + growings) / self.work_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the estimated remaining seconds of a run with these numbers after the `done` images, given as (seconds,
    /// seconds of scene construction).
    fn left(images: usize, growings: usize, elapsed_s: f64, done: &[(f64, u64)]) -> Option<f64> {
        let mut run = Run { begin: Instant::now(), images, growings, done: 0, grown: 0, work_s: 0.0, grow_s: 0.0 };
        for (seconds, grow) in done {
            run.add(*seconds, Duration::from_secs(*grow));
        }
        run.left(elapsed_s)
    }

    /// Rationale: only the first frame of a drive waits a minute for scene construction. Expected: with 60 s per field
    /// and 5 s per frame, the estimate is exact from the first frame on, for one field, for two, and for two at the
    /// same time; if each image has its own field, the estimate uses the mean of all images.
    #[test]
    fn a_field_grows_once() {
        let (first, next) = ((65.0, 60), (5.0, 0));
        for (images, growings, elapsed_s, done, expected) in [
            (24, 1, 65.0, &[first][..], 23.0 * 5.0),
            (24, 1, 70.0, &[first, next], 22.0 * 5.0),
            (24, 2, 65.0, &[first], 60.0 + 23.0 * 5.0),
            (4, 2, 135.0, &[first, next, first], 5.0),
            // Two workers.
            (24, 2, 65.0, &[first, first], 11.0 * 5.0),
            (10, 10, 130.0, &[first, first], 8.0 * 65.0),
            // Only formats of rendered images are made.
            (10, 0, 10.0, &[next, next], 8.0 * 5.0),
            (2, 1, 70.0, &[first, next], 0.0),
        ] {
            let computed = left(images, growings, elapsed_s, done).expect("some are done");
            assert!((computed - expected).abs() < 1e-9, "{computed} instead of {expected} after {done:?}");
        }
        assert_eq!(left(24, 1, 65.0, &[]), None);
    }

    #[test]
    fn no_time_is_estimated_before_the_first_image() {
        let time = TimeLeft::default();
        time.add(1.0, Duration::ZERO);
        assert_eq!(time.left(), None);
        time.expect(1, 1);
        assert_eq!(time.left(), None);
        time.add(1.0, Duration::from_millis(500));
        assert_eq!(time.left(), Some(Duration::ZERO));
    }
}
