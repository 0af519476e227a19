//! Renders field k: a [`Sample`].

use crate::format;
use crate::make::damage;
use crate::make::flow;
use crate::model::annotate::{self, keypoint, of_255};
use crate::model::keep::{self, Kept};
use crate::model::photo;
use crate::model::recipe::{self, Recipe};
use crate::model::record::{CaptureRecord, Exposure, Grown, Leaf, Plant, Record, Seen};
use crate::model::sample::{Rendered, Sample};
use crate::read::set::Set;
use furrow_base::math::Vec3;
use furrow_base::{Error, Result};
use furrow_field::PlantRecord;
use furrow_field::drive::Capture;
use furrow_field::traits::{PlantTraits, Traits};
use furrow_job::{Field, Image, Renderer, Request, SceneFile};
use furrow_render::render::{self, LabelMap, Watch};
use furrow_render::settings::Engine;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// What its name says.
const SECONDS_A_DAY: f64 = 86_400.0;

/// Where an image's time went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Times {
    /// Growing the field and building what rays hit.
    pub grow: Duration,
    /// Drawing, denoising included.
    pub draw: Duration,
    /// Labels and extents.
    pub label: Duration,
}

/// A new image of a dataset.
pub struct RenderedSample {
    /// The image.
    pub sample: Sample,
    /// What its pictures say of where they came from.
    pub text: String,
    /// Where the time went.
    pub times: Times,
}

/// The scene file that a dataset is rendered from.
pub fn scene_file(set: &Set) -> Result<SceneFile> {
    let rendering = set.recipe.rendering()?;
    let (folder, edit) = (&set.folder, rendering.edit()?);
    let scene = SceneFile::open_within(rendering.scene_in(folder)?, edit, recipe::scope(folder))?;
    let scene = scene.seed(rendering.seed).width(rendering.width).height(rendering.height);
    Ok(scene.unlit(rendering.labels_only))
}

/// What renders the images of a dataset; `None` for images that were imported. An error where this machine would make other bits than
/// the one that began the dataset.
pub fn renderer(set: &Set) -> Result<Option<Renderer>> {
    let renderer = near_renderer(set)?;
    if let Some(renderer) = &renderer {
        same(set, "the ray tracing kernels", &set.recipe.rendering()?.kernels, renderer.kernels())?;
    }
    Ok(renderer)
}

/// The same for images that are compared and not kept: its ray tracing kernels may be others than the dataset's, as long as the images are
/// [nearly the same](crate::check::difference).
pub fn near_renderer(set: &Set) -> Result<Option<Renderer>> {
    let Ok(rendering) = set.recipe.rendering() else { return Ok(None) };
    same(set, "furrow", &set.recipe.furrow, env!("CARGO_PKG_VERSION"))?;
    let renderer = Renderer::open(&rendering.options())?;
    if rendering.engine == Engine::Raster {
        same(set, "the graphics card", &rendering.kernels, renderer.kernels())?;
    }
    Ok(Some(renderer))
}

/// Nothing where this machine has what the dataset was begun with.
fn same(set: &Set, what: &str, there: &str, here: &str) -> Result<()> {
    if there == here {
        return Ok(());
    }
    let folder = set.folder.display();
    let words = format!("{folder}: the dataset was begun with {what} {there}, this is {here}: its images would differ");
    Err(Error::misuse(words).help(format!("go on with {there}, or begin another dataset")))
}

/// The field that was grown last, for the next image of it.
#[derive(Default)]
pub struct LastField {
    field: Option<Field>,
    /// Of its image before.
    traits: Option<Traits>,
}

/// A field as an image has it.
pub(crate) struct Last<'a> {
    pub(crate) field: &'a Field,
    /// What was measured of it for its image before, if it has one.
    traits: &'a mut Option<Traits>,
    /// How long it took to grow and build it now.
    pub(crate) grow: Duration,
}

impl LastField {
    /// The field that an image of a dataset shows.
    pub(crate) fn at(&mut self, set: &Set, scene_file: &SceneFile, index: u64) -> Result<Last<'_>> {
        let Set { folder, recipe, .. } = set;
        let rendering = recipe.rendering()?;
        let (number, capture) = recipe.field_of(index);
        let (of_day, day) = of_day(recipe, capture);
        let known = self.field.take().filter(|field| field.grown().index == number && field.grown().day == day);
        let new = known.is_none();
        if new {
            self.traits = None;
        }
        let mut field = known.map_or_else(|| scene_file.clone().day(day).field(number), Ok)?;
        if field.grown().hash != rendering.scene_sha256 {
            let help = format!("restore {}/scene/, or begin another dataset", folder.display());
            let words = "the scene file or something that it names was changed since the dataset was begun";
            return Err(Error::misuse(words).help(help).in_file(folder.join(&rendering.scene)));
        }
        field.take(of_day)?;
        field.geometry()?;
        let (grow, build) = field.times();
        let grow = if new { grow + build } else { Duration::ZERO };
        Ok(Last { field: self.field.insert(field), traits: &mut self.traits, grow })
    }
}

