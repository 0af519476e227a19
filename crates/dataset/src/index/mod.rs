//! Tables for selecting images and plants, in a format that databases read: `images.parquet` has a row for each image,
//! `plants.parquet` a row for each visible or occluded plant of an image. The format `traits` adds a table of leaves
//! (`leaves.parquet`).
//!
//! A cell is empty if its value is unknown, as for models from disk and for imported images.

pub(crate) mod leaves;
pub(crate) mod origin;
mod table;

use crate::model::record::{Plant, PointState, Record, Seen};
use crate::read::native;
use crate::read::packs::Packing;
use crate::read::set::{Set, SetWriter};
use furrow_base::Result;
use furrow_base::math::Spectrum;
use furrow_optics::light::LightRecord;
use furrow_render::scene::tag::Class;
use furrow_render::settings::Engine;
use origin::Origin;
use table::{Row, Table, count};

/// Path of the table of images, relative to the dataset's folder.
pub const IMAGES: &str = "images.parquet";
/// Path of the table of plants, relative to the dataset's folder.
pub const PLANTS: &str = "plants.parquet";

/// Writes both tables of a dataset whose images are complete.
pub(crate) fn write(set: &Set, out: &mut SetWriter<'_>) -> Result<()> {
    let mut records = set.all().peekable();
    if let Some(Ok(first)) = records.peek() {
        let like = of_image(set, first);
        out.file(IMAGES, |out| {
            let mut table = Table::begin(out, &like)?;
            records.try_for_each(|record| table.add(of_image(set, &record?)))?;
            table.end()
        })?;
    }
    out.file(PLANTS, |out| {
        let none = Plant {
            number: 0,
            id: None,
            class: Class::Soil,
            kind: 0,
            seen: Seen::default(),
            stem: None,
            grown: None,
            leaves: Vec::new(),
        };
        let mut table = Table::begin(out, &of_plant(&Origin::default(), &none))?;
        for record in set.all() {
            let record = record?;
            let origin = Origin::of(&set.recipe, &record);
            for plant in &record.plants {
                table.add(of_plant(&origin, plant))?;
            }
        }
        table.end()
    })
}

/// Returns the angle between the optical axis of the camera and straight down, degrees.
fn tilt(world_to_camera: [[f64; 3]; 3]) -> f64 {
    (-world_to_camera[2][2]).clamp(-1.0, 1.0).acos().to_degrees()
}

/// Joins values into one cell, separated by semicolons.
fn joined<'a>(values: impl IntoIterator<Item = &'a str>) -> String {
    values.into_iter().collect::<Vec<_>>().join("; ")
}

/// Returns the mean number of samples per pixel of a path-traced image: that of the film or, if the record has none (as
/// for one sample), the requested number.
fn spp(set: &Set, record: &Record) -> Option<f64> {
    let recorded_spp = record.sampling.as_ref().map(|sampling| sampling.spp);
    let traced = || set.recipe.rendering().ok().filter(|rendering| rendering.engine == Engine::Trace);
    recorded_spp.or_else(|| record.exposure.and_then(|_| Some(f64::from(traced()?.spp))))
}

