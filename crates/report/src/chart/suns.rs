//! Sun positions in the sky: north up, the zenith in the centre, the horizon as the outer circle.

use super::frame::{WIDTH, figure, tenth};
use furrow_base::math::ToFloat;
use maud::{Markup, html};

/// Radius of the horizon, and position of the zenith.
const RADIUS: f64 = 82.0;
const SKY: (f64, f64) = (WIDTH / 2.0, 100.0);

/// Renders suns, each given as azimuth (degrees clockwise from north), elevation (degrees) and cloud cover (0 to 1);
/// empty if there are none.
pub fn suns(suns: &[[f64; 3]]) -> Markup {
    if suns.is_empty() {
        return html! {};
    }
    let (x0, y0) = SKY;
    let radius = |elevation: f64| RADIUS * (90.0 - elevation) / 90.0;
    // Opacity decreases with the number of dots, down to a visible minimum.
    let opacity = (40.0 / suns.len().to_f64()).clamp(0.25, 0.85);
    let dot = |[azimuth, elevation, cloud]: [f64; 3]| {
        let (sin, cos) = azimuth.to_radians().sin_cos();
        let r = radius(elevation);
        (if cloud >= 0.5 { "clouded" } else { "sun" }, x0 + r * sin, y0 - r * cos)
    };
    let body = html! {
        @for elevation in [0.0, 30.0, 60.0] {
            circle.ring cx=(x0) cy=(y0) r=(tenth(radius(elevation))) {}
            @if elevation > 0.0 { text.tick x=(tenth(x0 + 2.0)) y=(tenth(y0 - radius(elevation) + 9.0)) { (elevation) "°" } }
        }
        @for (name, dx, dy) in [("N", 0.0, -1.0), ("E", 1.0, 0.0), ("S", 0.0, 1.0), ("W", -1.0, 0.0)] {
            text.tick x=(x0 + dx * (RADIUS + 9.0)) y=(y0 + dy * (RADIUS + 9.0) + 3.5) text-anchor="middle" { (name) }
        }
        @for (class, x, y) in suns.iter().copied().map(dot) {
            circle class=(class) cx=(tenth(x)) cy=(tenth(y)) r="3.2" fill-opacity=(format!("{opacity:.2}")) {}
        }
    };
    let clouded = suns.iter().any(|sun| sun[2] >= 0.5);
    figure("Sun in the sky", if clouded { "gray: cloud cover of a half or more" } else { "" }, 200.0, body)
}
