//! Charts as inline SVG. Colours are the style sheet's, so that they follow light and dark.

use super::histogram::{Bar, Histogram};
use crate::html::{escape, number, percent, step, whole};
use std::fmt::Write;

/// Width of a chart, in its own units; it grows with its place.
const WIDTH: f64 = 320.0;
/// Room on the left for the highest count, and on the right for half a number.
const LEFT: f64 = 34.0;
const RIGHT: f64 = 12.0;
/// Height of the words above a row of bars, and of the bars.
const WORDS: f64 = 16.0;
const BARS: f64 = 58.0;
/// Between two rows, and below the last.
const GAP: f64 = 8.0;
const FOOT: f64 = 18.0;
/// What is higher takes the place of two.
const TALL: f64 = 190.0;

/// A row of bars.
pub(super) struct Series<'a> {
    /// What it is of.
    pub(super) name: &'a str,
    /// Its colour: a class of the style sheet.
    pub(super) class: &'a str,
    /// The values.
    pub(super) values: &'a Histogram,
}

/// Histograms below each other on one axis, so that they can be compared; nothing where no value was counted. `key` is the name
/// by which a program finds it.
pub(super) fn histograms(key: &str, title: &str, unit: &str, series: &[Series<'_>]) -> String {
    let shown: Vec<&Series<'_>> = series.iter().filter(|s| s.values.n() > 0).collect();
    if shown.is_empty() {
        return String::new();
    }
    let values: Vec<&Histogram> = shown.iter().map(|s| s.values).collect();
    if let [one] = shown.as_slice()
        && let Some((least, most)) = one.values.range()
        && least == most
    {
        return constant(key, title, unit, one, least);
    }
    let rows = Histogram::bars(&values);
    let axis = Axis::of(&rows[0], values[0]);
    let height = rows.len() as f64 * (WORDS + BARS + GAP) - GAP + FOOT;
    let mut body = String::new();
    let mut top = 0.0;
    for (one, bars) in shown.iter().zip(&rows) {
        row(&mut body, key, one, bars, &axis, top);
        top += WORDS + BARS + GAP;
    }
    for (at, text) in axis.ticks() {
        let y = height - 5.0;
        let _ = write!(body, "<text class=\"tick\" x=\"{at:.1}\" y=\"{y:.1}\" text-anchor=\"middle\">{text}</text>");
    }
    figure(title, unit, height, &body)
}

/// What is the same everywhere needs no bars.
fn constant(key: &str, title: &str, unit: &str, one: &Series<'_>, value: f64) -> String {
    let n = one.values.n();
    let body = format!(
        "<g class=\"{}\" data-key=\"{key}\" data-n=\"{n}\" data-mean=\"{value}\"><text class=\"same\" x=\"0\" y=\"36\">{}</text>\
         <text class=\"tick\" x=\"0\" y=\"56\">the same in all {}</text></g>",
        one.class,
        number(value),
        whole(n)
    );
    figure(title, unit, 66.0, &body)
}

/// A chart with its title.
fn figure(title: &str, unit: &str, height: f64, body: &str) -> String {
    let unit = if unit.is_empty() { String::new() } else { format!(" <small>{}</small>", escape(unit)) };
    let title = escape(title);
    format!(
        "<figure class=\"chart{}\"><figcaption>{title}{unit}</figcaption>\
         <svg viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"{title}\">{body}</svg></figure>\n",
        // Beside two rows of others.
        if height > TALL { " tall" } else { "" }
    )
}

/// One row: its words, its bars, the line that they stand on, how high the highest is.
fn row(out: &mut String, key: &str, one: &Series<'_>, bars: &[Bar], axis: &Axis, top: f64) {
    let most = bars.iter().map(|b| b.count).max().unwrap_or(1).max(1);
    let (least, greatest) = one.values.range().unwrap_or((0.0, 0.0));
    let counts: Vec<String> = bars.iter().map(|b| b.count.to_string()).collect();
    let (n, mean) = (one.values.n(), one.values.mean());
    let _ = write!(
        out,
        "<g class=\"{}\" data-key=\"{key}{}{}\" data-n=\"{n}\" data-mean=\"{mean}\" data-counts=\"{}\">",
        one.class,
        if one.name.is_empty() { "" } else { "." },
        escape(one.name),
        counts.join(" ")
    );
    let words = top + 11.0;
    let _ = write!(
        out,
        "<text class=\"name\" x=\"{LEFT}\" y=\"{words}\">{}</text>\
         <text class=\"tick\" x=\"{:.1}\" y=\"{words}\" text-anchor=\"end\">mean {}, {} to {}</text>",
        escape(one.name),
        WIDTH - RIGHT,
        number(mean),
        number(least),
        number(greatest),
    );
    let floor = top + WORDS + BARS;
    for bar in bars.iter().filter(|b| b.count > 0) {
        // What is counted once is seen as well.
        let tall = (BARS * bar.count as f64 / most as f64).max(1.0);
        let (from, to) = (axis.at(bar.from), axis.at(bar.to));
        let range = if axis.centred { number(bar.from) } else { format!("{} to {}", number(bar.from), number(bar.to)) };
        let _ = write!(
            out,
            "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{tall:.1}\"><title>{range}: {}</title></rect>",
            from + 0.5,
            floor - tall,
            (to - from - 1.0).max(0.5),
            whole(bar.count),
        );
    }
    let _ = write!(
        out,
        "<path class=\"axis\" d=\"M{LEFT} {floor}H{:.1}\"/><text class=\"tick\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text></g>",
        WIDTH - RIGHT,
        LEFT - 5.0,
        top + WORDS + 8.0,
        whole(most),
    );
}

/// Where a value lies across.
struct Axis {
    from: f64,
    to: f64,
    logarithmic: bool,
    /// Bars stand for one whole number each, which is written below their middle.
    centred: bool,
}

impl Axis {
    fn of(bars: &[Bar], values: &Histogram) -> Self {
        let (first, last) = (bars[0], bars[bars.len() - 1]);
        let centred = values.is_whole() && first.to - first.from == 1.0;
        // Few bars are not drawn as wide as a barn.
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

    /// Places and words below.
    fn ticks(&self) -> Vec<(f64, String)> {
        if self.logarithmic {
            let (from, to) = (self.from.max(1.0).log2(), self.to.max(1.0).log2());
            let step = ((to - from) / 6.0).ceil().max(1.0);
            let first = (from / step).ceil() as i32;
            let last = (to / step).floor() as i32;
            return (first..=last).map(|k| (f64::from(k) * step).exp2()).map(|v| (self.at(v), short(v))).collect();
        }
        let step = step((self.to - self.from) / 5.0).max(if self.centred { 1.0 } else { 0.0 });
        let half = if self.centred { 0.5 } else { 0.0 };
        let (first, last) = ((self.from / step - 1e-9).ceil() as i64, ((self.to - half) / step + 1e-9).floor() as i64);
        (first..=last).map(|k| k as f64 * step).map(|v| (self.at(v + half), number(v))).collect()
    }
}

/// A power of two below a logarithmic axis.
fn short(value: f64) -> String {
    if value >= 1_048_576.0 {
        format!("{}M", number(value / 1_048_576.0))
    } else if value >= 10_000.0 {
        format!("{}k", number(value / 1024.0))
    } else {
        number(value)
    }
}

/// Radius of the horizon, and where the zenith lies.
const RADIUS: f64 = 82.0;
const SKY: (f64, f64) = (WIDTH / 2.0, 100.0);

/// Suns in the sky, north up, the zenith in the middle, the horizon around; each as azimuth, elevation (degrees), cloud.
pub(super) fn suns(suns: &[[f64; 3]]) -> String {
    if suns.is_empty() {
        return String::new();
    }
    let (x0, y0) = SKY;
    let mut body = String::new();
    for elevation in [0.0, 30.0, 60.0] {
        let r = RADIUS * (90.0 - elevation) / 90.0;
        let _ = write!(body, "<circle class=\"ring\" cx=\"{x0}\" cy=\"{y0}\" r=\"{r:.1}\"/>");
        if elevation > 0.0 {
            let _ = write!(
                body,
                "<text class=\"tick\" x=\"{:.1}\" y=\"{:.1}\">{elevation}°</text>",
                x0 + 2.0,
                y0 - r + 9.0
            );
        }
    }
    for (name, dx, dy) in [("N", 0.0, -1.0), ("E", 1.0, 0.0), ("S", 0.0, 1.0), ("W", -1.0, 0.0)] {
        let (x, y) = (x0 + dx * (RADIUS + 9.0), y0 + dy * (RADIUS + 9.0) + 3.5);
        let _ = write!(body, "<text class=\"tick\" x=\"{x}\" y=\"{y}\" text-anchor=\"middle\">{name}</text>");
    }
    // Many dots become lighter, down to what is still seen.
    let opacity = (40.0 / suns.len() as f64).clamp(0.25, 0.85);
    for [azimuth, elevation, cloud] in suns {
        let (sin, cos) = azimuth.to_radians().sin_cos();
        let r = RADIUS * (90.0 - elevation) / 90.0;
        let class = if *cloud >= 0.5 { "clouded" } else { "sun" };
        let _ = write!(
            body,
            "<circle class=\"{class}\" cx=\"{:.1}\" cy=\"{:.1}\" r=\"3.2\" fill-opacity=\"{opacity:.2}\"/>",
            x0 + r * sin,
            y0 - r * cos
        );
    }
    let clouded = suns.iter().filter(|s| s[2] >= 0.5).count();
    let note = if clouded > 0 { "gray: cloud cover of a half or more" } else { "" };
    figure("Sun in the sky", note, 200.0, &body)
}

/// Shares of a whole as lines with bars: name, colour class, share.
pub(super) fn shares(title: &str, unit: &str, rows: &[(String, &str, f64)]) -> String {
    let most = rows.iter().map(|r| r.2).fold(0.0, f64::max);
    if rows.is_empty() || most <= 0.0 {
        return String::new();
    }
    let mut body = String::new();
    let mut y = 2.0;
    for (name, class, share) in rows {
        let width = (WIDTH - 2.0 * RIGHT) * share / most;
        let _ = write!(
            body,
            "<g class=\"{class}\"><text class=\"name\" x=\"{RIGHT}\" y=\"{:.1}\">{}</text>\
             <text class=\"tick\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>\
             <rect class=\"groove\" x=\"{RIGHT}\" y=\"{:.1}\" width=\"{:.1}\" height=\"7\" rx=\"2\"/>\
             <rect x=\"{RIGHT}\" y=\"{:.1}\" width=\"{width:.1}\" height=\"7\" rx=\"2\"/></g>",
            y + 11.0,
            escape(name),
            WIDTH - RIGHT,
            y + 11.0,
            percent(*share),
            y + 16.0,
            WIDTH - 2.0 * RIGHT,
            y + 16.0,
        );
        y += 32.0;
    }
    figure(title, unit, y, &body)
}

/// Colours side by side, each a mean over an image.
pub(super) fn swatches(title: &str, unit: &str, colors: &[[u8; 3]]) -> String {
    if colors.is_empty() {
        return String::new();
    }
    let width = (WIDTH - 2.0 * RIGHT) / colors.len() as f64;
    let mut body = String::new();
    for (k, [r, g, b]) in colors.iter().enumerate() {
        let x = RIGHT + k as f64 * width;
        // A little wider, lest the background shows between.
        let _ = write!(
            body,
            "<rect x=\"{x:.2}\" y=\"4\" width=\"{:.2}\" height=\"64\" style=\"fill:#{r:02x}{g:02x}{b:02x}\"/>",
            width + 0.3
        );
    }
    figure(title, unit, 76.0, &body)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_lie_in_the_picture_and_ticks_below_it() {
        let mut values = Histogram::whole();
        for value in [10.0, 12.0, 12.0, 14.0] {
            values.add(value);
        }
        let svg = histograms("k", "Title", "", &[Series { name: "a < b", class: "crop", values: &values }]);
        assert!(svg.contains("data-counts=\"1 0 2 0 1\"") && svg.contains("a &lt; b"), "{svg}");
        let bars = Histogram::bars(&[&values]).remove(0);
        let axis = Axis::of(&bars, &values);
        assert!(bars.iter().all(|b| axis.at(b.from) >= LEFT && axis.at(b.to) <= WIDTH - RIGHT + 1e-9));
        assert!(axis.ticks().iter().any(|(_, text)| text == "12"));
        assert_eq!(histograms("k", "Title", "", &[]), "");
    }
}
