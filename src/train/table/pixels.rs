//! Whether crops can be scaled by the pixels of their images on the ground, told before anything is rendered: the images that are there are asked
//! for their records, scenes for their cameras.

use super::desc::ExperimentDesc;
use super::experiment::{Part, Source, TrainSet};
use super::renamed::as_written;
use super::sets::Bound;
use crate::ablation::{Edit, FULL};
use crate::dataset::{Set, recipe};
use crate::job::SceneFile;
use crate::ron_file::{RonFile, Step};
use crate::train::data::{Pick, Store};
use crate::train::run::PIXEL_MM;
use crate::{Error, Result};

/// Fields of a scene, most, whose cameras are asked for.
const ASKED: u64 = 64;

/// Checks that the images of training sets tell the size of their pixels on the ground where `augment_scale` asks for it. Of scenes the first 64
/// fields are asked for their cameras; what is wrong with sets otherwise is told by others.
///
/// # Errors
/// The first training set with an image that does not, at its place in the experiment file.
pub fn check_pixel_sizes(bound: &Bound, page: &RonFile) -> Result<()> {
    let experiment = &bound.experiment;
    for train in experiment.train.iter().filter(|train| !train.plan.hyper.augment_scale.is_relative()) {
        let Some(lack) = train.from.iter().find_map(|part| untold(bound, train, part)) else { continue };
        let scale = train.plan.hyper.augment_scale.name();
        let name = &train.name;
        let what = format!("`{name}` cannot be trained with \"{scale}\": {lack} the size of its pixels on the ground");
        let help = "imported images do not, nor cameras that do not look down: write \"relative\", or that in \
                    `hyperparameters` of this training set alone";
        let desc: ExperimentDesc = page.parse_all()?;
        let at = place(&desc, train, experiment.scale.as_deref());
        return Err(page.blame(&as_written(page, &at), Error::input(what).help(help)));
    }
    Ok(())
}

/// Where the scale of a training set's crops stands: with the training set, the scale of the experiment or the experiment.
fn place(desc: &ExperimentDesc, train: &TrainSet, scale: Option<&str>) -> Vec<Step<'static>> {
    let own = desc.train.iter().position(|desc| desc.name == train.name);
    let own = own.filter(|i| desc.train[*i].hyperparameters.augment_scale.is_some());
    let scaled = scale.and_then(|name| desc.scales.find(name));
    let scaled = scaled.filter(|i| desc.scales.0[*i].1.hyperparameters.augment_scale.is_some());
    let list = own.map(|i| ("train", i)).or(scaled.map(|i| ("scales", i)));
    let mut at = list.map_or_else(Vec::new, |(list, i)| vec![Step::Field(list), Step::Item(i)]);
    at.extend(["hyperparameters", "augment_scale"].map(Step::Field));
    at
}

/// Which image of a part does not tell the size of its pixels, in words that go on with what it does not tell; `None` where all do, as far as that
/// is known.
fn untold(bound: &Bound, train: &TrainSet, part: &Part) -> Option<String> {
    let (name, source) = &bound.experiment.sets[part.set];
    if bound.is_imported(part.set) {
        return Some(format!("no image of the set `{name}` tells"));
    }
    let there = untold_there(bound, train, part);
    let number = there.or_else(|| untold_of_scene(source, part.pick, train.plan.shape.width))?;
    Some(format!("image {} of the set `{name}` does not tell", Set::name(number)))
}

/// Number of the first such image of those that are there.
fn untold_there(bound: &Bound, train: &TrainSet, part: &Part) -> Option<u64> {
    if !bound.folder(part.set).join(recipe::FILE).is_file() {
        return None;
    }
    // Other seeds pick other images only at random.
    let seeds = bound.experiment.seeds.iter().take(if matches!(part.pick, Pick::Random(_)) { usize::MAX } else { 1 });
    let (selection, plan) = ([bound.selection(part)], &train.plan);
    let open = |seed: u64| Store::open(&selection, Pick::All, seed, &plan.classes, &plan.shape, false, 0).ok();
    seeds.copied().filter_map(open).find_map(|store| store.first_untold())
}

/// The same of those that are to be rendered, `width` pixels wide where networks see them; of images that are picked at random one where none tells.
fn untold_of_scene(source: &Source, pick: Pick, width: u32) -> Option<u64> {
    let Source::Scene { file, count, size, seed, edit, split, .. } = source else { return None };
    let edit = edit.map_or(Ok(&FULL), Edit::named).ok()?;
    let scene = SceneFile::edited(file, edit).ok()?.seed(*seed).width(size.0).height(size.1);
    let captures = scene.captures();
    let is_picked = |number: u64| match pick {
        Pick::All | Pick::Random(_) => true,
        Pick::Split(wanted) => split.of(number / captures) == wanted,
        Pick::Range(from, to) => (from..to).contains(&number),
        Pick::Every(first, of) => number % of == first,
    };
    let (mut first, mut any_tells) = (None, false);
    for field in 0..count.div_ceil(captures).min(ASKED) {
        let numbers = field * captures..((field + 1) * captures).min(*count);
        // Those of one day after those of another.
        let cameras = scene.cameras(field).ok()?;
        for (number, camera) in numbers.zip(cameras.iter().cycle()).filter(|(number, _)| is_picked(*number)) {
            let mm = camera.pixel_m().map(|m| 1e3 * m * f64::from(size.0) / f64::from(width));
            if mm.is_some_and(|mm| PIXEL_MM.contains(&mm)) {
                any_tells = true;
            } else {
                first = first.or(Some(number));
            }
        }
    }
    first.filter(|_| !any_tells || !matches!(pick, Pick::Random(_)))
}
