//! Places models from disk on the ground, one by one or in rows and patches, and labels them.

use super::contents::Contents;
use super::drawn::{Drawn, Floor};
use super::extent::FARTHEST;
use super::preview::PlacedModel;
use super::stand::SHADOW;
use super::view::VisibleGround;
use super::{identity, model_spots};
use crate::desc::ModelDesc;
use crate::library::Library;
use crate::{PartKind, PlantRecord};
use furrow_base::geometry::{Mesh, Placement};
use furrow_base::math::{Mat3, Spectrum, ToFloat, ToInt, Vec3};
use furrow_base::ron_file::{Num, RonFile, Step};
use furrow_base::sampling::Purpose;
use furrow_base::sampling::rng::mix;
use furrow_base::{Error, Result};
use furrow_grow::model::{self, Label, Model};
use furrow_grow::scatter::{Disc, Spot};
use furrow_render::material::{Material, ModelSurface, SurfaceOverride};
use furrow_render::scene::tag::{Class, MOST_PLANTS, Tag};
use furrow_render::scene::{Instance, Part};
use std::collections::{BTreeMap, BTreeSet};
use std::f32::consts::{FRAC_1_SQRT_2, TAU};
use std::path::Path;
use std::sync::Arc;

/// Mean visible reflectance of a model above which a warning is given: photographs used as colours, and white paint.
const BRIGHT: f32 = 0.6;
/// Sizes in metres beyond which a warning is given: of plants, of other models, and of any.
const LARGEST_PLANT_M: f32 = 10.0;
const LARGEST_M: f32 = 100.0;
const SMALLEST_M: f32 = 5e-4;
/// Mean visible reflectance of a green leaf.
const LEAF: f32 = 0.1;

/// The ground that models are placed on, what is seen of it, and the stones on it.
pub(super) struct ModelGround<'a> {
    pub(super) floor: Option<Floor<'a>>,
    pub(super) sight: &'a VisibleGround,
    pub(super) stones: &'a [Disc],
}

impl ModelGround<'_> {
    fn height(&self, x: f32, y: f32) -> f32 {
        self.floor.map_or(0.0, |f| f.height(x, y))
    }
}

/// An item of `models` and its file.
struct Entry<'a> {
    k: usize,
    desc: &'a ModelDesc,
    kind: PartKind,
    model: Arc<Model>,
    /// Material index of each surface.
    materials: Vec<u32>,
}

impl Entry<'_> {
    fn place(&self) -> [Step<'static>; 2] {
        [Step::Field("models"), Step::Item(self.k)]
    }

    fn part(&self, i: usize, mesh: Arc<Mesh>, tag: Tag, instance: Option<Instance>) -> Part {
        let surface = self.model.parts[i].surface;
        let mask = self.model.surfaces[surface].mask.clone();
        Part { mesh, mask, material: self.materials[surface], tag, instance }
    }

    /// Returns the tag of each part, after `numbered` plants.
    fn tags(&self, drawn: &Drawn<'_>, numbered: usize) -> Result<Vec<Tag>> {
        let tags = self.model.parts.iter().map(|part| tag(self.desc.class, part.label.as_ref(), numbered));
        tags.collect::<Option<_>>().ok_or_else(|| {
            let words = format!("label maps can number at most {MOST_PLANTS} plants; this model exceeds that");
            drawn.page.blame(&self.place(), Error::input(words).help("place fewer plants"))
        })
    }

    /// Returns an error if a part that is `size` metres large reaches farther than [`FARTHEST`] from the world's origin.
    fn within_reach(&self, drawn: &Drawn<'_>, part: &str, reach: f32, size: f32) -> Result<()> {
        if reach.is_finite() && reach <= FARTHEST {
            return Ok(());
        }
        let fault = if size > FARTHEST {
            let words = format!("`{part}` of this model is {size:.0} m large");
            Error::input(words).help("lengths are in metres; a file in millimetres needs scale: 0.001")
        } else {
            too_far(part)
        };
        Err(drawn.page.blame(&self.place(), fault))
    }
}

