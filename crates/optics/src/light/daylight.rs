//! Sun and sky together, as described in a scene file: clear, partly clouded or overcast.
//!
//! Clouds follow Kasten & Czeplak 1980, "Solar and terrestrial radiation dependent on the amount and type of cloud",
//! Solar Energy 24. With the cloud cover N (0 to 1), the global irradiance is 1 − 0.75 N^3.4 times that of the clear
//! sky. Its diffuse fraction grows from the clear-sky value s by (1 − s) N².
//!
//! The sun's beam is therefore multiplied by (1 − 0.75 N^3.4)(1 − N²), as if it passed through a uniform thin cloud.
//! The dome keeps 1 − N of the clear sky's light; the rest comes from an overcast dome with the colour of clouds.

use super::clearsky::{ClearSky, clear_sky, optical_depth};
use super::described::{Described, Open, Recorded, irradiance};
use super::hosek::HosekWilkie;
use super::position::{SunPosition, Utc, sun_position};
use super::sky::{Dome, Sky};
use super::sun::Sun;
use furrow_base::math::{Spectrum, ToFloat, Vec3, direction, vec3};
use furrow_base::ron_file::{Bound, Fraction, Pick, Signed, Vary};
use furrow_base::sampling::rng::Stream;
use furrow_base::{Error, Result};
use serde::{Deserialize, Serialize};

/// Relative irradiance per band under thick cloud, with R = 1. An estimate: clouds are nearly grey in R, G, B, and
/// their water absorbs in NIR.
const CLOUD: Spectrum = Spectrum::new(1.00, 1.06, 1.04, 0.60);

/// Kilolux per W·m⁻²·nm⁻¹ of luminance: 683 lm/W times 106.86 nm, the integral of the luminous efficiency curve.
const KLX: f32 = 72.98;

/// Elevation in degrees of a sun that is above the horizon.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AboveHorizon;

impl Bound for AboveHorizon {
    const MIN: f64 = 0.0;
    const MAX: f64 = 90.0;
    const WORDS: &'static str = "between 0 and 90 degrees, because there is no daylight from a sun below the horizon";
}

/// Turbidity of the air: 2 very clear, 3 clear, 6 hazy.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Turbidity;

impl Bound for Turbidity {
    const MIN: f64 = 1.7;
    const MAX: f64 = 10.0;
    const WORDS: &'static str = "between 1.7 (arctic air) and 10 (thick haze)";
}

/// Degrees north of the equator.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Latitude;

impl Bound for Latitude {
    const MIN: f64 = -90.0;
    const MAX: f64 = 90.0;
    const WORDS: &'static str = "between -90 and 90 degrees";
}

/// Degrees east of Greenwich.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Longitude;

impl Bound for Longitude {
    const MIN: f64 = -180.0;
    const MAX: f64 = 180.0;
    const WORDS: &'static str = "between -180 and 180 degrees";
}

/// Position of the sun.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum SunDesc {
    /// Position at a place and time.
    At {
        /// Degrees north.
        #[schemars(extend("x-example" = "50.6"))]
        latitude_deg: Vary<Latitude>,
        /// Degrees east.
        #[schemars(extend("x-example" = "7.0"))]
        longitude_deg: Vary<Longitude>,
        /// Universal time; `Choice(["…", "…"])` for one of several.
        #[schemars(extend("x-example" = "\"2016-05-02T10:00:00Z\""))]
        utc: Pick<Utc>,
        /// Hours added to `utc`: `Uniform(0, 6)` for any time of an afternoon.
        #[serde(default = "zero::<Signed<48>>")]
        later_h: Vary<Signed<48>>,
    },
    /// Position given as a direction.
    Angles {
        /// Degrees above the horizon.
        elevation_deg: Vary<AboveHorizon>,
        /// Degrees clockwise from north.
        #[schemars(extend("x-example" = "140"))]
        azimuth_deg: Vary<Signed<360>>,
    },
}

