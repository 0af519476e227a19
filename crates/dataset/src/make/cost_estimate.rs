//! Cost estimate of a dataset before it is made: core time, disk space, number of files, memory.
//!
//! At least three of its images (the first, the middle and the last one) are rendered as probes at full size with two
//! smaller numbers of samples. Time that grows with the number of samples is rendering time; the rest is scene
//! construction, labelling and writing. File sizes are extrapolated in the same way, since noise compresses badly. The
//! files of the whole dataset (lists, report) are written for a few copies of the probes in a temporary folder, and
//! their size is extrapolated to all images.
//!
//! Probes are rendered one after another in memory; nothing is written to the dataset's folder.

use crate::make::begin::merged_recipe;
use crate::make::finish::finish;
use crate::make::generate::{MOST_AT_ONCE, formatted};
use crate::make::meter;
use crate::make::plan::{Draft, Order, draft};
use crate::make::render::{CachedField, RenderedSample, render, view_of};
use crate::model::invariants;
use crate::model::recipe::{FILE, ImageOrigin, Recipe, compact};
use crate::model::record::{CaptureRecord, Record};
use crate::model::split::{Shares, Split};
use crate::read::checksum_record::{BLOCK, ChecksumRecord, write_files};
use crate::read::native;
use crate::read::native::is_native;
use crate::read::packs::Packing;
use crate::read::set::Set;
use crate::{File, report};
use furrow_base::math::{RoundTo, ToFloat, ToInt};
use furrow_base::sampling::Sampler;
use furrow_base::{Error, Result};
use furrow_job::{Renderer, SceneFile, Threads};
use furrow_render::render::RenderMonitor;
use furrow_render::settings::{Quality, RenderOptions};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Samples of all pixels of a probe's second rendering: about 1.5 core seconds, hundred times the resolution of the clock.
const SAMPLES: u64 = 700_000;
/// Smallest number of samples per pixel of a probe's second rendering: the first has fewer.
const FEWEST: u64 = 2;
/// Smallest number of probes, whatever time they take, and largest number.
const PROBES: [usize; 2] = [3, 16];
/// Core seconds of the process within which further probes must end, once the smallest number is reached.
const LONG_ENOUGH_S: f64 = 13.0;
/// Ratio of the numbers of samples of a probe's second and first rendering.
const STEP: u32 = 4;
/// Approximate length of an image's row in the timing log, bytes.
const LOG_ROW: u64 = 270;
/// Overhead in bytes of a file in an archive: tar header, mean padding, entry in the archive's record.
const MEMBER: u64 = 512 + 256 + 40;
/// Length in bytes of the hash of the checksum record itself, with its key, in a checksum record.
const SEAL_HASH: u64 = 81;
/// Number of images for which the time of writing the whole dataset's files is extrapolated; for further images only
/// the records are read.
const MOST_LOOKED_AT: u64 = 240;
/// Largest number of fields whose memory is estimated.
const MOST_ASKED: u64 = 64;
/// Number of images that the report shows.
const REPORTED: u64 = 24;

/// Estimated cost of a dataset.
#[derive(Clone, Debug, PartialEq)]
pub struct CostEstimate {
    /// Number of images.
    pub images: u64,
    /// Number of fields that the images show.
    pub fields: u64,
    /// Number of scene constructions: each field is built once for all its images of a day.
    pub growings: u64,
    /// Number of units (fields or packs) that are divided among shards.
    pub units: u64,
    /// Indices of the images that were rendered as probes.
    pub probes: Vec<u64>,
    /// Samples per pixel of the two renderings of each probe, smaller number first.
    pub spp: [u32; 2],
    /// Total core seconds.
    pub core_s: f64,
    /// Core seconds of scene construction.
    pub grow_s: f64,
    /// Core seconds of rendering.
    pub sample_s: f64,
    /// Total size of all files, bytes; hard links to the same file count once.
    pub bytes: u64,
    /// Number of files if the dataset is made in one run; hard links count separately.
    pub files: u64,
    /// Memory of the process before its first image, bytes.
    pub base_memory: u64,
    /// Memory of each image in progress, bytes: that of the probes, scaled to the largest estimated memory of a field.
    pub image_memory: u64,
}

