//! Environment map, as described in a scene file.

use super::described::{Described, Open, Recorded, irradiance};
use super::environment_map::{EnvironmentMap, Infrared};
use furrow_base::Result;
use furrow_base::math::Spectrum;
use furrow_base::ron_file::{NonNegative, Positive, Signed, Vary};
use furrow_base::sampling::rng::Stream;
use serde::{Deserialize, Serialize};

/// Near-infrared source of an environment map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum InfraredDesc {
    /// The file's channel NIR.
    Channel,
    /// Extrapolated from blue and red, as for a sky.
    Sky,
    /// Red times this factor.
    OfRed(Vary<NonNegative<100>>),
}

/// Fields of `EnvironmentMap`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "EnvironmentMap")]
#[schemars(inline)]
pub struct EnvironmentMapDesc {
    /// A .exr or .hdr file, equirectangular, linear, with the zenith in its first row; relative paths start at the scene
    /// file's folder.
    #[schemars(extend("x-example" = "\"sky.exr\""))]
    pub file: String,
    /// Factor from the file's values to radiance, W·m⁻²·sr⁻¹·nm⁻¹; default 1.
    #[serde(default = "as_it_is")]
    pub scale: Vary<Positive<1_000_000_000>>,
    /// Azimuth of the middle column, degrees clockwise from north; default 0.
    #[serde(default = "north")]
    pub rotate_deg: Vary<Signed<360>>,
    /// Source of near infrared; by default the file's channel NIR, or the extrapolation for a sky if it has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nir: Option<InfraredDesc>,
}

fn as_it_is() -> Vary<Positive<1_000_000_000>> {
    Vary::fixed(1.0)
}

fn north() -> Vary<Signed<360>> {
    Vary::fixed(0.0)
}

/// Sampled values of `EnvironmentMap`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EnvironmentMapRecord {
    /// File, as named in the scene file.
    pub file: String,
    /// Factor from the file's values to radiance.
    pub scale: f32,
    /// Azimuth of the middle column, clockwise from north.
    pub rotate_deg: f32,
    /// Irradiance of the ground.
    pub irradiance_w_m2_nm: Spectrum,
}

impl EnvironmentMapDesc {
    /// Returns the near-infrared source and the sampled factor on that band.
    fn draw_infrared(&self, stream: &mut Stream) -> (Infrared, f32) {
        match &self.nir {
            None => (Infrared::Found, 1.0),
            Some(InfraredDesc::Channel) => (Infrared::Channel, 1.0),
            Some(InfraredDesc::Sky) => (Infrared::Sky, 1.0),
            Some(InfraredDesc::OfRed(share)) => (Infrared::Red, share.draw32(stream)),
        }
    }
}

impl Described for EnvironmentMapDesc {
    type Record = EnvironmentMapRecord;
    type Sources = Option<EnvironmentMap>;

    fn draw(&self, stream: &mut Stream, open: &mut Open<'_>) -> Result<(Self::Record, Self::Sources)> {
        let (scale, rotate_deg) = (self.scale.draw32(stream), self.rotate_deg.draw32(stream));
        let (infrared, share) = self.draw_infrared(stream);
        let bands = Spectrum::new(1.0, 1.0, 1.0, share) * scale;
        let light = EnvironmentMap::new(open(&self.file, infrared)?, bands, rotate_deg);
        let irradiance_w_m2_nm = irradiance(light.as_ref());
        Ok((EnvironmentMapRecord { file: self.file.clone(), scale, rotate_deg, irradiance_w_m2_nm }, light))
    }

    fn files(&self) -> Vec<&str> {
        vec![&self.file]
    }

    fn examples() -> Vec<(&'static str, Self::Sources)> {
        vec![("environment map", EnvironmentMap::example())]
    }
}

impl Recorded for EnvironmentMapRecord {
    fn irradiance_w_m2_nm(&self) -> Spectrum {
        self.irradiance_w_m2_nm
    }
}
