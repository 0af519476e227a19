//! Loss and scores over training, as SVG.

use crate::html::{escape, number, ticks};
use std::fmt::Write;

/// Size of a chart, in its own units; it grows with its place.
const SIZE: (f64, f64) = (640.0, 360.0);
/// Around the plot: left, right, bottom; above it stand the title and the legend.
const LEFT: f64 = 62.0;
const RIGHT: f64 = 16.0;
const BOTTOM: f64 = 44.0;
const TITLE: f64 = 30.0;
const LEGEND: f64 = 18.0;
/// About how wide a character of the legend is.
const CHARACTER: f64 = 6.6;
/// Most points of a curve that are drawn.
const POINTS: usize = 600;
/// Colours of curves, told apart by colour-blind eyes and on light and dark. Source: Okabe & Ito 2008.
const COLORS: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];

/// One line of a chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Its name in the legend.
    pub name: String,
    /// Points from left to right; one that is not finite breaks the line.
    pub points: Vec<(f64, f64)>,
}

/// Curves on common axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// What it shows.
    pub title: String,
    /// What runs across, with its unit.
    pub across: String,
    /// What runs upwards, with its unit.
    pub upwards: String,
    /// The curves.
    pub curves: Vec<Curve>,
    /// Whether the upward axis is logarithmic; then values up to zero are not drawn.
    pub logarithmic: bool,
}

/// Colours of words and lines: in a file of its own, or in a page, whose style they follow.
struct Ink {
    text: &'static str,
    soft: &'static str,
    line: &'static str,
}

const FILE: Ink = Ink { text: "#22261f", soft: "#5d6358", line: "#dcdad0" };
const PAGE: Ink = Ink { text: "var(--ink)", soft: "var(--soft)", line: "var(--line)" };

impl Chart {
    /// As a file, on white.
    pub fn svg(&self) -> String {
        let (w, h) = SIZE;
        format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {w} {h}\" width=\"{w}\" \
             height=\"{h}\" font-family=\"system-ui, 'DejaVu Sans', sans-serif\" role=\"img\">\n\
             <rect width=\"{w}\" height=\"{h}\" fill=\"#ffffff\"/>\n{}</svg>\n",
            self.body(&FILE)
        )
    }

    /// As a part of a page.
    pub(super) fn inline(&self) -> String {
        let (w, h) = SIZE;
        format!(
            "<svg viewBox=\"0 0 {w} {h}\" role=\"img\" aria-label=\"{}\">\n{}</svg>",
            escape(&self.title),
            self.body(&PAGE)
        )
    }

    fn body(&self, ink: &Ink) -> String {
        let mut out = format!("<title>{}</title>\n", escape(&self.title));
        text(&mut out, (LEFT, 20.0), 15, ink.text, "start", &self.title, " font-weight=\"600\"");
        let (legend, rows) = self.legend(ink);
        let Some(frame) = Frame::of(self, TITLE + LEGEND * rows as f64 + 8.0) else {
            text(&mut out, (LEFT, SIZE.1 / 2.0), 13, ink.soft, "start", "nothing to show yet", "");
            return out;
        };
        out.push_str(&legend);
        frame.draw(&mut out, self, ink);
        for (k, curve) in self.curves.iter().enumerate() {
            let _ = writeln!(out, "<g data-curve=\"{}\">{}</g>", escape(&curve.name), frame.line(curve, &stroke(k)));
        }
        out
    }

    /// Names of curves beside pieces of their lines, in as many rows as they need.
    fn legend(&self, ink: &Ink) -> (String, usize) {
        let (mut out, mut x, mut row) = (String::new(), LEFT, 0);
        for (k, curve) in self.curves.iter().enumerate() {
            let wide = 26.0 + CHARACTER * curve.name.chars().count() as f64 + 18.0;
            if x > LEFT && x + wide > SIZE.0 - RIGHT {
                (x, row) = (LEFT, row + 1);
            }
            let y = TITLE + LEGEND * row as f64 + 10.0;
            let _ = writeln!(out, "<path d=\"M{x:.1} {:.1}h20\" {} stroke-width=\"3\"/>", y - 4.0, stroke(k));
            text(&mut out, (x + 26.0, y), 12, ink.text, "start", &curve.name, "");
            x += wide;
        }
        (out, if self.curves.is_empty() { 0 } else { row + 1 })
    }
}

/// How a curve is drawn: colours begin again with broken lines.
fn stroke(k: usize) -> String {
    let color = COLORS[k % COLORS.len()];
    let dashes = ["", " stroke-dasharray=\"7 4\"", " stroke-dasharray=\"2 3\""][k / COLORS.len() % 3];
    format!("fill=\"none\" stroke=\"{color}\"{dashes}")
}

/// Where values lie in the chart.
struct Frame {
    across: (f64, f64),
    upwards: (f64, f64),
    logarithmic: bool,
    top: f64,
}

impl Frame {
    /// The ends of the axes, a little beyond the values; `None` where there is nothing to draw.
    fn of(chart: &Chart, top: f64) -> Option<Self> {
        let logarithmic = chart.logarithmic;
        let points = || chart.curves.iter().flat_map(|c| &c.points).copied().filter(|p| drawn(*p, logarithmic));
        let ends = |values: &mut dyn Iterator<Item = f64>| {
            values.fold(None, |ends: Option<(f64, f64)>, v| {
                Some(ends.map_or((v, v), |(least, most)| (least.min(v), most.max(v))))
            })
        };
        let (left, right) = ends(&mut points().map(|p| p.0))?;
        let (least, most) = ends(&mut points().map(|p| if logarithmic { p.1.log10() } else { p.1 }))?;
        let wide = |least: f64, most: f64| if most > least { (least, most) } else { (least - 0.5, most + 0.5) };
        let (least, most) = wide(least, most);
        let room = 0.05 * (most - least);
        // What is never below zero does not begin below it, and begins there where it comes near.
        let floor = if !logarithmic && least >= 0.0 && least <= 0.5 * most { 0.0 } else { least - room };
        Some(Self { across: wide(left, right), upwards: (floor, most + room), logarithmic, top })
    }