fn of_image(set: &Set, record: &Record) -> Row {
    let capture = record.capture.as_ref();
    let conditions = record.conditions.as_ref();
    let pixels = |class: Class| record.classes.iter().find(|share| share.class == class);
    let covered = |class: Class| pixels(class).and_then(|share| share.covered);
    let seen = |class: Class| count(record.seen().filter(|plant| plant.class == class).count());
    let camera = conditions.map(|conditions| &conditions.camera);
    let lights = conditions.map(|conditions| &conditions.lights[..]).unwrap_or_default();
    let sun = lights.iter().find_map(|light| match light {
        LightRecord::Daylight(day) => Some((day.sun_elevation_deg, day.sun_azimuth_deg, day.turbidity, day.cloud)),
        _ => None,
    });
    let ground = lights.iter().fold(Spectrum::ZERO, |sum, light| sum + light.irradiance_w_m2_nm());
    let soil = conditions.and_then(|conditions| conditions.soil.as_ref());
    let layer = soil.and_then(|soil| soil.layers.iter().max_by(|a, b| a.share.total_cmp(&b.share)));
    let row = conditions.and_then(|conditions| Some(&conditions.crops.first()?.rows));
    let place = match Packing::of(&set.recipe) {
        Some(packing) => packing.id(record.index).path(),
        None => native::folder(&record.name),
    };
    vec![
        ("image", record.name.as_str().into()),
        ("number", count(record.index).into()),
        ("split", record.split.name().into()),
        ("place", place.into()),
        ("source", record.source.as_deref().into()),
        ("field", count(set.recipe.field_of(record.index).0).into()),
        ("camera", capture.map(|capture| capture.camera.as_str()).into()),
        ("day", capture.and_then(|capture| capture.day).into()),
        ("frame", capture.map(|capture| capture.frame).into()),
        ("light", record.light.map(count).into()),
        ("time_s", capture.map(|capture| capture.time_s).into()),
        ("width", record.width.into()),
        ("height", record.height.into()),
        ("soil_px", pixels(Class::Soil).map(|share| count(share.pixels)).into()),
        ("crop_px", pixels(Class::Crop).map(|share| count(share.pixels)).into()),
        ("weed_px", pixels(Class::Weed).map(|share| count(share.pixels)).into()),
        ("ignored_px", count(record.ignored).into()),
        ("crop_covered_px", covered(Class::Crop).into()),
        ("weed_covered_px", covered(Class::Weed).into()),
        ("crops_seen", seen(Class::Crop).into()),
        ("weeds_seen", seen(Class::Weed).into()),
        ("leaves_seen", count(record.leaves().count()).into()),
        ("ground_m2", record.canopy.map(|canopy| canopy.ground_m2).into()),
        ("leaf_area_m2", record.canopy.and_then(|canopy| canopy.leaf_area_m2).into()),
        ("lai", record.canopy.and_then(|canopy| canopy.lai).into()),
        ("crops", conditions.map(|c| joined(c.crops.iter().map(|crop| crop.species.as_str()))).into()),
        ("weeds", conditions.map(|c| joined(c.weeds.iter().map(|weed| weed.species.as_str()))).into()),
        ("row_spacing_m", row.map(|row| row.spacing_m).into()),
        ("row_azimuth_deg", row.map(|row| row.azimuth_deg).into()),
        ("lights", conditions.map(|_| joined(lights.iter().map(LightRecord::kind))).into()),
        ("sun_elevation_deg", sun.map(|(elevation, ..)| elevation).into()),
        ("sun_azimuth_deg", sun.map(|(_, azimuth, ..)| azimuth).into()),
        ("turbidity", sun.map(|(_, _, turbidity, _)| turbidity).into()),
        ("cloud", sun.map(|(.., cloud)| cloud).into()),
        ("green_irradiance_w_m2_nm", conditions.map(|_| ground.to_array()[1]).into()),
        ("moisture", soil.map(|soil| soil.moisture.mean).into()),
        ("roughness_mm", soil.map(|soil| soil.relief.rms_mm).into()),
        ("clods_per_m2", soil.map(|soil| soil.clods.over_5mm_per_m2).into()),
        ("stones_cover", soil.map(|soil| soil.stones_cover.iter().fold(0.0, |sum, cover| sum + cover)).into()),
        ("straw_cover", soil.map(|soil| soil.litter.straw_cover).into()),
        ("soil_layer", layer.map(|layer| layer.name.as_str()).into()),
        ("camera_height_m", camera.map(|camera| camera.position_m[2]).into()),
        ("camera_tilt_deg", camera.map(|camera| tilt(camera.world_to_camera)).into()),
        ("pixel_m", camera.and_then(furrow_optics::sensor::CameraRecord::pixel_m).into()),
        ("gain", record.exposure.map(|exposure| exposure.gain).into()),
        ("nir_gain", record.exposure.map(|exposure| exposure.nir_gain).into()),
        ("spp", spp(set, record).into()),
        ("relative_error", record.sampling.as_ref().map(|sampling| sampling.relative_error).into()),
        ("warnings", joined(record.warnings.iter().map(String::as_str)).into()),
    ]
}