fn zero<B: Bound>() -> Vary<B> {
    Vary::fixed(0.0)
}

fn clear_air() -> Vary<Turbidity> {
    Vary::fixed(3.0)
}

/// Fields of `Daylight`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Daylight")]
#[schemars(inline)]
pub struct DaylightDesc {
    /// Position of the sun.
    pub sun: SunDesc,
    /// Turbidity (haze), 1.7 to 10; default 3.
    #[serde(default = "clear_air")]
    pub turbidity: Vary<Turbidity>,
    /// Cloud cover, 0 clear to 1 overcast; default 0.
    #[serde(default = "zero::<Fraction>")]
    pub cloud: Vary<Fraction>,
}

/// Sampled values of `Daylight`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DaylightRecord {
    /// Elevation of the sun above the horizon.
    pub sun_elevation_deg: f64,
    /// Azimuth of the sun, clockwise from north.
    pub sun_azimuth_deg: f64,
    /// Turbidity (haze), 1.7 to 10.
    pub turbidity: f64,
    /// Cloud cover, 0 to 1.
    pub cloud: f32,
    /// Irradiance of the ground from the sun's disc.
    pub sun_irradiance_w_m2_nm: Spectrum,
    /// Irradiance of the ground from the sky.
    pub sky_irradiance_w_m2_nm: Spectrum,
    /// Place and time; left out if the scene file gives the sun's direction instead.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub moment: Option<MomentRecord>,
}

/// Place and time of a field.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MomentRecord {
    /// Degrees north.
    pub latitude_deg: f64,
    /// Degrees east.
    pub longitude_deg: f64,
    /// Universal time, rounded to seconds.
    #[serde(deserialize_with = "Utc::of_record")]
    pub utc: Utc,
}

impl Recorded for DaylightRecord {
    fn irradiance_w_m2_nm(&self) -> Spectrum {
        self.sun_irradiance_w_m2_nm + self.sky_irradiance_w_m2_nm
    }
}

impl Described for DaylightDesc {
    type Record = DaylightRecord;
    type Sources = (Option<Sun>, Option<Box<Sky>>);

    fn draw(&self, stream: &mut Stream, _: &mut Open<'_>) -> Result<(Self::Record, Self::Sources)> {
        let (at, moment) = self.sun.draw(stream)?;
        let (turbidity, cloud) = (self.turbidity.draw(stream), self.cloud.draw32(stream));
        let (sun, sky) = daylight(at.elevation_deg, at.azimuth_deg, turbidity, cloud);
        let record = DaylightRecord {
            sun_elevation_deg: at.elevation_deg,
            sun_azimuth_deg: at.azimuth_deg,
            turbidity,
            cloud,
            sun_irradiance_w_m2_nm: irradiance(sun.as_ref()),
            sky_irradiance_w_m2_nm: irradiance(sky.as_ref()),
            moment,
        };
        Ok((record, (sun, sky.map(Box::new))))
    }

    fn check(&self, stream: &mut Stream) -> Result<()> {
        self.sun.draw(stream).map(drop)
    }

    fn examples() -> Vec<(&'static str, Self::Sources)> {
        let mut all = Vec::new();
        for (sun_name, sky_name, elevation, azimuth, turbidity, cloud) in [
            ("high sun", "clear sky", 60.0, 170.0, 3.0, 0.0),
            ("low sun", "hazy sky at a low sun", 6.0, 265.0, 6.0, 0.0),
            ("veiled sun", "half clouded sky", 35.0, 95.0, 2.0, 0.5),
        ] {
            let (sun, sky) = daylight(elevation, azimuth, turbidity, cloud);
            all.extend([(sun_name, (sun, None)), (sky_name, (None, sky.map(Box::new)))]);
        }
        all.push(("uniform sun", (Some(Sun::uniform(vec3(0.6, 0.0, 0.8), Spectrum::ONE)), None)));
        all
    }
}

