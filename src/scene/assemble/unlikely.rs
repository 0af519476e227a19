//! What a scene file says that is allowed and was probably not meant: the field is built, and its warnings tell.

use super::builder::{Builder, Floor};
use crate::Result;
use crate::math::Vec3;
use crate::ron_file::{Step, place};
use crate::sampling::Purpose;
use crate::scatter::Rows;
use crate::scene::PlantRecord;
use crate::scene::desc::{Detail, Growth, SpeciesDesc};
use crate::scene::tag::Class;
use crate::soil::Rect;

/// Widest rows that no one asks about, metres: maize and sunflower stand at 0.75, vines at 2.
const WIDE_ROWS_M: f32 = 2.0;
/// Farthest from seed to seed along a row that no one asks about, metres: pumpkins and vines stand about one apart.
const WIDE_IN_ROW_M: f32 = 1.5;
/// Height of a camera that no one asks about, metres; robots hold theirs at half a metre to two, masts at three.
const HIGH_M: f32 = 5.0;

impl Builder<'_> {
    /// Warnings about the camera and the sensor.
    pub(super) fn warn_of_camera(&mut self) {
        let height = match self.scanners.first() {
            None => self.scene.camera.pose().height(),
            // It is not the camera that looks.
            Some(_) => 0.0,
        };
        // Who asks for a drone's detail means it.
        if height > HIGH_M && self.desc.detail == Detail::Full {
            self.warnings.push(format!(
                "the camera hangs {height:.1} m above the ground; heights are in metres, 0.85 for 85 cm"
            ));
        }
        let first = |field| {
            let at = place(&self.page.text, &[Step::Field(field)]);
            let value = &self.page.text[at];
            value[..value.find(|c: char| !c.is_alphanumeric()).unwrap_or(value.len())].to_owned()
        };
        let (camera, sensor) = (first("camera"), first("sensor"));
        let known = |name: &str| crate::sensor::PRESETS.contains(&name);
        if known(&camera) && known(&sensor) && camera != sensor {
            self.warnings.push(format!(
                "the camera is {camera} and its sensor that of {sensor}; `sensor: {camera}` has its own"
            ));
        }
    }

    /// Warnings about rows and growth stages of the crops that this field has, and about growth stages of its weeds and plants.
    pub(super) fn warn_of_plants(&mut self) -> Result<()> {
        let (page, desc) = (self.page, self.desc);
        for k in self.sown.clone() {
            let crop = &desc.crops[k];
            let rows = Rows::draw(&crop.rows, &self.stream(Purpose::Scatter, k as u64));
            let (species, spacing, in_row) = (&crop.species, rows.spacing_m, rows.in_row_m);
            if spacing > WIDE_ROWS_M {
                let words =
                    format!("rows of {species} stand {spacing} m apart; spacing_m is in metres, 0.75 for 75 cm");
                self.warnings.push(words);
            }
            if in_row > WIDE_IN_ROW_M {
                let words =
                    format!("{species} stands {in_row} m apart in its rows; in_row_m is in metres, 0.16 for 16 cm");
                self.warnings.push(words);
            }
        }
        let crops = self.sown.clone().map(|k| (&desc.crops[k].species, &desc.crops[k].growth));
        let weeds = desc.weeds.iter().map(|weed| (&weed.species, &weed.growth));
        let plants = desc.plants.iter().map(|plant| (&plant.species, &plant.growth));
        for (path, growth) in crops.chain(weeds).chain(plants) {
            let species = self.library.species(page, path)?;
            if let Some(words) = beyond(&species.desc, growth, self.season.place()) {
                let words = format!("{path}: {words}");
                // Several entries may be of one species.
                if !self.warnings.contains(&words) {
                    self.warnings.push(words);
                }
            }
        }
        Ok(())
    }

    /// A warning where a camera or the LiDAR lies in ground that is higher than z = 0 at its place; nothing but the inside of it is seen then.
    pub(super) fn warn_of_burial(&mut self, floor: Floor<'_>) {
        let depth = |at: Vec3| floor.height(at.x, at.y) - at.z;
        let (what, places): (_, Vec<Vec3>) = if self.scanners.is_empty() {
            ("camera", self.captures.iter().map(|capture| capture.camera.pose().position).collect())
        } else {
            ("LiDAR", self.scanners.iter().map(|lidar| lidar.position).collect())
        };
        let deepest = places.iter().copied().max_by(|a, b| depth(*a).total_cmp(&depth(*b)));
        if let Some(at) = deepest.filter(|at| depth(*at) > 0.0) {
            let Vec3 { x, y, z } = at;
            let words = format!(
                "the {what} at ({x:.3}, {y:.3}, {z:.3}) lies {:.0} mm under the ground, which is {:.0} mm high there: raise it, or lower the soil's relief",
                (1e3 * depth(at)).ceil(),
                1e3 * (depth(at) + z)
            );
            self.warnings.push(words);
        }
    }

    /// Warnings about what stands in view.
    pub(super) fn warn_of_view(&mut self, plants: &[PlantRecord], shown: Option<Rect>) {
        // On some days nothing has emerged yet.
        let (Some(view), false) = (shown, self.sown.is_empty() || self.today.is_some()) else { return };
        let near = |plant: &&PlantRecord| view.grown(plant.radius).contains(plant.position.truncate());
        if plants.iter().filter(near).any(|plant| plant.class == Class::Crop) {
            return;
        }
        let whose = if self.scanners.is_empty() { "the camera's view" } else { "view of the LiDAR" };
        self.warnings.push(format!(
            "no crop stands in {whose}; rows.offset_m moves the rows, spacing_m and in_row_m bring plants closer"
        ));
    }
}

/// What a species file cannot show of a growth stage: its plants stay at its first or last stage.
fn beyond(species: &SpeciesDesc, growth: &Growth, season: usize) -> Option<String> {
    let stages = &species.plant.stages;
    let (first, last) = (stages.first()?, stages.last()?);
    match growth {
        Growth::Either(of) => beyond(species, of.get(season)?, season),
        Growth::EmergesOn(_) => None,
        Growth::Bbch(code) => {
            let (lo, hi) = code.usual();
            let top = species.plant.cover_days.keys().max().map_or(0, |code| *code).max(last.bbch);
            (hi > f64::from(top))
                .then(|| format!("its plants end at BBCH {top}, so BBCH {hi} looks like that"))
                .or_else(|| {
                    (lo < f64::from(first.bbch))
                        .then(|| format!("its plants begin at BBCH {}, so BBCH {lo} looks like that", first.bbch))
                })
        }
        // All of them beyond the last stage: that some are is what a wide distribution does.
        Growth::AgeDays(days) => {
            let (lo, end) = (days.usual().0, last.days.get());
            (lo > end)
                .then(|| format!("its plants end {end} days after emergence, so {lo} days and more look like that"))
        }
    }
}
