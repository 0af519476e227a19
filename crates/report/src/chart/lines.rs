//! Curves on common axes: in a page, as a small chart among others, or as an SVG file.

use super::frame::{figure, tenth};
use crate::axis::ticks;
use crate::number;
use furrow_base::math::{RoundTo, ToFloat};
use maud::{Markup, html};
use std::fmt::Write;

/// Width and height of a chart in its own units; it scales with its container.
const SIZE: (f64, f64) = (640.0, 360.0);
/// Margins of the plot: left, right, bottom. Title and legend are above it.
const LEFT: f64 = 62.0;
const RIGHT: f64 = 16.0;
const BOTTOM: f64 = 44.0;
const TITLE: f64 = 30.0;
const LEGEND: f64 = 18.0;
/// Size and margins of a small chart, whose title and legend are outside. The left margin holds the labels of the
/// vertical axis.
const SMALL: (f64, f64) = (super::frame::WIDTH, 146.0);
const SMALL_LEFT: f64 = 30.0;
const SMALL_BOTTOM: f64 = 18.0;
/// Approximate character width in the legend.
const CHARACTER: f64 = 6.6;
/// Minimum number of labels on a logarithmic axis.
const LEAST: usize = 3;
/// Maximum number of points of a curve that are drawn.
const POINTS: usize = 600;
/// Colours of curves, distinguishable with colour blindness and on light and dark backgrounds. Source: Okabe & Ito
/// 2008.
const COLORS: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];
/// Colours of the curves of small charts, from the style sheet.
const SMALL_COLORS: [&str; 2] = ["var(--crop)", "var(--light)"];

/// A curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Name in the legend.
    pub name: String,
    /// Points from left to right. A point that is not finite breaks the line.
    pub points: Vec<(f64, f64)>,
}

/// Curves on common axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// Title.
    pub title: String,
    /// Label of the horizontal axis, with its unit.
    pub across: String,
    /// Label of the vertical axis, with its unit. If empty, a small chart has no labels on the left.
    pub upwards: String,
    /// The curves.
    pub curves: Vec<Curve>,
    /// `true` for a logarithmic vertical axis; values ≤ 0 are then not drawn.
    pub logarithmic: bool,
}

/// Colours of text and lines: fixed for a file, or from the style of the page.
struct Ink {
    text: &'static str,
    soft: &'static str,
    line: &'static str,
}

const FILE: Ink = Ink { text: "#22261f", soft: "#5d6358", line: "#dcdad0" };
const PAGE: Ink = Ink { text: "var(--ink)", soft: "var(--soft)", line: "var(--line)" };

impl Chart {
    /// Renders the chart as a file with a white background.
    pub fn svg(&self) -> String {
        let (w, h) = SIZE;
        let svg = html! {
            svg xmlns="http://www.w3.org/2000/svg" viewBox={ "0 0 " (w) " " (h) } width=(w) height=(h)
                font-family="system-ui, 'DejaVu Sans', sans-serif" role="img" {
                rect width=(w) height=(h) fill="#ffffff" {}
                (self.body(&FILE))
            }
        };
        format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{}\n", svg.0)
    }

    /// Renders the chart as part of a page, with title, legend and axes.
    pub fn plot(&self) -> Markup {
        let (w, h) = SIZE;
        html! {
            figure.plot {
                svg viewBox={ "0 0 " (w) " " (h) } role="img" aria-label=(self.title) { (self.body(&PAGE)) }
            }
        }
    }

    /// Renders one of many small charts of a page; the page shows the common legend once. `note` is shown below the
    /// title, `name` formats the labels of the horizontal axis.
    pub fn small(&self, note: &str, name: &dyn Fn(f64) -> String) -> Markup {
        let (width, height) = SMALL;
        let left = if self.upwards.is_empty() { 0.0 } else { SMALL_LEFT };
        let Some(frame) = Frame::of(self, [left, width, 4.0, height - SMALL_BOTTOM]) else { return html! {} };
        let body = html! {
            @if !self.upwards.is_empty() { (frame.rungs(&PAGE, 3)) }
            @for x in ticks(frame.across.0, frame.across.1, 4) {
                @let at = frame.x(x);
                @let anchor = if at < left + 12.0 { "start" } else if at > width - 12.0 { "end" } else { "middle" };
                text.tick x=(tenth(at)) y=(tenth(height - 4.0)) text-anchor=(anchor) { (name(x)) }
            }
            path.axis d=(format!("M{left} {}H{width}", frame.floor)) {}
            @for (curve, color) in self.curves.iter().zip(SMALL_COLORS) {
                g data-curve=(curve.name) { (frame.line(curve, color, None)) }
            }
        };
        figure(&self.title, note, height, body)
    }