impl CostEstimate {
    /// Returns the largest memory of a process that renders on `cores` cores, bytes.
    pub fn memory(&self, cores: usize) -> u64 {
        // Images of one field are rendered one after another, so at most one image per scene construction is in
        // progress.
        let at_once = cores.clamp(1, MOST_AT_ONCE).min(usize::try_from(self.growings.max(1)).unwrap_or(usize::MAX));
        self.base_memory + at_once.to_u64() * self.image_memory
    }

    /// Returns the number of shards that take about an hour each on `cores` cores; no shard is empty.
    pub fn shards(&self, cores: u32) -> u64 {
        let hours = self.core_s / 3600.0 / f64::from(cores.max(1));
        hours.ceil_to::<u64>().clamp(1, self.units.max(1))
    }
}

/// A step of the cost estimate, for progress messages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// A probe image is rendered.
    Image {
        /// Number of the probe, from 1.
        number: usize,
        /// Smallest total number of probes.
        least: usize,
        /// Largest total number of probes.
        most: usize,
    },
    /// The files of the whole dataset are written for a few images.
    Lists,
}

/// Estimates the cost of `order` in `folder`, and returns it with warnings for the user. `begun` is called at the start
/// of each step. Raising `stop` ends the estimate with an error.
///
/// # Errors
/// The errors of [`plan`](crate::make::plan::plan()), for example if the folder contains another dataset.
pub fn estimate_cost(
    folder: &Path,
    order: &Order,
    threads: &Threads,
    begun: &dyn Fn(Step),
    stop: &Arc<AtomicBool>,
) -> Result<(CostEstimate, Vec<String>)> {
    let Draft { recipe, files, mut warnings, scene, scene_sha256 } = draft(order, stop)?;
    let recipe = merged_recipe(folder, recipe, order.omit.is_some())?;
    // The run itself will need the same time as this process until here, for checking the order.
    let start = cpu()?;
    let base_memory = meter::memory().unwrap_or(0);
    let images = Images::of(&recipe, scene_sha256, scene.threads(threads))?;
    let mut probes = Vec::new();
    let lights = recipe.lights();
    let some: Vec<u64> = probed(recipe.count.div_ceil(lights)).into_iter().map(|view| view * lights).collect();
    let (least, most) = (PROBES[0].min(some.len()), some.len());
    for (drawn, index) in some.into_iter().enumerate() {
        if drawn >= PROBES[0] {
            let taken = cpu()?;
            if taken + (taken - start) / drawn.to_f64() > LONG_ENOUGH_S {
                break;
            }
        }
        begun(Step::Image { number: drawn + 1, least, most });
        match threads.install(|| images.probe(index, stop)) {
            Ok(probe) => probes.push(probe),
            Err(e) if e.is_of_one_field() => warnings.push(format!("image {}: {e}", Set::name(index))),
            Err(e) => return Err(e),
        }
    }
    if probes.is_empty() {
        return Err(Error::input(format!("none of the probe images could be made: {}", warnings.join("; "))));
    }
    begun(Step::Lists);
    let peak = meter::peak_memory().unwrap_or(0);
    let mean = |of: &dyn Fn(&Probe) -> f64| probes.iter().map(of).sum::<f64>() / probes.len().max(1).to_f64();
    let all = threads.install(|| SharedFiles::of(&recipe, &files, &probes))?;
    let growings = recipe.count.div_ceil(recipe.captures_a_day());
    let (count, spp) = (recipe.count.to_f64(), f64::from(images.spp));
    let (grow_s, sample_s) = (growings.to_f64() * mean(&|p| p.grow_s), count * spp * mean(&|p| p.sample_s));
    let rest_s = start + count * mean(&|p| p.fixed_s) + all.core_s;
    let packs = Packing::of(&recipe).map_or(0, |packing| packing.all().count().to_u64());
    // Each pack is an archive and its record.
    let (mut bytes, mut number) = (all.bytes + count * LOG_ROW.to_f64(), all.files + 1 + 2 * packs);
    for (split, images) in Split::ALL.into_iter().zip(images_of_splits(&recipe)) {
        if images > 0 {
            bytes += images.to_f64() * mean(&|p| p.bytes(split));
            number += images * probes.first().map_or(0, |p| p.lying(&p.files[&split]));
        }
    }
    let cost = CostEstimate {
        images: recipe.count,
        fields: recipe.count.div_ceil(recipe.captures()),
        growings,
        units: recipe.units(),
        probes: probes.iter().map(|probe| probe.record.index).collect(),
        spp: images.drawn,
        core_s: grow_s + sample_s + rest_s,
        grow_s,
        sample_s,
        bytes: bytes.trunc_to::<u64>(),
        files: number,
        base_memory,
        image_memory: (peak.saturating_sub(base_memory).to_f64() * images.largest_over(&probes)).trunc_to::<u64>(),
    };
    Ok((cost, warnings))
}

