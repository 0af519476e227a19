//! A light as it was drawn.
//!
//! Irradiance is that of a horizontal plane at the world's origin, unoccluded, W·m⁻²·nm⁻¹ in R, G, B, NIR.

use super::{Lamp, Outline};
use crate::light::sample::Emitter;
use crate::math::Spectrum;
use serde::{Deserialize, Serialize};

/// A light as it was drawn: one for each that the scene file lists.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum LightRecord {
    /// Sun and sky.
    Daylight {
        /// The sun above the horizon.
        sun_elevation_deg: f64,
        /// The sun clockwise from north.
        sun_azimuth_deg: f64,
        /// Haze, 1.7 to 10.
        turbidity: f64,
        /// Cloud cover, 0 to 1.
        cloud: f32,
        /// What the sun's disc gives the ground.
        sun_irradiance_w_m2_nm: Spectrum,
        /// What the sky gives the ground.
        sky_irradiance_w_m2_nm: Spectrum,
    },
    /// A sky of even cloud.
    Overcast {
        /// Illuminance of the ground.
        illuminance_klx: f32,
        /// What it gives the ground.
        irradiance_w_m2_nm: Spectrum,
    },
    /// The same radiance from everywhere.
    Constant {
        /// Radiance.
        radiance_w_m2_sr_nm: Spectrum,
        /// What it gives the ground.
        irradiance_w_m2_nm: Spectrum,
    },
    /// An environment map.
    #[serde(rename = "environment")]
    EnvironmentMap {
        /// The file, as the scene file names it.
        file: String,
        /// By what its values became radiance.
        scale: f32,
        /// Where its middle column is, clockwise from north.
        rotate_deg: f32,
        /// What it gives the ground.
        irradiance_w_m2_nm: Spectrum,
    },
    /// An area that shines on one side.
    Lamp {
        /// Horizontal and other side of a rectangle; twice the radius of a disc.
        size_m: [f32; 2],
        /// Whether it is a disc.
        round: bool,
        /// Its centre.
        position_m: [f32; 3],
        /// Unit direction in which it shines.
        direction: [f32; 3],
        /// Radiance.
        radiance_w_m2_sr_nm: Spectrum,
        /// All that it sends out: π times radiance times area.
        power_w_nm: Spectrum,
        /// What it gives the ground.
        irradiance_w_m2_nm: Spectrum,
    },
}

impl LightRecord {
    pub(super) fn lamp(lamp: &Lamp) -> Self {
        let (size_m, round) = match lamp.outline() {
            Outline::Rectangle(half) => ((half * 2.0).to_array(), false),
            Outline::Disc(radius) => ([2.0 * radius; 2], true),
        };
        Self::Lamp {
            size_m,
            round,
            position_m: lamp.centre().to_array(),
            direction: lamp.frame().z.to_array(),
            radiance_w_m2_sr_nm: lamp.radiance(),
            power_w_nm: lamp.radiance() * (std::f32::consts::PI * lamp.area()),
            irradiance_w_m2_nm: lamp.horizontal_irradiance(),
        }
    }

    /// What kind of light it is, in the word that its record has: `daylight`, `overcast`, `constant`, `environment`, `lamp`.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Daylight { .. } => "daylight",
            Self::Overcast { .. } => "overcast",
            Self::Constant { .. } => "constant",
            Self::EnvironmentMap { .. } => "environment",
            Self::Lamp { .. } => "lamp",
        }
    }

    /// What it gives the ground, sun and sky together.
    pub fn irradiance_w_m2_nm(&self) -> Spectrum {
        match self {
            Self::Daylight { sun_irradiance_w_m2_nm, sky_irradiance_w_m2_nm, .. } => {
                *sun_irradiance_w_m2_nm + *sky_irradiance_w_m2_nm
            }
            Self::Overcast { irradiance_w_m2_nm, .. }
            | Self::Constant { irradiance_w_m2_nm, .. }
            | Self::EnvironmentMap { irradiance_w_m2_nm, .. }
            | Self::Lamp { irradiance_w_m2_nm, .. } => *irradiance_w_m2_nm,
        }
    }
}
