//! Estimates the cost of a field before it is built: film, LiDAR echoes, ground, debris, plants, models, images.

use super::census::Population;
use super::detail::MeshDetail;
use super::drawn::Drawn;
use super::member::Member;
use super::preview::CountedPlant;
use super::seedling::{PlantSite, Seedling, grow};
use super::view::VisibleGround;
use super::{ground, model_spots, sow};
use crate::desc::Detail;
use crate::estimate::{Estimate, Share};
use crate::library::Library;
use furrow_base::Result;
use furrow_base::geometry::Cost;
use furrow_base::math::{ToFloat, Vec3};
use furrow_base::ron_file::Step;
use furrow_grow::plant::most_triangles;
use furrow_grow::soil::Expected;
use furrow_optics::optics::soil::LOESS;
use furrow_render::film::Pixel;
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::ops::Range;

/// Bytes per pixel in addition to the film: labels, images, and the encoded files before they are written.
const BYTES_BESIDE: f64 = 160.0;
/// Core seconds to label a pixel and write it.
const SECONDS_PER_PIXEL: f64 = 2e-6;
/// Bytes per LiDAR pulse: its echoes in memory, and in the file before it is written.
const BYTES_PER_PULSE: f64 = 400.0;
/// Core seconds to trace a LiDAR pulse.
const SECONDS_PER_PULSE: f64 = 5e-6;
/// Number of plants of a population that are grown to estimate the size of all.
const LOOKED_AT: usize = 4;
/// The same number for single plants, which may differ in species.
const LOOKED_AT_PLACED: usize = 16;
/// Maximum number of triangles of a plant that is grown for the estimate.
const TRIED: f64 = 2e7;
/// Bytes of an instance of a plant without its organs, in the BVH and in the records.
const BYTES_PER_INSTANCE: f64 = 1800.0;
/// Bytes of each organ of an instance: its part and the record of its leaf.
const BYTES_PER_INSTANCED_ORGAN: f64 = 500.0;
/// Core seconds to place an instance.
const SECONDS_PER_INSTANCE: f64 = 1e-5;
/// Core seconds per triangle of a plant.
const SECONDS_PER_TRIANGLE: f64 = 2e-6;

/// Time to build the plants of a field above which a coarser level of detail is recommended, core seconds.
const SLOW_S: f64 = 60.0;

/// Estimates the cost of the field for the ground in sight.
pub(super) fn estimate(drawn: &Drawn<'_>, library: &mut Library, sight: &VisibleGround) -> Result<Estimate> {
    let camera = &drawn.camera;
    let pixels = f64::from(camera.width()) * f64::from(camera.height());
    let film = Cost::work(pixels * (size_of::<Pixel>().to_f64() + BYTES_BESIDE), pixels * SECONDS_PER_PIXEL);
    let coarser = match drawn.detail {
        MeshDetail::Full => ", or lower the camera, or set detail: ByPixel",
        MeshDetail::ByPixel => ", or lower the camera, or set detail: Instanced",
        MeshDetail::Instanced => ", or lower the camera",
    };
    let mut shares = Vec::new();
    let fewer = match (drawn.desc.drive.is_some(), drawn.scanners.is_empty()) {
        (false, true) => "",
        (true, true) => "use fewer frames, or ",
        (false, false) => "lower reach_m, or ",
        (true, false) => "use fewer frames, lower reach_m, or ",
    };
    let mut add = |at: &[Step<'static>], cost, advice: &str| {
        shares.push(Share { at: at.to_vec(), cost, advice: format!("{fewer}{advice}") });
    };
    add(&[Step::Field("camera"), Step::Field("size")], film, "make the image smaller, with --width");
    // Only one frame is scanned at a time, and all frames have the same number of pulses.
    if let Some(lidar) = drawn.scanners.first() {
        let pulses = f64::from(lidar.columns()) * f64::from(lidar.beams());
        let echoes = Cost::work(pulses * BYTES_PER_PULSE, pulses * SECONDS_PER_PULSE);
        add(&[Step::Field("lidar")], echoes, "use fewer beams, or a larger step in `pulses`");
    }
    if let Some(soil) = &drawn.desc.soil {
        let (bare, all) = ground::expected_soil(drawn, soil, sight.view);
        add(&[Step::Field("camera")], bare, "lower the camera, narrow its angle of view, or make the image smaller");
        for Expected { at, cost, advice } in all {
            add(&[&[Step::Field("soil")], &at[..]].concat(), cost, &format!("{advice}{coarser}"));
        }
    }
    let (seedlings, populations) = sow::seedlings(drawn, library, sight, &[])?;
    let mut counted = Vec::new();
    for (population, range) in populations {
        let (at, advice) = population.place();
        let number = range.len();
        let some = count(drawn, &seedlings, population, range.clone())?;
        let shared = seedlings[range].iter().filter_map(|s| s.member).collect::<Vec<_>>();
        add(&at, expected(&some, number, &shared), &format!("{advice}{coarser}"));
        counted.extend(some);
    }
    if let Some(preview) = &drawn.options.preview {
        preview.keep_counted(counted);
    }
    for k in 0..drawn.desc.models.len() {
        let (at, cost, advice) = model(drawn, library, sight, k)?;
        add(&at, cost, advice);
    }
    shares.extend(pictured(drawn, library)?);
    Ok(Estimate { shares })
}

