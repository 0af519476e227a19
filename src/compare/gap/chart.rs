//! Curves of both sets over one axis.

use super::feature::Pool;
use super::frequency::{decibels, frequencies};
use super::histogram::Histogram;
use crate::html::{escape, number, ticks};
use std::fmt::Write;

/// Width and height of the drawing, and the room below it for numbers.
const SIZE: (f64, f64, f64) = (300.0, 120.0, 16.0);
/// Share of the values that may lie beyond an axis' end.
const BEYOND: f64 = 0.002;
/// Bins of a histogram that are drawn as one.
const DRAWN: f64 = 64.0;

type Curve = Vec<(f64, f64)>;

/// Charts of what two pools of one feature say, real and synthetic; `title` and what is below it are HTML.
pub(super) fn charts(title: &str, small: &str, real: &Pool, synthetic: &Pool, tile: Option<usize>) -> String {
    match (real, synthetic) {
        (Pool::Counts(a), Pool::Counts(b)) => {
            let letters: &[&str] = if a.len() == 3 { &[": L*", ": a*", ": b*"] } else { &[""] };
            let one = |((a, b), letter): ((&Histogram, &Histogram), &&str)| {
                let (a, b) = density(a, b);
                draw(&format!("{title}{letter}"), small, [&a, &b], (0.0, top(&a, &b)), &|x| number(x))
            };
            a.iter().zip(b).zip(letters).map(one).collect()
        }
        (Pool::Values(a), Pool::Values(b)) => {
            let (a, b) = cumulative(a, b);
            draw(title, &format!("{small}; cumulative share"), [&a, &b], (0.0, 1.0), &|x| number(x))
        }
        (Pool::Power(a), Pool::Power(b)) => {
            let curve = |power: &[f64]| -> Curve {
                let frequencies = tile.map(frequencies).unwrap_or_default();
                frequencies.iter().zip(power).map(|(f, p)| (f.log2(), decibels(*p))).collect()
            };
            let (a, b) = (curve(a), curve(b));
            let values = || a.iter().chain(&b).map(|(_, y)| *y);
            let ends = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
            let words = format!("{small}; {} to {} dB", number(ends.0), number(ends.1));
            draw(title, &words, [&a, &b], ends, &|x| format!("1/{}", number(2.0_f64.powf(-x))))
        }
        _ => String::new(),
    }
}

/// Shares of a histogram's values by place, coarse enough to be looked at, where nearly all of both lie.
fn density(a: &Histogram, b: &Histogram) -> (Curve, Curve) {
    let inside = |h: &Histogram| {
        let (mut sum, total) = (0.0, h.total().max(1) as f64);
        let share = |n: &u64| {
            sum += *n as f64 / total;
            sum
        };
        let sums: Vec<f64> = h.counts.iter().map(share).collect();
        let first = sums.iter().position(|s| *s > BEYOND).unwrap_or(0);
        let last = sums.iter().position(|s| *s >= 1.0 - BEYOND).unwrap_or(sums.len() - 1);
        (first, last)
    };
    let ((a0, a1), (b0, b1)) = (inside(a), inside(b));
    let (first, last) = (a0.min(b0), a1.max(b1));
    let joined = (((last - first) as f64 / DRAWN).ceil() as usize).max(1);
    let curve = |h: &Histogram| -> Curve {
        let total = h.total().max(1) as f64;
        let bins = h.counts[first..=last].chunks(joined).enumerate();
        let middle = |k: usize| h.from + (first as f64 + (k as f64 + 0.5) * joined as f64) * h.step;
        bins.map(|(k, bins)| (middle(k), bins.iter().sum::<u64>() as f64 / total)).collect()
    };
    (curve(a), curve(b))
}

/// Share of values that are no larger, as stairs.
fn cumulative(a: &[f64], b: &[f64]) -> (Curve, Curve) {
    let all = || a.iter().chain(b).copied();
    let ends = (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
    let curve = |values: &[f64]| -> Curve {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let n = sorted.len() as f64;
        let stair = |(k, x): (usize, f64)| [(x, k as f64 / n), (x, (k + 1) as f64 / n)];
        let stairs = sorted.into_iter().enumerate().flat_map(stair);
        [(ends.0, 0.0)].into_iter().chain(stairs).chain([(ends.1, 1.0)]).collect()
    };
    (curve(a), curve(b))
}

fn top(a: &Curve, b: &Curve) -> f64 {
    a.iter().chain(b).map(|(_, y)| *y).fold(0.0, f64::max)
}

/// Two curves, the real one first; `name` writes the numbers of the axis.
fn draw(
    title: &str,
    small: &str,
    curves: [&Curve; 2],
    (low, high): (f64, f64),
    name: &dyn Fn(f64) -> String,
) -> String {
    let (width, height, below) = SIZE;
    let xs = || curves.iter().flat_map(|curve| curve.iter().map(|(x, _)| *x));
    let (from, to) = (xs().fold(f64::INFINITY, f64::min), xs().fold(f64::NEG_INFINITY, f64::max));
    // A single value has some axis around it.
    let (from, to) = if to > from { (from, to) } else { (from - 0.5, to + 0.5) };
    let place = |x: f64| (x - from) / (to - from) * width;
    let mut lines = String::new();
    for (curve, class) in curves.into_iter().zip(["real", "made"]) {
        let mut points = String::new();
        for (x, y) in curve {
            let up = (y - low) / (high - low).max(1e-12) * (height - 4.0);
            let _ = write!(points, "{:.1},{:.1} ", place(*x), height - up);
        }
        let _ = write!(lines, "<polyline class=\"{class}\" points=\"{}\"/>", points.trim_end());
    }
    for x in ticks(from, to, 4) {
        let (at, y) = (place(x).clamp(0.0, width), height + below - 3.0);
        let anchor = if at < 12.0 {
            "start"
        } else if at > width - 12.0 {
            "end"
        } else {
            "middle"
        };
        let _ = write!(lines, "<text x=\"{at:.1}\" y=\"{y}\" text-anchor=\"{anchor}\">{}</text>", escape(&name(x)));
    }
    format!(
        "<figure class=\"chart\"><figcaption>{title}<small>{small}</small></figcaption>\
         <svg viewBox=\"0 0 {width} {}\"><path class=\"axis\" d=\"M0 {height}H{width}\"/>{lines}</svg></figure>\n",
        height + below
    )
}
