//! How far a score would stray on other images of the same kind: percentile intervals of the bootstrap.
//!
//! Images, not pixels, are drawn with replacement, as many as there are; a score is taken of the sum of their matrices; the 2.5th and
//! 97.5th percentile of 1000 such scores bound the interval. Source: Efron & Tibshirani 1993, "An Introduction to the Bootstrap", §13.3.
//! It tells of the images that were tested on, not of another seed of training.

use super::confusion::Confusion;
use crate::sampling::rng::{Purpose, Stream};
use serde::{Deserialize, Serialize};

/// Resamples.
pub const RESAMPLES: u64 = 1000;
/// Share of scores that the interval holds.
pub const LEVEL: f64 = 0.95;

/// Where a score lies with 95 % of confidence.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// From.
    pub low: f64,
    /// To.
    pub high: f64,
}

/// Intervals of the scores that `scores` takes of a matrix, in its order. Of each score those resamples count in which it is of something;
/// `None` where these are fewer than half, and of fewer than two images. The same `seed` gives the same resamples.
pub fn intervals(
    images: &[Confusion],
    seed: u64,
    scores: impl Fn(&Confusion) -> Vec<Option<f64>>,
) -> Vec<Option<Interval>> {
    let Some(first) = images.first() else { return Vec::new() };
    let mut drawn: Vec<Vec<f64>> = vec![Vec::new(); scores(first).len()];
    if images.len() < 2 {
        return vec![None; drawn.len()];
    }
    for resample in 0..RESAMPLES {
        let mut stream = Stream::of(seed, 0, Purpose::Resample, resample);
        let mut sum = Confusion::new(first.classes());
        for _ in images {
            sum.merge(&images[stream.index(images.len())]);
        }
        for (values, score) in drawn.iter_mut().zip(scores(&sum)) {
            values.extend(score);
        }
    }
    drawn.into_iter().map(interval).collect()
}

fn interval(mut values: Vec<f64>) -> Option<Interval> {
    if 2 * (values.len() as u64) < RESAMPLES {
        return None;
    }
    values.sort_by(f64::total_cmp);
    let tail = (1.0 - LEVEL) / 2.0;
    Some(Interval { low: quantile(&values, tail), high: quantile(&values, 1.0 - tail) })
}

/// Quantile of sorted values, linear between neighbours. Source: Hyndman & Fan 1996, type 7.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = share * (sorted.len() - 1) as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(sorted.len() - 1);
    sorted[below] + (place - below as f64) * (sorted[above] - sorted[below])
}
