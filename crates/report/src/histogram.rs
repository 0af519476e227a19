//! Histograms, and the distance between two distributions.
//!
//! The distance is the 1-D Wasserstein (earth mover's) distance of order 1, W₁ = ∫ |F(x) − G(x)| dx with the cumulative
//! distributions F and G: the mean distance that values must move to turn one distribution into the other, in the unit
//! of the values. Source: Vallender 1974, "Calculation of the Wasserstein Distance between Probability Distributions on
//! the Line".

use furrow_base::math::{RoundTo, ToFloat};

/// Assignment of values to bins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bins {
    /// `count` bins of equal width; bin k is [`from` + k `width`, `from` + (k + 1) `width`). A value less than `slack`
    /// bin widths below an edge is counted above it, because decimal numbers are seldom exactly on an edge.
    Linear {
        /// Start of the first bin.
        from: f64,
        /// Width of a bin.
        width: f64,
        /// Number of bins.
        count: usize,
        /// Tolerance as a fraction of the bin width, 0 or more.
        slack: f64,
    },
    /// `count` logarithmic bins; bin k is [2^(k / 4), 2^((k + 1) / 4)), for sizes from 1 over orders of magnitude.
    Logarithmic {
        /// Number of bins.
        count: usize,
    },
}

/// Number of logarithmic bins per doubling.
const PER_DOUBLING: f64 = 4.0;

/// Tolerance for decimal numbers: 0.6 counts as 3 × 0.2 whatever its last bit.
pub(super) const DECIMALS: f64 = 5e-4;

impl Bins {
    /// `count` bins of equal width from `from` to `to`.
    pub fn between(from: f64, to: f64, count: usize) -> Self {
        Self::Linear { from, width: (to - from) / count.to_f64(), count, slack: 0.0 }
    }

    /// Number of bins.
    pub fn count(&self) -> usize {
        match self {
            Self::Linear { count, .. } | Self::Logarithmic { count } => *count,
        }
    }

    /// Returns the bin of a value. Values outside all bins, and NaN, are counted in the first or last bin.
    fn place(&self, value: f64) -> usize {
        let place = match self {
            Self::Linear { from, width, slack, .. } => (value - from) / width + slack,
            Self::Logarithmic { .. } => value.max(1.0).log2() * PER_DOUBLING + DECIMALS,
        };
        place.max(0.0).trunc_to::<usize>().min(self.count() - 1)
    }

    /// Returns the start of bin number `place`. Bin 0 starts at 0, or at 1 for logarithmic bins.
    pub(super) fn edge(&self, place: i64) -> f64 {
        match self {
            Self::Linear { width, .. } => place.to_f64() * width,
            Self::Logarithmic { .. } => (place.to_f64() / PER_DOUBLING).exp2(),
        }
    }

    /// Returns the number of the first bin, as [`edge`](Self::edge) counts.
    pub(super) fn first(&self) -> i64 {
        match self {
            Self::Linear { from, width, .. } => (from / width).round_to::<i64>(),
            Self::Logarithmic { .. } => 0,
        }
    }
}

/// A histogram.
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    /// The bins.
    pub bins: Bins,
    /// Number of values in each bin.
    pub counts: Vec<u64>,
}

impl Histogram {
    /// Builds an empty histogram.
    pub fn new(bins: Bins) -> Self {
        Self { bins, counts: vec![0; bins.count()] }
    }

    /// Counts a value.
    pub fn add(&mut self, value: f64) {
        self.counts[self.bins.place(value)] += 1;
    }

    /// Adds the counts of another histogram with the same bins.
    pub fn merge(&mut self, other: &Self) {
        for (count, more) in self.counts.iter_mut().zip(&other.counts) {
            *count += more;
        }
    }

    /// Total number of values.
    pub fn total(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// Centre of a bin; the geometric mean of its ends for logarithmic bins.
    pub fn middle(&self, bin: usize) -> f64 {
        match self.bins {
            Bins::Linear { from, width, .. } => from + (bin.to_f64() + 0.5) * width,
            Bins::Logarithmic { .. } => ((bin.to_f64() + 0.5) / PER_DOUBLING).exp2(),
        }
    }

    /// Mean of the values, up to the resolution of the bins; 0 if empty.
    pub fn mean(&self) -> f64 {
        let sum: f64 = self.counts.iter().enumerate().map(|(bin, n)| self.middle(bin) * n.to_f64()).sum();
        sum / self.total().max(1).to_f64()
    }

    /// Standard deviation of the values, up to the resolution of the bins; 0 if empty.
    pub fn deviation(&self) -> f64 {
        let mean = self.mean();
        let square = |(bin, n): (usize, &u64)| (self.middle(bin) - mean).powi(2) * n.to_f64();
        (self.counts.iter().enumerate().map(square).sum::<f64>() / self.total().max(1).to_f64()).sqrt()
    }

    /// W₁ distance to another histogram with the same bins, in the unit of the values, or in bins if logarithmic.
    /// Neither may be empty.
    pub fn distance(&self, other: &Self) -> f64 {
        let (all, others) = (self.total().to_f64(), other.total().to_f64());
        let (mut sum, mut f, mut g) = (0.0, 0, 0);
        for (a, b) in self.counts.iter().zip(&other.counts) {
            f += a;
            g += b;
            sum += (f.to_f64() / all - g.to_f64() / others).abs();
        }
        match self.bins {
            Bins::Linear { width, .. } => sum * width,
            Bins::Logarithmic { .. } => sum,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_beyond_the_ends_are_held_there() {
        let mut h = Histogram::new(Bins::between(0.0, 1.0, 4));
        for v in [-7.0, f64::NAN, f64::NEG_INFINITY, 0.3, 1.0, 9.0] {
            h.add(v);
        }
        assert_eq!(h.counts, [3, 1, 0, 2]);
    }

    #[test]
    fn moved_values_are_as_far_as_they_moved() {
        let values = [3.0, -1.0, 4.0, 1.0, 5.0];
        let histogram = |by: f64| {
            let mut h = Histogram::new(Bins::between(-10.0, 10.0, 200));
            for v in values {
                h.add(v + 0.05 + by);
            }
            h
        };
        assert!((histogram(0.0).distance(&histogram(2.5)) - 2.5).abs() < 1e-9);
        assert!((histogram(0.0).mean() - 2.45).abs() < 0.1);
        assert_eq!(histogram(1.0).distance(&histogram(1.0)), 0.0);
    }
}
