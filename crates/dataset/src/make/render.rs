//! Renders or labels one image of a dataset and describes it as a [`Sample`].

use crate::format;
use crate::make::damage;
use crate::make::flow;
use crate::make::plant_boxes;
use crate::model::annotate::{self, keypoint, of_255};
use crate::model::image_format;
use crate::model::optional_maps::{self, OptionalMap};
use crate::model::recipe::{self, Recipe, Rendering};
use crate::model::record::{CaptureRecord, Exposure, Leaf, Plant, PlantAttributes, Record, Seen};
use crate::model::sample::{Rendered, Sample};
use crate::read::set::Set;
use furrow_base::math::{ToInt, Vec3};
use furrow_base::{Error, Result};
use furrow_field::PlantRecord;
use furrow_field::drive::Capture;
use furrow_field::profile::Phase;
use furrow_field::traits::{PlantTraits, Traits, near_view};
use furrow_job::{Image, Known, PreparedField, Renderer, Request, SceneFile};
use furrow_output::Provenance;
use furrow_render::film::{Film, Pixel};
use furrow_render::render::{self, Extent, LabelMap, RenderMonitor, WholePlants};
use furrow_render::settings::Engine;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Seconds per day.
const SECONDS_A_DAY: f64 = 86_400.0;

/// Time of each step of making an image.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Times {
    /// Building the scene and the BVH.
    pub grow: Duration,
    /// Rendering, including denoising.
    pub draw: Duration,
    /// Computing labels and extents.
    pub label: Duration,
}

/// A newly made image of a dataset.
pub struct RenderedSample {
    /// The image with its labels and record.
    pub sample: Sample,
    /// Provenance text, stored as metadata in its image files.
    pub text: String,
    /// Time of each step.
    pub times: Times,
}

/// Opens the scene file of a dataset.
pub fn scene_file(set: &Set) -> Result<SceneFile> {
    let rendering = set.recipe.rendering()?;
    let (folder, edit) = (&set.folder, rendering.edit()?);
    let scene = SceneFile::open_within(rendering.scene_in(folder)?, edit, recipe::scope(folder))?;
    let scene = scene.seed(rendering.seed).width(rendering.width).height(rendering.height);
    Ok(scene.unlit(rendering.labels_only))
}

/// Opens the renderer of a dataset; returns `None` for imported images. Returns an error if the images on this machine
/// would differ from those of the machine that created the dataset.
pub fn renderer(set: &Set) -> Result<Option<Renderer>> {
    let renderer = near_renderer(set)?;
    if let Some(renderer) = &renderer {
        same(set, "the ray tracing kernels", &set.recipe.rendering()?.kernels, renderer.kernels())?;
    }
    Ok(renderer)
}

/// Like [`renderer`], for images that are only compared: the ray tracing kernels may differ from the dataset's, since
/// the comparison allows [small differences](crate::check::difference).
pub fn near_renderer(set: &Set) -> Result<Option<Renderer>> {
    let Ok(rendering) = set.recipe.rendering() else { return Ok(None) };
    same(set, "furrow", &set.recipe.furrow, env!("CARGO_PKG_VERSION"))?;
    let renderer = Renderer::open(&rendering.options())?;
    if rendering.engine == Engine::Raster {
        same(set, "the graphics card", &rendering.kernels, renderer.kernels())?;
    }
    Ok(Some(renderer))
}

/// Returns an error if `here`, the version on this machine, is not `there`, the one that the dataset was created with.
fn same(set: &Set, what: &str, there: &str, here: &str) -> Result<()> {
    if there == here {
        return Ok(());
    }
    let folder = set.folder.display();
    let words = format!("{folder}: the dataset was created with {what} {there}, this is {here}: images would differ");
    Err(Error::misuse(words).help(format!("continue it with {there}, or create another dataset")))
}

/// Maximum memory of the films of a view that are rendered at once, under several lights, bytes.
const FILMS: u64 = 256 << 20;

/// The field that was built last, reused for further images of it.
#[derive(Default)]
pub struct CachedField {
    field: Option<PreparedField>,
    /// Traits that were measured for the previous image of this field.
    traits: Option<Traits>,
    view: CachedView,
    /// Images that are made next, in order.
    next: Vec<u64>,
}

/// Data that the images of one view under several lights share.
#[derive(Default)]
struct CachedView {
    /// Number of the view among those of the field and day that were built last.
    number: Option<u64>,
    /// Labels and record of an image of the view.
    labelled: Option<Sample>,
    /// Films by the number of their light, until their images are made.
    films: BTreeMap<u64, Film>,
}

