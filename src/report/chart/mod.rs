//! Charts as inline SVG. Colours are the style sheet's, so that they follow light and dark.
//!
//! | file | idea |
//! |---|---|
//! | `bars` | histograms below each other on one axis |
//! | `lines` | curves on common axes, in a page or as a file |
//! | `forest` | effects with error bars and a line at zero |
//! | `shares` | parts of a whole as bars |
//! | `colors` | colours side by side |
//! | `suns` | places of the sun in the sky |
//! | `frame` | the figure around a chart |

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

/// Charts beside each other as far as there is room; nothing where there are none.
pub fn grid(charts: impl IntoIterator<Item = Markup>) -> Markup {
    let charts: Vec<Markup> = charts.into_iter().filter(|chart| !chart.0.is_empty()).collect();
    html! { @if !charts.is_empty() { div.charts { @for chart in &charts { (chart) } } } }
}
