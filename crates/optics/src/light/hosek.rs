//! Relative radiance of a clear sky: Hosek & Wilkie 2012, "An Analytic Model for Full Spectral Sky-Dome Radiance", by `hw-skymodel`.
//!
//! The model has R, G and B only. NIR extrapolates each direction's own slope from blue to red: α = ln(L_B/L_R) /
//! ln(615/470), clamped to 0.3..4.1 (haze to pure Rayleigh scattering), and L_N = L_R (824/615)^−α. The result is
//! relative: every band is scaled to a given irradiance afterwards (see `clearsky`).

use furrow_base::math::{Spectrum, Vec3};
use hw_skymodel::rgb::{Channel, SkyParams, SkyState};
use std::f32::consts::FRAC_PI_2;

/// Ground albedo, the same as in the irradiance table.
const GROUND: f32 = 0.2;

/// The model for one sun direction and turbidity.
#[derive(Clone, Copy, Debug)]
pub struct HosekWilkie {
    state: SkyState,
    sun: Vec3,
}

impl HosekWilkie {
    /// Creates the model for the unit direction to the sun and a turbidity. Both are clamped to the model's range: sun
    /// above the horizon, turbidity 1 to 10.
    pub fn new(sun: Vec3, turbidity: f32) -> Self {
        let params = SkyParams {
            elevation: sun.z.clamp(-1.0, 1.0).asin().clamp(0.0, FRAC_PI_2),
            turbidity: turbidity.clamp(1.0, 10.0),
            albedo: [GROUND; 3],
        };
        Self { state: SkyState::new(&params).expect("parameters are clamped to the model's range"), sun }
    }

    /// Returns the radiance from the unit direction `dir`, z ≥ 0, in the model's own units; NIR is extrapolated.
    pub fn radiance(&self, dir: Vec3) -> Spectrum {
        let theta = dir.z.clamp(0.0, 1.0).acos();
        // Computes the angle from its tangent, because the cosine loses all precision close to the sun.
        let gamma = dir.cross(self.sun).length().atan2(dir.dot(self.sun));
        let [r, g, b] =
            [Channel::R, Channel::G, Channel::B].map(|channel| self.state.radiance(theta, gamma, channel).max(0.0));
        let slope = if r > 0.0 && b > 0.0 { (b / r).ln() / (615.0_f32 / 470.0).ln() } else { 0.3 };
        Spectrum::new(r, g, b, r * (824.0_f32 / 615.0).powf(-slope.clamp(0.3, 4.1)))
    }
}