/// The error about a part that reaches farther than [`FARTHEST`]. It names no distance, so that it is the same before a model is placed.
fn too_far(part: &str) -> Error {
    Error::input(format!("`{part}` of this model reaches more than {FARTHEST} m from the field's origin"))
        .help("move it to the origin in your program, or give another position_m")
}

/// Adds all models to `parts`. `numbered` is the number of plants that already have a label number. Returns the plants among the models.
pub(super) fn models(
    drawn: &Drawn<'_>,
    library: &mut Library,
    parts: &mut Contents,
    numbered: usize,
    ground: &ModelGround<'_>,
) -> Result<Vec<PlantRecord>> {
    let names = names(drawn)?;
    let mut records: Vec<PlantRecord> = Vec::new();
    let mut last = numbered;
    for (k, desc) in drawn.desc.models.iter().enumerate() {
        let named = names.iter().position(|name| desc.name.as_ref() == Some(name));
        let kind = named.map_or(PartKind::Model, |place| PartKind::Named(place.to_u8()));
        let entry = open(drawn, library, parts, (k, desc, kind))?;
        let found = match model_spots::spots(drawn, k, ground.sight, ground.stones)? {
            None => place(drawn, library, parts, &entry, last, ground)?,
            Some(spots) => sow(drawn, library, parts, &entry, (last, &spots), ground)?,
        };
        last = found.iter().map(|r| r.number.to_usize()).max().unwrap_or(last);
        records.extend(found);
    }
    Ok(records)
}

/// Loads the file of model `k` of the scene file and checks that it has a class.
pub(super) fn load(page: &RonFile, library: &mut Library, k: usize, desc: &ModelDesc) -> Result<Arc<Model>> {
    let model = library.model(page, desc)?;
    let place = [Step::Field("models"), Step::Item(k)];
    if let Some(fault) = if desc.class.is_none() { label_fault(&model) } else { None } {
        let help = "correct the extras in your program, such as {\"class\": \"crop\", \"plant\": 1, \"leaf\": 2}, or add class: Crop or Weed";
        return Err(page.blame(&place, Error::input(fault).help(help)));
    }
    if desc.class.is_none() && !model.parts.iter().any(|p| known(p.label.as_ref()).is_some()) {
        let fault = Error::input("this model's file defines no class")
            .help("add class: Crop, class: Weed, or class: Soil for an object that is not a plant");
        return Err(page.blame(&place, fault));
    }
    Ok(model)
}

/// Refuses models that are too far away at any usual scale and position, and warns of those of an unusual size.
pub(super) fn check_sizes(page: &RonFile, library: &mut Library, models: &[ModelDesc]) -> Result<()> {
    for (k, desc) in models.iter().enumerate() {
        let model = load(page, library, k, desc)?;
        let (least, most) = desc.scale.usual();
        let places = [desc.position_m.0.usual(), desc.position_m.1.usual(), desc.lift_m.usual()];
        let [x, y, lift] = places.map(|(lo, hi)| lo.abs().max(hi.abs()).to_f32());
        for part in &model.parts {
            let Some((lo, hi)) = part.mesh.bounds() else { continue };
            // At the least scale. A turn divides the distance from the axis between x and y, so that one of them is at least 1/√2 of it.
            let middle = (0.5 * (lo + hi) * least.to_f32()).abs();
            let reach = (middle.z - lift).max(middle.truncate().length() * FRAC_1_SQRT_2 - x.max(y));
            if reach > FARTHEST && (hi - lo).max_element() * most.to_f32() <= FARTHEST {
                return Err(page.blame(&[Step::Field("models"), Step::Item(k)], too_far(&part.name)));
            }
        }
        let extent = size(model.parts.iter().map(|part| &part.mesh)).map(|size| size * (0.5 * (least + most)).to_f32());
        if let Some(words) = extent.and_then(|size| odd_size(size, desc.class)) {
            library.warn(page, &desc.file, &words)?;
        }
    }
    Ok(())
}