/// Returns the indices of possible probes: the first, the middle and the last image, then images at successively halved
/// distances between them.
fn probed(count: u64) -> Vec<u64> {
    let last = count.saturating_sub(1);
    let halves = (2..).flat_map(|level: u32| (1..1_u64 << level).step_by(2).map(move |odd| (odd, level)));
    let between =
        halves.take(4 * PROBES[1]).map(|(odd, level)| ((u128::from(last) * u128::from(odd)) >> level).to_u64());
    let mut all = Vec::new();
    for index in [0, count / 2, last].into_iter().chain(between) {
        if all.len() < PROBES[1] && !all.contains(&index) {
            all.push(index);
        }
    }
    all
}

/// Returns the core seconds that this process has used so far.
fn cpu() -> Result<f64> {
    meter::cpu().map(|taken| taken.as_secs_f64()).ok_or_else(|| {
        Error::missing("core time is measured with /proc/self/stat, which this system does not have")
            .help("estimate the cost on Linux, or leave the estimate out")
    })
}

/// Returns the number of images of each split, in the order of [`Split::ALL`].
fn images_of_splits(recipe: &Recipe) -> [u64; 3] {
    let captures = recipe.captures();
    let mut images = [0; 3];
    for field in 0..recipe.count.div_ceil(captures) {
        let first = field * captures;
        images[recipe.split_of(first) as usize] += captures.min(recipe.count - first);
    }
    images
}

/// Scene and renderers for the probes of an order.
struct Images {
    set: Set,
    scene: SceneFile,
    /// Samples per pixel of the dataset's images.
    spp: u32,
    /// Samples per pixel of the two renderings of a probe, smaller number first; equal if the images have a single
    /// sample.
    drawn: [u32; 2],
    renderers: [Renderer; 2],
    /// Splits that contain images of the dataset.
    splits: Vec<Split>,
}

/// An image that was rendered to estimate the cost of all images.
struct Probe {
    record: Record,
    /// Whether its native files go into an archive.
    packed: bool,
    /// Names of the cameras of its field.
    cameras: Vec<String>,
    /// Core seconds of building its scene.
    grow_s: f64,
    /// Core seconds of one sample in every pixel.
    sample_s: f64,
    /// Core seconds that do not depend on the number of samples: labelling, encoding, checksums.
    fixed_s: f64,
    /// Its files as they would be in each split.
    files: BTreeMap<Split, Vec<File>>,
    /// Ratio of the total file size with all samples to that of the probe.
    longer: f64,
}

