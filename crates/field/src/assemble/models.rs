//! Places models from disk on the ground and labels them.

use super::contents::Contents;
use super::drawn::{Drawn, Floor};
use super::extent::FARTHEST;
use super::identity;
use super::preview::PlacedModel;
use crate::desc::ModelDesc;
use crate::library::Library;
use crate::{PartKind, PlantRecord};
use furrow_base::geometry::Mesh;
use furrow_base::math::{Mat3, Spectrum, ToInt, Vec3};
use furrow_base::ron_file::{Num, Step};
use furrow_base::sampling::Purpose;
use furrow_base::{Error, Result};
use furrow_grow::model::{self, Label, Model};
use furrow_render::material::{Material, ModelSurface, SurfaceOverride};
use furrow_render::scene::Part;
use furrow_render::scene::tag::{Class, MOST_PLANTS, Tag};
use std::collections::{BTreeMap, BTreeSet};
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

/// Adds all models to `parts`. `numbered` is the number of plants that already have a label number. Returns the plants among the models.
pub(super) fn models(
    drawn: &Drawn<'_>,
    library: &mut Library,
    parts: &mut Contents,
    numbered: usize,
    floor: Option<Floor<'_>>,
) -> Result<Vec<PlantRecord>> {
    let names = names(drawn)?;
    let mut records: Vec<PlantRecord> = Vec::new();
    let mut last = numbered;
    for (k, desc) in drawn.desc.models.iter().enumerate() {
        let named = names.iter().position(|name| desc.name.as_ref() == Some(name));
        let kind = named.map_or(PartKind::Model, |place| PartKind::Named(place.to_u8()));
        let found = place(drawn, library, parts, (k, desc, kind), last, floor)?;
        last = found.iter().map(|r| r.number.to_usize()).max().unwrap_or(last);
        records.extend(found);
    }
    Ok(records)
}

fn place(
    drawn: &Drawn<'_>,
    library: &mut Library,
    all: &mut Contents,
    (k, desc, kind): (usize, &ModelDesc, PartKind),
    numbered: usize,
    floor: Option<Floor<'_>>,
) -> Result<Vec<PlantRecord>> {
    let at = [Step::Field("models"), Step::Item(k)];
    let model = library.model(drawn.page, desc)?;
    if desc.class.is_none() && !model.parts.iter().any(|p| known(p.label.as_ref()).is_some()) {
        let fault = Error::input("this model's file defines no class")
            .help("add class: Crop, class: Weed, or class: Soil for an object that is not a plant");
        return Err(drawn.page.blame(&at, fault));
    }
    let mut stream = drawn.stream(Purpose::Scatter, 3000 + k.to_u64());
    let (x, y) = (desc.position_m.0.draw32(&mut stream), desc.position_m.1.draw32(&mut stream));
    let turn = desc.turn_deg.draw32(&mut stream).to_radians();
    let scale = desc.scale.draw32(&mut stream);
    let foot = Vec3::new(x, y, floor.map_or(0.0, |f| f.height(x, y)) + desc.lift_m.draw32(&mut stream));
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
    let materials: Vec<u32> = surfaces.into_iter().map(|s| all.material(Material::ModelSurface(s))).collect();
    let mut plants: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    let meshes = meshes(drawn, k, &PlacedModel { model: model.clone(), turn, scale, foot });
    if let Some(words) = odd_size(&meshes, desc.class) {
        library.warn(drawn.page, &desc.file, &words)?;
    }
    for (part, mesh) in model.parts.iter().zip(meshes) {
        let tag = tag(desc.class, part.label.as_ref(), numbered).ok_or_else(|| {
            let words = format!("label maps can number at most {MOST_PLANTS} plants; this model exceeds that");
            drawn.page.blame(&at, Error::input(words).help("place fewer plants"))
        })?;
        let (lo, hi) = mesh.bounds().unwrap_or_default();
        let reach = lo.abs().max(hi.abs()).max_element();
        if !reach.is_finite() || reach > FARTHEST {
            let size = (hi - lo).max_element();
            let words = format!("`{}` of this model is {size:.0} m large or too far from the origin", part.name);
            let fault = Error::input(words).help("lengths are in metres; a file in millimetres needs scale: 0.001");
            return Err(drawn.page.blame(&at, fault));
        }
        if tag.plant > 0 {
            plants.entry(tag.plant).or_default().push(all.parts.len());
        }
        let mask = model.surfaces[part.surface].mask.clone();
        all.push(Part { mesh, mask, material: materials[part.surface], tag, instance: None }, kind);
    }
    let plants = plants.into_iter().map(|(number, parts)| {
        // Plant number within the model, independent of the number of plants before it.
        let own = u64::from(number) - numbered.to_u64();
        let id = identity::of(drawn.seed, drawn.index, identity::MODELS + k.to_u64(), own);
        let parts: Vec<&Part> = parts.iter().map(|i| &all.parts[*i]).collect();
        record((number, id), &parts, called(desc), foot, &model)
    });
    Ok(plants.collect())
}

/// Returns a warning if the size of a model suggests that its file is in another unit than metres.
fn odd_size(meshes: &[Arc<Mesh>], class: Option<Class>) -> Option<String> {
    let largest = if matches!(class, Some(Class::Crop | Class::Weed)) { LARGEST_PLANT_M } else { LARGEST_M };
    let bounds = meshes.iter().filter_map(|mesh| mesh.bounds());
    let (lo, hi) = bounds.reduce(|(lo, hi), (low, high)| (lo.min(low), hi.max(high)))?;
    let size = (hi - lo).max_element();
    if size > largest {
        Some(format!("it is {size:.0} m large; lengths are in metres: a file in millimetres needs scale: 0.001"))
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
fn record((number, id): (u32, u32), parts: &[&Part], name: String, foot: Vec3, model: &Model) -> PlantRecord {
    let mut all = Mesh::default();
    for part in parts {
        all.positions.extend_from_slice(&part.mesh.positions);
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
        class: parts[0].tag.class,
        position,
        axis: Vec3::Z,
        bbch: 0,
        age_days: 0.0,
        height: hi.z - position.z,
        radius: across,
        leaves: parts.iter().map(|p| p.tag.leaf).max().unwrap_or(0),
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
