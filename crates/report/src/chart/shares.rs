//! Fractions of a whole as bars.

use super::frame::{WIDTH, figure, tenth};
use crate::percent;
use furrow_base::math::ToFloat;
use maud::{Markup, html};

/// Left and right margin.
const MARGIN: f64 = 12.0;
/// Height of a label with its bar.
const LINE: f64 = 32.0;

/// Renders fractions of a whole, scaled to the longest bar: name, CSS class, fraction from 0 to 1. Empty if all
/// fractions are 0.
pub fn shares(title: &str, unit: &str, rows: &[(String, &str, f64)]) -> Markup {
    let most = rows.iter().map(|row| row.2).fold(0.0, f64::max);
    if most <= 0.0 {
        return html! {};
    }
    let wide = WIDTH - 2.0 * MARGIN;
    let body = html! {
        @for (k, (name, class, share)) in rows.iter().enumerate() {
            @let top = 2.0 + LINE * k.to_f64();
            g class=(class) {
                text.name x=(MARGIN) y=(tenth(top + 11.0)) { (name) }
                text.tick x=(tenth(WIDTH - MARGIN)) y=(tenth(top + 11.0)) text-anchor="end" { (percent(*share)) }
                rect.groove x=(MARGIN) y=(tenth(top + 16.0)) width=(tenth(wide)) height="7" rx="2" {}
                rect x=(MARGIN) y=(tenth(top + 16.0)) width=(tenth(wide * share / most)) height="7" rx="2" {}
            }
        }
    };
    figure(title, unit, 2.0 + LINE * rows.len().to_f64(), body)
}