/// Returns what is wrong with the labels of a model file: an unknown class, or numbers that contradict the class.
fn label_fault(model: &Model) -> Option<String> {
    if model.label_fault.is_some() {
        return model.label_fault.clone();
    }
    let mut classes: BTreeMap<u32, (Class, &str)> = BTreeMap::new();
    for part in &model.parts {
        let (Some(label), name) = (&part.label, &part.name) else { continue };
        let Some(class) = Class::named(&label.class) else {
            return Some(format!("`{name}` has the unknown class `{}`: there are soil, crop and weed", label.class));
        };
        match (class, label.plant, label.leaf) {
            (Class::Soil, 0, 0) => {}
            (Class::Soil, ..) => return Some(format!("`{name}` is soil, but has the number of a plant or leaf")),
            (_, 0, _) => return Some(format!("`{name}` is a {}, but has no number of a plant from 1", label.class)),
            (_, plant, _) => {
                let (first, other) = *classes.entry(plant).or_insert((class, name));
                if first != class {
                    return Some(format!("plant {plant} is a {} in `{name}`, but not in `{other}`", label.class));
                }
            }
        }
    }
    None
}

/// Loads the file of a model and creates its materials.
fn open<'a>(
    drawn: &Drawn<'_>,
    library: &mut Library,
    all: &mut Contents,
    (k, desc, kind): (usize, &'a ModelDesc, PartKind),
) -> Result<Entry<'a>> {
    let model = load(drawn.page, library, k, desc)?;
    let repaint = SurfaceOverride {
        roughness: desc.roughness.map(Num::f32),
        transmission: desc.transmission.map(|(r, g, b, nir)| Spectrum::new(r.f32(), g.f32(), b.f32(), nir.f32())),
        nir: desc.nir.map(Num::f32),
        gain: desc.gain.map(Num::f32),
    };
    let surfaces: Vec<ModelSurface> = model.surfaces.iter().map(|s| ModelSurface::new(s, &repaint)).collect();
    if let Some(words) = bright(desc, &model, &surfaces) {
        library.warn(drawn.page, &desc.file, &words)?;
    }
    let materials = surfaces.into_iter().map(|s| all.material(Material::ModelSurface(s))).collect();
    Ok(Entry { k, desc, kind, model, materials })
}

/// Places a single model.
fn place(
    drawn: &Drawn<'_>,
    library: &mut Library,
    all: &mut Contents,
    entry: &Entry<'_>,
    numbered: usize,
    ground: &ModelGround<'_>,
) -> Result<Vec<PlantRecord>> {
    let Entry { k, desc, model, .. } = entry;
    let mut stream = model_spots::stream(drawn, *k);
    let (x, y) = (desc.position_m.0.draw32(&mut stream), desc.position_m.1.draw32(&mut stream));
    let turn = desc.turn_deg.as_ref().map_or(0.0, |turn| turn.draw32(&mut stream)).to_radians();
    let scale = desc.scale.draw32(&mut stream);
    let foot = Vec3::new(x, y, ground.height(x, y) + desc.lift_m.draw32(&mut stream));
    let mut plants: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    let meshes = meshes(drawn, *k, &PlacedModel { model: model.clone(), turn, scale, foot });
    if let Some(words) = size(meshes.iter().map(|mesh| &**mesh)).and_then(|size| odd_size(size, desc.class)) {
        library.warn(drawn.page, &desc.file, &words)?;
    }
    let tags = entry.tags(drawn, numbered)?;
    for (i, (mesh, tag)) in meshes.into_iter().zip(tags).enumerate() {
        let (lo, hi) = mesh.bounds().unwrap_or_default();
        let reach = lo.abs().max(hi.abs()).max_element();
        entry.within_reach(drawn, &model.parts[i].name, reach, (hi - lo).max_element())?;
        if tag.plant > 0 {
            plants.entry(tag.plant).or_default().push(all.parts.len());
        }
        all.push(entry.part(i, mesh, tag, None), entry.kind);
    }
    let plants = plants.into_iter().map(|(number, parts)| {
        // Plant number within the model, independent of the number of plants before it.
        let own = u64::from(number) - numbered.to_u64();
        let id = identity::of(drawn.seed, drawn.index, identity::MODELS + k.to_u64(), own);
        let parts: Vec<(&Mesh, Tag)> = parts.iter().map(|i| (&*all.parts[*i].mesh, all.parts[*i].tag)).collect();
        record((number, id), &parts, called(desc), foot, model)
    });
    Ok(plants.collect())
}

