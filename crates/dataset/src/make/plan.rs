//! Begins a dataset: checks the scene file by growing its first field, takes everything that it reads into the folder, writes the recipe.

use crate::format::labels::Labels;
use crate::make::begin::begin;
use crate::make::gather::{Gathered, gather};
use crate::make::generate::interrupted;
use crate::make::status::images_there;
use crate::model::classes::Classes;
use crate::model::keep::{self, Kept, Omitted};
use crate::model::labelling::Labelling;
use crate::model::photo::Photo;
use crate::model::recipe::{FILE, Made, Recipe, Rendering};
use crate::model::split::Shares;
use crate::pack;
use crate::read::checksum_record;
use crate::read::links;
use crate::read::set::Set;
use crate::{File, format};
use furrow_base::error::Kind;
use furrow_base::{Error, Result};
use furrow_field::ablation::{Edit, FULL};
use furrow_field::assemble::BuildProgress;
use furrow_job::{Renderer, SceneFile};
use furrow_optics::sensor::Camera;
use furrow_render::settings::{Engine, RenderOptions};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// What a dataset is to be: scene file, number of images, size, formats, render options.
#[derive(Clone, Debug)]
pub struct Order {
    /// The scene file.
    pub scene: PathBuf,
    /// Seed, instead of the scene file's.
    pub seed: Option<u64>,
    /// How many images.
    pub count: u64,
    /// Days on which they are taken, instead of the scene file's; none keeps them.
    pub days: Vec<u32>,
    /// Image width, instead of the scene file's.
    pub width: Option<u32>,
    /// Image height.
    pub height: Option<u32>,
    /// Formats beside the native one.
    pub formats: Vec<String>,
    /// Classes of the formats, and what they leave out.
    pub labelling: Labelling,
    /// Maps that images keep beside photograph, labels and record.
    pub keep: Vec<Kept>,
    /// Label maps that images go without, since their records tell the same. `None`: none, or those that a dataset goes without that is gone on
    /// with.
    pub omit: Option<Vec<Omitted>>,
    /// How photographs are stored; as PNG, a dataset that is gone on with keeps its way.
    pub photo: Photo,
    /// Whether images are labels alone: nothing is lit, and there are no photographs.
    pub labels_only: bool,
    /// How the images are split.
    pub split: Shares,
    /// Images of an archive, instead of a folder each; a multiple of the images of a field.
    pub pack: Option<u64>,
    /// What others may do with them.
    pub licence: String,
    /// How the images are rendered, before the edit; a fixed number of samples.
    pub options: RenderOptions,
    /// What is changed; [`furrow_field::ablation::FULL`] for nothing.
    pub edit: &'static Edit,
    /// Most bytes of memory that a field may take, where not the usual; no byte depends on it.
    pub memory: Option<u64>,
    /// Told how far the first field is, which grows to check the order, and of a bill those of the images that are drawn; no byte depends on it.
    pub progress: Arc<BuildProgress>,
}

