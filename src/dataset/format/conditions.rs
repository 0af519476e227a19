//! What a record's conditions come down to: the few numbers that lists of images tell.

use crate::dataset::record::Record;
use serde_json::Value;

/// Light, soil and camera of an image in short; `None` where the page or an imported image says nothing of it.
pub(super) struct Brief<'a> {
    conditions: &'a Value,
}

impl<'a> Brief<'a> {
    pub(super) fn of(record: &'a Record) -> Self {
        Self { conditions: &record.conditions }
    }

    /// A number by its JSON pointer.
    fn number(&self, pointer: &str) -> Option<f64> {
        self.conditions.pointer(pointer)?.as_f64()
    }

    /// Mean moisture of the soil, 0 air-dry to 1 saturated.
    pub(super) fn moisture(&self) -> Option<f64> {
        self.number("/soil/moisture/mean")
    }

    /// Clods longer than 5 mm on a square metre.
    pub(super) fn clods_per_m2(&self) -> Option<f64> {
        self.number("/soil/clods/over_5mm_per_m2")
    }

    /// Root mean square height of the ground's noise, mm.
    pub(super) fn relief_mm(&self) -> Option<f64> {
        self.number("/soil/relief/rms_mm")
    }

    /// Share of the ground under straw.
    pub(super) fn straw(&self) -> Option<f64> {
        self.number("/soil/litter/straw_cover")
    }

    /// The soil's layers by name, the one with the largest share first.
    pub(super) fn layers(&self) -> Vec<&'a str> {
        let layers = self.conditions.pointer("/soil/layers").and_then(Value::as_array);
        let named = |layer: &'a Value| Some((layer["name"].as_str()?, layer["share"].as_f64()?));
        let mut all: Vec<(&str, f64)> = layers.into_iter().flatten().filter_map(named).collect();
        all.sort_by(|a, b| b.1.total_cmp(&a.1));
        all.into_iter().map(|(name, _)| name).collect()
    }

    fn lights(&self) -> impl Iterator<Item = &'a Value> {
        self.conditions["lights"].as_array().into_iter().flatten()
    }

    /// The kinds of light: `daylight`, `overcast`, `constant`, `lamp`.
    pub(super) fn kinds_of_light(&self) -> Vec<&'a str> {
        self.lights().filter_map(|light| light["kind"].as_str()).collect()
    }

    /// A number of the first daylight.
    fn daylight(&self, key: &str) -> Option<f64> {
        self.lights().find_map(|light| light[key].as_f64())
    }

    /// The sun above the horizon, degrees.
    pub(super) fn sun_elevation_deg(&self) -> Option<f64> {
        self.daylight("sun_elevation_deg")
    }

    /// The sun clockwise from north, degrees.
    pub(super) fn sun_azimuth_deg(&self) -> Option<f64> {
        self.daylight("sun_azimuth_deg")
    }

    /// Haze.
    pub(super) fn turbidity(&self) -> Option<f64> {
        self.daylight("turbidity")
    }

    /// Share of the visible irradiance of the ground that comes straight from the sun.
    pub(super) fn sun_share(&self) -> Option<f64> {
        let (mut sun, mut all) = (0.0, 0.0);
        for light in self.lights() {
            let direct = visible(&light["sun_irradiance_w_m2_nm"]);
            sun += direct;
            all += direct + visible(&light["sky_irradiance_w_m2_nm"]) + visible(&light["irradiance_w_m2_nm"]);
        }
        (all > 0.0).then(|| sun / all)
    }

    /// Height of the lens over the world's ground plane, metres.
    pub(super) fn camera_height_m(&self) -> Option<f64> {
        self.number("/camera/position_m/2")
    }
}

/// Sum of the bands R, G, B; 0 for what is no spectrum.
fn visible(spectrum: &Value) -> f64 {
    spectrum.as_array().map_or(0.0, |bands| bands.iter().take(3).filter_map(Value::as_f64).sum())
}