/// Of an image of a field: which of its day it is, and the day.
pub(crate) fn of_day(recipe: &Recipe, capture: u64) -> (u64, Option<u32>) {
    let a_day = recipe.captures_a_day();
    (capture % a_day, recipe.days().get((capture / a_day) as usize).copied())
}

/// Makes image `index` of a dataset from its [`scene_file`], whose threads do the work.
pub fn render(
    set: &Set,
    scene_file: &SceneFile,
    index: u64,
    renderer: &Renderer,
    watch: Watch<'_>,
    kept: &mut LastField,
) -> Result<RenderedSample> {
    let Last { field, traits, grow } = kept.at(set, scene_file, index)?;
    if set.recipe.labels_only() {
        return label(set, Last { field, traits, grow }, index, renderer);
    }
    let image = renderer.render(field, &Request { watch, ..Request::default() })?;
    image.check_denoised()?;
    let begin = Instant::now();
    let (draw, label) = (image.times.draw, image.times.label);
    let text = image.provenance.photograph_text(image.denoised.is_some());
    let sample = field.threads().install(|| describe(&set.recipe, index, image, traits))?;
    Ok(RenderedSample { sample, text, times: Times { grow, draw, label: label + begin.elapsed() } })
}

/// Labels an image without drawing it.
fn label(set: &Set, Last { field, traits, grow }: Last<'_>, index: u64, renderer: &Renderer) -> Result<RenderedSample> {
    let begin = Instant::now();
    let labels = field.label()?;
    let sample = field.threads().install(|| labelled(&set.recipe, index, field, (labels, traits)))?;
    let text = format!("{}\nlabels: without light\nkernels: {}", field.grown().provenance(), renderer.kernels());
    Ok(RenderedSample { sample, text, times: Times { grow, draw: Duration::ZERO, label: begin.elapsed() } })
}

/// The sample of an image.
fn describe(recipe: &Recipe, index: u64, image: Image<'_>, traits: &mut Option<Traits>) -> Result<Sample> {
    let photograph = image.photograph();
    let field = image.field();
    let Image { film, labels, denoised, .. } = image;
    let mut sample = labelled(recipe, index, field, (labels, traits))?;
    sample.record.exposure = Some(Exposure {
        gain: photograph.gain,
        nir_gain: photograph.nir_gain,
        white_balance: photograph.white_balance,
    });
    sample.record.sampling = if denoised.is_none() { film.sampling() } else { None };
    sample.rgb = photograph.rgb.as_chunks::<3>().0.to_vec();
    if recipe.keeps(Kept::Nir) {
        sample.nir = photograph.nir;
    }
    sample.jpeg = photo::store(sample.size(), &mut sample.rgb, &mut sample.nir, recipe.photo())?;
    sample.coverage = render::coverage(&film, &field.grown().scene.tags()).into_iter().map(of_255).collect();
    // Classes know what they cover.
    (sample.record.classes, sample.record.ignored) = annotate::classes(&sample);
    if !recipe.keeps(Kept::Coverage) {
        sample.coverage.clear();
    }
    if let Some(rendered) = &mut sample.film {
        rendered.film = Some(film);
    }
    Ok(sample)
}

/// The sample of an image of which nothing but labels is known.
fn labelled(
    recipe: &Recipe,
    index: u64,
    of: &Field,
    (labels, known): (LabelMap, &mut Option<Traits>),
) -> Result<Sample> {
    let field = of.grown();
    let formats = format::all(recipe)?;
    let flows = if formats.iter().any(|(_, format)| format.needs_flow()) {
        flow::flows(&field.captures, field.capture, &labels.depth, of.geometry()?)
    } else {
        Vec::new()
    };
    let damage = if formats.iter().any(|(_, format)| format.needs_damage()) {
        damage::damage(&field.scene, of.geometry()?)
    } else {
        Vec::new()
    };
    let tags = field.scene.tags();
    let kinds: BTreeMap<u32, u16> = field.plants.iter().map(|p| (p.number, p.kind)).collect();
    let kind = |plant: u32| kinds.get(&plant).copied().unwrap_or(0);
    let mut sample = Sample {
        record: Record {
            index,
            name: Set::name(index),
            source: None,
            split: recipe.split_of(index),
            capture: recipe.has_sequences().then(|| taken(recipe, field)),
            width: labels.window.width(),
            height: labels.window.height(),
            classes: Vec::new(),
            ignored: 0,
            plants: Vec::new(),
            conditions: Some(field.conditions.clone()),
            canopy: None,
            exposure: None,
            sampling: None,
            warnings: field.warnings.clone(),
        },
        rgb: Vec::new(),
        nir: Vec::new(),
        semantics: labels.tags.iter().map(|t| t.class as u8).collect(),
        // The recipe holds no more species than 8 bits number.
        species: labels.tags.iter().map(|t| kind(t.plant) as u8).collect(),
        parts: if recipe.rendering()?.parts { annotate::part_numbers(&labels, &field.kinds) } else { Vec::new() },
        plants: labels.tags.iter().map(|t| t.plant).collect(),
        leaves: labels.tags.iter().map(|t| t.leaf).collect(),
        coverage: Vec::new(),
        depth: keep::depths(&recipe.rendering()?.keep, &labels.depth),
        normals: keep::normals(&recipe.rendering()?.keep, labels.normals.iter().map(Vec3::to_array)),
        jpeg: None,
        film: None,
    };
    (sample.record.classes, sample.record.ignored) = annotate::classes(&sample);
    let before = known.take().unwrap_or_default();
    let traits = known.insert(before.of_next_image(field));
    sample.record.canopy = traits.canopy;
    sample.record.plants = plants(field, traits, &labels, &sample);
    sample.film = Some(Rendered {
        film: None,
        labels,
        tags,
        kinds: field.kinds.clone(),
        plants: field.plants.clone(),
        camera: field.scene.camera,
        flows,
        damage,
    });
    Ok(sample)
}

