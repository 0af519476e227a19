//! Tick positions along an axis.

use furrow_base::math::{RoundTo, ToFloat};

/// Returns the smallest number ≥ `least` that is 1, 2 or 5 times a power of ten.
pub(super) fn step(least: f64) -> f64 {
    let power = 10.0_f64.powf(least.max(1e-9).log10().floor());
    [1.0, 2.0, 5.0, 10.0].map(|f| f * power).into_iter().find(|s| *s >= least * (1.0 - 1e-9)).unwrap_or(power * 10.0)
}

/// Returns about `about` multiples of a round step in `from..=to`: at least two, unless `from` equals `to`.
pub(super) fn ticks(from: f64, to: f64, about: usize) -> Vec<f64> {
    let step = step((to - from) / about.max(1).to_f64());
    // Tolerance of 0.0005 steps, because 0.3 counts as a multiple of 0.1 whatever its last bit.
    let (first, last) = ((from / step - 5e-4).ceil_to::<i64>(), (to / step + 5e-4).floor_to::<i64>());
    (first..=last).map(|k| k.to_f64() * step).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_round() {
        assert_eq!([0.11, 0.2, 0.21, 1.0, 6.0, 51.0].map(step), [0.2, 0.2, 0.5, 1.0, 10.0, 100.0]);
    }

    #[test]
    fn ticks_lie_between_the_ends() {
        assert_eq!(ticks(0.0, 1.0, 5), [0.0, 0.2, 0.4, 0.6000000000000001, 0.8, 1.0]);
        assert_eq!(ticks(3.0, 11.0, 4), [4.0, 6.0, 8.0, 10.0]);
        assert_eq!(ticks(-5.0, 5.0, 2), [-5.0, 0.0, 5.0]);
        for (from, to) in [(0.013, 0.0151), (1e5, 3e6), (-7.0, -6.9)] {
            let ticks = ticks(from, to, 5);
            assert!(ticks.len() >= 2 && ticks[0] >= from && ticks[ticks.len() - 1] <= to, "{ticks:?}");
        }
    }
}
