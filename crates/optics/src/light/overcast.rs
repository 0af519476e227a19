//! Uniformly overcast sky, as described in a scene file.

use super::daylight::overcast_irradiance;
use super::described::{Described, Open, Recorded, irradiance};
use super::sky::{Dome, Sky};
use furrow_base::Result;
use furrow_base::math::Spectrum;
use furrow_base::ron_file::{Positive, Vary};
use furrow_base::sampling::rng::Stream;
use serde::{Deserialize, Serialize};

/// Fields of `Overcast`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Overcast")]
#[schemars(inline)]
pub struct OvercastDesc {
    /// Illuminance of the ground, kilolux: 5 to 25 under heavy cloud, 20 to 50 under bright cloud; default 20.
    #[serde(default = "bright_cloud")]
    pub illuminance_klx: Vary<Positive<1000>>,
}

fn bright_cloud() -> Vary<Positive<1000>> {
    Vary::fixed(20.0)
}

/// Sampled values of `Overcast`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OvercastRecord {
    /// Illuminance of the ground.
    pub illuminance_klx: f32,
    /// Irradiance of the ground.
    pub irradiance_w_m2_nm: Spectrum,
}

impl Described for OvercastDesc {
    type Record = OvercastRecord;
    type Sources = Option<Box<Sky>>;

    fn draw(&self, stream: &mut Stream, _: &mut Open<'_>) -> Result<(OvercastRecord, Option<Box<Sky>>)> {
        let illuminance_klx = self.illuminance_klx.draw32(stream);
        let sky = Sky::new(Dome::overcast(overcast_irradiance(illuminance_klx)));
        let record = OvercastRecord { illuminance_klx, irradiance_w_m2_nm: irradiance(sky.as_ref()) };
        Ok((record, sky.map(Box::new)))
    }

    fn examples() -> Vec<(&'static str, Option<Box<Sky>>)> {
        vec![("overcast sky", Sky::new(Dome::overcast(overcast_irradiance(20.0))).map(Box::new))]
    }
}

impl Recorded for OvercastRecord {
    fn irradiance_w_m2_nm(&self) -> Spectrum {
        self.irradiance_w_m2_nm
    }
}
