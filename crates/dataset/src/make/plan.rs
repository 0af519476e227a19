//! Creates a dataset: checks the scene file by building its first field, copies all files that it reads into the
//! folder, writes the recipe.

use crate::format::labels::Labels;
use crate::make::begin::begin;
use crate::make::generate::interrupted;
use crate::make::pack;
use crate::make::scene_files::{SceneFiles, collect_files};
use crate::make::status::images_there;
use crate::model::classes::Classes;
use crate::model::image_format::ImageFormat;
use crate::model::labelling::Labelling;
use crate::model::optional_maps::{self, OmittableMap, OptionalMap};
use crate::model::recipe::{FILE, ImageOrigin, Recipe, Rendering};
use crate::model::split::{Shares, Split};
use crate::read::checksum_record;
use crate::read::links;
use crate::read::set::Set;
use crate::{File, format};
use furrow_base::error::Kind;
use furrow_base::math::ToInt;
use furrow_base::ron_file::Assignment;
use furrow_base::{Error, Result};
use furrow_field::Field;
use furrow_field::ablation::{Edit, FULL};
use furrow_field::assemble::BuildProgress;
use furrow_job::{Renderer, SceneFile};
use furrow_optics::sensor::Camera;
use furrow_render::settings::{Engine, RenderOptions};
use furrow_report::count;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Order of a dataset: scene file, number of images, image size, formats, render options.
#[derive(Clone, Debug)]
pub struct Order {
    /// The scene file.
    pub scene: PathBuf,
    /// Values that replace those of the scene file; the dataset's copy of the file contains them.
    pub assigned: Vec<Assignment>,
    /// Seed; `None` for the scene file's.
    pub seed: Option<u64>,
    /// Number of images.
    pub count: u64,
    /// Days on which the images are taken; empty for the scene file's.
    pub days: Vec<u32>,
    /// Number of lights under which each view of a field is rendered, from 1.
    pub lights: u64,
    /// Image width in pixels; `None` for the scene file's.
    pub width: Option<u32>,
    /// Image height in pixels; `None` for the scene file's.
    pub height: Option<u32>,
    /// Names of additional formats; the native format is always written.
    pub formats: Vec<String>,
    /// Classes of the formats, and limits below which plants and leaves are omitted from them.
    pub labelling: Labelling,
    /// Maps that are stored in addition to the image, labels and record.
    pub keep: Vec<OptionalMap>,
    /// Label maps that are not stored, since the record contains the same information. `None` omits none in a new
    /// dataset and keeps the choice of an existing one.
    pub omit: Option<Vec<OmittableMap>>,
    /// Encoding of the images; with the default, PNG, an existing dataset keeps its encoding.
    pub image_format: ImageFormat,
    /// Whether only labels are made, without lighting and without rendered images.
    pub labels_only: bool,
    /// Shares of the training, validation and test sets.
    pub split: Shares,
    /// Number of images per archive, a multiple of the images of a field; `None` stores each image in a folder.
    pub pack: Option<u64>,
    /// Licence of the dataset, as free text.
    pub licence: String,
    /// Render options before `edit` is applied; the number of samples must be fixed.
    pub options: RenderOptions,
    /// Ablation that is applied; [`furrow_field::ablation::FULL`] for none.
    pub edit: &'static Edit,
    /// Memory limit of a field, bytes; `None` for the default. Does not affect the contents of the dataset.
    pub memory: Option<u64>,
    /// Receives the progress of building the first field, which checks the order, and of the probes of a cost estimate.
    /// Does not affect the contents of the dataset.
    pub progress: Arc<BuildProgress>,
}

impl Order {
    /// Creates an order for images 0 to `count` − 1 of a scene file: its size, seed and days, path traced with the
    /// default quality, in the native format.
    pub fn new(scene: impl Into<PathBuf>, count: u64) -> Self {
        Self {
            scene: scene.into(),
            assigned: Vec::new(),
            seed: None,
            count,
            days: Vec::new(),
            lights: 1,
            width: None,
            height: None,
            formats: Vec::new(),
            labelling: Labelling::default(),
            keep: OptionalMap::USUAL.to_vec(),
            omit: None,
            image_format: ImageFormat::default(),
            labels_only: false,
            split: Shares::default(),
            pack: None,
            licence: Self::NO_LICENCE.into(),
            options: RenderOptions::default(),
            edit: &FULL,
            memory: None,
            progress: Arc::default(),
        }
    }