/// Which image of its field this is.
fn taken(recipe: &Recipe, field: &furrow_field::Field) -> CaptureRecord {
    let Capture { name, frame, time_s, .. } = &field.captures[field.capture];
    let (first, place) = (recipe.days().first(), recipe.days().iter().position(|day| Some(*day) == field.day));
    let frames = field.captures.last().map_or(1, |last| last.frame + 1);
    let later = field.day.zip(first).map_or(0, |(day, first)| day - first);
    CaptureRecord {
        field: field.index,
        day: field.day,
        frame: place.unwrap_or(0) as u32 * frames + frame,
        camera: name.clone(),
        time_s: time_s + f64::from(later) * SECONDS_A_DAY,
    }
}

/// The plants of a field that its image shows or hides, in the order of their numbers.
fn plants(field: &furrow_field::Field, traits: &Traits, labels: &LabelMap, sample: &Sample) -> Vec<Plant> {
    let extents = render::extents(&field.scene, labels);
    let camera = &field.scene.camera;
    let mut shown: BTreeMap<u32, Plant> = annotate::plants(sample).into_iter().map(|p| (p.number, p)).collect();
    let mut all = Vec::new();
    for grown in &field.plants {
        let Some(extent) = extents.get(&(grown.number, 0)).filter(|e| e.unoccluded > 0) else { continue };
        let mut plant = shown.remove(&grown.number).unwrap_or_else(|| hidden(grown));
        let known = |seen: &mut Seen, extent: &render::Extent| {
            (seen.unoccluded, seen.whole) = (Some(extent.unoccluded), Some(extent.whole));
        };
        known(&mut plant.seen, extent);
        for leaf in &mut plant.leaves {
            if let Some(extent) = extents.get(&(grown.number, leaf.number)) {
                known(&mut leaf.seen, extent);
            }
        }
        // Leaves of which no pixel is seen.
        for ((_, number), extent) in extents.range((grown.number, 1)..=(grown.number, u16::MAX)) {
            if extent.unoccluded > 0
                && let Err(place) = plant.leaves.binary_search_by_key(number, |l| l.number)
            {
                let mut leaf =
                    Leaf { number: *number, id: None, seen: Seen::default(), base: None, tip: None, traits: None };
                known(&mut leaf.seen, extent);
                plant.leaves.insert(place, leaf);
            }
        }
        let of_plant = |i: usize| sample.plants[i] == grown.number;
        plant.stem = keypoint(camera, grown.position, of_plant);
        for axis in &grown.leaf_axes {
            if let Ok(place) = plant.leaves.binary_search_by_key(&axis.leaf, |l| l.number) {
                let owns = |i: usize| of_plant(i) && sample.leaves[i] == axis.leaf;
                let leaf = &mut plant.leaves[place];
                leaf.base = keypoint(camera, axis.base, owns);
                leaf.tip = keypoint(camera, axis.tip, owns);
            }
        }
        plant.id = Some(grown.id);
        for leaf in &mut plant.leaves {
            leaf.id = usize::from(leaf.number).checked_sub(1).and_then(|place| grown.leaf_ids.get(place)).copied();
            leaf.traits = traits.leaves.get(&(grown.number, leaf.number)).copied();
        }
        plant.grown = Some(described(grown, traits.plants.get(&grown.number).copied()));
        plant.kind = grown.kind;
        all.push(plant);
    }
    all.sort_by_key(|p: &Plant| p.number);
    all
}

/// A plant of which no pixel is seen.
fn hidden(grown: &PlantRecord) -> Plant {
    Plant {
        number: grown.number,
        id: Some(grown.id),
        class: grown.class,
        kind: grown.kind,
        seen: Seen::default(),
        stem: None,
        grown: None,
        leaves: Vec::new(),
    }
}

fn described(grown: &PlantRecord, traits: Option<PlantTraits>) -> Grown {
    Grown {
        species: grown.species.clone(),
        eppo: grown.eppo.clone(),
        bbch: grown.bbch,
        age_days: grown.age_days,
        position_m: grown.position.to_array(),
        axis: grown.axis.to_array(),
        height_m: grown.height,
        radius_m: grown.radius,
        leaves: grown.leaves,
        traits,
        condition: grown.condition,
    }
}
