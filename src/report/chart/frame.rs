//! The figure around a chart: its title, what its numbers are of, and the drawing.

use maud::{Markup, html};

/// Width of a chart, in its own units; it grows with its place.
pub(super) const WIDTH: f64 = 320.0;
/// What is higher takes the place of two.
const TALL: f64 = 190.0;

/// A chart `height` units high with its title and its unit, which may be empty.
pub(super) fn figure(title: &str, unit: &str, height: f64, body: Markup) -> Markup {
    html! {
        figure.chart.tall[height > TALL] { (drawing(title, unit, (WIDTH, height), body)) }
    }
}

/// What stands in the figure around a chart of another size.
#[expect(clippy::needless_pass_by_value, reason = "markup is made where it is used")]
pub(super) fn drawing(title: &str, unit: &str, (width, height): (f64, f64), body: Markup) -> Markup {
    html! {
        figcaption { (title) @if !unit.is_empty() { small { (unit) } } }
        svg viewBox={ "0 0 " (width) " " (height) } role="img" aria-label=(title) { (body) }
    }
}

/// A length to a tenth of a unit.
pub(super) fn tenth(x: f64) -> String {
    format!("{x:.1}")
}
