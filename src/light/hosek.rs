//! The shape of a clear sky: Hosek & Wilkie 2012, "An Analytic Model for Full Spectral Sky-Dome Radiance", by `hw-skymodel`.
//!
//! The model has R, G and B only. NIR continues each direction's own slope from blue to red,
//! α = ln(L_B/L_R) / ln(615/470), L_N = L_R (824/615)^−α, with α held to 0.3..4.1 (haze to pure Rayleigh scattering). The result
//! is a shape: every band is scaled to a given irradiance afterwards (see `clearsky`).

use crate::math::{Spectrum, Vec3};
use hw_skymodel::rgb::{Channel, SkyParams, SkyState};
use std::f32::consts::FRAC_PI_2;

/// Reflectance of the land below, as in the irradiance table.
const GROUND: f32 = 0.2;

/// The model at one sun and turbidity.
#[derive(Clone, Copy, Debug)]
pub struct HosekWilkie {
    state: SkyState,
    sun: Vec3,
}

impl HosekWilkie {
    /// For the unit direction to the sun and a turbidity; held to the model's range, sun above the horizon and 1 to 10.
    pub fn new(sun: Vec3, turbidity: f32) -> Self {
        let params = SkyParams {
            elevation: sun.z.clamp(-1.0, 1.0).asin().clamp(0.0, FRAC_PI_2),
            turbidity: turbidity.clamp(1.0, 10.0),
            albedo: [GROUND; 3],
        };
        Self { state: SkyState::new(&params).expect("parameters are clamped to the model's range"), sun }
    }

    /// Radiance in the model's own units from the unit direction `dir`, z ≥ 0, NIR by the slope.
    pub fn radiance(&self, dir: Vec3) -> Spectrum {
        let theta = dir.z.clamp(0.0, 1.0).acos();
        // The angle by its tangent: the cosine has no digits left beside the sun.
        let gamma = dir.cross(self.sun).length().atan2(dir.dot(self.sun));
        let [r, g, b] =
            [Channel::R, Channel::G, Channel::B].map(|channel| self.state.radiance(theta, gamma, channel).max(0.0));
        let slope = if r > 0.0 && b > 0.0 { (b / r).ln() / (615.0_f32 / 470.0).ln() } else { 0.3 };
        Spectrum::new(r, g, b, r * (824.0_f32 / 615.0).powf(-slope.clamp(0.3, 4.1)))
    }
}