    fn body(&self, ink: &Ink) -> Markup {
        let rows = self.legend();
        let top = TITLE + LEGEND * rows.last().map_or(0, |(_, _, row)| row + 1).to_f64() + 8.0;
        let frame = Frame::of(self, [LEFT, SIZE.0 - RIGHT, top, SIZE.1 - BOTTOM]);
        html! {
            title { (self.title) }
            text x=(LEFT) y="20" style={ "font-size:15px;fill:" (ink.text) } font-weight="600" { (self.title) }
            @if let Some(frame) = frame {
                @for (k, (name, x, row)) in rows.into_iter().enumerate() {
                    @let y = TITLE + LEGEND * row.to_f64() + 10.0;
                    path d=(format!("M{x:.1} {:.1}h20", y - 4.0)) fill="none" stroke=(color(k)) stroke-dasharray=[dashes(k)]
                        stroke-width="3" {}
                    (words((x + 26.0, y), 12, ink.text, "start", name))
                }
                (frame.axes(self, ink))
                @for (k, curve) in self.curves.iter().enumerate() {
                    g data-curve=(curve.name) { (frame.line(curve, color(k), dashes(k))) }
                }
            } @else {
                (words((LEFT, SIZE.1 / 2.0), 13, ink.soft, "start", "nothing to show yet"))
            }
        }
    }

    /// Curve names with their horizontal positions and rows in the legend.
    fn legend(&self) -> Vec<(&str, f64, usize)> {
        let (mut x, mut row) = (LEFT, 0);
        let place = |curve: &Curve| -> (f64, usize) {
            let wide = 26.0 + CHARACTER * curve.name.chars().count().to_f64() + 18.0;
            if x > LEFT && x + wide > SIZE.0 - RIGHT {
                (x, row) = (LEFT, row + 1);
            }
            let at = x;
            x += wide;
            (at, row)
        };
        let places: Vec<(f64, usize)> = self.curves.iter().map(place).collect();
        self.curves.iter().zip(places).map(|(curve, (x, row))| (curve.name.as_str(), x, row)).collect()
    }
}

/// Colour of curve k. Colours repeat with a different dash pattern.
fn color(k: usize) -> &'static str {
    COLORS[k % COLORS.len()]
}

/// Dash pattern of curve k.
fn dashes(k: usize) -> Option<&'static str> {
    [None, Some("7 4"), Some("2 3")][k / COLORS.len() % 3]
}

/// Mapping of values to positions in the chart.
struct Frame {
    across: (f64, f64),
    upwards: (f64, f64),
    logarithmic: bool,
    left: f64,
    right: f64,
    top: f64,
    floor: f64,
}

impl Frame {
    /// Computes axis ranges slightly larger than the values, for a plot with these edges; `None` if there is nothing to
    /// draw.
    fn of(chart: &Chart, [left, right, top, floor]: [f64; 4]) -> Option<Self> {
        let logarithmic = chart.logarithmic;
        let points = || chart.curves.iter().flat_map(|c| &c.points).copied().filter(|p| drawn(*p, logarithmic));
        let ends = |values: &mut dyn Iterator<Item = f64>| {
            values.fold(None, |ends: Option<(f64, f64)>, v| {
                Some(ends.map_or((v, v), |(least, most)| (least.min(v), most.max(v))))
            })
        };
        let (first, last) = ends(&mut points().map(|p| p.0))?;
        let (least, most) = ends(&mut points().map(|p| if logarithmic { p.1.log10() } else { p.1 }))?;
        let wide = |least: f64, most: f64| if most > least { (least, most) } else { (least - 0.5, most + 0.5) };
        let (least, most) = wide(least, most);
        let room = 0.05 * (most - least);
        // An axis of non-negative values does not extend below zero. It starts at zero if the minimum is at most half
        // of the maximum.
        let lowest = if !logarithmic && least >= 0.0 && least <= 0.5 * most { 0.0 } else { least - room };
        Some(Self { across: wide(first, last), upwards: (lowest, most + room), logarithmic, left, right, top, floor })
    }

    fn x(&self, value: f64) -> f64 {
        self.left + (value - self.across.0) / (self.across.1 - self.across.0) * (self.right - self.left)
    }

    /// Vertical position of a value; on a logarithmic axis, of its logarithm.
    fn y(&self, value: f64) -> f64 {
        self.floor - (value - self.upwards.0) / (self.upwards.1 - self.upwards.0) * (self.floor - self.top)
    }

