//! How often values lie where, counted one by one in little memory, in whatever order they come.

use std::collections::BTreeMap;

/// Fewest and most bars that a chart is cut into where its values are spread over as many bins.
const BARS: (f64, f64) = (10.0, 24.0);

/// How values are put into bins.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Bins {
    /// Bin k is [k w, (k + 1) w).
    Linear(f64),
    /// Bin k is [2^(k/4), 2^((k+1)/4)): sizes that span orders of magnitude. Values from 1 on.
    Logarithmic,
}

/// Bins of a logarithmic histogram in a doubling.
const PER_DOUBLING: f64 = 4.0;

/// Counts of values by bin, and their number, sum, least and most.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Histogram {
    bins: Bins,
    /// Values from here on fall into the bin below it.
    top: f64,
    counts: BTreeMap<i64, u64>,
    n: u64,
    sum: f64,
    least: f64,
    most: f64,
}

/// A bar of a chart: from, to, how many.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bar {
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) count: u64,
}

impl Histogram {
    /// For values of a fixed scale, told apart by `width`.
    pub(super) fn linear(width: f64) -> Self {
        Self::new(Bins::Linear(width), f64::INFINITY)
    }

    /// For numbers of things.
    pub(super) fn whole() -> Self {
        Self::linear(1.0)
    }

    /// For shares in percent: 100 falls into the last bin below it.
    pub(super) fn percents() -> Self {
        Self::new(Bins::Linear(0.2), 100.0)
    }

    /// For sizes from 1 on, over orders of magnitude.
    pub(super) fn sizes() -> Self {
        Self::new(Bins::Logarithmic, f64::INFINITY)
    }

    fn new(bins: Bins, top: f64) -> Self {
        Self { bins, top, counts: BTreeMap::new(), n: 0, sum: 0.0, least: f64::INFINITY, most: f64::NEG_INFINITY }
    }

    /// Counts a value; one that is not finite is left out.
    pub(super) fn add(&mut self, value: f64) {
        if !value.is_finite() {
            return;
        }
        let place = match self.bins {
            // Half of a thousandth of a bin: 0.6 is the third of 0.2 whatever its last bit says.
            Bins::Linear(width) => (value / width + 5e-4).floor() as i64,
            Bins::Logarithmic => (value.max(1.0).log2() * PER_DOUBLING + 5e-4).floor() as i64,
        };
        let place = if value >= self.top { self.place_below_top() } else { place };
        *self.counts.entry(place).or_default() += 1;
        self.n += 1;
        self.sum += value;
        self.least = self.least.min(value);
        self.most = self.most.max(value);
    }

    fn place_below_top(&self) -> i64 {
        match self.bins {
            Bins::Linear(width) => (self.top / width).round() as i64 - 1,
            Bins::Logarithmic => i64::MAX,
        }
    }

    /// Number of values.
    pub(super) fn n(&self) -> u64 {
        self.n
    }

    /// Mean of the values; 0 of none.
    pub(super) fn mean(&self) -> f64 {
        if self.n == 0 { 0.0 } else { self.sum / self.n as f64 }
    }

    /// The least and the most of the values.
    pub(super) fn range(&self) -> Option<(f64, f64)> {
        (self.n > 0).then_some((self.least, self.most))
    }

    /// Whether the bars stand for whole numbers of things.
    pub(super) fn is_whole(&self) -> bool {
        self.bins == Bins::Linear(1.0)
    }

    /// Whether the axis is logarithmic.
    pub(super) fn is_logarithmic(&self) -> bool {
        self.bins == Bins::Logarithmic
    }

    /// Where a bin begins.
    fn begin(&self, place: i64) -> f64 {
        match self.bins {
            Bins::Linear(width) => place as f64 * width,
            Bins::Logarithmic => (place as f64 / PER_DOUBLING).exp2(),
        }
    }

    /// Bars on common bins for charts that are compared: one list a histogram, all of the same kind; empty where nothing was
    /// counted.
    pub(super) fn bars(all: &[&Self]) -> Vec<Vec<Bar>> {
        let places = || all.iter().flat_map(|h| h.counts.keys().copied());
        let (Some(first), Some(last)) = (places().min(), places().max()) else { return vec![Vec::new(); all.len()] };
        let logarithmic = all[0].is_logarithmic();
        // Of few values few bars tell more. Source: Rice's rule, 2 n^(1/3).
        let n = all.iter().map(|h| h.n).max().unwrap_or(0) as f64;
        let most = (2.0 * n.cbrt()).clamp(BARS.0, BARS.1) as i64;
        let factor =
            factors(logarithmic).find(|f| last.div_euclid(*f) - first.div_euclid(*f) < most).unwrap_or(i64::MAX);
        let (from, to) = (first.div_euclid(factor), last.div_euclid(factor));
        let of = |h: &Self| {
            let count = |k: i64| h.counts.range(k * factor..(k + 1) * factor).map(|(_, n)| n).sum();
            (from..=to)
                .map(|k| Bar { from: h.begin(k * factor), to: h.begin((k + 1) * factor), count: count(k) })
                .collect()
        };
        all.iter().map(|h| of(h)).collect()
    }
}

/// By how many bins a bar may be wide: 1, 2, 5, 10, … of linear ones, so that bars end at round numbers; doublings of the others.
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
            let mut histogram = if log { Histogram::sizes() } else { Histogram::linear(0.5) };
            for value in &values {
                histogram.add(*value);
            }
            let bars = &Histogram::bars(&[&histogram])[0];
            prop_assert!(bars.len() as f64 <= BARS.1);
            prop_assert_eq!(bars.iter().map(|b| b.count).sum::<u64>(), values.len() as u64);
            for bar in bars {
                let slack = 1e-3 * bar.to;
                let held = |low: f64, high: f64| values.iter().map(|v| if log { v.max(1.0) } else { *v }).filter(|v| *v >= low && *v < high).count() as u64;
                prop_assert!(held(bar.from + slack, bar.to - slack) <= bar.count);
                prop_assert!(bar.count <= held(bar.from - slack, bar.to + slack));
            }
        }
    }

    #[test]
    fn all_of_a_thing_is_the_last_bar_of_its_shares() {
        let mut shares = Histogram::percents();
        for k in 0..=1000 {
            shares.add(f64::from(k) / 10.0);
        }
        let bars = &Histogram::bars(&[&shares])[0];
        assert_eq!((bars.len(), bars[0].count, bars[9].count), (10, 100, 101));
        assert_eq!((bars[9].from, bars[9].to), (90.0, 100.0));
    }

    #[test]
    fn charts_that_are_compared_have_the_same_bars() {
        let (mut a, mut b) = (Histogram::whole(), Histogram::whole());
        a.add(3.0);
        b.add(90.0);
        b.add(f64::NAN);
        let bars = Histogram::bars(&[&a, &b]);
        assert_eq!(bars[0].len(), bars[1].len());
        assert_eq!((bars[0][0].from, bars[0][0].to), (0.0, 10.0));
        assert_eq!((bars[0][0].count, bars[1].last().unwrap().count), (1, 1));
        assert_eq!((b.n(), b.mean(), b.range()), (1, 90.0, Some((90.0, 90.0))));
    }
}