impl Probe {
    /// Returns the size in bytes of its files in a split with all samples, including the checksum record.
    fn bytes(&self, split: Split) -> f64 {
        let files = self.files.get(&split).map_or(&[][..], Vec::as_slice);
        let seal = files.iter().map(|file| file.path.len().to_u64() + 100).sum::<u64>() + 2 * SEAL_HASH;
        let in_archive =
            if self.packed { files.iter().filter(|file| is_native(&file.path)).count().to_u64() } else { 0 };
        // In an archive each file has a header, is padded by half a block on average, and has an entry in the archive's
        // record.
        length(files).to_f64() * self.longer + (seal + in_archive * MEMBER).to_f64()
    }

    /// Returns how many of its files, including the checksum record, are stored outside archives.
    fn lying(&self, files: &[File]) -> u64 {
        let in_archive = |file: &&File| self.packed && is_native(&file.path);
        (files.len() - files.iter().filter(in_archive).count()).to_u64() + u64::from(!self.packed)
    }
}

impl Images {
    fn of(recipe: &Recipe, scene_sha256: String, scene: SceneFile) -> Result<Self> {
        let mut recipe = recipe.clone();
        if let ImageOrigin::Rendered(rendering) = &mut recipe.made {
            rendering.scene_sha256 = scene_sha256;
        }
        let rendering = recipe.rendering()?;
        let options = rendering.options();
        let spp = options.quality.spp;
        let pixels = u64::from(rendering.width) * u64::from(rendering.height);
        let many = (SAMPLES / pixels.max(1)).clamp(FEWEST, u64::from(Sampler::MAX_SAMPLES)).to_u32().min(spp);
        let drawn = [(many / STEP).max(1), many];
        let quality = |spp| Quality { spp, ..options.quality };
        let opened = |spp| Renderer::open(&RenderOptions { quality: quality(spp), ..options.clone() });
        let splits = Split::ALL.into_iter().zip(images_of_splits(&recipe));
        let splits = splits.filter(|(_, images)| *images > 0).map(|(split, _)| split).collect();
        let renderers = [opened(drawn[0])?, opened(drawn[1])?];
        let set = Set::new(Path::new(""), recipe);
        Ok(Self { set, scene, spp, drawn, renderers, splits })
    }

    /// Returns the estimated memory of the largest field divided by that of the largest probe's field; at least 1.
    fn largest_over(&self, probes: &[Probe]) -> f64 {
        let recipe = &self.set.recipe;
        let fields = recipe.count.div_ceil(recipe.captures());
        let asked = fields.clamp(1, MOST_ASKED);
        // The error of a field that cannot be built is reported when its image is made.
        let bytes = |field: u64| self.scene.estimate(field).map_or(0.0, |estimate| estimate.total().bytes);
        let largest = (0..asked).map(|k| bytes(k * fields / asked)).fold(0.0, f64::max);
        let drawn = probes.iter().map(|probe| bytes(recipe.field_of(probe.record.index).0)).fold(0.0, f64::max);
        if drawn > 0.0 { (largest / drawn).max(1.0) } else { 1.0 }
    }

    /// Returns an image and the following ones of the same view, under other lights, that are in the dataset.
    fn of_view(&self, index: u64) -> Vec<u64> {
        let (lights, count) = (self.set.recipe.lights(), self.set.recipe.count);
        (index..count.min((index / lights + 1) * lights)).collect()
    }

