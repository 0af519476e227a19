//! Percentile bootstrap intervals: how much a score over some images would vary on other images of the same kind.
//!
//! Resamples images, not pixels, with replacement, keeping their number. The 2.5th and 97.5th percentiles of the scores
//! of 1000 resamples bound the interval. Source: Efron & Tibshirani 1993, "An Introduction to the Bootstrap", §13.3.

use super::rng::{Purpose, Stream};
use crate::math::{RoundTo, ToFloat, ToInt};
use serde::{Deserialize, Serialize};

/// Number of resamples.
pub const RESAMPLES: u64 = 1000;
/// Confidence level of the interval.
pub const LEVEL: f64 = 0.95;

/// Confidence interval of a score at [`LEVEL`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Computes intervals of the scores that `scores` returns for a resample, given as `count` image indices from 0. For
/// each score only the resamples in which it is defined are used. An interval is `None` if these are fewer than half,
/// or if there are fewer than two images. The same `seed` gives the same resamples.
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
    if 2 * values.len().to_u64() < RESAMPLES {
        return None;
    }
    values.sort_by(f64::total_cmp);
    let tail = (1.0 - LEVEL) / 2.0;
    Some(Interval { low: quantile(&values, tail), high: quantile(&values, 1.0 - tail) })
}

/// Quantile of sorted values, linear between neighbours. Source: Hyndman & Fan 1996, type 7.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = share * (sorted.len() - 1).to_f64();
    let below = place.floor_to::<usize>();
    let above = (below + 1).min(sorted.len() - 1);
    sorted[below] + (place - below.to_f64()) * (sorted[above] - sorted[below])
}
