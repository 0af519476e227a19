//! Colour swatches side by side.

use super::frame::{WIDTH, figure};
use crate::color;
use furrow_base::math::ToFloat;
use maud::{Markup, html};

/// Left and right margin.
const MARGIN: f64 = 12.0;

/// Renders 8-bit sRGB colours from left to right; empty if there are none.
pub fn colors(title: &str, unit: &str, all: &[[u8; 3]]) -> Markup {
    if all.is_empty() {
        return html! {};
    }
    let width = (WIDTH - 2.0 * MARGIN) / all.len().to_f64();
    let body = html! {
        @for (k, rgb) in all.iter().enumerate() {
            // Slightly wider, so that no background shows in between.
            rect x=(format!("{:.2}", MARGIN + k.to_f64() * width)) y="4" width=(format!("{:.2}", width + 0.3)) height="64"
                style={ "fill:" (color(*rgb)) } {}
        }
    };
    figure(title, unit, 76.0, body)
}
