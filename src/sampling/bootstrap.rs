//! How far a number of some images would stray on others of the same kind: percentile intervals of the bootstrap.
//!
//! Images, not pixels, are drawn with replacement, as many as there are; the 2.5th and 97.5th percentile of what 1000 such draws score
//! bound the interval. Source: Efron & Tibshirani 1993, "An Introduction to the Bootstrap", §13.3.

use super::rng::{Purpose, Stream};
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

/// Intervals of what `scores` says of a draw of `count` images, given by their places from 0, in its order. Of each score those resamples
/// count in which it is of something; `None` where these are fewer than half, and of fewer than two images. The same `seed` gives the same
/// resamples.
pub fn intervals(
    count: usize,
    seed: u64,
    mut scores: impl FnMut(&[usize]) -> Vec<Option<f64>>,
) -> Vec<Option<Interval>> {
    let all: Vec<usize> = (0..count).collect();
    let mut drawn: Vec<Vec<f64>> = vec![Vec::new(); scores(&all).len()];
    if count < 2 {
        return vec![None; drawn.len()];
    }
    for resample in 0..RESAMPLES {
        let mut stream = Stream::of(seed, 0, Purpose::Resample, resample);
        let places: Vec<usize> = all.iter().map(|_| stream.index(count)).collect();
        for (values, score) in drawn.iter_mut().zip(scores(&places)) {
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