/// The field of an image, set to the image's camera, frame and light.
pub(crate) struct FieldAtCamera<'a> {
    pub(crate) field: &'a mut PreparedField,
    /// Traits that were measured for the previous image of this field; `None` for the first.
    traits: &'a mut Option<Traits>,
    view: &'a mut CachedView,
    /// Time of building the scene and BVH; zero if the field was reused.
    pub(crate) grow: Duration,
}

impl CachedField {
    /// Returns the field of an image of a dataset, and builds it if it is not the previous one.
    pub(crate) fn at(&mut self, set: &Set, scene_file: &SceneFile, index: u64) -> Result<FieldAtCamera<'_>> {
        let Set { folder, recipe, .. } = set;
        let rendering = recipe.rendering()?;
        let (number, capture) = recipe.field_of(index);
        let (view, day) = view_of(recipe, capture);
        let known = self.field.take().filter(|field| field.grown().index == number && field.grown().day == day);
        let new = known.is_none();
        if new {
            self.traits = None;
        }
        if new || self.view.number != Some(view) {
            self.view = CachedView { number: Some(view), ..CachedView::default() };
        }
        let field = known.map_or_else(|| scene_file.clone().day(day).field(number), Ok)?;
        if field.grown().hash != rendering.scene_sha256 {
            let help = format!("restore {}/scene/, or create another dataset", folder.display());
            let words = "the scene file or a file that it names was changed since the dataset was created";
            return Err(Error::misuse(words).help(help).in_file(folder.join(&rendering.scene)));
        }
        field.geometry()?;
        // Kept before it is set to the image, so that an error of one light costs no other light its field.
        let field = self.field.insert(field);
        field.take(view)?;
        field.relight(recipe.light_of(index))?;
        let (grow, build) = field.times();
        let grow = if new { grow + build } else { Duration::ZERO };
        Ok(FieldAtCamera { field, traits: &mut self.traits, view: &mut self.view, grow })
    }

    /// Announces the images that are made next, in order. Those of one view are then rendered at once.
    pub fn expect(&mut self, images: Vec<u64>) {
        self.next = images;
    }

    /// Forgets labels and films of the current view.
    pub(crate) fn forget_view(&mut self) {
        self.view = CachedView::default();
    }

    /// Measures the traits of the plants near the view, which its images share.
    pub(crate) fn measure_traits(&mut self) {
        if let Some(field) = &self.field {
            let (before, near) = (self.traits.take().unwrap_or_default(), near_view(field.grown()));
            let measure = || before.of_next_image(field.grown(), |plant| near.contains(&plant));
            self.traits = Some(field.threads().install(measure));
        }
    }
}

/// Splits the number of an image of a field into the number of its view within the day and the day.
pub(crate) fn view_of(recipe: &Recipe, capture: u64) -> (u64, Option<u32>) {
    let a_day = recipe.captures_a_day();
    (capture % a_day / recipe.lights(), recipe.days().get((capture / a_day).to_usize()).copied())
}

/// Makes image `index` of a dataset from its [`scene_file`], on the threads of the scene file.
pub fn render(
    set: &Set,
    scene_file: &SceneFile,
    index: u64,
    renderer: &Renderer,
    watch: RenderMonitor<'_>,
    kept: &mut CachedField,
) -> Result<RenderedSample> {
    let recipe = &set.recipe;
    let together = of_view(recipe, index, &std::mem::take(&mut kept.next))?;
    let at = kept.at(set, scene_file, index)?;
    if recipe.labels_only() {
        return label(set, at, index, renderer);
    }
    let FieldAtCamera { field, traits, view, grow } = at;
    let (begin, light) = (Instant::now(), recipe.light_of(index));
    if together.len() > 1 && !view.films.contains_key(&light) {
        view.films = renderer.films(field, &together, &watch)?;
        field.relight(light)?;
    }
    let shared = begin.elapsed();
    let labels = view.labelled.as_ref().and_then(|sample| Some(sample.film.as_ref()?.labels.clone()));
    let known = Known { labels, film: view.films.remove(&light) };
    let image = renderer.render_known(field, &Request { watch, ..Request::default() }, known)?;
    image.check_denoised()?;
    let begin = Instant::now();
    let (draw, label) = (shared + image.times.draw, image.times.label);
    // Label maps have this comment. It does not name the light, so that they are the same files for all lights.
    let text = Provenance { light: 0, ..image.provenance.clone() }.photograph_text(image.denoised.is_some());
    let sample = field.threads().install(|| describe(recipe, index, image, (traits, &mut view.labelled)))?;
    Ok(RenderedSample { sample, text, times: Times { grow, draw, label: label + begin.elapsed() } })
}