    fn x(&self, value: f64) -> f64 {
        LEFT + (value - self.across.0) / (self.across.1 - self.across.0) * (SIZE.0 - LEFT - RIGHT)
    }

    /// Of a value as it is on the axis: its logarithm on a logarithmic one.
    fn y(&self, value: f64) -> f64 {
        let floor = SIZE.1 - BOTTOM;
        floor - (value - self.upwards.0) / (self.upwards.1 - self.upwards.0) * (floor - self.top)
    }

    /// Grid, axes and their words.
    fn draw(&self, out: &mut String, chart: &Chart, ink: &Ink) {
        let (floor, end) = (SIZE.1 - BOTTOM, SIZE.0 - RIGHT);
        for (value, words) in self.rungs() {
            let y = self.y(value);
            let _ = writeln!(out, "<path d=\"M{LEFT} {y:.1}H{end}\" fill=\"none\" stroke=\"{}\"/>", ink.line);
            text(out, (LEFT - 8.0, y + 4.0), 11, ink.soft, "end", &words, "");
        }
        for value in ticks(self.across.0, self.across.1, 6) {
            let x = self.x(value);
            let _ = writeln!(out, "<path d=\"M{x:.1} {floor}v5\" fill=\"none\" stroke=\"{}\"/>", ink.soft);
            text(out, (x, floor + 18.0), 11, ink.soft, "middle", &number(value), "");
        }
        let _ = writeln!(out, "<path d=\"M{LEFT} {floor}H{end}\" fill=\"none\" stroke=\"{}\"/>", ink.soft);
        text(out, (f64::midpoint(LEFT, end), SIZE.1 - 8.0), 12, ink.text, "middle", &chart.across, "");
        let middle = f64::midpoint(self.top, floor);
        let turned = format!(" transform=\"rotate(-90 14 {middle:.1})\"");
        text(out, (14.0, middle), 12, ink.text, "middle", &chart.upwards, &turned);
    }

    /// Places and words of the upward axis.
    fn rungs(&self) -> Vec<(f64, String)> {
        let (from, to) = self.upwards;
        if !self.logarithmic {
            return ticks(from, to, 5).into_iter().map(|v| (v, number(v))).collect();
        }
        // Powers of ten; in a short range twice and five times them as well.
        let decades = from.floor() as i32..=to.ceil() as i32;
        let steps: &[f64] = if to - from < 2.5 { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let every = ((to - from) / 8.0).ceil().max(1.0) as i32;
        decades
            .filter(|k| k % every == 0)
            .flat_map(|k| steps.iter().map(move |s| s * 10.0_f64.powi(k)))
            .map(|v| (v.log10(), v))
            .filter(|(place, _)| (from..=to).contains(place))
            .map(|(place, v)| (place, if v < 1e-4 { format!("{v:e}") } else { number(v) }))
            .collect()
    }

    /// A curve; a point on its own is a dot.
    fn line(&self, curve: &Curve, stroke: &str) -> String {
        let (mut path, mut dots) = (String::new(), String::new());
        for run in curve.points.split(|p| !drawn(*p, self.logarithmic)).filter(|run| !run.is_empty()) {
            let place = |(x, y): (f64, f64)| (self.x(x), self.y(if self.logarithmic { y.log10() } else { y }));
            if let [one] = run {
                let (x, y) = place(*one);
                let _ = write!(dots, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2\" {stroke} stroke-width=\"3\"/>");
                continue;
            }
            for (k, point) in thinned(run).into_iter().enumerate() {
                let (x, y) = place(point);
                let _ = write!(path, "{}{x:.1} {y:.1}", if k == 0 { 'M' } else { 'L' });
            }
        }
        if !path.is_empty() {
            path = format!("<path d=\"{path}\" {stroke} stroke-width=\"1.8\" stroke-linejoin=\"round\"/>");
        }
        path + &dots
    }
}

fn drawn((x, y): (f64, f64), logarithmic: bool) -> bool {
    x.is_finite() && y.is_finite() && (!logarithmic || y > 0.0)
}

/// Of many points the lowest and the highest of each stretch: no peak is lost.
fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    if points.len() <= POINTS {
        return points.to_vec();
    }
    let stretch = points.len().div_ceil(POINTS / 2);
    let ends = |part: &[(f64, f64)]| {
        let at = |better: fn(f64, f64) -> bool| {
            (1..part.len()).fold(0, |best, k| if better(part[k].1, part[best].1) { k } else { best })
        };
        let (low, high) = (at(|a, b| a < b), at(|a, b| a > b));
        let mut ends = vec![part[low.min(high)], part[low.max(high)]];
        ends.dedup();
        ends
    };
    points.chunks(stretch).flat_map(ends).collect()
}

/// Words at a place.
fn text(out: &mut String, (x, y): (f64, f64), size: u32, fill: &str, anchor: &str, words: &str, more: &str) {
    let _ = writeln!(
        out,
        "<text x=\"{x:.1}\" y=\"{y:.1}\" style=\"font-size:{size}px;fill:{fill}\" text-anchor=\"{anchor}\"{more}>{}</text>",
        escape(words)
    );
}
