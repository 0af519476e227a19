//! Plants, ground and other objects: one mesh for each part, with its labels.

use super::layer::Layer;
use super::material;
use super::skeleton::Skeleton;
use super::text::{Names, Text, integers, number, quoted, quoted_list, tuples};
use furrow_base::Result;
use furrow_base::geometry::Mesh;
use furrow_base::math::{ToFloat, Vec3};
use furrow_field::{Field, PartKind, PlantRecord};
use furrow_grow::plant::OrganKind;
use furrow_render::scene::Part;
use furrow_render::scene::tag::Tag;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Part of a field with the number of its material.
#[derive(Clone, Copy)]
pub(super) struct Item<'a> {
    pub(super) part: &'a Part,
    pub(super) kind: PartKind,
    pub(super) material: usize,
}

/// Semantic labels: the kind of label, and the label.
type Labels = Vec<(&'static str, String)>;

/// Number of prims whose text is made at once, on all threads.
const AT_ONCE: usize = 64;

/// Writes the plants with their parts, in the order of their numbers.
pub(super) fn plants(field: &Field, items: &[Item<'_>], layer: &mut Layer<'_>) -> Result<()> {
    let mut of: BTreeMap<u32, Vec<Item<'_>>> = BTreeMap::new();
    for item in items.iter().filter(|item| item.part.tag.plant > 0) {
        of.entry(item.part.tag.plant).or_default().push(*item);
    }
    let of: Vec<(u32, Vec<Item<'_>>)> = of.into_iter().collect();
    group("plants", "group", &of, layer, |(number, items)| plant(field, *number, items))
}

/// Writes the parts that belong to no plant: `ground` with soil, stones and litter, and `objects` with all others.
pub(super) fn others(field: &Field, items: &[Item<'_>], layer: &mut Layer<'_>) -> Result<()> {
    let is_ground = |item: &&Item<'_>| matches!(item.kind, PartKind::Soil | PartKind::Debris(_));
    let (ground, objects): (Vec<&Item<'_>>, Vec<&Item<'_>>) =
        items.iter().filter(|item| item.part.tag.plant == 0).partition(is_ground);
    for (name, items) in [("ground", ground), ("objects", objects)] {
        if items.is_empty() {
            continue;
        }
        let mut names = Names::default();
        let named: Vec<(String, &Item<'_>)> =
            items.into_iter().map(|item| (names.unique(kind_name(field, item.kind)), item)).collect();
        group(name, "component", &named, layer, |(name, item)| mesh(field, name, **item, None, 2))?;
    }
    Ok(())
}

/// Writes a prim below `/field` with the texts of `items` in it.
fn group<T: Sync>(
    name: &str,
    kind: &str,
    items: &[T],
    layer: &mut Layer<'_>,
    text: impl Fn(&T) -> Text + Sync,
) -> Result<()> {
    let mut head = Text::at(1);
    head.open("Xform", name, &[format!("kind = {}", quoted(kind))]);
    layer.add(&head)?;
    for items in items.chunks(AT_ONCE) {
        let texts: Vec<Text> = items.par_iter().map(&text).collect();
        texts.iter().try_for_each(|text| layer.add(text))?;
    }
    layer.add(&Text::end(1))
}

/// Returns one plant. With joints it is a `SkelRoot`.
fn plant(field: &Field, number: u32, items: &[Item<'_>]) -> Text {
    let record = field.plants.iter().find(|plant| plant.number == number);
    let skeleton = record.and_then(Skeleton::of);
    let name = format!("plant_{number}");
    let path = format!("/field/plants/{name}");
    let mut labels = vec![("plant", number.to_string())];
    labels.extend(items.first().map(|item| ("class", item.part.tag.class.name().to_owned())));
    labels.extend(record.map(|plant| ("species", plant.species.clone())));
    let mut text = Text::at(2);
    let kind = if skeleton.is_some() { "SkelRoot" } else { "Xform" };
    text.open(kind, &name, &["kind = \"component\"".into(), schemas(&labels, &[])]);
    set_labels(&labels, &mut text);
    if let Some(plant) = record {
        facts(plant, &mut text);
    }
    if let Some(skeleton) = &skeleton {
        skeleton.write(&mut text);
    }
    let mut names = Names::default();
    for item in items {
        let name = names.unique(&part_name(field, item));
        let of = skeleton.as_ref().map(|skeleton| (skeleton, &*path));
        text.append(&mesh(field, &name, *item, of, 3));
    }
    text.close();
    text
}

/// Writes facts about a plant that have no schema.
fn facts(plant: &PlantRecord, text: &mut Text) {
    text.set("custom float furrow:ageDays", number(plant.age_days));
    text.set("custom int furrow:bbch", plant.bbch);
    text.set("custom string furrow:eppo", quoted(&plant.eppo));
    text.set("custom float furrow:heightM", number(plant.height));
    text.set("custom int64 furrow:id", plant.id);
}

/// Returns the name of a part within its plant: `leaf_3` for a blade, `leaf_3_petiole`, `stem`.
fn part_name(field: &Field, item: &Item<'_>) -> String {
    let kind = kind_name(field, item.kind);
    match (item.part.tag.leaf, item.kind) {
        (0, _) => kind.to_owned(),
        (leaf, PartKind::Organ(organ)) if !matches!(organ, OrganKind::Blade | OrganKind::Cotyledon) => {
            format!("leaf {leaf} {kind}")
        }
        (leaf, _) => format!("leaf {leaf}"),
    }
}

/// Returns the name of a kind of part, as in label maps.
fn kind_name(field: &Field, kind: PartKind) -> &str {
    match kind {
        PartKind::Named(place) => field.models.get(usize::from(place)).map_or("model", String::as_str),
        kind => PartKind::NUMBERED.iter().find(|(.., known)| *known == kind).map_or("part", |(_, name, ..)| name),
    }
}

/// Returns one mesh `depth` levels below the root, bound to the skeleton and path of its plant.
fn mesh(field: &Field, name: &str, item: Item<'_>, skeleton: Option<(&Skeleton, &str)>, depth: usize) -> Text {
    let tag = item.part.tag;
    let mesh = item.part.in_world();
    let skeleton = skeleton.filter(|(skeleton, _)| !mesh.weights.is_empty() && skeleton.bends(tag.leaf));
    let labels = labels(tag, kind_name(field, item.kind));
    let mut text = Text::at(depth);
    let other =
        if skeleton.is_some() { &["MaterialBindingAPI", "SkelBindingAPI"][..] } else { &["MaterialBindingAPI"] };
    text.open("Mesh", name, &[schemas(&labels, other)]);
    set_labels(&labels, &mut text);
    text.set("rel material:binding", material::path(item.material));
    geometry(&mesh, &mut text);
    if let Some((skeleton, plant)) = skeleton {
        skeleton.bind(tag.leaf, &mesh.weights, plant, &mut text);
    }
    text.close();
    text
}

fn geometry(mesh: &Mesh, text: &mut Text) {
    let extent = mesh.bounds().map_or(Vec::new(), |(lo, hi)| vec![lo.to_array(), hi.to_array()]);
    text.set("uniform bool doubleSided", 1);
    text.set("float3[] extent", tuples(extent));
    text.set("int[] faceVertexCounts", integers(mesh.triangles.iter().map(|_| 3)));
    text.set("int[] faceVertexIndices", integers(mesh.triangles.as_flattened().iter().copied()));
    text.set_vertices("normal3f[] normals", tuples(mesh.normals.iter().map(Vec3::to_array)), &[]);
    text.set("point3f[] points", tuples(mesh.positions.iter().map(Vec3::to_array)));
    // USD's t increases upwards.
    let st = mesh.uvs.iter().map(|uv| [uv.x, (1.0 - f64::from(uv.y)).to_f32()]);
    text.set_vertices("texCoord2f[] primvars:st", tuples(st), &[]);
    text.set("uniform token subdivisionScheme", quoted("none"));
}

/// Returns the labels of a part: class and kind, and plant and leaf if it belongs to one.
fn labels(tag: Tag, kind: &str) -> Labels {
    let mut labels = vec![("class", tag.class.name().to_owned()), ("part", kind.to_owned())];
    labels.extend((tag.plant > 0).then(|| ("plant", tag.plant.to_string())));
    labels.extend((tag.leaf > 0).then(|| ("leaf", tag.leaf.to_string())));
    labels
}

/// Returns the metadata that applies schemas for these labels, and `others`.
fn schemas(labels: &Labels, others: &[&str]) -> String {
    let labels: Vec<String> = labels.iter().map(|(kind, _)| format!("SemanticsLabelsAPI:{kind}")).collect();
    let all = others.iter().copied().chain(labels.iter().map(String::as_str));
    format!("prepend apiSchemas = {}", quoted_list(all))
}

fn set_labels(labels: &Labels, text: &mut Text) {
    for (kind, label) in labels {
        text.set(&format!("token[] semantics:labels:{kind}"), quoted_list([&**label]));
    }
}
