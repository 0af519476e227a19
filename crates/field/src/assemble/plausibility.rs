//! Warnings about settings that are valid but probably not intended. The field is built all the same.

use super::drawn::{Drawn, Floor};
use super::model_spots;
use crate::PlantRecord;
use crate::desc::{Detail, Growth, SpeciesDesc};
use crate::library::Library;
use furrow_base::Result;
use furrow_base::math::{ToInt, Vec3};
use furrow_base::ron_file::{Step, place};
use furrow_base::sampling::Purpose;
use furrow_grow::scatter::Rows;
use furrow_grow::soil::Rect;
use furrow_render::scene::tag::Class;

/// Row spacing above which a warning is given, metres: maize and sunflower are sown at 0.75, vines planted at 2.
const WIDE_ROWS_M: f32 = 2.0;
/// Spacing in the row above which a warning is given, metres: pumpkins and vines are about one metre apart.
const WIDE_IN_ROW_M: f32 = 1.5;
/// Camera height above which a warning is given, metres: robots carry cameras at 0.5 to 2 m, masts at 3 m.
const HIGH_M: f32 = 5.0;

/// Words of the warning about a species in a list of another class than that of its file.
const ROLE: &str = "the role in its species file";

/// Returns `true` if a warning is about a species in a list of another class than that of its file. Programs that write scene files
/// with such lists on purpose leave it out.
pub fn is_about_role(warning: &str) -> bool {
    warning.contains(ROLE)
}

/// Returns warnings about the camera and the sensor.
pub(super) fn camera(drawn: &Drawn<'_>) -> Vec<String> {
    let mut warnings = Vec::new();
    let height = match drawn.scanners.first() {
        None => drawn.camera.pose().height(),
        // A scan does not use the camera.
        Some(_) => 0.0,
    };
    // Any other detail is a deliberate choice for a high camera.
    if height > HIGH_M && drawn.desc.detail == Detail::Full {
        warnings.push(format!("the camera is {height:.1} m above the ground; heights are in metres, 0.85 for 85 cm"));
    }
    let first = |field| {
        let at = place(&drawn.page.text, &[Step::Field(field)]);
        let value = &drawn.page.text[at];
        value[..value.find(|c: char| !c.is_alphanumeric()).unwrap_or(value.len())].to_owned()
    };
    let (camera, sensor) = (first("camera"), first("sensor"));
    let known = |name: &str| furrow_optics::sensor::PRESETS.contains(&name);
    if known(&camera) && known(&sensor) && camera != sensor {
        warnings.push(format!(
            "the camera is {camera}, but the sensor is that of {sensor}; its own sensor is `sensor: {camera}`"
        ));
    }
    warnings
}

