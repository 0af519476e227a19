//! Distributions of many values, and how far one is from another.
//!
//! The distance is the 1-D Wasserstein (earth mover's) distance of order 1, W₁ = ∫ |F(x) − G(x)| dx with F and G the cumulative shares: by
//! how much values must move on average to make one of the other, in the values' own unit. Source: Vallender 1974, "Calculation of the
//! Wasserstein Distance between Probability Distributions on the Line".

/// Counts of values in bins of one width.
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    /// Where the first bin begins.
    pub from: f64,
    /// Width of a bin.
    pub step: f64,
    /// Values in each bin; what lies outside is in the first or the last.
    pub counts: Vec<u64>,
}

impl Histogram {
    /// An empty one of `bins` bins from `from` to `to`.
    pub fn new(from: f64, to: f64, bins: usize) -> Self {
        Self { from, step: (to - from) / bins as f64, counts: vec![0; bins] }
    }

    /// Counts a value; one that is no number lies in the first bin.
    pub fn add(&mut self, value: f64) {
        let bin = ((value - self.from) / self.step).max(0.0) as usize;
        let last = self.counts.len() - 1;
        self.counts[bin.min(last)] += 1;
    }

    /// Counts all that another one of the same bins has.
    pub fn merge(&mut self, other: &Self) {
        for (count, more) in self.counts.iter_mut().zip(&other.counts) {
            *count += more;
        }
    }

    /// How many values there are.
    pub fn total(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// Middle of a bin.
    pub fn middle(&self, bin: usize) -> f64 {
        self.from + (bin as f64 + 0.5) * self.step
    }

    /// Mean of the values, as exact as the bins are narrow; 0 of none.
    pub fn mean(&self) -> f64 {
        let sum: f64 = self.counts.iter().enumerate().map(|(bin, n)| self.middle(bin) * *n as f64).sum();
        sum / self.total().max(1) as f64
    }

    /// W₁ to another one of the same bins; neither is empty.
    pub fn distance(&self, other: &Self) -> f64 {
        let (all, others) = (self.total() as f64, other.total() as f64);
        let (mut sum, mut f, mut g) = (0.0, 0, 0);
        for (a, b) in self.counts.iter().zip(&other.counts) {
            f += a;
            g += b;
            sum += (f as f64 / all - g as f64 / others).abs();
        }
        sum * self.step
    }
}

/// W₁ of two sets of values, neither empty; in any order.
pub(super) fn distance(a: &[f64], b: &[f64]) -> f64 {
    let sorted = |values: &[f64]| {
        let mut values = values.to_vec();
        values.sort_by(f64::total_cmp);
        values
    };
    let (a, b) = (sorted(a), sorted(b));
    let (mut i, mut j, mut sum) = (0, 0, 0.0);
    let mut at = a[0].min(b[0]);
    while i < a.len() || j < b.len() {
        let next = match (a.get(i), b.get(j)) {
            (Some(x), Some(y)) => x.min(*y),
            (Some(x), None) | (None, Some(x)) => *x,
            (None, None) => break,
        };
        sum += (i as f64 / a.len() as f64 - j as f64 / b.len() as f64).abs() * (next - at);
        at = next;
        while a.get(i) == Some(&at) {
            i += 1;
        }
        while b.get(j) == Some(&at) {
            j += 1;
        }
    }
    sum
}

/// The value in the middle; of two, their mean. `None` of none.
pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    (n > 0).then(|| 0.5 * (values[(n - 1) / 2] + values[n / 2]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moved_values_are_as_far_as_they_moved() {
        let values = [3.0, -1.0, 4.0, 1.0, 5.0];
        let moved = values.map(|v| v + 2.5);
        assert!((distance(&values, &moved) - 2.5).abs() < 1e-12);
        assert_eq!(distance(&values, &values), 0.0);
        // Half of what lies at 0 goes to 1; how many there are does not matter.
        assert_eq!(distance(&[0.0], &[0.0, 1.0, 0.0, 1.0]), 0.5);
        let histogram = |values: &[f64]| {
            let mut h = Histogram::new(-10.0, 10.0, 200);
            for v in values {
                h.add(v + 0.05);
            }
            h
        };
        assert!((histogram(&values).distance(&histogram(&moved)) - 2.5).abs() < 1e-9);
        assert!((histogram(&values).mean() - 2.45).abs() < 0.1);
    }

    #[test]
    fn values_beyond_the_ends_are_held_there() {
        let mut h = Histogram::new(0.0, 1.0, 4);
        for v in [-7.0, f64::NAN, 0.3, 1.0, 9.0] {
            h.add(v);
        }
        assert_eq!(h.counts, [2, 1, 0, 2]);
    }

    #[test]
    fn medians() {
        assert_eq!(median(vec![5.0, 1.0, 3.0]), Some(3.0));
        assert_eq!(median(vec![4.0, 1.0]), Some(2.5));
        assert_eq!(median(Vec::new()), None);
    }
}