    /// Licence text of the manifest if no licence is given.
    pub const NO_LICENCE: &'static str = "not stated";
}

/// Largest number of species: `species.png` has 8 bits, and 0 is no species.
const MOST_SPECIES: usize = u8::MAX as usize;

/// Creates a dataset in `folder`, or continues the existing one, which may get more images and more formats. Returns it
/// with warnings for the user. Raising `stop` while the first field is built returns [`Kind::Interrupted`] with the
/// number of complete images.
pub fn plan(folder: &Path, order: &Order, stop: &Arc<AtomicBool>) -> Result<(Set, Vec<String>)> {
    let drafted = draft(order, stop).map_err(|error| match error.kind() {
        Kind::Interrupted => given_up(folder, order.count, error),
        _ => error,
    });
    let Draft { recipe, files, warnings, .. } = drafted?;
    let recipe = begin(folder, recipe, &files, order.omit.is_some())?;
    Ok((Set::new(folder, recipe), warnings))
}

/// Adds the number of complete images in the folder to an interruption; `images` is the number of ordered images.
fn given_up(folder: &Path, images: u64, error: Error) -> Error {
    let begun = Set::open(folder).and_then(|set| Ok((images_there(&set)?, set.recipe.count)));
    match begun {
        Ok((there, before)) => interrupted(folder, there, images.max(before).to_usize()),
        Err(_) => error.in_file(folder),
    }
}

/// A checked order; nothing is written yet.
pub(crate) struct Draft {
    /// Recipe of the dataset.
    pub(crate) recipe: Recipe,
    /// Files of the scene, to be copied into the dataset.
    pub(crate) files: Vec<File>,
    /// Warnings for the user.
    pub(crate) warnings: Vec<String>,
    /// The original scene file.
    pub(crate) scene: SceneFile,
    /// [`Rendering::scene_sha256`] of the original scene.
    pub(crate) scene_sha256: String,
}

/// Checks an order by building its first field, without most of the ground. Raising `stop` ends it with an error.
pub(crate) fn draft(order: &Order, stop: &Arc<AtomicBool>) -> Result<Draft> {
    // Options are checked before anything is written.
    let options = order.edit.options(order.options.clone());
    if !options.quality.is_fixed() {
        return Err(Error::input("the images of a dataset need a fixed number of samples")
            .help("give --spp instead of --target-error or --time"));
    }
    let keep =
        if order.labels_only { labels_alone(order, &options)? } else { optional_maps::checked(order.keep.clone())? };
    if order.lights > 1 && order.edit.asks_samples() {
        return Err(Error::misuse("this --edit makes labels from samples, so they would differ between lights")
            .help("leave out --relight or --edit"));
    }
    // Opening the renderer first reports missing hardware or libraries before a field is built.
    let kernels = Renderer::open(&options)?.kernels().to_owned();
    let source = opened(&order.scene, order)?.until(stop);
    let first = source.clone().records_only().field(0)?;
    let field = first.grown();
    if field.species.len() > MOST_SPECIES {
        return Err(Error::input(format!(
            "{} species, more than the {MOST_SPECIES} that species.png numbers",
            field.species.len()
        ))
        .in_file(&order.scene)
        .help("split it into two scene files"));
    }
    let SceneFiles { files, scene, rewritten } =
        collect_files(&field.files, &field.shipped, (&order.scene, &field.text))?;
    let elsewhere = rewritten || source.allows_outside();
    let scene_sha256 = if elsewhere { hash_of_copies(order, &files, &scene, stop)? } else { field.hash.clone() };
    let camera = &field.scene.camera;
    order.image_format.check_size(camera.width(), camera.height())?;
    let recipe = Recipe {
        furrow: env!("CARGO_PKG_VERSION").into(),
        made: ImageOrigin::Rendered(Box::new(Rendering {
            scene,
            scene_sha256,
            parts: order.labelling.classes.as_ref().is_some_and(Classes::needs_parts),
            keep,
            omit: optional_maps::in_order(order.omit.clone().unwrap_or_default()),
            labels_only: order.labels_only,
            image_format: Some(order.image_format),
            edit: order.edit.label(),
            captures: source.captures() * order.lights,
            lights: order.lights,
            ..rendering(&source, field, &options, &kernels)
        })),
        count: order.count,
        split: order.split,
        formats: order.formats.clone(),
        labelling: order.labelling.clone(),
        pack: order.pack,
        licence: order.licence.clone(),
        species: field.species.clone(),
    };
    Labels::of(&recipe)?;
    format::check_maps(&recipe)?;
    pack::check(&recipe)?;
    let mut all_warnings = field.warnings.clone();
    all_warnings.extend(warnings(&recipe)?);
    all_warnings.extend(without_fields(&recipe));
    all_warnings.extend(rolling(&recipe, camera)?);
    all_warnings.extend(distorted(&recipe, field.captures.iter().map(|capture| &capture.camera))?);
    let scene_sha256 = field.hash.clone();
    Ok(Draft { recipe, files, warnings: all_warnings, scene: source, scene_sha256 })
}

