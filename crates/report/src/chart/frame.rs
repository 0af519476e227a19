//! The figure around a chart: title, unit and drawing.

use maud::{Markup, html};

/// Width of a chart in its own units; it scales with its container.
pub(super) const WIDTH: f64 = 320.0;
/// Charts higher than this take two rows of the grid.
const TALL: f64 = 190.0;

/// A chart of `height` units with its title and unit; the unit may be empty.
pub(super) fn figure(title: &str, unit: &str, height: f64, body: Markup) -> Markup {
    html! {
        figure.chart.tall[height > TALL] { (drawing(title, unit, (WIDTH, height), body)) }
    }
}

/// Content of the figure of a chart with another size.
#[expect(clippy::needless_pass_by_value, reason = "markup is made where it is used")]
pub(super) fn drawing(title: &str, unit: &str, (width, height): (f64, f64), body: Markup) -> Markup {
    html! {
        figcaption { (title) @if !unit.is_empty() { small { (unit) } } }
        svg viewBox={ "0 0 " (width) " " (height) } role="img" aria-label=(title) { (body) }
    }
}

/// Formats a length with one decimal.
pub(super) fn tenth(x: f64) -> String {
    format!("{x:.1}")
}