/// Places a copy of a model at each of the positions `spots`, after `numbered` plants. All copies share the meshes of the file; those of a
/// preview, which finds changed parts by their meshes, have their own. Returns the records of the plants that reach the view.
fn sow(
    drawn: &Drawn<'_>,
    library: &mut Library,
    all: &mut Contents,
    entry: &Entry<'_>,
    (mut numbered, spots): (usize, &[Spot]),
    ground: &ModelGround<'_>,
) -> Result<Vec<PlantRecord>> {
    let Entry { k, desc, model, .. } = entry;
    let meshes: Vec<Arc<Mesh>> = model.parts.iter().map(|part| Arc::new(part.mesh.clone())).collect();
    let (templates, extent) =
        (templates(entry, &meshes, &entry.tags(drawn, 0)?), size(meshes.iter().map(|mesh| &**mesh)).unwrap_or(0.0));
    let vertices = || meshes.iter().flat_map(|mesh| &mesh.positions);
    let radius = vertices().map(|p| p.truncate().length()).fold(0.0, f32::max);
    let height = vertices().map(|p| p.z).fold(0.0, f32::max);
    let (view, mut records) = (ground.sight.shown(drawn), Vec::new());
    for (i, spot) in spots.iter().enumerate() {
        drawn.options.wanted()?;
        let placement = copy(drawn, entry, *spot, ground);
        let scale = placement.scale;
        if let Some(words) = odd_size(extent * scale, desc.class).filter(|_| i == 0) {
            library.warn(drawn.page, &desc.file, &words)?;
        }
        let reach = radius.max(height) * scale + placement.offset.abs().max_element();
        entry.within_reach(drawn, &called(desc), reach, extent * scale)?;
        if !view.is_none_or(|view| view.grown((radius + SHADOW * height) * scale).contains(spot.at)) {
            continue;
        }
        let placement = Arc::new(placement);
        for (i, (mesh, tag)) in meshes.iter().zip(entry.tags(drawn, numbered)?).enumerate() {
            let part = if drawn.options.preview.is_some() {
                let mut own = Mesh::clone(mesh);
                own.transform(placement.matrix(), placement.offset);
                entry.part(i, Arc::new(own), tag, None)
            } else {
                entry.part(i, mesh.clone(), tag, Some(Instance { placement: placement.clone(), tint: Vec3::ONE }))
            };
            all.push(part, entry.kind);
        }
        let address = |own: u32| mix(spot.key) ^ u64::from(own);
        records.extend(templates.iter().map(|plant| PlantRecord {
            number: plant.number + numbered.to_u32(),
            id: identity::of(drawn.seed, drawn.index, identity::MODELS + k.to_u64(), address(plant.number)),
            position: placement.point(plant.position),
            height: plant.height * scale,
            radius: plant.radius * scale,
            ..plant.clone()
        }));
        numbered += templates.iter().map(|plant| plant.number.to_usize()).max().unwrap_or(0);
    }
    Ok(records)
}

/// Draws rotation, scale and height of the copy of a model at a position.
fn copy(drawn: &Drawn<'_>, entry: &Entry<'_>, spot: Spot, ground: &ModelGround<'_>) -> Placement {
    let Entry { k, desc, .. } = entry;
    let stream = model_spots::copy_stream(drawn, *k, spot);
    let child = |number| stream.child(Purpose::Page, number);
    let turn = match &desc.turn_deg {
        Some(turn) => turn.draw32(&mut child(0)).to_radians(),
        None => child(0).range32(0.0, TAU),
    };
    let height = ground.height(spot.at.x, spot.at.y) + desc.lift_m.draw32(&mut child(2));
    let rotation = Mat3::from_rotation_z(-turn);
    Placement { rotation, scale: desc.scale.draw32(&mut child(1)), offset: spot.at.extend(height) }
}

