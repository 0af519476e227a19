//! How long a run still takes: a field is grown once, however many images are taken of it.
//!
//! The work of a run is the time of its images, one after another. Of it, growing goes with the fields and the rest with the images. Several images
//! are under way at once, so what is left takes as many times the time until now as it is of the work until now.

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Is told of images as they are done, and tells how long all others take.
#[derive(Debug, Default)]
pub struct TimeLeft(Mutex<Option<Run>>);

/// What a run is to do and has done.
#[derive(Clone, Copy, Debug)]
struct Run {
    begin: Instant,
    images: usize,
    /// Times that a field is to grow.
    growings: usize,
    done: usize,
    grown: usize,
    /// Seconds that images took, one after another.
    work_s: f64,
    /// Of them, growing.
    grow_s: f64,
}

impl TimeLeft {
    /// From now on so many images are made, for which a field grows so many times.
    pub(crate) fn expect(&self, images: usize, growings: usize) {
        let run = Run { begin: Instant::now(), images, growings, done: 0, grown: 0, work_s: 0.0, grow_s: 0.0 };
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(run);
    }

    /// An image is there; of the seconds that it took, its field grew so long, which is nothing where it was grown before.
    pub(crate) fn add(&self, seconds: f64, grow: Duration) {
        if let Some(run) = self.0.lock().unwrap_or_else(PoisonError::into_inner).as_mut() {
            run.add(seconds, grow);
        }
    }

    /// Until all images are there; `None` before the first.
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

    /// Seconds until all images are there, of a run that has worked for so many.
    fn left(&self, elapsed_s: f64) -> Option<f64> {
        if self.done == 0 || self.work_s <= 0.0 {
            return None;
        }
        let all = |work_s: f64, done: usize, of: usize| work_s * of.saturating_sub(done) as f64 / done.max(1) as f64;
        let images = all(self.work_s - self.grow_s, self.done, self.images);
        let growings = all(self.grow_s, self.grown, self.growings);
        Some(elapsed_s * (images + growings) / self.work_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Seconds that are left of so many images of fields that grow so many times, once these are done: the seconds of each, and of them growing.
    fn left(images: usize, growings: usize, elapsed_s: f64, done: &[(f64, u64)]) -> Option<f64> {
        let mut run = Run { begin: Instant::now(), images, growings, done: 0, grown: 0, work_s: 0.0, grow_s: 0.0 };
        for (seconds, grow) in done {
            run.add(*seconds, Duration::from_secs(*grow));
        }
        run.left(elapsed_s)
    }

    /// Rationale: the first frame of a drive waits a minute for its field, all others do not. Expected: a field of 60 s and frames of 5 s are told as
    /// what they take, from the first frame on, of one field, of two, and of two at once; where each image has its own field it is the mean of all.
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
            // Formats of images that are there.
            (10, 0, 10.0, &[next, next], 8.0 * 5.0),
            (2, 1, 70.0, &[first, next], 0.0),
        ] {
            let told = left(images, growings, elapsed_s, done).expect("some are done");
            assert!((told - expected).abs() < 1e-9, "{told} instead of {expected} after {done:?}");
        }
        assert_eq!(left(24, 1, 65.0, &[]), None);
    }

    #[test]
    fn nothing_is_told_before_the_first_image() {
        let time = TimeLeft::default();
        time.add(1.0, Duration::ZERO);
        assert_eq!(time.left(), None);
        time.expect(1, 1);
        assert_eq!(time.left(), None);
        time.add(1.0, Duration::from_millis(500));
        assert_eq!(time.left(), Some(Duration::ZERO));
    }
}
