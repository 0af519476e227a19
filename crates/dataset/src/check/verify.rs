//! Verification that a dataset is complete and consistent with its recipe and checksums.

use crate::check::difference::Difference;
use crate::check::manifest_check::{ManifestCheck, check_manifest};
use crate::make::finish::{lacks, ranges};
use crate::make::pack::store;
use crate::make::push;
use crate::make::render::{CachedField, RenderedSample, render, scene_file};
use crate::make::task::{Task, remaining};
use crate::make::timing_log;
use crate::model::image_files::{NAMES, belongs};
use crate::model::invariants;
use crate::model::split::Split;
use crate::read::native;
use crate::read::native::Files;
use crate::read::packs::Id;
use crate::read::packs::Packing;
use crate::read::set::{Set, in_parallel};
use crate::{File, format};
use furrow_base::math::ToInt;
use furrow_base::sampling::rng::mix;
use furrow_base::{Error, Result};
use furrow_job::{Renderer, Threads};
use furrow_render::render::RenderMonitor;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::AtomicBool;

/// Result of a verification.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Findings {
    /// Indices of missing or incomplete images.
    pub missing: Vec<u64>,
    /// Faults, one sentence each.
    pub faults: Vec<String>,
    /// Description of the checks that were skipped because images are missing; `None` if no image is missing.
    pub unchecked: Option<String>,
    /// Number of images that were checked.
    pub checked: u64,
    /// Number of images that were rendered again and are identical, or nearly identical with other ray tracing kernels.
    pub rendered: u64,
    /// The kernels and the difference, if images were rendered again with other ray tracing kernels.
    pub kernels: Option<OtherKernels>,
}

/// Comparison of images that were made with different ray tracing kernels.
#[derive(Clone, Debug, PartialEq)]
pub struct OtherKernels {
    /// Kernels that made the dataset.
    pub there: String,
    /// Kernels of this program.
    pub here: String,
    /// Largest difference of an image.
    pub most: Difference,
}

impl OtherKernels {
    /// Returns `None` if the renderer has the dataset's kernels.
    pub fn of(set: &Set, renderer: &Renderer) -> Result<Option<Self>> {
        let (there, here) = (set.recipe.rendering()?.kernels.clone(), renderer.kernels().to_owned());
        Ok((there != here).then_some(Self { there, here, most: Difference::NONE }))
    }
}

impl Findings {
    /// Returns an error that lists all faults and missing images, if there are any. `shards` is the dataset's number of
    /// shards, if known; the error then lists the incomplete shards.
    pub fn verdict(&self, set: &Set, shards: Option<u64>) -> Result<()> {
        const MOST: usize = 20;
        let mut words: Vec<String> = self.faults.iter().take(MOST).cloned().collect();
        if self.faults.len() > MOST {
            words.push(format!("and {} more", self.faults.len() - MOST));
        }
        if !self.missing.is_empty() {
            words.push(lacks(set, &self.missing, shards).to_string());
        }
        if words.is_empty() { Ok(()) } else { Err(Error::damaged(words.join("\nerror: "))) }
    }
}

/// Settings for rendering images again.
#[derive(Clone, Copy, Default)]
pub struct Rerender<'a> {
    /// Number of images to render.
    pub images: u64,
    /// The renderer; `None` for imported images.
    pub renderer: Option<&'a Renderer>,
    /// Memory limit of a field, bytes; `None` for the default.
    pub memory: Option<u64>,
}