/// Returns the parameters of images of a scene file: PNG files with the usual maps. `field` is any of its fields.
pub(crate) fn rendering(source: &SceneFile, field: &Field, options: &RenderOptions, kernels: &str) -> Rendering {
    Rendering {
        scene: String::new(),
        scene_sha256: field.hash.clone(),
        seed: field.seed,
        captures: source.captures(),
        lights: 1,
        days: source.seen_days().to_vec(),
        width: field.scene.camera.width(),
        height: field.scene.camera.height(),
        engine: options.engine,
        spp: options.quality.spp,
        denoise: options.quality.denoise,
        without: options.techniques.left_out().to_vec(),
        max_depth: options.techniques.max_depth,
        clamp: options.techniques.clamp,
        quality: options.preset,
        parts: false,
        models: field.models.clone(),
        keep: OptionalMap::USUAL.to_vec(),
        omit: Vec::new(),
        labels_only: false,
        image_format: Some(ImageFormat::Png),
        kernels: kernels.to_owned(),
        edit: None,
    }
}

/// Returns the maps to store for images without rendering (`labels_only`). Returns an error for options that need
/// rendering.
fn labels_alone(order: &Order, options: &RenderOptions) -> Result<Vec<OptionalMap>> {
    let refused = |what: &str| Err(Error::misuse(what).help("leave out --labels-only or this option"));
    if options.engine != Engine::Trace {
        return refused("--engine raster renders labels together with the image, and --labels-only renders no image");
    }
    if order.lights > 1 {
        return refused("--relight renders the same labels under several lights, and --labels-only renders no light");
    }
    if order.edit.asks_samples() {
        return refused("this --edit makes labels from samples, and --labels-only takes none");
    }
    if order.image_format != ImageFormat::default() {
        return refused("--image-format sets the encoding of images, and --labels-only renders none");
    }
    optional_maps::checked(optional_maps::of_labels(&order.keep)?)
}

/// Opens a scene file with the edit, seed, days, size and limits of an order.
fn opened(scene: &Path, order: &Order) -> Result<SceneFile> {
    let scene = SceneFile::edited(scene, order.edit)?.assign(&order.assigned)?;
    let scene = scene.seed(order.seed).days(&order.days).width(order.width).height(order.height).memory(order.memory);
    Ok(scene.unlit(order.labels_only).progress(&order.progress))
}

/// Returns the SHA-256 of a scene whose copied files may contain other paths than the originals. Builds the first field
/// from the copies in a temporary folder, and returns an error if it reads a file outside that folder.
fn hash_of_copies(order: &Order, files: &[File], scene: &str, stop: &Arc<AtomicBool>) -> Result<String> {
    let folder = tempfile::tempdir().map_err(Error::io(&std::env::temp_dir()))?;
    checksum_record::write_files(folder.path(), files)?;
    // The copy already has the assigned values.
    let order = &Order { assigned: Vec::new(), ..order.clone() };
    let first = opened(&folder.path().join(scene), order)?.until(stop).records_only().field(0)?;
    let field = first.grown();
    match field.files.iter().find(|file| !file.starts_with(folder.path())) {
        None => Ok(field.hash.clone()),
        Some(outside) => Err(Error::input(format!(
            "{} is named by an absolute path in a file that is not a RON file, so it cannot be taken into the dataset",
            outside.display()
        ))
        .in_file(&order.scene)
        .help("name it relative to the file that needs it")),
    }
}

