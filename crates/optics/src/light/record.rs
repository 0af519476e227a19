//! Record of a sampled light.
//!
//! Irradiance is that of an unoccluded horizontal plane at the world's origin, W·m⁻²·nm⁻¹ in R, G, B, NIR.

use super::{Lamp, Outline};
use crate::light::sample::Emitter;
use furrow_base::math::Spectrum;
use serde::{Deserialize, Serialize};

/// Sampled values of a light, one record for each light of the scene file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum LightRecord {
    /// Sun and sky.
    Daylight {
        /// Elevation of the sun above the horizon.
        sun_elevation_deg: f64,
        /// Azimuth of the sun, clockwise from north.
        sun_azimuth_deg: f64,
        /// Turbidity (haze), 1.7 to 10.
        turbidity: f64,
        /// Cloud cover, 0 to 1.
        cloud: f32,
        /// Irradiance of the ground from the sun's disc.
        sun_irradiance_w_m2_nm: Spectrum,
        /// Irradiance of the ground from the sky.
        sky_irradiance_w_m2_nm: Spectrum,
    },
    /// Uniformly overcast sky.
    Overcast {
        /// Illuminance of the ground.
        illuminance_klx: f32,
        /// Irradiance of the ground.
        irradiance_w_m2_nm: Spectrum,
    },
    /// The same radiance from all directions.
    Constant {
        /// Radiance.
        radiance_w_m2_sr_nm: Spectrum,
        /// Irradiance of the ground.
        irradiance_w_m2_nm: Spectrum,
    },
    /// Environment map.
    #[serde(rename = "environment")]
    EnvironmentMap {
        /// File, as named in the scene file.
        file: String,
        /// Factor from the file's values to radiance.
        scale: f32,
        /// Azimuth of the middle column, clockwise from north.
        rotate_deg: f32,
        /// Irradiance of the ground.
        irradiance_w_m2_nm: Spectrum,
    },
    /// Area that emits on one side.
    Lamp {
        /// Horizontal and other side of a rectangle; twice the radius for a disc.
        size_m: [f32; 2],
        /// `true` for a disc.
        round: bool,
        /// Centre of the area.
        position_m: [f32; 3],
        /// Unit direction of emission.
        direction: [f32; 3],
        /// Radiance.
        radiance_w_m2_sr_nm: Spectrum,
        /// Total emitted power: π times radiance times area.
        power_w_nm: Spectrum,
        /// Irradiance of the ground.
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

    /// Returns the kind of light as written in its record: `daylight`, `overcast`, `constant`, `environment`, `lamp`.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Daylight { .. } => "daylight",
            Self::Overcast { .. } => "overcast",
            Self::Constant { .. } => "constant",
            Self::EnvironmentMap { .. } => "environment",
            Self::Lamp { .. } => "lamp",
        }
    }

    /// Returns the irradiance of the ground; for daylight, the sum of sun and sky.
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