/// Returns the lights of an image and of the following images of the same view. [`FILMS`] limits their number.
fn of_view(recipe: &Recipe, index: u64, next: &[u64]) -> Result<Vec<u64>> {
    let Rendering { width, height, .. } = recipe.rendering()?;
    let film = u64::from(*width) * u64::from(*height) * size_of::<Pixel>().to_u64();
    let view = |index: u64| index / recipe.lights();
    let same = next.iter().take_while(|next| view(**next) == view(index));
    let lights = std::iter::once(&index).chain(same).map(|index| recipe.light_of(*index));
    Ok(lights.take((FILMS / film.max(1)).max(1).to_usize()).collect())
}

/// Labels an image without rendering it.
fn label(
    set: &Set,
    FieldAtCamera { field, traits, grow, .. }: FieldAtCamera<'_>,
    index: u64,
    renderer: &Renderer,
) -> Result<RenderedSample> {
    let begin = Instant::now();
    let labels = field.label()?;
    field.profiler().enter(Phase::Records);
    let sample = field.threads().install(|| labelled(&set.recipe, index, field, (labels, traits)))?;
    let text = format!("{}\nlabels: without light\nkernels: {}", field.grown().provenance(), renderer.kernels());
    Ok(RenderedSample { sample, text, times: Times { grow, draw: Duration::ZERO, label: begin.elapsed() } })
}

/// Returns the sample of a rendered image. `traits` are those of the previous image of the field, `view` is the sample of
/// another image of the same view before it had colours; both are set to this image's.
pub(crate) fn describe(
    recipe: &Recipe,
    index: u64,
    image: Image<'_>,
    (traits, view): (&mut Option<Traits>, &mut Option<Sample>),
) -> Result<Sample> {
    let photograph = image.photograph();
    let field = image.field();
    field.profiler().enter(Phase::Records);
    let Image { film, labels, denoised, .. } = image;
    let mut sample = match view.take() {
        Some(of_view) => relit(recipe, index, field.grown(), of_view),
        None => labelled(recipe, index, field, (labels, traits))?,
    };
    if recipe.lights() > 1 {
        *view = Some(sample.clone());
    }
    sample.record.exposure = Some(Exposure {
        gain: photograph.gain,
        nir_gain: photograph.nir_gain,
        white_balance: photograph.white_balance,
        bands: Some(photograph.shot),
    });
    sample.record.sampling = if denoised.is_none() { film.sampling() } else { None };
    sample.record.quality = recipe.rendering()?.quality;
    sample.rgb = photograph.rgb.as_chunks::<3>().0.to_vec();
    if recipe.keeps(OptionalMap::Nir) {
        sample.nir = photograph.nir;
    }
    field.profiler().enter(Phase::Files);
    sample.jpeg = image_format::store(sample.size(), &mut sample.rgb, &mut sample.nir, recipe.image_format())?;
    field.profiler().enter(Phase::Records);
    sample.coverage = render::coverage(&film, &field.grown().scene.tags()).into_iter().map(of_255).collect();
    // Class statistics include the coverage, so they are computed again now that it is known.
    (sample.record.classes, sample.record.ignored) = annotate::classes(&sample);
    if !recipe.keeps(OptionalMap::Coverage) {
        sample.coverage.clear();
    }
    if let Some(rendered) = &mut sample.film {
        rendered.film = Some(film);
    }
    Ok(sample)
}

/// Returns the sample of an image with the labels of its view, under the field's current light.
fn relit(recipe: &Recipe, index: u64, field: &furrow_field::Field, of_view: Sample) -> Sample {
    let record = Record {
        index,
        name: Set::name(index),
        light: Some(recipe.light_of(index)),
        conditions: Some(field.conditions.clone()),
        warnings: field.warnings.clone(),
        ..of_view.record
    };
    let film = of_view.film.map(|rendered| Rendered { camera: field.scene.camera, ..rendered });
    Sample { record, film, ..of_view }
}

