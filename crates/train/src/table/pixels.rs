//! Check that crops can be scaled by the ground sampling distance of their images, before anything is rendered. Existing images are
//! checked by their metadata, scenes that are not rendered yet by their cameras.

use super::desc::ExperimentDesc;
use super::experiment::{ImageSelection, Source, TrainSet};
use super::sets::BoundExperiment;
use crate::data::{Pick, Store};
use crate::run::PIXEL_MM;
use furrow_base::ron_file::{RonFile, Step};
use furrow_base::{Error, Result};
use furrow_dataset::Set;
use furrow_dataset::model::recipe;
use furrow_field::ablation::{Edit, FULL};
use furrow_job::SceneFile;

/// Maximum number of fields of a scene whose cameras are checked.
const ASKED: u64 = 64;

/// Checks that the images of training sets record their ground sampling distance if `augment_scale` needs it. Of a scene the cameras of the
/// first 64 fields are checked. Other errors in datasets are ignored here; they are reported when the dataset is opened or made.
///
/// # Errors
/// Returns an error for the first training set with an image that lacks it, at the value of `augment_scale` in the experiment file.
pub fn check_pixel_sizes(bound: &BoundExperiment, page: &RonFile) -> Result<()> {
    let experiment = &bound.experiment;
    for train in experiment.train.iter().filter(|train| !train.plan.hyper.augment_scale.is_relative()) {
        let Some(lack) = train.from.iter().find_map(|part| lacking(bound, train, part)) else { continue };
        let scale = train.plan.hyper.augment_scale.name();
        let name = &train.name;
        let what = format!("`{name}` cannot be trained with \"{scale}\": {lack} its ground sampling distance");
        let help = "imported images and cameras that do not look down have none: write \"relative\", here or in the \
                    `hyperparameters` of this training set alone";
        let desc: ExperimentDesc = page.parse_all()?;
        let at = place(&desc, train, experiment.scale.as_deref());
        return Err(page.blame(&at, Error::input(what).help(help)));
    }
    Ok(())
}

/// Returns the path of the `augment_scale` that applies to a training set: in the training set, the experiment's scale or the experiment.
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

/// Returns the beginning of a message about the first image of a part without a ground sampling distance, up to the verb. Returns `None` if
/// no such image is known.
fn lacking(bound: &BoundExperiment, train: &TrainSet, part: &ImageSelection) -> Option<String> {
    let (name, source) = &bound.experiment.sets[part.set];
    if bound.is_imported(part.set) {
        return Some(format!("no image of the set `{name}` records"));
    }
    let there = first_stored_without(bound, train, part);
    let number = there.or_else(|| first_rendered_without(source, part.pick, train.plan.shape.width))?;
    Some(format!("image {} of the set `{name}` does not record", Set::name(number)))
}

/// Returns the number of the first existing image without a ground sampling distance.
fn first_stored_without(bound: &BoundExperiment, train: &TrainSet, part: &ImageSelection) -> Option<u64> {
    if !bound.folder(part.set).join(recipe::FILE).is_file() {
        return None;
    }
    // The seed changes the selection only if images are picked at random.
    let seeds = bound.experiment.seeds.iter().take(if matches!(part.pick, Pick::Random(_)) { usize::MAX } else { 1 });
    let (selection, plan) = ([bound.selection(part)], &train.plan);
    let open = |seed: u64| Store::open(&selection, Pick::All, seed, &plan.classes, &plan.shape, false, 0).ok();
    seeds.copied().filter_map(open).find_map(|store| store.first_without_pixel_size())
}

/// Returns the number of the first image to be rendered whose camera gives no ground sampling distance in range, for network inputs `width`
/// pixels wide. If images are picked at random, returns one only if no camera gives any.
fn first_rendered_without(source: &Source, pick: Pick, width: u32) -> Option<u64> {
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
    let (mut first, mut any_known) = (None, false);
    for field in 0..count.div_ceil(captures).min(ASKED) {
        let numbers = field * captures..((field + 1) * captures).min(*count);
        // Images of a field are ordered by day, then by camera.
        let cameras = scene.cameras(field).ok()?;
        for (number, camera) in numbers.zip(cameras.iter().cycle()).filter(|(number, _)| is_picked(*number)) {
            let mm = camera.pixel_m().map(|m| 1e3 * m * f64::from(size.0) / f64::from(width));
            if mm.is_some_and(|mm| PIXEL_MM.contains(&mm)) {
                any_known = true;
            } else {
                first = first.or(Some(number));
            }
        }
    }
    first.filter(|_| !any_known || !matches!(pick, Pick::Random(_)))
}
