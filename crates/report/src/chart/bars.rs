//! Histograms stacked on a common axis for comparison.

use super::frame::{WIDTH, figure, tenth};
use crate::axis::step;
use crate::{Bar, Tally, number, whole};
use furrow_base::math::{RoundTo, ToFloat};
use maud::{Markup, html};

/// Margins: left for the maximum count, right for half of a tick label.
const LEFT: f64 = 34.0;
const RIGHT: f64 = 12.0;
/// Height of the text above a row of bars, and of the bars.
const WORDS: f64 = 16.0;
const BARS: f64 = 58.0;
/// Gap between rows, and height of the axis labels below the last row.
const GAP: f64 = 8.0;
const FOOT: f64 = 18.0;

/// A row of bars.
pub struct Series<'a> {
    /// Name of the series.
    pub name: &'a str,
    /// CSS class that sets its colour.
    pub class: &'a str,
    /// The values.
    pub values: &'a Tally,
}

/// Renders the chart; empty if there are no values. `key` is the name for programs that read the page.
pub fn histograms(key: &str, title: &str, unit: &str, series: &[Series<'_>]) -> Markup {
    let shown: Vec<&Series<'_>> = series.iter().filter(|s| s.values.n() > 0).collect();
    if shown.is_empty() {
        return html! {};
    }
    if let [one] = shown.as_slice()
        && let Some((least, most)) = one.values.range()
        && least == most
    {
        return constant(key, title, unit, one, least);
    }
    let values: Vec<&Tally> = shown.iter().map(|s| s.values).collect();
    let rows = Tally::bars(&values);
    let axis = Axis::of(&rows[0], values[0]);
    let height = rows.len().to_f64() * (WORDS + BARS + GAP) - GAP + FOOT;
    let body = html! {
        @for (k, (one, bars)) in shown.iter().zip(&rows).enumerate() {
            (row(key, one, bars, &axis, k.to_f64() * (WORDS + BARS + GAP)))
        }
        @for (at, text) in axis.ticks() {
            text.tick x=(tenth(at)) y=(tenth(height - 5.0)) text-anchor="middle" { (text) }
        }
    };
    figure(title, unit, height, body)
}

/// Constant values are shown as a number without bars.
fn constant(key: &str, title: &str, unit: &str, one: &Series<'_>, value: f64) -> Markup {
    let n = one.values.n();
    let body = html! {
        g class=(one.class) data-key=(key) data-n=(n) data-mean=(value) {
            text.same x="0" y="36" { (number(value)) }
            text.tick x="0" y="56" { "the same in all " (whole(n)) }
        }
    };
    figure(title, unit, 66.0, body)
}

/// One row: its text, bars, baseline and maximum count.
fn row(key: &str, one: &Series<'_>, bars: &[Bar], axis: &Axis, top: f64) -> Markup {
    let most = bars.iter().map(|b| b.count).max().unwrap_or(1).max(1);
    let (least, greatest) = one.values.range().unwrap_or((0.0, 0.0));
    let counts: Vec<String> = bars.iter().map(|b| b.count.to_string()).collect();
    let key = if one.name.is_empty() { key.to_owned() } else { format!("{key}.{}", one.name) };
    let (words, floor, end) = (tenth(top + 11.0), top + WORDS + BARS, tenth(WIDTH - RIGHT));
    let mean = one.values.mean();
    html! {
        g class=(one.class) data-key=(key) data-n=(one.values.n()) data-mean=(mean) data-counts=(counts.join(" ")) {
            text.name x=(LEFT) y=(words) { (one.name) }
            text.tick x=(end) y=(words) text-anchor="end" {
                "mean " (number(mean)) ", " (number(least)) " to " (number(greatest))
            }
            @for bar in bars.iter().filter(|b| b.count > 0) { (column(bar, most, axis, floor)) }
            path.axis d=(format!("M{LEFT} {floor}H{end}")) {}
            text.tick x=(tenth(LEFT - 5.0)) y=(tenth(top + WORDS + 8.0)) text-anchor="end" { (whole(most)) }
        }
    }
}

/// One bar.
fn column(bar: &Bar, most: u64, axis: &Axis, floor: f64) -> Markup {
    // A single count remains visible.
    let tall = (BARS * bar.count.to_f64() / most.to_f64()).max(1.0);
    let (from, to) = (axis.at(bar.from), axis.at(bar.to));
    let range = if axis.centred { number(bar.from) } else { format!("{} to {}", number(bar.from), number(bar.to)) };
    html! {
        rect x=(tenth(from + 0.5)) y=(tenth(floor - tall)) width=(tenth((to - from - 1.0).max(0.5))) height=(tenth(tall)) {
            title { (range) ": " (whole(bar.count)) }
        }
    }
}

/// Mapping of values to horizontal positions.
struct Axis {
    from: f64,
    to: f64,
    logarithmic: bool,
    /// `true` if each bar is a single whole number, labelled below its centre.
    centred: bool,
}

impl Axis {
    fn of(bars: &[Bar], values: &Tally) -> Self {
        let (first, last) = (bars[0], bars[bars.len() - 1]);
        let centred = values.is_whole() && first.to - first.from == 1.0;
        // A few bars are not stretched over the full width.
        let (mut from, mut to) = (first.from, last.to);
        if !values.is_logarithmic() && bars.len() < 6 {
            let width = first.to - first.from;
            to = from + 6.0 * width;
            if from >= width {
                from -= width;
                to -= width;
            }
        }
        Self { from, to, logarithmic: values.is_logarithmic(), centred }
    }

    fn at(&self, value: f64) -> f64 {
        let across = |v: f64| if self.logarithmic { v.max(1.0).log2() } else { v };
        let (from, to) = (across(self.from), across(self.to));
        LEFT + (across(value) - from) / (to - from).max(1e-12) * (WIDTH - LEFT - RIGHT)
    }

    /// Positions and labels of the ticks.
    fn ticks(&self) -> Vec<(f64, String)> {
        if self.logarithmic {
            let (from, to) = (self.from.max(1.0).log2(), self.to.max(1.0).log2());
            let step = ((to - from) / 6.0).ceil().max(1.0);
            let first = (from / step).ceil_to::<i32>();
            let last = (to / step).floor_to::<i32>();
            return (first..=last).map(|k| (f64::from(k) * step).exp2()).map(|v| (self.at(v), short(v))).collect();
        }
        let step = step((self.to - self.from) / 5.0).max(if self.centred { 1.0 } else { 0.0 });
        let half = if self.centred { 0.5 } else { 0.0 };
        let (first, last) =
            ((self.from / step - 1e-9).ceil_to::<i64>(), ((self.to - half) / step + 1e-9).floor_to::<i64>());
        (first..=last).map(|k| k.to_f64() * step).map(|v| (self.at(v + half), number(v))).collect()
    }
}

/// Formats a power of two for a logarithmic axis.
fn short(value: f64) -> String {
    if value >= 1_048_576.0 {
        format!("{}M", number(value / 1_048_576.0))
    } else if value >= 10_000.0 {
        format!("{}k", number(value / 1024.0))
    } else {
        number(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_lie_in_the_picture_and_ticks_below_it() {
        let mut values = Tally::whole();
        for value in [10.0, 12.0, 12.0, 14.0] {
            values.add(value);
        }
        let svg = histograms("k", "Title", "", &[Series { name: "a < b", class: "crop", values: &values }]).0;
        assert!(svg.contains("data-counts=\"1 0 2 0 1\"") && svg.contains("a &lt; b"), "{svg}");
        let bars = Tally::bars(&[&values]).remove(0);
        let axis = Axis::of(&bars, &values);
        assert!(bars.iter().all(|b| axis.at(b.from) >= LEFT && axis.at(b.to) <= WIDTH - RIGHT + 1e-9));
        assert!(axis.ticks().iter().any(|(_, text)| text == "12"));
        assert_eq!(histograms("k", "Title", "", &[]).0, "");
    }
}