/// Returns the records of the plants in a model that is placed at the world's origin without rotation and scale.
fn templates(entry: &Entry<'_>, meshes: &[Arc<Mesh>], tags: &[Tag]) -> Vec<PlantRecord> {
    let mut plants: BTreeMap<u32, Vec<(&Mesh, Tag)>> = BTreeMap::new();
    for (mesh, tag) in meshes.iter().zip(tags).filter(|(_, tag)| tag.plant > 0) {
        plants.entry(tag.plant).or_default().push((mesh, *tag));
    }
    let record = |(number, parts): (u32, Vec<(&Mesh, Tag)>)| {
        record((number, 0), &parts, called(entry.desc), Vec3::ZERO, &entry.model)
    };
    plants.into_iter().map(record).collect()
}

/// Returns the number of plants in a model.
pub(super) fn plants_in(desc: &ModelDesc, model: &Model) -> usize {
    let tags = model.parts.iter().filter_map(|part| tag(desc.class, part.label.as_ref(), 0));
    tags.map(|tag| tag.plant).filter(|plant| *plant > 0).collect::<BTreeSet<_>>().len()
}

/// Returns the largest side of the box around meshes, metres; `None` without vertices.
fn size<'a>(meshes: impl Iterator<Item = &'a Mesh>) -> Option<f32> {
    let bounds = meshes.filter_map(Mesh::bounds);
    let (lo, hi) = bounds.reduce(|(lo, hi), (low, high)| (lo.min(low), hi.max(high)))?;
    Some((hi - lo).max_element())
}

/// Returns a warning if the size of a model suggests that its file is in another unit than metres.
fn odd_size(size: f32, class: Option<Class>) -> Option<String> {
    let largest = if matches!(class, Some(Class::Crop | Class::Weed)) { LARGEST_PLANT_M } else { LARGEST_M };
    if size > largest {
        Some(format!(
            "it is {size:.0} m large; lengths are in metres: a file in millimetres needs scale: 0.001, one in centimetres scale: 0.01"
        ))
    } else if size < SMALLEST_M {
        Some(format!("it is {size:.2e} m large; lengths are in metres: scale enlarges it"))
    } else {
        None
    }
}

/// Returns a warning if a model reflects more of the visible light than plants and ground do. Objects that are painted
/// white without an image are as bright on purpose.
fn bright(desc: &ModelDesc, model: &Model, surfaces: &[ModelSurface]) -> Option<String> {
    if desc.class == Some(Class::Soil) && model.surfaces.iter().all(|surface| surface.picture.is_none()) {
        return None;
    }
    let reflectances = surfaces.iter().map(ModelSurface::mean_reflectance);
    let visible: Vec<f32> = reflectances.map(|mean| mean.to_array()[..3].iter().sum::<f32>() / 3.0).collect();
    let (mut light, mut area) = (0.0, 0.0);
    for part in &model.parts {
        let of = part.mesh.area();
        area += of;
        light += of * visible[part.surface];
    }
    let mean = light / area;
    (mean > BRIGHT).then(|| {
        let gain = desc.gain.map_or(1.0, Num::f32) * LEAF / mean;
        format!(
            "its mean reflectance in the visible is {mean:.2}; leaves have 0.1, soil 0.2, white paint 0.8: \
             gain: {gain:.2} gives it that of a leaf"
        )
    })
}

/// Returns the meshes of a model's parts in world space.
fn meshes(drawn: &Drawn<'_>, k: usize, stood: &PlacedModel) -> Vec<Arc<Mesh>> {
    let preview = drawn.options.preview.as_ref();
    if let Some(known) = preview.and_then(|preview| preview.model(k, stood)) {
        return known;
    }
    let PlacedModel { model, turn, scale, foot } = stood;
    let put = |part: &model::ModelPart| {
        let mut mesh = part.mesh.clone();
        // Skip the identity transform, so that the vertices stay bit-identical.
        if *turn != 0.0 || *scale != 1.0 || *foot != Vec3::ZERO {
            mesh.transform(Mat3::from_rotation_z(-turn) * *scale, *foot);
        }
        Arc::new(mesh)
    };
    let meshes: Vec<Arc<Mesh>> = model.parts.iter().map(put).collect();
    if let Some(preview) = preview {
        preview.keep_model(k, stood, &meshes);
    }
    meshes
}