    /// Grid, axes and labels.
    fn axes(&self, chart: &Chart, ink: &Ink) -> Markup {
        let (floor, middle) = (self.floor, f64::midpoint(self.top, self.floor));
        html! {
            (self.rungs(ink, 5))
            @for value in ticks(self.across.0, self.across.1, 6) {
                path d=(format!("M{:.1} {floor}v5", self.x(value))) fill="none" stroke=(ink.soft) {}
                (words((self.x(value), floor + 18.0), 11, ink.soft, "middle", &number(value)))
            }
            path d=(format!("M{} {floor}H{}", self.left, self.right)) fill="none" stroke=(ink.soft) {}
            (words((f64::midpoint(self.left, self.right), SIZE.1 - 8.0), 12, ink.text, "middle", &chart.across))
            g transform=(format!("rotate(-90 14 {middle:.1})")) {
                (words((14.0, middle), 12, ink.text, "middle", &chart.upwards))
            }
        }
    }

    /// About `about` horizontal grid lines at round values, with labels on the left.
    fn rungs(&self, ink: &Ink, about: usize) -> Markup {
        html! {
            @for (value, name) in self.heights(about) {
                @let y = self.y(value);
                path d=(format!("M{} {y:.1}H{}", self.left, self.right)) fill="none" stroke=(ink.line) {}
                (words((self.left - 6.0, y + 4.0), 11, ink.soft, "end", &name))
            }
        }
    }

    /// Positions and labels of the vertical axis.
    fn heights(&self, about: usize) -> Vec<(f64, String)> {
        let (from, to) = self.upwards;
        if !self.logarithmic {
            return ticks(from, to, about).into_iter().map(|v| (v, number(v))).collect();
        }
        // Powers of ten; in a short range also 2 and 5 times them.
        let decades = from.floor_to::<i32>()..=to.ceil_to::<i32>();
        let steps: &[f64] = if to - from < 2.5 { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let every = ((to - from) / 8.0).ceil().max(1.0).trunc_to::<i32>();
        let round = decades.filter(|k| k % every == 0).flat_map(|k| steps.iter().map(move |s| s * 10.0_f64.powi(k)));
        let mut values: Vec<f64> = round.filter(|v| (from..=to).contains(&v.log10())).collect();
        if values.len() < LEAST {
            // A range below one decade contains hardly any of these: use multiples of a round step.
            let some = [1, 2, 4].map(|times| ticks(10.0_f64.powf(from), 10.0_f64.powf(to), times * about));
            values = some.into_iter().find(|values| values.len() >= LEAST).unwrap_or(values);
        }
        values.into_iter().map(|v| (v.log10(), if v < 1e-4 { format!("{v:e}") } else { number(v) })).collect()
    }

    /// A curve; an isolated point is drawn as a dot.
    fn line(&self, curve: &Curve, color: &str, dashes: Option<&str>) -> Markup {
        let place = |(x, y): (f64, f64)| (self.x(x), self.y(if self.logarithmic { y.log10() } else { y }));
        let (mut path, mut dots) = (String::new(), Vec::new());
        for run in curve.points.split(|p| !drawn(*p, self.logarithmic)).filter(|run| !run.is_empty()) {
            if let [one] = run {
                dots.push(place(*one));
                continue;
            }
            for (k, point) in thinned(run).into_iter().enumerate() {
                let (x, y) = place(point);
                let _ = write!(path, "{}{x:.1} {y:.1}", if k == 0 { 'M' } else { 'L' });
            }
        }
        html! {
            @if !path.is_empty() {
                path d=(path) fill="none" stroke=(color) stroke-dasharray=[dashes] stroke-width="1.8" stroke-linejoin="round" {}
            }
            @for (x, y) in dots {
                circle cx=(tenth(x)) cy=(tenth(y)) r="2" fill="none" stroke=(color) stroke-width="3" {}
            }
        }
    }
}

fn drawn((x, y): (f64, f64), logarithmic: bool) -> bool {
    x.is_finite() && y.is_finite() && (!logarithmic || y > 0.0)
}

/// Reduces the number of points to the minimum and maximum of each interval, which keeps all peaks.
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

/// Text at a position.
fn words((x, y): (f64, f64), size: u32, fill: &str, anchor: &str, words: &str) -> Markup {
    html! {
        text x=(tenth(x)) y=(tenth(y)) style=(format!("font-size:{size}px;fill:{fill}")) text-anchor=(anchor) { (words) }
    }
}