/// Checks all files and invariants of a dataset, and renders some images again for comparison. `done` is called with
/// the index of each checked image; raising `stop` ends the verification with an error.
pub fn verify(
    set: &Set,
    again: &Rerender<'_>,
    threads: &Threads,
    done: &(dyn Fn(u64) + Sync),
    stop: &AtomicBool,
) -> Result<Findings> {
    push::refuse_freed(set)?;
    let count = set.recipe.count;
    let cut = threads.install(|| store::cut_short(set));
    let look_at = |index: u64| {
        if stop.load(std::sync::atomic::Ordering::Relaxed) {
            return Err(Error::stopped("stopped before all images were checked; nothing was changed"));
        }
        // The fault of a truncated archive is reported once, not for each image.
        let looked = if store::lies_in(set, &cut, index) { ImageCheck::MISSING } else { check_image(set, index)? };
        done(index);
        Ok(looked)
    };
    let looked: Vec<ImageCheck> = threads.install(|| in_parallel(0..count, look_at).collect::<Result<_>>())?;
    let mut found = Findings { faults: threads.install(|| in_archives(set)), ..Findings::default() };
    for (index, looked) in (0..count).zip(&looked) {
        if looked.missing {
            found.missing.push(index);
        } else {
            found.checked += 1;
        }
        found.faults.extend(looked.faults.iter().cloned());
    }
    found.faults.extend(shared_between_splits(set, &looked));
    found.faults.extend(made_differently(set)?);
    let ManifestCheck { mut faults, unchecked } = check_manifest(set, &found.missing)?;
    // Removes faults of archives that were already reported.
    let known_faults: BTreeSet<&String> = found.faults.iter().collect();
    faults.retain(|fault| !known_faults.contains(fault));
    // Faults of images come last, because only the first faults are printed.
    faults.append(&mut found.faults);
    found.faults = faults;
    if !found.missing.is_empty() {
        let photographs = "whether missing images are in two splits".to_owned();
        found.unchecked = Some(unchecked.into_iter().chain([photographs]).collect::<Vec<_>>().join("; "));
    }
    let Some(renderer) = again.renderer.filter(|_| again.images > 0) else { return Ok(found) };
    found.kernels = OtherKernels::of(set, renderer)?;
    let scene = scene_file(set)?.memory(again.memory).threads(threads);
    let mut kept = CachedField::default();
    for index in drawn(count, again.images) {
        if found.missing.contains(&index) {
            continue;
        }
        let made = render(set, &scene, index, renderer, RenderMonitor { done: &|_| (), stop }, &mut kept)?;
        let fault = match &mut found.kernels {
            None => other_bytes(set, &made)?,
            Some(kernels) => too_far(set, &made, kernels)?,
        };
        match fault {
            Some(fault) => found.faults.push(fault),
            None => found.rendered += 1,
        }
    }
    Ok(found)
}

/// Result of checking one image.
struct ImageCheck {
    missing: bool,
    faults: Vec<String>,
    /// SHA-256 of its colour image.
    photograph: Option<String>,
}

impl ImageCheck {
    const MISSING: Self = Self { missing: true, faults: Vec::new(), photograph: None };
}

fn check_image(set: &Set, index: u64) -> Result<ImageCheck> {
    let name = Set::name(index);
    let Some(checksums) = set.checksums(index) else {
        return Ok(ImageCheck::MISSING);
    };
    let mut faults: Vec<String> =
        set.faults(&checksums).into_iter().map(|(path, fault)| format!("{path} {fault}")).collect();
    let mut missing = !faults.is_empty();
    if !missing && remaining(set, &checksums)? != Task::Done {
        missing = true;
        faults.push(format!("image {name}: it was made with another recipe, or lacks a format"));
    }
    faults.extend(strays(set, &name));
    if !missing {
        match set.sample(index) {
            Ok(sample) => {
                let broken = invariants::faults(&set.recipe, &sample);
                faults.extend(broken.into_iter().map(|fault| format!("image {name}: {fault}")));
            }
            Err(e) => faults.push(e.to_string()),
        }
    }
    let mut photographs = checksums.files.iter().filter(|(path, _)| native::is_photograph(path));
    let photograph = photographs.next().map(|(_, sum)| sum.sha256.clone());
    Ok(ImageCheck { missing, faults, photograph })
}

