//! Parts of a whole as bars.

use super::frame::{WIDTH, figure, tenth};
use crate::report::percent;
use maud::{Markup, html};

/// Room on both sides.
const MARGIN: f64 = 12.0;
/// Height of a line with its bar.
const LINE: f64 = 32.0;

/// Shares of a whole, the longest bar as wide as the chart: name, colour (a class of the style sheet), share from 0 to 1. Nothing where
/// all shares are 0.
pub fn shares(title: &str, unit: &str, rows: &[(String, &str, f64)]) -> Markup {
    let most = rows.iter().map(|row| row.2).fold(0.0, f64::max);
    if most <= 0.0 {
        return html! {};
    }
    let wide = WIDTH - 2.0 * MARGIN;
    let body = html! {
        @for (k, (name, class, share)) in rows.iter().enumerate() {
            @let top = 2.0 + LINE * k as f64;
            g class=(class) {
                text.name x=(MARGIN) y=(tenth(top + 11.0)) { (name) }
                text.tick x=(tenth(WIDTH - MARGIN)) y=(tenth(top + 11.0)) text-anchor="end" { (percent(*share)) }
                rect.groove x=(MARGIN) y=(tenth(top + 16.0)) width=(tenth(wide)) height="7" rx="2" {}
                rect x=(MARGIN) y=(tenth(top + 16.0)) width=(tenth(wide * share / most)) height="7" rx="2" {}
            }
        }
    };
    figure(title, unit, 2.0 + LINE * rows.len() as f64, body)
}
