//! Edits of what shines.

use crate::light::{Constant, Light};
use std::f32::consts::PI;

/// Size of what stands for a point, of the light's own: the sun's disc is then 0.5′ across, and the edges of its shadows are finer
/// than a pixel.
const POINT: f32 = 1.0 / 64.0;

/// Whether it shines from all around.
fn is_dome(light: &Light) -> bool {
    matches!(light, Light::Sky(_) | Light::Constant(_) | Light::EnvironmentMap(_))
}

/// Takes the sky away where anything else shines.
pub(super) fn no_sky(lights: &mut Vec<Light>) {
    if !lights.iter().all(is_dome) {
        lights.retain(|light| !is_dome(light));
    }
}

/// Puts the same radiance everywhere in the place of each sky, of the sky's irradiance on level ground: E = πL.
pub(super) fn hard_ambient(lights: &mut Vec<Light>) {
    for light in lights {
        if matches!(light, Light::Sky(_) | Light::EnvironmentMap(_)) {
            *light = Light::Constant(Constant::new(light.horizontal_irradiance() / PI));
        }
    }
}

/// Makes sun and lamps nearly points.
pub(super) fn points(lights: &mut Vec<Light>) {
    for light in lights {
        match light {
            Light::Sun(sun) => *sun = sun.shrunk(POINT),
            Light::Lamp(lamp) => *lamp = lamp.shrunk(POINT),
            Light::Sky(_) | Light::Constant(_) | Light::EnvironmentMap(_) => {}
        }
    }
}