    /// Renders an image twice with few samples, and measures times and file sizes.
    fn probe(&self, index: u64, stop: &Arc<AtomicBool>) -> Result<Probe> {
        let scene = self.scene.clone().until(stop);
        let mut kept = CachedField::default();
        let begin = cpu()?;
        let field = kept.at(&self.set, &scene, index)?.field;
        let captures = field.grown().captures.iter().take_while(|capture| capture.frame == 0);
        let cameras = captures.map(|capture| capture.name.clone()).collect();
        // Once for each field: counted with the first rendering, it would hide the time of the samples.
        kept.measure_traits();
        let grown = cpu()?;
        let of_view = self.of_view(index);
        let lights = of_view.len().to_f64();
        let mut draw = |renderer: &Renderer| {
            // All lights of the view are rendered at once, as in the run.
            kept.forget_view();
            kept.expect(of_view[1..].to_vec());
            let begin = cpu()?;
            let made = render(&self.set, &scene, index, renderer, RenderMonitor { done: &|_| (), stop }, &mut kept)?;
            // Called only to measure its time; the faults are ignored, because with few samples the classes by samples
            // and at the pixel centre differ more than in the dataset.
            let _ = invariants::faults(&self.set.recipe, &made.sample);
            let files = self.files(&made)?;
            ChecksumRecord::of(index, &self.set.recipe, &files)?;
            if stop.load(Ordering::Relaxed) {
                return Err(Error::interrupted());
            }
            Ok((made, files, cpu()? - begin))
        };
        let [few, many] = &self.renderers;
        let [fewer, more] = self.drawn.map(f64::from);
        let spp = f64::from(self.spp);
        // Only the measurements of the first rendering are kept, so that memory holds one image at a time, as in the
        // run.
        let less =
            if fewer < more { Some(draw(few).map(|(_, files, seconds)| (length(&files), seconds))?) } else { None };
        let (mut made, files, seconds) = draw(many)?;
        let (sample_s, longer) = less.map_or((0.0, 1.0), |(short, short_s)| {
            let doublings = |from: f64, to: f64| (to / from).log2();
            let (short, long) = (short.to_f64(), length(&files).to_f64());
            // Each doubling of samples halves the variance of the noise, which saves a constant number of bits per
            // pixel.
            let steepness = (long - short) / doublings(fewer, more);
            ((seconds - short_s).max(0.0) / (more - fewer) / lights, 1.0 + steepness * doublings(more, spp) / long)
        });
        let own = made.sample.record.split;
        let mut of_splits = BTreeMap::new();
        for split in &self.splits {
            made.sample.record.split = *split;
            let files = if *split == own { files.clone() } else { self.files(&made)? };
            of_splits.insert(*split, files);
        }
        made.sample.record.split = own;
        Ok(Probe {
            record: made.sample.record,
            packed: self.set.recipe.pack.is_some(),
            cameras,
            grow_s: grown - begin,
            sample_s,
            fixed_s: (seconds - sample_s * more * lights).max(0.0),
            files: of_splits,
            longer: longer.clamp(0.5, 2.0),
        })
    }

    /// Returns all files of an image, native and of formats.
    fn files(&self, made: &RenderedSample) -> Result<Vec<File>> {
        let mut files = native::files(&self.set.recipe, &made.sample, &made.text)?;
        files.extend(formatted(&self.set, &made.sample)?);
        Ok(files)
    }
}

/// Returns the total size of files. Files with equal contents count once, since [`write_files`] stores them as hard
/// links.
fn length(files: &[File]) -> u64 {
    let mut known = BTreeSet::new();
    let fresh = files.iter().filter(|file| file.bytes.len() <= BLOCK || known.insert(file.bytes.as_slice()));
    fresh.map(|file| file.bytes.len().to_u64()).sum()
}

/// Estimated cost of the files that belong to the whole dataset.
struct SharedFiles {
    files: u64,
    bytes: f64,
    core_s: f64,
}