/// Returns the record of a plant that is a model or part of one.
fn record((number, id): (u32, u32), parts: &[(&Mesh, Tag)], name: String, foot: Vec3, model: &Model) -> PlantRecord {
    let mut all = Mesh::default();
    for (mesh, _) in parts {
        all.positions.extend_from_slice(&mesh.positions);
    }
    let (lo, hi) = all.bounds().unwrap_or((foot, foot));
    // A single plant is at the scene file's position; one of several is at the centre of its own bounding box.
    let position = if parts.len() == model.parts.len() { foot } else { ((lo + hi) * 0.5).with_z(lo.z) };
    let across = all.positions.iter().map(|p| (p - position).truncate().length()).fold(0.0, f32::max);
    PlantRecord {
        number,
        id,
        leaf_ids: Vec::new(),
        species: name,
        eppo: String::new(),
        kind: 0,
        class: parts[0].1.class,
        position,
        axis: Vec3::Z,
        bbch: 0,
        age_days: 0.0,
        height: hi.z - position.z,
        radius: across,
        leaves: parts.iter().map(|(_, tag)| tag.leaf).max().unwrap_or(0),
        leaf_axes: Vec::new(),
        rig: Vec::new(),
        condition: None,
    }
}

/// Returns the distinct classes of the plants among a model's parts, sorted.
pub(super) fn classes(desc: &ModelDesc, model: &Model) -> BTreeSet<Class> {
    let tags = model.parts.iter().filter_map(|part| tag(desc.class, part.label.as_ref(), 0));
    tags.filter(|tag| tag.plant > 0).map(|tag| tag.class).collect()
}

/// Returns the label with its class, if the class name is known.
fn known(label: Option<&Label>) -> Option<(Class, &Label)> {
    label.and_then(|l| Class::named(&l.class).map(|class| (class, l)))
}

/// Returns the tag of a part: the class from the scene file, or else from the model file. `None` if no plant number is left.
fn tag(class: Option<Class>, label: Option<&Label>, numbered: usize) -> Option<Tag> {
    let number = |n: usize| u32::try_from(numbered + n).ok().filter(|number| *number <= MOST_PLANTS);
    let label = known(label);
    match (class, label) {
        (Some(Class::Soil), _) | (None, None) => Some(Tag::default()),
        (Some(class), label) => Some(Tag { class, plant: number(1)?, leaf: label.map_or(0, |(_, l)| l.leaf) }),
        (None, Some((class, l))) if l.plant > 0 => {
            Some(Tag { class, plant: number(l.plant.to_usize())?, leaf: l.leaf })
        }
        (None, Some((class, l))) => Some(Tag { class, plant: 0, leaf: l.leaf }),
    }
}

/// Returns the name of a model: the name in the scene file, or else the file name without folder and extension.
pub(super) fn called(desc: &ModelDesc) -> String {
    let of_file = || Path::new(&desc.file).file_stem().unwrap_or_default().to_string_lossy().into_owned();
    desc.name.clone().unwrap_or_else(of_file)
}

/// Returns the names of models from disk in the scene file's order, each once. The list is the same for every index.
pub(super) fn names(drawn: &Drawn<'_>) -> Result<Vec<String>> {
    let mut all: Vec<String> = Vec::new();
    for (k, desc) in drawn.desc.models.iter().enumerate() {
        let Some(name) = desc.name.as_ref().filter(|name| !all.contains(name)) else { continue };
        if let Some(fault) = fault_of_name(name, all.len()) {
            let at = [Step::Field("models"), Step::Item(k), Step::Field("name")];
            let help = "give a short name such as \"robot\"; models of the same class may share it";
            return Err(drawn.page.blame(&at, Error::input(fault).help(help)));
        }
        all.push(name.clone());
    }
    Ok(all)
}

/// Returns the fault of a new model name, if there is one; `known` is the number of other names.
fn fault_of_name(name: &str, known: usize) -> Option<&'static str> {
    if name.is_empty() || name.trim() != name || name.contains([',', ';', '=']) {
        return Some("a class cannot have this name: it is empty, has spaces at an end, or contains `,`, `;` or `=`");
    }
    if name.contains(char::is_control) {
        return Some("the name of this model contains a control character");
    }
    (known >= PartKind::MOST_NAMED).then_some("label maps have numbers for 100 model names, and this name exceeds that")
}
