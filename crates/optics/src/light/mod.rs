//! Lights: sun, sky, constant environments, environment maps and lamps; their descriptions in scene files and their
//! sampling by path tracers.
//!
//! A light is one file and one entry of the table below. `sample.rs` defines the contract of a source, `described.rs`
//! that of a light in scene files, and `form.rs` what exporters, the rasterizer and ablations may ask. Radiance is in
//! W·m⁻²·sr⁻¹·nm⁻¹ and irradiance in W·m⁻²·nm⁻¹, both in the four bands R, G, B, NIR.

#[macro_use]
mod table;

pub mod clearsky;
mod constant;
mod daylight;
mod described;
mod environment;
mod environment_map;
mod form;
pub mod hosek;
mod lamp;
mod overcast;
mod position;
mod sample;
mod sky;
mod sun;

pub use constant::{Constant, ConstantDesc, ConstantRecord};
pub use daylight::{
    AboveHorizon, DaylightDesc, DaylightRecord, Latitude, Longitude, MomentRecord, SunDesc, Turbidity, daylight,
    overcast_irradiance,
};
pub use described::{Described, Open, Recorded};
pub use environment::{EnvironmentMapDesc, EnvironmentMapRecord, InfraredDesc};
pub use environment_map::{EnvironmentMap, Infrared, Table};
pub use form::{Form, Outline, Portable};
pub use lamp::{GlowDesc, Lamp, LampDesc, LampRecord, PointDesc, ShapeDesc};
pub use overcast::{OvercastDesc, OvercastRecord};
pub use position::{SunPosition, Utc, sun_position};
pub use sample::{Emitter, LampHit, LightSample};
pub use sky::{Dome, Sky};
pub use sun::{HALF_ANGLE_DEG, Sun};

/// Types of lights in scene files.
pub mod desc {
    pub use super::{
        ConstantDesc, DaylightDesc, EnvironmentMapDesc, GlowDesc, InfraredDesc, LampDesc, LightDesc, OvercastDesc,
        PointDesc, ShapeDesc, SunDesc,
    };
}

use described::Sources;
use furrow_base::math::{Spectrum, Vec3};
use furrow_base::sampling::rng::Stream;
use furrow_base::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;

lights! {
    /// Sun and sky at one moment.
    Daylight(DaylightDesc, DaylightRecord as "daylight") =>
        /// Disc of the sun.
        Sun(Sun),
        /// Dome of the sky.
        Sky(Box<Sky>);
    /// Uniformly overcast sky.
    Overcast(OvercastDesc, OvercastRecord as "overcast");
    /// The same radiance from all directions.
    Constant(ConstantDesc, ConstantRecord as "constant") =>
        /// Constant environment.
        Constant(Constant);
    /// Environment map: measured radiance from all directions.
    EnvironmentMap(EnvironmentMapDesc, EnvironmentMapRecord as "environment") =>
        /// Environment map.
        EnvironmentMap(EnvironmentMap);
    /// Area that emits on one side.
    Lamp(LampDesc, LampRecord as "lamp") =>
        /// Rectangle or disc that emits on one side.
        Lamp(Lamp);
}

impl LightDesc {
    /// Samples the lights: two for daylight with sun and sky, one for the others, none for one that is black. Relative
    /// file paths start at the working directory.
    pub fn build(&self, stream: &mut Stream) -> Result<Vec<Light>> {
        let mut open = |file: &str, infrared| Table::load(Path::new(file), infrared).map(Arc::new);
        Ok(self.draw(stream, &mut open)?.1)
    }
}

/// Returns the error for a `OneOf` inside another `OneOf`.
pub fn one_of_inside() -> Error {
    Error::input("a OneOf must be in a scene file's list of lights, not inside another one")
        .help("write all lists side by side: OneOf([[…], […], […]])")
}
