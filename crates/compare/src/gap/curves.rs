//! Charts of both sets on common axes.

use super::feature::Pool;
use super::frequency::{decibels, frequencies};
use furrow_base::math::{RoundTo, ToFloat};
use furrow_report::chart::{Chart, Curve};
use furrow_report::{Histogram, number};
use maud::Markup;

/// Fraction of the values that may be outside an axis' range at either end.
const BEYOND: f64 = 0.002;
/// Largest number of points per curve; the bins of a histogram are merged to stay below it.
const DRAWN: f64 = 64.0;

type Points = Vec<(f64, f64)>;

/// Returns the charts of two pools of one feature, real and synthetic; `note` is shown below the title.
pub(super) fn charts(title: &str, note: &str, real: &Pool, synthetic: &Pool, tile: Option<usize>) -> Vec<Markup> {
    match (real, synthetic) {
        (Pool::Counts(a), Pool::Counts(b)) => {
            let letters: &[&str] = if a.len() == 3 { &[": L*", ": a*", ": b*"] } else { &[""] };
            let one = |((a, b), letter): ((&Histogram, &Histogram), &&str)| {
                chart(&format!("{title}{letter}"), "", density(a, b)).small(note, &number)
            };
            a.iter().zip(b).zip(letters).map(one).collect()
        }
        (Pool::Values(a), Pool::Values(b)) => {
            vec![chart(title, "fraction", cumulative(a, b)).small(&format!("{note}; cumulative fraction"), &number)]
        }
        (Pool::Power(a), Pool::Power(b)) => {
            let curve = |power: &[f64]| -> Points {
                let frequencies = tile.map(frequencies).unwrap_or_default();
                frequencies.iter().zip(power).map(|(f, p)| (f.log2(), decibels(*p))).collect()
            };
            let period = |x: f64| format!("1/{}", number(2.0_f64.powf(-x)));
            vec![chart(title, "dB", [curve(a), curve(b)]).small(note, &period)]
        }
        _ => Vec::new(),
    }
}

fn chart(title: &str, upwards: &str, [real, synthetic]: [Points; 2]) -> Chart {
    let curve = |name: &str, points| Curve { name: name.into(), points };
    Chart {
        title: title.into(),
        across: String::new(),
        upwards: upwards.into(),
        curves: vec![curve("real", real), curve("synthetic", synthetic)],
        logarithmic: false,
    }
}

/// Returns the fraction of values per merged bin, over the range that contains nearly all values of both histograms.
fn density(a: &Histogram, b: &Histogram) -> [Points; 2] {
    let inside = |h: &Histogram| {
        let (mut sum, total) = (0.0, h.total().max(1).to_f64());
        let share = |n: &u64| {
            sum += n.to_f64() / total;
            sum
        };
        let sums: Vec<f64> = h.counts.iter().map(share).collect();
        let first = sums.iter().position(|s| *s > BEYOND).unwrap_or(0);
        let last = sums.iter().position(|s| *s >= 1.0 - BEYOND).unwrap_or(sums.len() - 1);
        (first, last)
    };
    let ((a0, a1), (b0, b1)) = (inside(a), inside(b));
    let (first, last) = (a0.min(b0), a1.max(b1));
    let joined = ((last - first).to_f64() / DRAWN).ceil_to::<usize>().max(1);
    let curve = |h: &Histogram| -> Points {
        let total = h.total().max(1).to_f64();
        // Midpoint of the merged bins.
        let middle = |k: usize| {
            let begin = first + k * joined;
            f64::midpoint(h.middle(begin), h.middle(begin + joined - 1))
        };
        let bins = h.counts[first..=last].chunks(joined).enumerate();
        bins.map(|(k, bins)| (middle(k), bins.iter().sum::<u64>().to_f64() / total)).collect()
    };
    [curve(a), curve(b)]
}

/// Returns the cumulative distribution as a step curve.
fn cumulative(a: &[f64], b: &[f64]) -> [Points; 2] {
    let all = || a.iter().chain(b).copied();
    let ends = (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
    let curve = |values: &[f64]| -> Points {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let n = sorted.len().to_f64();
        let stair = |(k, x): (usize, f64)| [(x, k.to_f64() / n), (x, (k + 1).to_f64() / n)];
        let stairs = sorted.into_iter().enumerate().flat_map(stair);
        [(ends.0, 0.0)].into_iter().chain(stairs).chain([(ends.1, 1.0)]).collect()
    };
    [curve(a), curve(b)]
}
