//! Charts as inline SVG. Colours come from the style sheet, so that they follow light and dark mode.
//!
//! | file | idea |
//! |---|---|
//! | `bars` | histograms stacked on a common axis |
//! | `lines` | curves on common axes, in a page or as a file |
//! | `forest` | effects with error bars and a line at zero |
//! | `shares` | fractions of a whole as bars |
//! | `colors` | colours side by side |
//! | `suns` | positions of the sun in the sky |
//! | `frame` | figure with title around a chart |

mod bars;
mod colors;
mod forest;
mod frame;
mod lines;
mod shares;
mod suns;

pub use bars::{Series, histograms};
pub use colors::colors;
pub use forest::{Effect, forest};
pub use lines::{Chart, Curve};
pub use shares::shares;
pub use suns::suns;

use maud::{Markup, html};

/// A grid of charts; empty if there are none.
pub fn grid(charts: impl IntoIterator<Item = Markup>) -> Markup {
    let charts: Vec<Markup> = charts.into_iter().filter(|chart| !chart.0.is_empty()).collect();
    html! { @if !charts.is_empty() { div.charts { @for chart in &charts { (chart) } } } }
}