/// Returns the sample of an image with everything that follows from its labels and its field.
fn labelled(
    recipe: &Recipe,
    index: u64,
    of: &PreparedField,
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
    let WholePlants { extents, masks } = if formats.iter().any(|(_, format)| format.needs_masks()) {
        render::whole_plants(&field.scene, &labels)
    } else {
        WholePlants { extents: render::extents(&field.scene, &labels), masks: BTreeMap::new() }
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
            light: (recipe.lights() > 1).then_some(field.light),
            width: labels.window.width(),
            height: labels.window.height(),
            classes: Vec::new(),
            ignored: 0,
            plants: Vec::new(),
            conditions: Some(field.conditions.clone()),
            canopy: None,
            exposure: None,
            sampling: None,
            quality: None,
            warnings: field.warnings.clone(),
        },
        rgb: Vec::new(),
        nir: Vec::new(),
        semantics: labels.tags.iter().map(|t| t.class as u8).collect(),
        // At most 255 species, checked when the dataset is planned.
        species: labels.tags.iter().map(|t| kind(t.plant).to_u8()).collect(),
        parts: if recipe.rendering()?.parts { annotate::part_numbers(&labels, &field.kinds) } else { Vec::new() },
        plants: labels.tags.iter().map(|t| t.plant).collect(),
        leaves: labels.tags.iter().map(|t| t.leaf).collect(),
        coverage: Vec::new(),
        depth: optional_maps::depths(&recipe.rendering()?.keep, &labels.depth),
        normals: optional_maps::normals(&recipe.rendering()?.keep, labels.normals.iter().map(Vec3::to_array)),
        jpeg: None,
        film: None,
    };
    (sample.record.classes, sample.record.ignored) = annotate::classes(&sample);
    let before = known.take().unwrap_or_default();
    let traits = known.insert(before.of_next_image(field, |plant| extents.contains_key(&(plant, 0))));
    sample.record.canopy = traits.canopy;
    sample.record.plants = plants(field, traits, &extents, &sample);
    let boxes = if formats.iter().any(|(_, format)| format.needs_boxes()) {
        plant_boxes::boxes(field, sample.record.plants.iter().map(|plant| plant.number))
    } else {
        BTreeMap::new()
    };
    sample.film = Some(Rendered {
        film: None,
        labels,
        tags,
        kinds: field.kinds.clone(),
        plants: field.plants.clone(),
        camera: field.scene.camera,
        flows,
        damage,
        masks,
        boxes,
    });
    Ok(sample)
}

/// Returns the record of a capture: field, day, frame, camera and time.
fn taken(recipe: &Recipe, field: &furrow_field::Field) -> CaptureRecord {
    let Capture { name, frame, time_s, .. } = &field.captures[field.capture];
    let (first, place) = (recipe.days().first(), recipe.days().iter().position(|day| Some(*day) == field.day));
    let frames = field.captures.last().map_or(1, |last| last.frame + 1);
    let later = field.day.zip(first).map_or(0, |(day, first)| day - first);
    CaptureRecord {
        field: field.index,
        day: field.day,
        frame: place.unwrap_or(0).to_u32() * frames + frame,
        camera: name.clone(),
        time_s: time_s + f64::from(later) * SECONDS_A_DAY,
    }
}

/// Returns the plants of a field in the image's view, including fully occluded ones, by ascending number.
fn plants(
    field: &furrow_field::Field,
    traits: &Traits,
    extents: &BTreeMap<(u32, u16), Extent>,
    sample: &Sample,
) -> Vec<Plant> {
    let camera = &field.scene.camera;
    let mut shown: BTreeMap<u32, Plant> = annotate::plants(sample).into_iter().map(|p| (p.number, p)).collect();
    let mut all = Vec::new();
    for grown in &field.plants {
        let Some(extent) = extents.get(&(grown.number, 0)).filter(|e| e.unoccluded > 0) else { continue };
        let mut plant = shown.remove(&grown.number).unwrap_or_else(|| hidden(grown));
        let known = |seen: &mut Seen, extent: &Extent| {
            (seen.unoccluded, seen.whole) = (Some(extent.unoccluded), Some(extent.whole));
        };
        known(&mut plant.seen, extent);
        for leaf in &mut plant.leaves {
            if let Some(extent) = extents.get(&(grown.number, leaf.number)) {
                known(&mut leaf.seen, extent);
            }
        }
        // Leaves without a visible pixel.
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

/// Returns the entry of a plant without a visible pixel.
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

fn described(grown: &PlantRecord, traits: Option<PlantTraits>) -> PlantAttributes {
    PlantAttributes {
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
