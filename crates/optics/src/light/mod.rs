//! Lights: sun, sky, constant environments, environment maps and lamps; their descriptions in scene files and their
//! sampling by path tracers.
//!
//! `sample.rs` defines the contract of a light, each variant implements it in its own file, and the enum here
//! dispatches. Radiance is in W·m⁻²·sr⁻¹·nm⁻¹ and irradiance in W·m⁻²·nm⁻¹, both in the four bands R, G, B, NIR.

pub mod clearsky;
mod constant;
mod daylight;
mod environment_map;
pub mod hosek;
mod lamp;
mod position;
mod record;
mod sample;
mod sky;
mod sun;

pub use constant::Constant;
pub use daylight::{AboveHorizon, Latitude, Longitude, SunDesc, Turbidity, daylight, overcast_irradiance};
pub use environment_map::{EnvironmentMap, Infrared, InfraredDesc, Table};
pub use lamp::{GlowDesc, Lamp, Outline, PointDesc, ShapeDesc};
pub use position::{SunPosition, Utc, sun_position};
pub use record::LightRecord;
pub use sample::{Emitter, LampHit, LightSample};
pub use sky::{Dome, Sky};
pub use sun::{HALF_ANGLE_DEG, Sun};

use furrow_base::math::{Frame, Spectrum, Vec2, Vec3, vec3};
use furrow_base::ron_file::{Finite, Fraction, NonNegative, Positive, Vary};
use furrow_base::sampling::rng::Stream;
use furrow_base::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;

/// Function that loads an environment map named in a scene file.
pub type Open<'a> = dyn FnMut(&str, Infrared) -> Result<Arc<Table>> + 'a;

/// Light source.
#[derive(Clone, Debug)]
pub enum Light {
    /// Disc of the sun.
    Sun(Sun),
    /// Dome of the sky.
    Sky(Box<Sky>),
    /// Constant environment: the same radiance from all directions.
    Constant(Constant),
    /// Environment map.
    EnvironmentMap(EnvironmentMap),
    /// Rectangle or disc that emits on one side.
    Lamp(Lamp),
}

macro_rules! of {
    ($light:expr, $inner:ident => $call:expr) => {
        match $light {
            Light::Sun($inner) => $call,
            Light::Sky($inner) => $call,
            Light::Constant($inner) => $call,
            Light::EnvironmentMap($inner) => $call,
            Light::Lamp($inner) => $call,
        }
    };
}

impl Light {
    /// Samples a direction from `p` (metres, world) to the light with two numbers in [0, 1); `None` if the light does
    /// not reach the point. Visibility is not tested.
    #[inline]
    pub fn sample_li(&self, p: Vec3, u: [f32; 2]) -> Option<LightSample> {
        of!(self, light => light.sample_li(p, u))
    }

    /// Returns the density per solid angle with which [`Self::sample_li`] samples the unit direction `wi` at `p`.
    #[inline]
    pub fn pdf_li(&self, p: Vec3, wi: Vec3) -> f32 {
        of!(self, light => light.pdf_li(p, wi))
    }

    /// Returns the radiance along a ray that left the scene in the unit direction `dir`: sun, sky, environment. Zero
    /// for lamps.
    #[inline]
    pub fn le(&self, dir: Vec3) -> Spectrum {
        of!(self, light => light.le(dir))
    }

    /// Returns the radiance that a camera sees along a ray that left the scene in the unit direction `dir`.
    #[inline]
    pub fn seen(&self, dir: Vec3) -> Spectrum {
        of!(self, light => light.seen(dir))
    }

    /// Intersects a ray with the lamp; `None` for lights at infinity.
    #[inline]
    pub fn hit(&self, origin: Vec3, dir: Vec3) -> Option<LampHit> {
        of!(self, light => light.hit(origin, dir))
    }

    /// Returns a cheap estimate of the irradiance (mean of the bands) at `p` on a surface of unit normal `n`; with
    /// `two_sided`, the sum over both sides. Above zero wherever the light can contribute.
    #[inline]
    pub fn importance(&self, p: Vec3, n: Vec3, two_sided: bool) -> f32 {
        of!(self, light => light.importance(p, n, two_sided))
    }