impl Order {
    /// Images 0 to `count` − 1 of a scene file, as the file says, path traced with the usual quality, in the native format.
    pub fn new(scene: impl Into<PathBuf>, count: u64) -> Self {
        Self {
            scene: scene.into(),
            seed: None,
            count,
            days: Vec::new(),
            width: None,
            height: None,
            formats: Vec::new(),
            labelling: Labelling::default(),
            keep: Kept::USUAL.to_vec(),
            omit: None,
            photo: Photo::default(),
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

    /// What the manifest says where nobody has said what others may do.
    pub const NO_LICENCE: &'static str = "not stated";
}

/// Most species that `species.png` numbers.
const MOST_SPECIES: usize = u8::MAX as usize;

/// Begins a dataset in `folder`, or goes on with the same one: it may get longer and get more formats. Returns it with what the user
/// should know. Given up where the flag is raised while the first field grows: [`Kind::Interrupted`], with the number of images that are there.
pub fn plan(folder: &Path, order: &Order, stop: &Arc<AtomicBool>) -> Result<(Set, Vec<String>)> {
    let drafted = draft(order, stop).map_err(|error| match error.kind() {
        Kind::Interrupted => given_up(folder, order.count, error),
        _ => error,
    });
    let Draft { recipe, files, warnings, .. } = drafted?;
    let recipe = begin(folder, recipe, &files, order.omit.is_some())?;
    Ok((Set::new(folder, recipe), warnings))
}

/// An interruption, with what lies in the folder of a dataset that is to have so many images.
fn given_up(folder: &Path, images: u64, error: Error) -> Error {
    let begun = Set::open(folder).and_then(|set| Ok((images_there(&set)?, set.recipe.count)));
    match begun {
        Ok((there, before)) => interrupted(folder, there, images.max(before) as usize),
        Err(_) => error.in_file(folder),
    }
}

/// A dataset that was checked and not begun.
pub(crate) struct Draft {
    /// What would make it.
    pub(crate) recipe: Recipe,
    /// The scene that it would hold.
    pub(crate) files: Vec<File>,
    /// What the user should know.
    pub(crate) warnings: Vec<String>,
    /// The scene file where it lies now.
    pub(crate) scene: SceneFile,
    /// [`Rendering::scene_sha256`] of the scene where it lies now.
    pub(crate) scene_sha256: String,
}

/// Checks an order by growing its first field as far as something is told of it; given up where the flag is raised.
pub(crate) fn draft(order: &Order, stop: &Arc<AtomicBool>) -> Result<Draft> {
    // Names are checked before anything is written.
    let options = order.edit.options(order.options.clone());
    if !options.quality.is_fixed() {
        return Err(Error::input("the images of a dataset have a fixed number of samples")
            .help("give --spp instead of --target-error or --time"));
    }
    let keep = if order.labels_only { labels_alone(order, &options)? } else { keep::checked(order.keep.clone())? };
    // Before anything grows: what could not be rendered here.
    let kernels = Renderer::open(&options)?.kernels().to_owned();
    let source = opened(&order.scene, order)?.until(stop);
    let first = source.clone().told_only().field(0)?;
    let field = first.grown();
    if field.species.len() > MOST_SPECIES {
        return Err(Error::input(format!(
            "{} species, more than the {MOST_SPECIES} that species.png numbers",
            field.species.len()
        ))
        .in_file(&order.scene)
        .help("make two scene files of it"));
    }
    let Gathered { files, scene, rewritten } = gather(&field.files, &field.shipped, &order.scene)?;
    let elsewhere = rewritten || source.allows_outside();
    let scene_sha256 = if elsewhere { hash_of_copies(order, &files, &scene, stop)? } else { field.hash.clone() };
    let camera = &field.scene.camera;
    order.photo.check_size(camera.width(), camera.height())?;
    let recipe = Recipe {
        furrow: env!("CARGO_PKG_VERSION").into(),
        made: Made::Rendered(Box::new(Rendering {
            scene,
            scene_sha256,
            seed: field.seed,
            captures: source.captures(),
            days: source.seen_days().to_vec(),
            width: camera.width(),
            height: camera.height(),
            engine: options.engine,
            spp: options.quality.spp,
            denoise: options.quality.denoise,
            without: options.techniques.left_out().to_vec(),
            max_depth: options.techniques.max_depth,
            clamp: options.techniques.clamp,
            parts: order.labelling.classes.as_ref().is_some_and(Classes::needs_parts),
            models: field.models.clone(),
            keep,
            omit: keep::in_order(order.omit.clone().unwrap_or_default()),
            labels_only: order.labels_only,
            photo: Some(order.photo),
            kernels,
            edit: order.edit.label(),
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
    let mut told = field.warnings.clone();
    told.extend(warnings(&recipe)?);
    told.extend(rolling(&recipe, camera)?);
    let scene_sha256 = field.hash.clone();
    Ok(Draft { recipe, files, warnings: told, scene: source, scene_sha256 })
}

/// The maps that images keep which are labels alone; an error for what such images cannot be.
fn labels_alone(order: &Order, options: &RenderOptions) -> Result<Vec<Kept>> {
    let refused = |what: &str| Err(Error::misuse(what).help("leave --labels-only out, or this"));
    if options.engine != Engine::Trace {
        return refused("--engine raster draws its labels with its picture, and --labels-only draws none");
    }
    if order.edit.asks_samples() {
        return refused("this --edit makes labels of samples, and --labels-only takes none");
    }
    if order.photo != Photo::default() {
        return refused("--photo stores photographs, and --labels-only draws none");
    }
    keep::checked(keep::of_labels(&order.keep)?)
}

/// A scene file as an order asks for it.
fn opened(scene: &Path, order: &Order) -> Result<SceneFile> {
    let scene = SceneFile::edited(scene, order.edit)?;
    let scene = scene.seed(order.seed).days(&order.days).width(order.width).height(order.height).memory(order.memory);
    Ok(scene.unlit(order.labels_only).progress(&order.progress))
}

/// SHA-256 of a scene whose copies may name other files than the originals do, found by growing the first field from them in
/// a folder of their own; an error where it still reads something outside.
fn hash_of_copies(order: &Order, files: &[File], scene: &str, stop: &Arc<AtomicBool>) -> Result<String> {
    let folder = tempfile::tempdir().map_err(Error::io(&std::env::temp_dir()))?;
    checksum_record::write_files(folder.path(), files)?;
    let first = opened(&folder.path().join(scene), order)?.until(stop).told_only().field(0)?;
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

/// What formats with one pose for all rows lose of a camera that rolls.
fn rolling(recipe: &Recipe, camera: &Camera) -> Result<Option<String>> {
    let formats = format::all(recipe)?.into_iter().filter(|(_, format)| camera.rolls() && format.has_one_pose());
    let names: Vec<String> = formats.map(|(name, _)| name.to_string()).collect();
    let words = "cannot tell a rolling shutter: poses are those of the middle row";
    Ok((!names.is_empty()).then(|| format!("{} {words}", names.join(", "))))
}

/// What the formats of a recipe cannot hold or do otherwise.
fn warnings(recipe: &Recipe) -> Result<Vec<String>> {
    let mut all = Vec::new();
    if recipe.formats.is_empty() && !recipe.labelling.is_usual() {
        all.push(
            "classes and limits are those of formats, and there is none: `trace dataset finish DIR --format …` writes them".into(),
        );
    }
    for (name, format) in format::all(recipe)? {
        all.extend(format.warnings(recipe).into_iter().map(|words| format!("{name}: {words}")));
    }
    Ok(all)
}

/// Adds formats to a dataset, and gives all of them other labels where some are given; their files are made by the next run. Returns what the
/// user should know.
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
            "--format {name} holds what only the renderer knows, and these images were not rendered"
        ))
        .in_file(&set.folder)
        .help(
            "other formats can be \
             added; `trace dataset finish --help` lists them",
        ));
    }
    format::check_maps(&recipe).and_then(|()| pack::check(&recipe)).map_err(|e| e.in_file(&set.folder))?;
    links::refuse(&set.folder, &recipe)?;
    let warnings = warnings(&recipe)?;
    checksum_record::write_files(&set.folder, &[File { path: FILE.into(), bytes: recipe.text()? }])?;
    set.recipe = recipe;
    Ok(warnings)
}
