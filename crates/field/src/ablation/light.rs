//! Edits of the lights.

use furrow_optics::light::{Constant, Form, Light};
use std::f32::consts::PI;

/// Size of a point light relative to the original light: the sun's disc is then 0.5′ across, and its penumbrae are narrower than a pixel.
const POINT: f32 = 1.0 / 64.0;

/// Returns `true` for lights that shine from all directions.
fn is_dome(light: &Light) -> bool {
    matches!(light.form(), Form::Dome { .. })
}

/// Removes the sky, unless there is no other light.
pub(super) fn no_sky(lights: &mut Vec<Light>) {
    if !lights.iter().all(is_dome) {
        lights.retain(|light| !is_dome(light));
    }
}

/// Replaces each sky by constant radiance L with the same irradiance E on level ground: E = πL.
pub(super) fn hard_ambient(lights: &mut Vec<Light>) {
    for light in lights {
        if light.form() == (Form::Dome { uniform: false }) {
            *light = Light::Constant(Constant::new(light.horizontal_irradiance() / PI));
        }
    }
}

/// Shrinks sun and lamps almost to points.
pub(super) fn points(lights: &mut Vec<Light>) {
    for light in lights {
        if let Some(point) = light.shrunk(POINT) {
            *light = point;
        }
    }
}