impl SharedFiles {
    /// Estimates the cost for images like `probes` and a dataset that contains the files of `scene`.
    fn of(recipe: &Recipe, scene: &[File], probes: &[Probe]) -> Result<Self> {
        let folder = tempfile::tempdir().map_err(Error::io(&std::env::temp_dir()))?;
        let small = ProbeDataset::of(recipe, probes, 1);
        small.write(folder.path(), scene)?;
        let splits = images_of_splits(recipe).into_iter().filter(|images| *images > 0).count().to_u64();
        let per_field = small.recipe.captures();
        // Finished with one field per split, with an additional incomplete field if the last field is incomplete, and
        // with an additional field per probe.
        let few_images = splits * per_field;
        let many_images = few_images + probes.len().to_u64() * per_field;
        let few = small.finished(folder.path(), few_images)?;
        let of_cut = recipe.count % recipe.captures();
        let cut = of_cut.min(per_field);
        let partial = if cut == 0 { 0 } else { small.finished(folder.path(), few_images + cut)?.files - few.files };
        let begin = cpu()?;
        let many = small.finished(folder.path(), many_images)?;
        let core_s = (cpu()? - begin) / many_images.to_f64() * recipe.count.min(MOST_LOOKED_AT).to_f64();
        let whole_fields = recipe.count / recipe.captures();
        let each = (many.files - few.files) / probes.len().max(1).to_u64();
        // Number of days after the first one, summed over all fields.
        let days = recipe.days().len().to_u64().saturating_sub(1);
        let later_days = whole_fields * days + of_cut.div_ceil(recipe.captures_a_day()).saturating_sub(1);
        let of_later_days = if later_days > 0 {
            later_days * ProbeDataset::of(recipe, probes, 2).files_of_a_field(scene, splits)?.saturating_sub(each)
        } else {
            0
        };
        let files = few.files + whole_fields * each + partial + of_later_days - splits * each;
        let prolonged = |few: u64, many: u64, images: u64| {
            let each = (many.to_f64() - few.to_f64()) / (many_images - few_images).max(1).to_f64();
            (few.to_f64() + each * (images.to_f64() - few_images.to_f64())).max(0.0)
        };
        let lists = prolonged(few.lists, many.lists, recipe.count);
        let page = prolonged(few.page, many.page, recipe.count.min(REPORTED));
        let own: u64 = scene.iter().map(|file| file.bytes.len().to_u64()).sum();
        let recipe_bytes = recipe.text()?.len().to_u64();
        Ok(Self {
            files: files + scene.len().to_u64() + 1,
            bytes: lists + page + (own + recipe_bytes).to_f64(),
            core_s,
        })
    }
}

/// Number and sizes of the files that belong to the whole of a small dataset.
struct Finished {
    /// Number of files.
    files: u64,
    /// Size of the report, bytes.
    page: u64,
    /// Size of the other files, bytes.
    lists: u64,
}

/// A small dataset of copies of the probes, with the splits and cameras of the planned one.
struct ProbeDataset<'a> {
    recipe: Recipe,
    probes: &'a [Probe],
}

impl<'a> ProbeDataset<'a> {
    /// Creates the recipe, with one frame per camera on each of the first `days` days.
    fn of(recipe: &Recipe, probes: &'a [Probe], days: usize) -> Self {
        let mut small = recipe.clone();
        small.split = Shares(images_of_splits(recipe).map(|images| u32::from(images > 0)));
        let cameras = probes.first().map_or(1, |probe| probe.cameras.len().max(1));
        if let ImageOrigin::Rendered(rendering) = &mut small.made {
            rendering.days.truncate(days);
            let views = recipe.views_a_day().min(cameras.to_u64());
            rendering.captures = views * rendering.lights * rendering.days.len().max(1).to_u64();
        }
        Self { recipe: small, probes }
    }

    /// Writes the dataset, with enough images for every later use.
    fn write(&self, folder: &Path, scene: &[File]) -> Result<()> {
        write_files(folder, scene)?;
        write_files(folder, &[File { path: FILE.into(), bytes: self.recipe.text()? }])?;
        let fields = Split::ALL.len() + self.probes.len();
        for (index, probe) in (0..fields.to_u64() * self.recipe.captures()).zip(self.probes.iter().cycle()) {
            let files = self.copy(probe, index)?;
            write_files(folder, &files)?;
            ChecksumRecord::of(index, &self.recipe, &files)?.write(folder)?;
        }
        Ok(())
    }