/// Returns warnings about row spacing and growth stages of the field's crops, about growth stages of its weeds and
/// single plants, and about species in a list of another class than that of their files.
pub(super) fn plants(drawn: &Drawn<'_>, library: &mut Library) -> Result<Vec<String>> {
    let mut warnings = Vec::new();
    let (page, desc) = (drawn.page, drawn.desc);
    let crops = drawn.sown.clone().map(|k| {
        let crop = &desc.crops[k];
        (&crop.species, Rows::draw(&crop.rows, &drawn.stream(Purpose::Scatter, k.to_u64())))
    });
    let models = desc.models.iter().enumerate();
    let models = models.filter_map(|(k, model)| Some((&model.file, model_spots::rows(drawn, k)?)));
    for (species, rows) in crops.chain(models) {
        let (spacing, in_row) = (rows.spacing_m, rows.in_row_m);
        if spacing > WIDE_ROWS_M {
            let words = format!("rows of {species} stand {spacing} m apart; spacing_m is in metres, 0.75 for 75 cm");
            warnings.push(words);
        }
        if in_row > WIDE_IN_ROW_M {
            let words = format!("{species} stands {in_row} m apart in its rows; in_row_m is in metres, 0.16 for 16 cm");
            warnings.push(words);
        }
    }
    let crops = desc.crops.iter().map(|crop| (&crop.species, Class::Crop));
    let weeds = desc.weeds.iter().map(|weed| (&weed.species, Class::Weed));
    for (path, class) in crops.chain(weeds) {
        let species = library.species(page, path)?;
        let (own, list) = (species.desc.role.class(), if class == Class::Crop { "crops" } else { "weeds" });
        let (name, listed, own_name) = (&species.desc.name, class.name(), own.name());
        let words = format!(
            "{name} is labelled {listed} because `{list}` lists it; {ROLE}, {own_name}, is that of single `plants`"
        );
        if own != class && !warnings.contains(&words) {
            warnings.push(words);
        }
    }
    let crops = drawn.sown.clone().map(|k| (&desc.crops[k].species, &desc.crops[k].growth));
    let weeds = desc.weeds.iter().map(|weed| (&weed.species, &weed.growth));
    let plants = desc.plants.iter().map(|plant| (&plant.species, &plant.growth));
    for (path, growth) in crops.chain(weeds).chain(plants) {
        let species = library.species(page, path)?;
        if let Some(words) = beyond(&species.desc, growth, drawn.season.place()) {
            let words = format!("{path}: {words}");
            // Several entries may have the same species.
            if !warnings.contains(&words) {
                warnings.push(words);
            }
        }
    }
    Ok(warnings)
}

/// Returns a warning if a camera or the LiDAR is inside the ground, which may be higher than z = 0; it then sees only the ground's inside.
pub(super) fn burial(drawn: &Drawn<'_>, floor: Floor<'_>) -> Option<String> {
    let depth = |at: Vec3| floor.height(at.x, at.y) - at.z;
    let (what, places): (_, Vec<Vec3>) = if drawn.scanners.is_empty() {
        ("camera", drawn.captures.iter().map(|capture| capture.camera.pose().position).collect())
    } else {
        ("LiDAR", drawn.scanners.iter().map(|lidar| lidar.position).collect())
    };
    let deepest = places.iter().copied().max_by(|a, b| depth(*a).total_cmp(&depth(*b)));
    let at = deepest.filter(|at| depth(*at) > 0.0)?;
    let Vec3 { x, y, z } = at;
    Some(format!(
        "the {what} at ({x:.3}, {y:.3}, {z:.3}) is {:.0} mm below the ground, which is {:.0} mm high there: raise it, or lower the soil's relief",
        (1e3 * depth(at)).ceil(),
        1e3 * (depth(at) + z)
    ))
}

/// Returns a warning if no crop is in view.
pub(super) fn view(drawn: &Drawn<'_>, plants: &[PlantRecord], shown: Option<Rect>) -> Option<String> {
    // On some days nothing has emerged yet.
    let (Some(view), false) = (shown, drawn.sown.is_empty() || drawn.today.is_some()) else { return None };
    let near = |plant: &&PlantRecord| view.grown(plant.radius).contains(plant.position.truncate());
    if plants.iter().filter(near).any(|plant| plant.class == Class::Crop) {
        return None;
    }
    let whose = if drawn.scanners.is_empty() { "the camera's view" } else { "the LiDAR's view" };
    Some(format!("no crop is in {whose}; rows.offset_m moves the rows, spacing_m and in_row_m bring plants closer"))
}

/// Returns a warning if a growth is outside the stages of the species file: its plants then stay at the first or last stage.
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
                .then(|| format!("its last stage is BBCH {top}, so BBCH {hi} looks like that"))
                .or_else(|| {
                    (lo < f64::from(first.bbch))
                        .then(|| format!("its first stage is BBCH {}, so BBCH {lo} looks like that", first.bbch))
                })
        }
        // Warn only if all ages are beyond the last stage: some of a wide distribution may be.
        Growth::AgeDays(days) => {
            let (lo, end) = (days.usual().0, last.days.get());
            (lo > end).then(|| format!("its last stage is at {end} days, so ages of {lo} days and more look like that"))
        }
    }
}
