//! Grows plants and places them in the field, each with its own meshes or as an instance of a bank plant.

use super::bank;
use super::bank::Variation;
use super::contents::Contents;
use super::drawn::{Drawn, Floor};
use super::grown::GrownOrgan;
use super::member::Member;
use super::preview::CachedPlant;
use super::progress::Stage;
use super::seedling::{PlantSite, Seedling, grow};
use crate::library::Library;
use crate::{PartKind, PlantRecord};
use furrow_base::geometry::Placement;
use furrow_base::math::{Spectrum, Vec2, Vec3};
use furrow_base::{Error, Result};
use furrow_grow::soil::{Rect, Stance};
use furrow_optics::optics::soil::LOESS;
use furrow_render::material::Material;
use furrow_render::scene::tag::Tag;
use furrow_render::scene::{Instance, Part};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::sync::Arc;

/// Maximum shadow length considered, in plant heights: for a sun 20° above the horizon.
pub(super) const SHADOW: f32 = 2.75;

/// A placed plant.
enum PlacedPlant {
    /// A plant with its own meshes.
    Own(Arc<CachedPlant>),
    /// An instance of a bank plant.
    Shared(Box<PlantRecord>, Member, Variation),
}

impl PlacedPlant {
    fn own(&self) -> Option<Arc<CachedPlant>> {
        match self {
            Self::Own(plant) => Some(plant.clone()),
            Self::Shared(..) => None,
        }
    }
}

/// Grows every plant, places it on the ground, and adds it to `parts`. Returns the records of the plants that reach the view.
pub(super) fn plant(
    drawn: &Drawn<'_>,
    library: &mut Library,
    parts: &mut Contents,
    seedlings: &[Seedling],
    floor: Option<Floor<'_>>,
    view: Option<Rect>,
) -> Result<Vec<PlantRecord>> {
    let (dust, options) = (dust(drawn, library)?, drawn.options);
    let bank = bank::bank(drawn, seedlings, dust)?;
    options.progress.enter(Stage::Plants);
    options.progress.plants.expect(seedlings.len());
    let cell = |at: Vec2| drawn.cell(at);
    // A plant is grown to know its size; its organs are dropped if neither it nor its shadow reaches the view.
    let reaches = |plant: &PlantRecord| {
        let reach = plant.radius + SHADOW * plant.height;
        view.is_none_or(|v| v.grown(reach).contains(plant.position.truncate()))
    };
    let stand = |seedling: &Seedling| {
        options.wanted()?;
        let Vec2 { x, y } = seedling.position;
        let level = Stance { height: 0.0, normal: Vec3::Z, rise: 0.0 };
        let Stance { height, normal, rise } = floor.map_or(level, |f| f.stance(x, y));
        if let Some(member) = seedling.member {
            let (record, own) = bank[&member].stand(seedling, seedling.position.extend(height), normal);
            return Ok(PlacedPlant::Shared(Box::new(record), member, own));
        }
        // Plants that are alike have one mesh, whatever is below them.
        let rise = if seedling.individual.is_some() { 0.0 } else { rise };
        let place = PlantSite { height, normal, rise, dust, cell: cell(seedling.position), rigged: options.rigged };
        let known = options.preview.as_ref().and_then(|preview| preview.plant(seedling, &place));
        let known = known.filter(|known| known.organs.is_some() || !reaches(&known.record));
        if let Some(known) = known {
            return Ok(PlacedPlant::Own(known));
        }
        let (record, organs) = grow(seedling, &place, reaches)?;
        Ok(PlacedPlant::Own(Arc::new(CachedPlant { seedling: seedling.clone(), place, record, organs })))
    };
    let grown = seedlings.par_iter().map(stand).inspect(|_| options.progress.plants.add());
    let grown: Vec<PlacedPlant> = grown.collect::<Result<_>>()?;
    if let Some(preview) = &options.preview {
        preview.keep_plants(&grown.iter().filter_map(PlacedPlant::own).collect::<Vec<_>>());
    }
    let mut records = Vec::with_capacity(grown.len());
    let mut worn: BTreeMap<Member, Vec<u32>> = BTreeMap::new();
    for (number, stands) in (1..).zip(grown) {
        match stands {
            PlacedPlant::Own(plant) => {
                let (true, Some(organs)) = (reaches(&plant.record), &plant.organs) else { continue };
                let record = PlantRecord { number, ..plant.record.clone() };
                let materials = dress(drawn, parts, &record, organs)?;
                put_organs(parts, number, organs, &materials, None);
                records.push(record);
            }
            PlacedPlant::Shared(record, member, own) => {
                let (true, Some(organs)) = (reaches(&record), &bank[&member].organs) else { continue };
                let record = PlantRecord { number, ..*record };
                if let Entry::Vacant(first) = worn.entry(member) {
                    first.insert(dress(drawn, parts, &record, organs)?);
                }
                put_organs(parts, number, organs, &worn[&member], Some(own));
                records.push(record);
            }
        }
    }
    Ok(records)
}

/// Creates the materials of a plant's organs. Returns the material index of each organ.
fn dress(drawn: &Drawn<'_>, parts: &mut Contents, record: &PlantRecord, organs: &[GrownOrgan]) -> Result<Vec<u32>> {
    // One material per plant and name, because plants differ in chlorophyll. Organs with damage have their own material.
    let mut made: Vec<(&str, usize, u32)> = Vec::new();
    let mut materials = Vec::with_capacity(organs.len());
    for organ in organs {
        if let Some(fault) = organ.part.mesh.fault() {
            let (species, number) = (&record.species, record.number);
            return Err(Error::input(format!(
                "{}: plant {number}, a {species}, grew a broken mesh: {fault}",
                drawn.page.path.display()
            ))
            .help("check its species file for extreme sizes"));
        }
        let same = |m: &&(&str, usize, u32)| !organ.own && m.0 == organ.key && m.1 == organ.choice;
        let known = made.iter().find(same).map(|m| m.2);
        materials.push(known.unwrap_or_else(|| {
            let material = parts.material(Material::Leaf(organ.material.clone()));
            if !organ.own {
                made.push((&organ.key, organ.choice, material));
            }
            material
        }));
    }
    Ok(materials)
}

/// Adds a plant's organs to the scene: meshes in world space, or those of a bank plant with the transform of an instance.
fn put_organs(
    parts: &mut Contents,
    number: u32,
    organs: &[GrownOrgan],
    materials: &[u32],
    instance: Option<Variation>,
) {
    let instance = instance.map(|Variation { at, greener }| (Arc::new(at), greener));
    for (organ, material) in organs.iter().zip(materials) {
        let tag = Tag { plant: number, ..organ.part.tag };
        let own = |(placement, greener): &(Arc<Placement>, f32)| {
            let tint = organ.tint(*greener);
            Instance { placement: placement.clone(), tint }
        };
        let instance = instance.as_ref().map(own);
        parts.push(Part { material: *material, tag, instance, ..organ.part.clone() }, PartKind::Organ(organ.kind));
    }
}

/// Returns the reflectance of the dry soil that covers leaves as dust.
fn dust(drawn: &Drawn<'_>, library: &mut Library) -> Result<Spectrum> {
    match drawn.desc.soil.as_ref().and_then(|soil| soil.layers.first()) {
        Some(layer) => Ok(library.layer(drawn.page, layer)?.mean()),
        None => Ok(LOESS),
    }
}
