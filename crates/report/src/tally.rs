//! Memory-efficient statistics of a stream of values: a histogram with exact mean and range.

use super::histogram::{Bins, DECIMALS, Histogram};
use furrow_base::math::{RoundTo, ToFloat, ToInt};

/// Minimum and maximum number of bars in a chart whose values spread over enough bins.
const BARS: (f64, f64) = (10.0, 24.0);
/// Number of bins for counts of objects: a hectare of sugar beet has about 100,000 plants.
const THINGS: usize = 1 << 18;
/// Number of bins for sizes: pixel counts have 32 bits.
const SIZES: usize = 128;

/// Histogram of values, with their exact number, mean, minimum and maximum.
#[derive(Clone, Debug, PartialEq)]
pub struct Tally {
    histogram: Histogram,
    n: u64,
    sum: f64,
    least: f64,
    most: f64,
}

/// A bar of a chart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bar {
    /// Start of its interval.
    pub from: f64,
    /// End of its interval.
    pub to: f64,
    /// Number of values.
    pub count: u64,
}

impl Tally {
    /// For values from `from` to `to` with bins of `width`; both must be multiples of `width`. Values outside are
    /// counted in the first or last bin, but mean and range remain exact.
    pub fn linear(from: f64, to: f64, width: f64) -> Self {
        Self::new(Bins::Linear { from, width, count: ((to - from) / width).round_to::<usize>(), slack: DECIMALS })
    }

    /// For counts of objects, with one bin per count up to 262,143.
    pub fn whole() -> Self {
        Self::linear(0.0, THINGS.to_f64(), 1.0)
    }

    /// For percentages; 100 is counted in the last bin.
    pub fn percents() -> Self {
        Self::linear(0.0, 100.0, 0.2)
    }

    /// For sizes from 1 over orders of magnitude.
    pub fn sizes() -> Self {
        Self::new(Bins::Logarithmic { count: SIZES })
    }

    fn new(bins: Bins) -> Self {
        Self { histogram: Histogram::new(bins), n: 0, sum: 0.0, least: f64::INFINITY, most: f64::NEG_INFINITY }
    }

    /// Adds a value. Values that are not finite are ignored.
    pub fn add(&mut self, value: f64) {
        if !value.is_finite() {
            return;
        }
        self.histogram.add(value);
        self.n += 1;
        self.sum += value;
        self.least = self.least.min(value);
        self.most = self.most.max(value);
    }

    /// Number of values.
    pub fn n(&self) -> u64 {
        self.n
    }

    /// Mean of the values; 0 if empty.
    pub fn mean(&self) -> f64 {
        if self.n == 0 { 0.0 } else { self.sum / self.n.to_f64() }
    }

    /// Minimum and maximum of the values.
    pub fn range(&self) -> Option<(f64, f64)> {
        (self.n > 0).then_some((self.least, self.most))
    }

    /// Returns `true` if the bins are whole counts.
    pub(super) fn is_whole(&self) -> bool {
        matches!(self.histogram.bins, Bins::Linear { width: 1.0, .. })
    }

    /// Returns `true` if the axis is logarithmic.
    pub(super) fn is_logarithmic(&self) -> bool {
        matches!(self.histogram.bins, Bins::Logarithmic { .. })
    }

    /// Returns the numbers of the first and last nonempty bin.
    fn places(&self) -> Option<(i64, i64)> {
        let counts = &self.histogram.counts;
        let (first, last) = (counts.iter().position(|n| *n > 0)?, counts.iter().rposition(|n| *n > 0)?);
        let begin = self.histogram.bins.first();
        Some((begin + first.to_i64(), begin + last.to_i64()))
    }

    /// Returns the number of values in bins `from..to`.
    fn between(&self, from: i64, to: i64) -> u64 {
        let begin = self.histogram.bins.first();
        let index = |place: i64| (place - begin).clamp(0, self.histogram.counts.len().to_i64()).to_usize();
        self.histogram.counts[index(from)..index(to)].iter().sum()
    }