/// Returns a fault for each file of an image that the recipe omits; such files are never read.
fn strays(set: &Set, name: &str) -> Vec<String> {
    let others = NAMES.iter().filter(|file| !belongs(&set.recipe, file));
    let paths = others.map(|file| format!("{}/{file}", native::folder(name)));
    let there = paths.filter(|path| set.length(path).is_ok());
    there.map(|path| format!("{path} does not belong here: the recipe leaves it out; remove it")).collect()
}

/// Returns a fault for each archive that was changed or is not written yet.
fn in_archives(set: &Set) -> Vec<String> {
    let Some(packing) = Packing::of(&set.recipe) else { return Vec::new() };
    let all: Vec<Id> = packing.all().collect();
    let fault = |id: &Id| {
        let path = id.path();
        let fault = match set.packs.get(&set.folder, *id) {
            Some(record) => record.tar.fault(&set.folder.join(&path))?,
            None => "is not written yet, or its record in seals/ is damaged".into(),
        };
        Some(format!("{path} {fault}"))
    };
    all.par_iter().filter_map(fault).collect()
}

/// Returns a fault if identical colour images are in two splits.
fn shared_between_splits(set: &Set, looked: &[ImageCheck]) -> Vec<String> {
    let mut places: BTreeMap<&str, BTreeSet<Split>> = BTreeMap::new();
    for (index, looked) in looked.iter().enumerate() {
        if let Some(hash) = &looked.photograph {
            places.entry(hash).or_default().insert(set.recipe.split_of(index.to_u64()));
        }
    }
    let twice = places.values().filter(|splits| splits.len() > 1).count();
    if twice == 0 { Vec::new() } else { vec![format!("{twice} images are in two splits")] }
}

/// Returns a fault if two runs made different files for the same image.
fn made_differently(set: &Set) -> Result<Vec<String>> {
    let mut images: BTreeMap<u64, BTreeSet<String>> = BTreeMap::new();
    for row in timing_log::rows(&set.folder)? {
        images.entry(row.index).or_default().insert(row.image);
    }
    let several: Vec<u64> = images.into_iter().filter(|(_, found)| found.len() > 1).map(|(index, _)| index).collect();
    if several.is_empty() {
        return Ok(Vec::new());
    }
    Ok(vec![format!("two runs made different files for images {}: do the machines differ?", ranges(&several))])
}

/// Returns the indices of the images to render again: a reproducible pseudo-random choice of `again` images.
fn drawn(count: u64, again: u64) -> Vec<u64> {
    let mut all: Vec<u64> = (0..count).collect();
    all.sort_by_key(|k| mix(*k));
    all.truncate(again.min(count).to_usize());
    all.sort_unstable();
    all
}

/// Returns a fault if files of an image differ after rendering it again.
fn other_bytes(set: &Set, made: &RenderedSample) -> Result<Option<String>> {
    let mut files = native::files(&set.recipe, &made.sample, &made.text)?;
    for (_, format) in format::all(&set.recipe)? {
        files.extend(format.image(&set.recipe, &made.sample)?);
    }
    let differs = |file: &&File| set.contents(&file.path).ok().as_ref() != Some(&file.bytes);
    let wrong: Vec<&str> = files.iter().filter(differs).map(|f| f.path.as_str()).collect();
    Ok((!wrong.is_empty()).then(|| format!("rendered again, these files differ: {}", wrong.join(", "))))
}

/// Returns a fault if an image that was rendered again differs by more than [`Difference::ALLOWED`].
fn too_far(set: &Set, made: &RenderedSample, kernels: &mut OtherKernels) -> Result<Option<String>> {
    let name = &made.sample.record.name;
    let difference = Difference::between(&set.sample(made.sample.record.index)?, &made.sample);
    kernels.most = kernels.most.max(difference);
    let fault = || {
        format!(
            "image {name}: rendered again by {}, it differs in {difference}; other kernels explain at most {}",
            kernels.here,
            Difference::ALLOWED
        )
    };
    Ok((!difference.within(Difference::ALLOWED)).then(fault))
}