fn of_plant(origin: &Origin<'_>, plant: &Plant) -> Row {
    let grown = plant.grown.as_ref();
    let place = |axis: usize| grown.map(|grown| grown.position_m[axis]);
    // Models have neither an EPPO code nor an age.
    let aged = grown.filter(|grown| !grown.eppo.is_empty());
    let traits = grown.and_then(|grown| grown.traits);
    let condition = grown.and_then(|grown| grown.condition);
    let seen = &plant.seen;
    let side = |k: usize| seen.bounds.map(|bounds| count(bounds.0[k]));
    let state = plant.stem.map(|stem| match stem.state {
        PointState::Outside => "outside",
        PointState::Hidden => "hidden",
        PointState::Visible => "visible",
    });
    let mut row = origin.cells();
    row.extend([
        ("plant", plant.number.cast_signed().into()),
        ("id", plant.id.into()),
        ("class", plant.class.name().into()),
        ("species", aged.map(|grown| grown.eppo.as_str()).into()),
        ("name", grown.map(|grown| grown.species.as_str()).into()),
        ("visible_px", seen.pixels.into()),
        ("unoccluded_px", seen.unoccluded.into()),
        ("whole_px", seen.whole.into()),
        ("visible_share", seen.visible_fraction().into()),
        ("shown_share", seen.shown_fraction().into()),
        ("box_x", side(0).into()),
        ("box_y", side(1).into()),
        ("box_width", side(2).into()),
        ("box_height", side(3).into()),
        ("stem_x", plant.stem.map(|stem| stem.x).into()),
        ("stem_y", plant.stem.map(|stem| stem.y).into()),
        ("stem_state", state.into()),
        ("bbch", aged.map(|grown| grown.bbch).into()),
        ("age_days", aged.map(|grown| grown.age_days).into()),
        ("x_m", place(0).into()),
        ("y_m", place(1).into()),
        ("z_m", place(2).into()),
        ("height_m", grown.map(|grown| grown.height_m).into()),
        ("radius_m", grown.map(|grown| grown.radius_m).into()),
        ("leaves", grown.map(|grown| grown.leaves).into()),
        ("leaves_seen", count(plant.leaves.iter().filter(|leaf| leaf.seen.pixels > 0).count()).into()),
        ("leaf_area_m2", traits.map(|traits| traits.leaf_area_m2).into()),
        ("cover_m2", traits.map(|traits| traits.cover_m2).into()),
        ("top_m", traits.map(|traits| traits.top_m).into()),
        ("holes", condition.map(|condition| condition.holes).into()),
        ("shot_holes", condition.map(|condition| condition.shot_holes).into()),
        ("bites", condition.map(|condition| condition.bites).into()),
        ("tears", condition.map(|condition| condition.tears).into()),
        ("chlorosis", condition.map(|condition| condition.chlorosis).into()),
        ("blotches", condition.map(|condition| condition.blotches).into()),
        ("spots", condition.map(|condition| condition.spots).into()),
        ("scorched", condition.map(|condition| condition.scorched).into()),
        ("scorch", condition.map(|condition| condition.scorch).into()),
        ("reddening", condition.map(|condition| condition.reddening).into()),
        ("dust", condition.map(|condition| condition.dust).into()),
        ("splash", condition.map(|condition| condition.splash).into()),
        ("wilt", condition.map(|condition| condition.wilt).into()),
        ("pale_young", condition.map(|condition| condition.pale_young).into()),
        ("greenness", condition.map(|condition| condition.greenness).into()),
    ]);
    row
}