    /// Returns bars with common bins for charts to be compared, one list per tally. All tallies must have the same kind
    /// of bins. The lists are empty if there are no values.
    pub fn bars(all: &[&Self]) -> Vec<Vec<Bar>> {
        let ends = || all.iter().filter_map(|tally| tally.places());
        let (Some(first), Some(last)) = (ends().map(|e| e.0).min(), ends().map(|e| e.1).max()) else {
            return vec![Vec::new(); all.len()];
        };
        // Few values are shown with few bars. Source: Rice's rule, 2 n^(1/3).
        let n = all.iter().map(|tally| tally.n).max().unwrap_or(0).to_f64();
        let most = (2.0 * n.cbrt()).clamp(BARS.0, BARS.1).trunc_to::<i64>();
        let factor = factors(all[0].is_logarithmic())
            .find(|f| last.div_euclid(*f) - first.div_euclid(*f) < most)
            .unwrap_or(i64::MAX);
        let (from, to) = (first.div_euclid(factor), last.div_euclid(factor));
        let bar = |tally: &Self, k: i64| {
            let (begin, end) = (k * factor, (k + 1) * factor);
            let edge = |place| tally.histogram.bins.edge(place);
            Bar { from: edge(begin), to: edge(end), count: tally.between(begin, end) }
        };
        all.iter().map(|tally| (from..=to).map(|k| bar(tally, k)).collect()).collect()
    }
}

/// Possible bar widths in bins: 1, 2, 5, 10, … for linear bins, so that bars end at round numbers; whole doublings for
/// logarithmic bins.
fn factors(logarithmic: bool) -> Box<dyn Iterator<Item = i64>> {
    if logarithmic {
        Box::new([4, 8, 16, 32].into_iter())
    } else {
        Box::new((0..12).flat_map(|k| [1, 2, 5].map(|f| f * 10_i64.pow(k))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_value_stands_in_the_bar_that_holds_it(values in prop::collection::vec(0.0..5000.0_f64, 1..200), log in any::<bool>()) {
            let mut tally = if log { Tally::sizes() } else { Tally::linear(0.0, 5000.0, 0.5) };
            for value in &values {
                tally.add(*value);
            }
            let bars = &Tally::bars(&[&tally])[0];
            prop_assert!(bars.len().to_f64() <= BARS.1);
            prop_assert_eq!(bars.iter().map(|b| b.count).sum::<u64>(), values.len().to_u64());
            for bar in bars {
                let slack = 1e-3 * bar.to;
                let held = |low: f64, high: f64| values.iter().map(|v| if log { v.max(1.0) } else { *v }).filter(|v| *v >= low && *v < high).count().to_u64();
                prop_assert!(held(bar.from + slack, bar.to - slack) <= bar.count);
                prop_assert!(bar.count <= held(bar.from - slack, bar.to + slack));
            }
        }
    }

    #[test]
    fn all_of_a_thing_is_the_last_bar_of_its_shares() {
        let mut shares = Tally::percents();
        for k in 0..=1000 {
            shares.add(f64::from(k) / 10.0);
        }
        let bars = &Tally::bars(&[&shares])[0];
        assert_eq!((bars.len(), bars[0].count, bars[9].count), (10, 100, 101));
        assert_eq!((bars[9].from, bars[9].to), (90.0, 100.0));
    }

    #[test]
    fn charts_that_are_compared_have_the_same_bars() {
        let (mut a, mut b) = (Tally::whole(), Tally::whole());
        a.add(3.0);
        b.add(90.0);
        b.add(f64::NAN);
        let bars = Tally::bars(&[&a, &b]);
        assert_eq!(bars[0].len(), bars[1].len());
        assert_eq!((bars[0][0].from, bars[0][0].to), (0.0, 10.0));
        assert_eq!((bars[0][0].count, bars[1].last().unwrap().count), (1, 1));
        assert_eq!((b.n(), b.mean(), b.range()), (1, 90.0, Some((90.0, 90.0))));
    }
}