    /// Returns the unoccluded irradiance of a horizontal plane at the world's origin, W·m⁻²·nm⁻¹ per band.
    pub fn horizontal_irradiance(&self) -> Spectrum {
        of!(self, light => light.horizontal_irradiance())
    }

    /// Returns `true` if neighbouring points see the whole light in nearly the same direction, so that shadow rays to
    /// it are best traced together.
    #[inline]
    pub fn is_narrow(&self) -> bool {
        matches!(self, Self::Sun(_) | Self::Lamp(_))
    }

    /// Returns `true` if rays that leave the scene see the light.
    pub fn is_infinite(&self) -> bool {
        !matches!(self, Self::Lamp(_))
    }

    /// Returns examples of every kind, including edge cases, for tests that run over all lights.
    pub fn examples() -> Vec<(&'static str, Self)> {
        let mut of = Vec::new();
        for (sun_name, sky_name, elevation, azimuth, turbidity, cloud) in [
            ("high sun", "clear sky", 60.0, 170.0, 3.0, 0.0),
            ("low sun", "hazy sky at a low sun", 6.0, 265.0, 6.0, 0.0),
            ("veiled sun", "half clouded sky", 35.0, 95.0, 2.0, 0.5),
        ] {
            let (sun, sky) = daylight(elevation, azimuth, turbidity, cloud);
            of.extend(sun.map(|sun| (sun_name, Self::Sun(sun))));
            of.extend(sky.map(|sky| (sky_name, Self::Sky(Box::new(sky)))));
        }
        let overcast = Sky::new(Dome::overcast(overcast_irradiance(20.0)));
        of.extend(overcast.map(|sky| ("overcast sky", Self::Sky(Box::new(sky)))));
        of.push(("uniform sun", Self::Sun(Sun::uniform(vec3(0.6, 0.0, 0.8), Spectrum::ONE))));
        of.push(("constant environment", Self::Constant(Constant::new(Spectrum::new(0.5, 1.0, 2.0, 4.0)))));
        of.extend(EnvironmentMap::example().map(|light| ("environment map", Self::EnvironmentMap(light))));
        let radiance = Spectrum::new(2.0, 3.0, 1.0, 0.5);
        let lamp = |outline, centre: Vec3, axis: Vec3| {
            Self::Lamp(Lamp::new(outline, centre, Frame::about(axis.normalize()), radiance))
        };
        of.push(("rectangle above", lamp(Outline::Rectangle(Vec2::new(0.3, 0.1)), vec3(0.1, 0.2, 0.9), -Vec3::Z)));
        of.push(("disc aside", lamp(Outline::Disc(0.15), vec3(0.5, -0.3, 0.6), vec3(-0.5, 0.3, -0.6))));
        of.push((
            "large near rectangle",
            lamp(Outline::Rectangle(Vec2::ONE), vec3(0.0, 0.0, 0.4), vec3(0.2, 0.1, -1.0)),
        ));
        of
    }
}