/// Estimates the cost of model `k`: one copy of its meshes, and an instance for each position where it is sown. A preview has a copy for
/// each. Returns the path of the setting that controls the number, the cost, and advice.
fn model(
    drawn: &Drawn<'_>,
    library: &mut Library,
    sight: &VisibleGround,
    k: usize,
) -> Result<(Vec<Step<'static>>, Cost, &'static str)> {
    let model = library.model(drawn.page, &drawn.desc.models[k])?;
    let triangles = model.parts.iter().map(|part| part.mesh.triangles.len()).sum::<usize>();
    let parts = model.parts.len().to_f64();
    let copy = Cost::of(triangles.to_f64(), parts);
    let at = vec![Step::Field("models"), Step::Item(k)];
    let Some(spots) = model_spots::spots(drawn, k, sight, &[])? else {
        return Ok((at, copy, "place fewer models, or coarser ones"));
    };
    let number = spots.len().to_f64();
    if drawn.options.preview.is_some() {
        return Ok((at, copy * number, "sow fewer models, or coarser ones"));
    }
    let instance = Cost::work(BYTES_PER_INSTANCE + parts * BYTES_PER_INSTANCED_ORGAN, SECONDS_PER_INSTANCE);
    Ok((at, copy + instance * number, "sow fewer models, or models of fewer parts"))
}

/// Returns a warning if `detail: Auto` has chosen a mesh for each plant and the plants take long: shared meshes take a fraction. It is not
/// given for a level that the scene file states.
pub(super) fn slow(drawn: &Drawn<'_>, estimate: &Estimate) -> Option<String> {
    let of_plants =
        |share: &&Share| [Some(&Step::Field("crops")), Some(&Step::Field("weeds"))].contains(&share.at.first());
    let seconds = estimate.shares.iter().filter(of_plants).map(|share| share.cost.seconds).sum::<f64>();
    let chosen = drawn.desc.detail == Detail::Auto && drawn.detail == MeshDetail::ByPixel;
    (chosen && seconds > SLOW_S).then(|| {
        format!(
            "the plants of this field take about {seconds:.0} core seconds to build; detail: Instanced shares meshes between plants of a \
             species and stage, in a fraction of the time and memory, and a lower reach_m builds fewer plants"
        )
    })
}

