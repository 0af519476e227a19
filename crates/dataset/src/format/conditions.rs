//! Summary values of a record's conditions, for the lists of images in formats.

use crate::model::record::Record;
use furrow_base::math::Spectrum;
use furrow_field::record::Conditions;
use furrow_grow::soil::SoilRecord;
use furrow_optics::light::LightRecord;

/// Summary of light, soil and camera of an image. Values are `None` if the scene file does not define them, and for
/// imported images.
pub(super) struct ConditionsSummary<'a> {
    conditions: Option<&'a Conditions>,
}

impl<'a> ConditionsSummary<'a> {
    pub(super) fn of(record: &'a Record) -> Self {
        Self { conditions: record.conditions.as_ref() }
    }

    fn soil(&self) -> Option<&'a SoilRecord> {
        self.conditions?.soil.as_ref()
    }

    /// Returns the mean moisture of the soil, 0 (air-dry) to 1 (saturated).
    pub(super) fn moisture(&self) -> Option<f64> {
        Some(self.soil()?.moisture.mean.into())
    }

    /// Returns the number of clods longer than 5 mm per square metre.
    pub(super) fn clods_per_m2(&self) -> Option<f64> {
        Some(self.soil()?.clods.over_5mm_per_m2.into())
    }

    /// Returns the root mean square height of the ground's noise, mm.
    pub(super) fn relief_mm(&self) -> Option<f64> {
        Some(self.soil()?.relief.rms_mm.into())
    }

    /// Returns the fraction of the ground that straw covers.
    pub(super) fn straw(&self) -> Option<f64> {
        Some(self.soil()?.litter.straw_cover.into())
    }

    /// Returns the names of the soil's layers, the one with the largest share first.
    pub(super) fn layers(&self) -> Vec<&'a str> {
        let mut all: Vec<_> = self.soil().into_iter().flat_map(|soil| &soil.layers).collect();
        all.sort_by(|a, b| b.share.total_cmp(&a.share));
        all.into_iter().map(|layer| layer.name.as_str()).collect()
    }

    fn lights(&self) -> &'a [LightRecord] {
        self.conditions.map_or(&[], |c| &c.lights)
    }

    /// Returns the kinds of light: `daylight`, `overcast`, `constant`, `environment`, `lamp`.
    pub(super) fn kinds_of_light(&self) -> Vec<&'a str> {
        self.lights().iter().map(LightRecord::kind).collect()
    }

    /// Returns elevation and azimuth of the sun (degrees) and the turbidity of the first daylight.
    fn daylight(&self) -> Option<[f64; 3]> {
        self.lights().iter().find_map(|light| match light {
            LightRecord::Daylight(day) => Some([day.sun_elevation_deg, day.sun_azimuth_deg, day.turbidity]),
            _ => None,
        })
    }

    /// Returns the elevation of the sun above the horizon, degrees.
    pub(super) fn sun_elevation_deg(&self) -> Option<f64> {
        self.daylight().map(|of| of[0])
    }

    /// Returns the azimuth of the sun, clockwise from north, degrees.
    pub(super) fn sun_azimuth_deg(&self) -> Option<f64> {
        self.daylight().map(|of| of[1])
    }

    /// Returns the turbidity of the atmosphere (haze).
    pub(super) fn turbidity(&self) -> Option<f64> {
        self.daylight().map(|of| of[2])
    }

    /// Returns the fraction of the ground's visible irradiance that comes directly from the sun.
    pub(super) fn sun_share(&self) -> Option<f64> {
        let (mut sun, mut all) = (0.0, 0.0);
        for light in self.lights() {
            let (direct, diffuse) = match light {
                LightRecord::Daylight(day) => {
                    (visible(day.sun_irradiance_w_m2_nm), visible(day.sky_irradiance_w_m2_nm))
                }
                other => (0.0, visible(other.irradiance_w_m2_nm())),
            };
            sun += direct;
            all += direct + diffuse;
        }
        (all > 0.0).then(|| sun / all)
    }

    /// Returns the height of the camera above the ground plane of the world, metres.
    pub(super) fn camera_height_m(&self) -> Option<f64> {
        Some(self.conditions?.camera.position_m[2])
    }
}

/// Returns the sum of the bands R, G and B.
fn visible(spectrum: Spectrum) -> f64 {
    spectrum.to_array().into_iter().take(3).map(f64::from).sum()
}