/// Description of a light in a scene file.
///
/// ```
/// use furrow_optics::light::LightDesc;
/// use furrow_base::sampling::{Purpose, Stream};
/// let mut stream = Stream::of(1, 0, Purpose::Page, 0);
/// for (text, count) in [
///     (r#"Daylight(sun: At(latitude_deg: 50.6, longitude_deg: 7, utc: "2016-05-27T11:30:00Z"), turbidity: 3)"#, 2),
///     ("Daylight(sun: Angles(elevation_deg: Uniform(20, 65), azimuth_deg: Uniform(0, 360)), cloud: 0.4)", 2),
///     ("Overcast(illuminance_klx: Uniform(5, 25))", 1),
///     ("Constant(radiance: (1, 1, 1, Uniform(0.5, 1)))", 1),
///     (
///         "Lamp(
///             shape: Rectangle(width_m: 0.3, height_m: 0.1),
///             position_m: (0.4, 0, 0.8),
///             look_at_m: (0, 0, 0),
///             glow: WhiteLed(irradiance: Uniform(0.8, 1.2), at_m: 0.9),
///         )",
///         1,
///     ),
///     ("Lamp(shape: Disc(radius_m: 0.05), position_m: (0, 0.3, 0.8), glow: Radiance(1, 1, 1, 0.5))", 1),
/// ] {
///     let desc: LightDesc = ron::from_str(text)?;
///     assert_eq!(desc.build(&mut stream)?.len(), count);
/// }
/// // A robot that works by day, and at night under its own two lamps: each scene gets one list or the other.
/// let text = "OneOf([
///     [Daylight(sun: Angles(elevation_deg: Uniform(20, 65), azimuth_deg: Uniform(0, 360)))],
///     [
///         Lamp(shape: Disc(radius_m: 0.05), position_m: (-0.3, 0, 0.8), glow: WhiteLed(irradiance: 1, at_m: 0.9)),
///         Lamp(shape: Disc(radius_m: 0.05), position_m: (0.3, 0, 0.8), glow: WhiteLed(irradiance: 1, at_m: 0.9)),
///     ],
/// ])";
/// let LightDesc::OneOf(lists) = ron::from_str(text)? else { unreachable!() };
/// assert_eq!((lists[0].len(), lists[1].len()), (1, 2));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
#[expect(clippy::large_enum_variant, reason = "a scene file has a handful of lights")]
pub enum LightDesc {
    /// Sun and sky at one moment.
    Daylight {
        /// Position of the sun.
        sun: SunDesc,
        /// Turbidity (haze), 1.7 to 10; default 3.
        #[serde(default = "daylight::clear_air")]
        turbidity: Vary<Turbidity>,
        /// Cloud cover, 0 clear to 1 overcast; default 0.
        #[serde(default = "daylight::zero::<Fraction>")]
        cloud: Vary<Fraction>,
    },
    /// Uniformly overcast sky.
    Overcast {
        /// Illuminance of the ground, kilolux: 5 to 25 under heavy cloud, 20 to 50 under bright cloud; default 20.
        #[serde(default = "daylight::bright_cloud")]
        illuminance_klx: Vary<Positive>,
    },
    /// The same radiance from all directions.
    Constant {
        /// Radiance in R, G, B, NIR, W·m⁻²·sr⁻¹·nm⁻¹.
        #[schemars(extend("x-example" = "(0.3, 0.3, 0.3, 0.2)"))]
        radiance: (Vary<NonNegative>, Vary<NonNegative>, Vary<NonNegative>, Vary<NonNegative>),
    },
    /// Environment map: measured radiance from all directions.
    EnvironmentMap {
        /// A .exr or .hdr file, equirectangular, linear, with the zenith in its first row; relative paths start at the
        /// scene file's folder.
        #[schemars(extend("x-example" = "\"sky.exr\""))]
        file: String,
        /// Factor from the file's values to radiance, W·m⁻²·sr⁻¹·nm⁻¹; default 1.
        #[serde(default = "environment_map::as_it_is")]
        scale: Vary<Positive>,
        /// Azimuth of the middle column, degrees clockwise from north; default 0.
        #[serde(default = "environment_map::north")]
        rotate_deg: Vary<Finite>,
        /// Source of near infrared; by default the file's channel NIR, or the extrapolation for a sky if it has none.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        nir: Option<InfraredDesc>,
    },
    /// Area that emits on one side.
    Lamp {
        /// Outline of the area.
        shape: ShapeDesc,
        /// Centre, metres.
        #[schemars(extend("x-example" = "(-0.35, 0.2, 1)"))]
        position_m: PointDesc,
        /// Point that the lamp faces, metres; default the origin.
        #[serde(default = "lamp::origin")]
        look_at_m: PointDesc,
        /// Brightness and colour.
        glow: GlowDesc,
    },
    /// One of these lists of lights, chosen once per scene with equal probability; its lights are used as if they were
    /// listed directly. Allowed only in a scene file's list of lights; a list may not be empty or contain a `OneOf`.
    OneOf(Vec<Vec<LightDesc>>),
}

/// Returns the error for a `OneOf` inside another `OneOf`.
pub fn one_of_inside() -> Error {
    Error::input("a OneOf must be in a scene file's list of lights, not inside another one")
        .help("write all lists side by side: OneOf([[…], […], […]])")
}