/// Returns a warning if several lights leave so few fields that a split has none.
fn without_fields(recipe: &Recipe) -> Option<String> {
    let (fields, lights) = (recipe.count.div_ceil(recipe.captures()), recipe.lights());
    let Shares([train, val, test]) = recipe.split;
    let period = u64::from(train) + u64::from(val) + u64::from(test);
    let has = |fields: u64, split| (0..fields.min(period)).any(|field| recipe.split.of(field) == split);
    let empty = Split::ALL.into_iter().filter(|split| has(period, *split) && !has(fields, *split));
    let names: Vec<&str> = empty.map(Split::name).collect();
    (lights > 1 && !names.is_empty()).then(|| {
        format!(
            "{} of {lights} lights each: too few fields for the split {train},{val},{test}, so {} without images; \
             a larger --count makes more fields",
            count(fields, "field", "fields"),
            if let [one] = names[..] { format!("{one} is") } else { format!("{} are", names.join(" and ")) }
        )
    })
}

/// Returns a warning if formats with one pose per image are written for a camera with a rolling shutter.
fn rolling(recipe: &Recipe, camera: &Camera) -> Result<Option<String>> {
    let formats = format::all(recipe)?.into_iter().filter(|(_, format)| camera.rolls() && format.has_one_pose());
    let names: Vec<String> = formats.map(|(name, _)| name.to_string()).collect();
    let words = "cannot represent a rolling shutter: poses are those of the middle row";
    Ok((!names.is_empty()).then(|| format!("{} {words}", names.join(", "))))
}

/// Returns a warning if formats that describe cameras as pinholes are written for a camera whose lens distorts.
fn distorted<'a>(recipe: &Recipe, mut cameras: impl Iterator<Item = &'a Camera>) -> Result<Option<String>> {
    let formats = format::all(recipe)?.into_iter().filter(|(_, format)| format.has_pinhole());
    let names: Vec<&str> = formats.map(|(name, _)| name).collect();
    let warns = !names.is_empty() && cameras.any(|camera| !camera.distortion().is_none());
    let words = "cannot represent the distortion of a lens: the camera is a pinhole";
    Ok(warns.then(|| format!("{} {words}", names.join(", "))))
}

/// Returns the formats' warnings about data that they cannot represent.
fn warnings(recipe: &Recipe) -> Result<Vec<String>> {
    let mut all = Vec::new();
    if recipe.formats.is_empty() && !recipe.labelling.is_usual() {
        all.push(
            "classes and limits apply to formats, and none is given: `trace dataset finish DIR --format …` adds formats".into(),
        );
    }
    for (name, format) in format::all(recipe)? {
        all.extend(format.warnings(recipe).into_iter().map(|words| format!("{name}: {words}")));
    }
    Ok(all)
}

/// Adds formats to a dataset, and replaces the classes and limits of all its formats if `labelling` is not the default.
/// The next run makes the formats' files. Returns warnings for the user.
pub fn add_formats(set: &mut Set, names: &[String], labelling: &Labelling) -> Result<Vec<String>> {
    let mut recipe = set.recipe.clone();
    if !labelling.is_usual() {
        recipe.labelling = labelling.clone().over(&recipe.labelling);
        Labels::of(&recipe).map_err(|e| e.in_file(&set.folder))?;
    }
    for name in names {
        if !recipe.formats.contains(name) {
            recipe.formats.push(name.clone());
        }
    }
    recipe.formats.sort();
    if recipe.rendering().is_err()
        && let Some((name, _)) = format::all(&recipe)?.into_iter().find(|(_, f)| f.needs_film() || f.needs_camera())
    {
        return Err(Error::input(format!(
            "--format {name} contains data that only the renderer has, and these images were imported"
        ))
        .in_file(&set.folder)
        .help(
            "add another format; \
             `trace dataset finish --help` lists all",
        ));
    }
    format::check_maps(&recipe).and_then(|()| pack::check(&recipe)).map_err(|e| e.in_file(&set.folder))?;
    links::refuse(&set.folder, &recipe)?;
    let warnings = warnings(&recipe)?;
    checksum_record::write_files(&set.folder, &[File { path: FILE.into(), bytes: recipe.text()? }])?;
    set.recipe = recipe;
    Ok(warnings)
}
