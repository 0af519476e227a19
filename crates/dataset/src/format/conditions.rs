//! What a record's conditions come down to: the few numbers that lists of images tell.

use crate::model::record::Record;
use furrow_base::math::Spectrum;
use furrow_field::record::Conditions;
use furrow_grow::soil::SoilRecord;
use furrow_optics::light::LightRecord;

/// Light, soil and camera of an image in short; `None` where the scene file or an imported image says nothing of it.
pub(super) struct Brief<'a> {
    conditions: Option<&'a Conditions>,
}

impl<'a> Brief<'a> {
    pub(super) fn of(record: &'a Record) -> Self {
        Self { conditions: record.conditions.as_ref() }
    }

    fn soil(&self) -> Option<&'a SoilRecord> {
        self.conditions?.soil.as_ref()
    }

    /// Mean moisture of the soil, 0 air-dry to 1 saturated.
    pub(super) fn moisture(&self) -> Option<f64> {
        Some(self.soil()?.moisture.mean.into())
    }

    /// Clods longer than 5 mm on a square metre.
    pub(super) fn clods_per_m2(&self) -> Option<f64> {
        Some(self.soil()?.clods.over_5mm_per_m2.into())
    }

    /// Root mean square height of the ground's noise, mm.
    pub(super) fn relief_mm(&self) -> Option<f64> {
        Some(self.soil()?.relief.rms_mm.into())
    }

    /// Share of the ground under straw.
    pub(super) fn straw(&self) -> Option<f64> {
        Some(self.soil()?.litter.straw_cover.into())
    }

    /// The soil's layers by name, the one with the largest share first.
    pub(super) fn layers(&self) -> Vec<&'a str> {
        let mut all: Vec<_> = self.soil().into_iter().flat_map(|soil| &soil.layers).collect();
        all.sort_by(|a, b| b.share.total_cmp(&a.share));
        all.into_iter().map(|layer| layer.name.as_str()).collect()
    }

    fn lights(&self) -> &'a [LightRecord] {
        self.conditions.map_or(&[], |c| &c.lights)
    }

    /// The kinds of light: `daylight`, `overcast`, `constant`, `environment`, `lamp`.
    pub(super) fn kinds_of_light(&self) -> Vec<&'a str> {
        self.lights().iter().map(LightRecord::kind).collect()
    }

    /// Elevation and azimuth of the sun (degrees) and turbidity of the first daylight.
    fn daylight(&self) -> Option<[f64; 3]> {
        self.lights().iter().find_map(|light| match light {
            LightRecord::Daylight { sun_elevation_deg, sun_azimuth_deg, turbidity, .. } => {
                Some([*sun_elevation_deg, *sun_azimuth_deg, *turbidity])
            }
            _ => None,
        })
    }

    /// The sun above the horizon, degrees.
    pub(super) fn sun_elevation_deg(&self) -> Option<f64> {
        self.daylight().map(|of| of[0])
    }

    /// The sun clockwise from north, degrees.
    pub(super) fn sun_azimuth_deg(&self) -> Option<f64> {
        self.daylight().map(|of| of[1])
    }

    /// Haze.
    pub(super) fn turbidity(&self) -> Option<f64> {
        self.daylight().map(|of| of[2])
    }

    /// Share of the visible irradiance of the ground that comes straight from the sun.
    pub(super) fn sun_share(&self) -> Option<f64> {
        let (mut sun, mut all) = (0.0, 0.0);
        for light in self.lights() {
            let (direct, diffuse) = match light {
                LightRecord::Daylight { sun_irradiance_w_m2_nm, sky_irradiance_w_m2_nm, .. } => {
                    (visible(*sun_irradiance_w_m2_nm), visible(*sky_irradiance_w_m2_nm))
                }
                other => (0.0, visible(other.irradiance_w_m2_nm())),
            };
            sun += direct;
            all += direct + diffuse;
        }
        (all > 0.0).then(|| sun / all)
    }

    /// Height of the lens over the world's ground plane, metres.
    pub(super) fn camera_height_m(&self) -> Option<f64> {
        Some(self.conditions?.camera.position_m[2])
    }
}

/// Sum of the bands R, G, B.
fn visible(spectrum: Spectrum) -> f64 {
    spectrum.to_array().into_iter().take(3).map(f64::from).sum()
}