impl LightDesc {
    /// Returns the environment maps named by this light, including those in all lists of a `OneOf`.
    pub fn files(&self) -> Vec<&str> {
        match self {
            Self::EnvironmentMap { file, .. } => vec![file],
            Self::OneOf(lists) => lists.iter().flatten().flat_map(Self::files).collect(),
            Self::Daylight { .. } | Self::Overcast { .. } | Self::Constant { .. } | Self::Lamp { .. } => Vec::new(),
        }
    }

    /// Samples the lights: two for daylight with sun and sky, one for the others, none for one that is black. Relative
    /// file paths start at the working directory.
    pub fn build(&self, stream: &mut Stream) -> Result<Vec<Light>> {
        let mut open = |file: &str, infrared| Table::load(Path::new(file), infrared).map(Arc::new);
        Ok(self.draw(stream, &mut open)?.1)
    }

    /// Samples the lights as [`LightDesc::build`] does and also returns a record of the sampled values. `open` loads a
    /// file named in the scene file. Returns a [`Kind::Input`](furrow_base::error::Kind::Input) error for a
    /// [`LightDesc::OneOf`], which must be resolved once per scene before.
    pub fn draw(&self, stream: &mut Stream, open: &mut Open<'_>) -> Result<(LightRecord, Vec<Light>)> {
        let sky = |sky: Option<Sky>| sky.map(|sky| Light::Sky(Box::new(sky)));
        let given = |light: Option<&Light>| light.map_or(Spectrum::ZERO, Light::horizontal_irradiance);
        Ok(match self {
            Self::Daylight { sun, turbidity, cloud } => {
                let at = sun.draw(stream)?;
                let (turbidity, cloud) = (turbidity.draw(stream), cloud.draw32(stream));
                let (sun, dome) = daylight(at.elevation_deg, at.azimuth_deg, turbidity, cloud);
                let (sun, sky) = (sun.map(Light::Sun), sky(dome));
                let record = LightRecord::Daylight {
                    sun_elevation_deg: at.elevation_deg,
                    sun_azimuth_deg: at.azimuth_deg,
                    turbidity,
                    cloud,
                    sun_irradiance_w_m2_nm: given(sun.as_ref()),
                    sky_irradiance_w_m2_nm: given(sky.as_ref()),
                };
                (record, sun.into_iter().chain(sky).collect())
            }
            Self::Overcast { illuminance_klx } => {
                let illuminance_klx = illuminance_klx.draw32(stream);
                let sky = sky(Sky::new(Dome::overcast(overcast_irradiance(illuminance_klx))));
                let record = LightRecord::Overcast { illuminance_klx, irradiance_w_m2_nm: given(sky.as_ref()) };
                (record, sky.into_iter().collect())
            }
            Self::Constant { radiance: (r, g, b, nir) } => {
                let radiance = Spectrum::from([r, g, b, nir].map(|band| band.draw32(stream)));
                let light = (!radiance.is_black()).then(|| Light::Constant(Constant::new(radiance)));
                let record =
                    LightRecord::Constant { radiance_w_m2_sr_nm: radiance, irradiance_w_m2_nm: given(light.as_ref()) };
                (record, light.into_iter().collect())
            }
            Self::EnvironmentMap { file, scale, rotate_deg, nir } => {
                let (scale, rotate_deg) = (scale.draw32(stream), rotate_deg.draw32(stream));
                let (infrared, share) = environment_map::draw_infrared(nir.as_ref(), stream);
                let bands = Spectrum::new(1.0, 1.0, 1.0, share) * scale;
                let light = EnvironmentMap::new(open(file, infrared)?, bands, rotate_deg).map(Light::EnvironmentMap);
                let irradiance_w_m2_nm = given(light.as_ref());
                let record = LightRecord::EnvironmentMap { file: file.clone(), scale, rotate_deg, irradiance_w_m2_nm };
                (record, light.into_iter().collect())
            }
            Self::Lamp { shape, position_m, look_at_m, glow } => {
                let lamp = Lamp::draw(shape, position_m, look_at_m, glow, stream)?;
                (LightRecord::lamp(&lamp), vec![Light::Lamp(lamp)])
            }
            Self::OneOf(_) => return Err(one_of_inside()),
        })
    }
}