/// Estimates the memory of images: soil textures, leaf images and model textures.
fn pictured(drawn: &Drawn<'_>, library: &mut Library) -> Result<Vec<Share>> {
    let (page, desc) = (drawn.page, drawn.desc);
    let at = |list, k, field| vec![Step::Field(list), Step::Item(k), Step::Field(field)];
    let mut places = Vec::new();
    let layers = desc.soil.iter().flat_map(|soil| &soil.layers);
    for (k, layer) in layers.enumerate() {
        let place = [vec![Step::Field("soil")], at("layers", k, "albedo")].concat();
        places.push((place, vec![library.layer_pictures(page, layer)?]));
    }
    let crops = drawn.sown.clone().map(|k| ("crops", k, &desc.crops[k].species));
    let weeds = desc.weeds.iter().enumerate().map(|(k, weed)| ("weeds", k, &weed.species));
    let plants = desc.plants.iter().enumerate().map(|(k, plant)| ("plants", k, &plant.species));
    for (list, k, species) in crops.chain(weeds).chain(plants) {
        places.push((at(list, k, "species"), library.species(page, species)?.pictures.clone()));
    }
    for (k, model) in desc.models.iter().enumerate() {
        places.push((at("models", k, "file"), vec![library.model_pictures(page, model)?]));
    }
    Ok(library.counted.shares(places))
}

/// Counts triangles and organs of sample plants of a population by growing them. A plant that might itself be too large is not grown.
fn count(
    drawn: &Drawn<'_>,
    seedlings: &[Seedling],
    population: Population,
    range: Range<usize>,
) -> Result<Vec<CountedPlant>> {
    let number = range.len();
    let most = if population == Population::Placed { LOOKED_AT_PLACED } else { LOOKED_AT };
    let tried = number.min(most);
    let samples = (0..tried).into_par_iter().map(|k| {
        let seedling = &seedlings[range.start + (2 * k + 1) * number / (2 * tried)];
        let cell = drawn.cell(seedling.position);
        let known = drawn.options.preview.as_ref().and_then(|preview| preview.counted(seedling, cell));
        let size = known.map_or_else(|| size(seedling, cell), Ok)?;
        Ok(CountedPlant { seedling: seedling.clone(), cell, size })
    });
    samples.collect()
}

/// Returns the numbers of triangles and organs of a plant; for a plant that may exceed [`TRIED`], the upper bound and 1.
fn size(seedling: &Seedling, cell: f32) -> Result<(f64, f64)> {
    let bound = most_triangles(&seedling.species.desc.plant);
    if bound > TRIED {
        return Ok((bound, 1.0));
    }
    // Holes and spots are expensive to compute and do not change the triangles.
    let healthy = Seedling { condition: None, ..seedling.clone() };
    let place = PlantSite { height: 0.0, normal: Vec3::Z, rise: 0.0, dust: LOESS, cell, rigged: false };
    let (_, organs) = grow(&healthy, &place, |_| true)?;
    let organs = organs.unwrap_or_default();
    let triangles = organs.iter().map(|organ| organ.part.mesh.triangles.len()).sum::<usize>();
    Ok((triangles.to_f64(), organs.len().to_f64()))
}

/// Estimates the cost of `number` plants from the samples `some`. `shared` lists the bank plants of those that are instances.
fn expected(some: &[CountedPlant], number: usize, shared: &[Member]) -> Cost {
    let (triangles, organs) = some.iter().fold((0.0, 0.0), |(a, b), CountedPlant { size: (t, o), .. }| (a + t, b + o));
    let each = Cost::of(triangles, organs) + Cost::work(0.0, triangles * SECONDS_PER_TRIANGLE);
    let meshes = number - shared.len() + shared.iter().collect::<BTreeSet<_>>().len();
    let of = some.len().max(1).to_f64();
    let instances = Cost::work(BYTES_PER_INSTANCE + organs / of * BYTES_PER_INSTANCED_ORGAN, SECONDS_PER_INSTANCE);
    each * (meshes.to_f64() / of) + instances * shared.len().to_f64()
}
