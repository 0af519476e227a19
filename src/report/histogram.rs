//! Counts of values in bins, and the distance between two distributions.
//!
//! The distance is the 1-D Wasserstein (earth mover's) distance of order 1, W₁ = ∫ |F(x) − G(x)| dx with F and G the cumulative shares: by
//! how much values must move on average to turn one distribution into the other, in the values' own unit. Source: Vallender 1974,
//! "Calculation of the Wasserstein Distance between Probability Distributions on the Line".

/// How values are put into bins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bins {
    /// `count` bins; bin k is [`from` + k `width`, `from` + (k + 1) `width`). A value that lies less than the share `slack` of a bin below
    /// an edge counts as above it: numbers written in decimals seldom lie exactly on one.
    Linear {
        /// Where the first bin begins.
        from: f64,
        /// Width of a bin.
        width: f64,
        /// Number of bins.
        count: usize,
        /// Share of a bin, 0 or more.
        slack: f64,
    },
    /// `count` bins; bin k is [2^(k / 4), 2^((k + 1) / 4)): sizes from 1 on, over orders of magnitude.
    Logarithmic {
        /// Number of bins.
        count: usize,
    },
}

/// Bins of a logarithmic histogram in a doubling.
const PER_DOUBLING: f64 = 4.0;

/// Slack of decimal numbers: 0.6 is the third of 0.2 whatever its last bit says.
pub(super) const DECIMALS: f64 = 5e-4;

impl Bins {
    /// `count` bins of one width from `from` to `to`.
    pub fn between(from: f64, to: f64, count: usize) -> Self {
        Self::Linear { from, width: (to - from) / count as f64, count, slack: 0.0 }
    }

    /// Number of bins.
    pub fn count(&self) -> usize {
        match self {
            Self::Linear { count, .. } | Self::Logarithmic { count } => *count,
        }
    }

    /// The bin of a value; what lies outside of all bins, or is not a number, belongs to the first or the last.
    fn place(&self, value: f64) -> usize {
        let place = match self {
            Self::Linear { from, width, slack, .. } => (value - from) / width + slack,
            Self::Logarithmic { .. } => value.max(1.0).log2() * PER_DOUBLING + DECIMALS,
        };
        (place.max(0.0) as usize).min(self.count() - 1)
    }

    /// Where bin `place` begins, for any place; place 0 is the bin that begins at 0, or at 1 of logarithmic ones.
    pub(super) fn edge(&self, place: i64) -> f64 {
        match self {
            Self::Linear { width, .. } => place as f64 * width,
            Self::Logarithmic { .. } => (place as f64 / PER_DOUBLING).exp2(),
        }
    }

    /// Place of the first bin, as [`edge`](Self::edge) counts them.
    pub(super) fn first(&self) -> i64 {
        match self {
            Self::Linear { from, width, .. } => (from / width).round() as i64,
            Self::Logarithmic { .. } => 0,
        }
    }
}

/// Counts of values in bins.
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    /// The bins.
    pub bins: Bins,
    /// Values in each bin.
    pub counts: Vec<u64>,
}

impl Histogram {
    /// An empty one.
    pub fn new(bins: Bins) -> Self {
        Self { bins, counts: vec![0; bins.count()] }
    }

    /// Counts a value.
    pub fn add(&mut self, value: f64) {
        self.counts[self.bins.place(value)] += 1;
    }

    /// Counts all that another one of the same bins has.
    pub fn merge(&mut self, other: &Self) {
        for (count, more) in self.counts.iter_mut().zip(&other.counts) {
            *count += more;
        }
    }

    /// Number of values.
    pub fn total(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// Middle of a bin: of its ends' logarithms for logarithmic bins.
    pub fn middle(&self, bin: usize) -> f64 {
        match self.bins {
            Bins::Linear { from, width, .. } => from + (bin as f64 + 0.5) * width,
            Bins::Logarithmic { .. } => ((bin as f64 + 0.5) / PER_DOUBLING).exp2(),
        }
    }

    /// Mean of the values, as exact as the bins are narrow; 0 of none.
    pub fn mean(&self) -> f64 {
        let sum: f64 = self.counts.iter().enumerate().map(|(bin, n)| self.middle(bin) * *n as f64).sum();
        sum / self.total().max(1) as f64
    }

    /// Standard deviation of the values, as exact as the bins are narrow; 0 of none.
    pub fn deviation(&self) -> f64 {
        let mean = self.mean();
        let square = |(bin, n): (usize, &u64)| (self.middle(bin) - mean).powi(2) * *n as f64;
        (self.counts.iter().enumerate().map(square).sum::<f64>() / self.total().max(1) as f64).sqrt()
    }

    /// W₁ to another one of the same bins, in the values' unit, of logarithmic bins in bins; neither is empty.
    pub fn distance(&self, other: &Self) -> f64 {
        let (all, others) = (self.total() as f64, other.total() as f64);
        let (mut sum, mut f, mut g) = (0.0, 0, 0);
        for (a, b) in self.counts.iter().zip(&other.counts) {
            f += a;
            g += b;
            sum += (f as f64 / all - g as f64 / others).abs();
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