impl SunDesc {
    /// Samples the sun's position, and its place and time if there are any. Returns a [`Kind::Input`](furrow_base::error::Kind::Input)
    /// error if the sun is below the horizon at the place and time: twilight is not modelled.
    pub fn draw(&self, stream: &mut Stream) -> Result<(SunPosition, Option<MomentRecord>)> {
        match self {
            Self::Angles { elevation_deg, azimuth_deg } => {
                let at =
                    SunPosition { elevation_deg: elevation_deg.draw(stream), azimuth_deg: azimuth_deg.draw(stream) };
                Ok((at, None))
            }
            Self::At { latitude_deg, longitude_deg, utc, later_h } => {
                let (latitude, longitude) = (latitude_deg.draw(stream), longitude_deg.draw(stream));
                let utc = *utc.draw(stream);
                let later = later_h.draw(stream);
                let at = sun_position(utc, later, latitude, longitude, true)?;
                if at.elevation_deg < 0.0 {
                    let moment = if later == 0.0 { utc.to_string() } else { format!("{utc} and {later:.2} h") };
                    return Err(Error::input(format!("the sun is {:.1} degrees below the horizon at {moment}, latitude {latitude}, longitude {longitude}", -at.elevation_deg)).help("choose a time of day (UTC, not local), or light the field with Overcast or Lamp"));
                }
                let utc = utc.later(later);
                Ok((at, Some(MomentRecord { latitude_deg: latitude, longitude_deg: longitude, utc })))
            }
        }
    }
}

/// Returns the sun and the sky for an elevation of 0 to 90 degrees, an azimuth in degrees clockwise from north, a
/// turbidity of 1.7 to 10 and a cloud cover of 0 to 1. A black sun or sky is `None`.
pub fn daylight(elevation_deg: f64, azimuth_deg: f64, turbidity: f64, cloud: f32) -> (Option<Sun>, Option<Sky>) {
    let zenith_deg = 90.0 - elevation_deg;
    let towards = direction(zenith_deg.to_radians().to_f32(), azimuth_deg.to_radians().to_f32()).normalize();
    let clear = clear_sky(zenith_deg, optical_depth(turbidity));
    let (beam, clear_part, cloud_part) = clouded(clear, towards, cloud);
    let mut dome = Dome::clear(HosekWilkie::new(towards, turbidity.to_f32())).with_irradiance(clear_part);
    if cloud > 0.0 {
        dome = dome.plus(&Dome::overcast(cloud_part));
    }
    let sun = (!beam.is_black()).then(|| Sun::new(towards, beam));
    (sun, Sky::new(dome))
}

/// Returns the direct normal irradiance and the horizontal irradiance of the dome's clear and clouded parts under a
/// cloud cover.
fn clouded(clear: ClearSky, towards: Vec3, cloud: f32) -> (Spectrum, Spectrum, Spectrum) {
    let transmitted = 1.0 - 0.75 * cloud.powf(3.4);
    let horizontal_beam = clear.direct_normal * towards.z.max(0.0);
    let beam = clear.direct_normal * (transmitted * (1.0 - cloud * cloud));
    // Diffuse light under cloud: the transmitted light minus the remaining direct beam.
    let diffuse = (clear.diffuse_horizontal + horizontal_beam * (cloud * cloud)) * transmitted;
    let clear_part = clear.diffuse_horizontal * (1.0 - cloud);
    let from_cloud = (diffuse - clear_part).mean().max(0.0);
    (beam, clear_part, CLOUD * (from_cloud / CLOUD.mean()))
}

/// Returns the horizontal irradiance per band under an overcast sky that gives the ground this illuminance in kilolux.
pub fn overcast_irradiance(illuminance_klx: f32) -> Spectrum {
    CLOUD * (illuminance_klx / (KLX * CLOUD.luminance()))
}