    /// Returns the files of a probe, renamed to those of image `index`.
    fn copy(&self, probe: &Probe, index: u64) -> Result<Vec<File>> {
        let (field, capture) = self.recipe.field_of(index);
        let mut record = probe.record.clone();
        record.index = index;
        record.name = Set::name(index);
        record.split = self.recipe.split_of(index);
        record.light = record.light.map(|_| self.recipe.light_of(index));
        if let Some(of_probe) = &mut record.capture {
            let (view, day) = view_of(&self.recipe, capture);
            let camera = probe.cameras.get(view.to_usize()).cloned().unwrap_or_default();
            *of_probe = CaptureRecord { field, day, frame: 0, camera, ..of_probe.clone() };
        }
        let own = format!("{}/record.json", native::folder(&record.name));
        let renamed = |file: &File| {
            let path = file.path.replace(&probe.record.name, &record.name);
            let bytes = if path == own { compact(&record)? } else { file.bytes.clone() };
            Ok(File { path, bytes })
        };
        probe.files.get(&record.split).into_iter().flatten().map(renamed).collect()
    }

    /// Returns the number of dataset-wide files that an additional field adds.
    fn files_of_a_field(&self, scene: &[File], splits: u64) -> Result<u64> {
        let folder = tempfile::tempdir().map_err(Error::io(&std::env::temp_dir()))?;
        self.write(folder.path(), scene)?;
        let (per_field, fields) = (self.recipe.captures(), self.probes.len().to_u64());
        let few = self.finished(folder.path(), splits * per_field)?;
        let many = self.finished(folder.path(), (splits + fields) * per_field)?;
        Ok((many.files - few.files) / fields.max(1))
    }

    /// Finishes the dataset of the first `images` images, and returns the number and sizes of the files written.
    fn finished(&self, folder: &Path, images: u64) -> Result<Finished> {
        let recipe = Recipe { count: images, ..self.recipe.clone() };
        let paths = finish(&Set::new(folder, recipe), None)?;
        let mut finished = Finished { files: paths.len().to_u64(), page: 0, lists: 0 };
        for path in paths {
            let bytes = std::fs::metadata(&path).map_err(Error::io(&path))?.len();
            let sum = if path.ends_with(report::FILE) { &mut finished.page } else { &mut finished.lists };
            *sum += bytes;
        }
        Ok(finished)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: fields of a scene file differ, so probes must be spread over the dataset. Expected: the first, the
    /// middle and the last image come first, no image is repeated or beyond the end, and further images are spread
    /// evenly.
    #[test]
    fn images_that_are_drawn_lie_far_apart() {
        assert_eq!(probed(1), [0]);
        assert_eq!(probed(3), [0, 1, 2]);
        assert_eq!(probed(1001)[..7], [0, 500, 1000, 250, 750, 125, 375]);
        for count in [2, 5, 17, 1000, u64::MAX] {
            let all = probed(count);
            assert_eq!(all.iter().collect::<BTreeSet<_>>().len(), all.len());
            assert!(all.iter().all(|index| *index < count));
            assert!(all.len().to_u64() >= count.min(PROBES[0].to_u64()) && all.len() <= PROBES[1], "{count}: {all:?}");
        }
    }

    /// Rationale: all images of a drive show one field, which one process builds. Expected: with one field, a day of
    /// work is one shard with the memory of one image, whatever the number of cores; with a thousand fields it is 24
    /// shards with eight images in progress each.
    #[test]
    fn images_of_one_field_are_not_shared_out() {
        let cost = |growings| CostEstimate {
            images: 1000,
            fields: growings,
            growings,
            units: growings,
            probes: Vec::new(),
            spp: [1, 1],
            core_s: 8.0 * 86_400.0,
            grow_s: 0.0,
            sample_s: 0.0,
            bytes: 0,
            files: 0,
            base_memory: 7,
            image_memory: 100,
        };
        assert_eq!((cost(1).shards(8), cost(1).memory(8)), (1, 107));
        assert_eq!((cost(1000).shards(8), cost(1000).memory(8)), (24, 807));
    }
}
