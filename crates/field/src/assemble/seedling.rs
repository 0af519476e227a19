//! A plant to be grown, and its growth at its position.

use super::condition::{self, HealthyOrgan, PlantCondition};
use super::field_day::{FieldDay, emerging};
use super::grown::GrownOrgan;
use super::individual::Individual;
use super::member::Member;
use crate::PlantRecord;
use crate::desc::{Growth, SpeciesDesc};
use crate::species::Species;
use furrow_base::Result;
use furrow_base::math::{Frame, Mat3, Spectrum, ToFloat, Vec2, Vec3};
use furrow_base::ron_file::{Positive, Vary};
use furrow_base::sampling::{Purpose, Stream};
use furrow_grow::plant::{self, ConditionDesc, GrowOptions, LeafAge, LeafAxis, OrganKind, Stage};
use furrow_grow::scatter;
use furrow_optics::optics::{Pigments, ageing};
use furrow_render::material::LeafMaterial;
use furrow_render::scene::Part;
use furrow_render::scene::tag::Class;
use furrow_render::scene::tag::Tag;
use std::sync::Arc;

/// Address of the plant's random stream for its vigour in the field.
const VIGOUR: u64 = 1 << 21;
/// Amplitude of white noise on the growth axis, degrees.
const AXIS_NOISE_DEG: f32 = 4.0;

/// A plant to be grown: species, growth, position, random stream, condition.
#[derive(Clone, PartialEq)]
pub(super) struct Seedling {
    pub(super) species: Arc<Species>,
    /// Class of its pixels.
    pub(super) class: Class,
    pub(super) growth: Growth,
    /// Index that the field has drawn for all `Either` lists of growths.
    pub(super) season: usize,
    /// Day of the field; `None` if it has no days.
    pub(super) today: Option<FieldDay>,
    pub(super) position: Vec2,
    pub(super) turn: f32,
    pub(super) only_leaf: Option<u16>,
    pub(super) stream: Stream,
    /// Individual that gives shape and age, if all plants of the species are alike.
    pub(super) individual: Option<Individual>,
    /// Scale factor of the plant's sizes.
    pub(super) vigour: Vary<Positive<100>>,
    pub(super) condition: Option<ConditionDesc>,
    /// Identity before collisions are resolved; see [`super::identity::of`].
    pub(super) id: u32,
    /// Bank plant that this plant is an instance of; `None` if it has its own meshes.
    pub(super) member: Option<Member>,
}

impl Seedling {
    /// Sets the vigour and, if there is one, the condition from the plant's entry in the scene file.
    pub(super) fn tended(self, vigour: &Vary<Positive<100>>, condition: Option<&ConditionDesc>) -> Self {
        let condition = condition.cloned().or(self.condition);
        Self { vigour: vigour.clone(), condition, ..self }
    }
}

/// Site of a plant and resolution of its mesh: together with the [`Seedling`] it determines shape and materials.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct PlantSite {
    /// Height of the plant's foot, metres.
    pub(super) height: f32,
    /// Normal of the ground around the plant.
    pub(super) normal: Vec3,
    /// Height of the highest crumb or plate around the foot above the plane of the ground, metres.
    pub(super) rise: f32,
    /// Reflectance of the dry soil that covers leaves as dust.
    pub(super) dust: Spectrum,
    /// Minimum cell length of the mesh, metres.
    pub(super) cell: f32,
    /// Whether leaves and stems keep their joints.
    pub(super) rigged: bool,
}

/// Grows one plant from its own random stream and places it. The returned record has no number yet. The organs are `None` if the plant
/// has not emerged or if `wanted` returns `false`. Returns an error if the species was not opened.
pub(super) fn grow(
    s: &Seedling,
    place: &PlantSite,
    wanted: impl FnOnce(&PlantRecord) -> bool,
) -> Result<(PlantRecord, Option<Vec<GrownOrgan>>)> {
    let PlantSite { height: z, normal, rise, dust, cell, rigged } = *place;
    let desc: &SpeciesDesc = &s.species.desc;
    let mut stream = s.stream.clone();
    let (drawn, green) = begun(s, &mut stream);
    let axis = scatter::axis(normal, AXIS_NOISE_DEG, &mut stream);
    let shape = s.individual.as_ref().map_or(&stream, Individual::shape);
    let Some(stage) = s.individual.as_ref().map_or(drawn, |individual| stage(s, &mut individual.age())) else {
        return Ok((unborn(s, normal, z), None));
    };
    let mut ailing = s.condition.as_ref().map(|condition| PlantCondition::new(condition, shape, dust));
    let mut vigour = s.vigour.draw32(&mut shape.child(Purpose::Plant, VIGOUR));
    if let (Some(_), Stage::Age(days)) = (&s.today, stage) {
        if let Some(ailing) = &mut ailing {
            ailing.over_days(plant::leaf_lives(&desc.plant, shape, vigour), days);
        }
        vigour *= emerging(&desc.plant, days);
    }
    let condition = ailing.as_ref().map(PlantCondition::posture);
    let options = GrowOptions { vigour, condition, cell, rigged, rise };
    let plant = match &s.individual {
        Some(individual) => individual.plant(desc, stage, &stream, &options),
        None => plant::grow_with(&desc.plant, stage, &stream, &options),
    };
    let foot = s.position.extend(z);
    // Plant coordinates: y is north before the turn, z is the axis. The grown plant already has a random azimuth.
    let ahead = Vec3::new(s.turn.sin(), s.turn.cos(), 0.0);
    let frame = Frame::with_tangent(axis, ahead.cross(axis));
    let rotation = Mat3::from_cols(frame.x, frame.y, frame.z);
    let class = s.class;
    let kept = |leaf: u16| s.only_leaf.is_none_or(|l| leaf == l);
    let to_world = |p: Vec3| rotation * p + foot;
    let axes = plant.leaf_axes().filter(|a| kept(a.leaf));
    let mut leaf_axes: Vec<LeafAxis> = axes.map(|a| a.moved(to_world)).collect();
    leaf_axes.sort_by_key(|a| a.leaf);
    let record = PlantRecord {
        axis,
        bbch: plant.bbch,
        age_days: plant.age_days,
        height: plant.height,
        radius: plant.radius,
        leaves: plant.organs.iter().map(|o| o.leaf).filter(|leaf| kept(*leaf)).max().unwrap_or(0),
        leaf_axes,
        rig: if kept(0) { plant.rig.iter().map(|joint| joint.moved(to_world)).collect() } else { Vec::new() },
        condition: ailing.as_ref().map(PlantCondition::drawn),
        ..unborn(s, normal, z)
    };
    if !wanted(&record) {
        return Ok((record, None));
    }
    let materials = s.species.materials()?;
    let last = plant.organs.iter().map(|o| o.leaf).max().unwrap_or(0);
    let organs = plant.organs.into_iter().filter(|o| kept(o.leaf)).flat_map(|organ| {
        let mut mesh = organ.mesh;
        mesh.transform(rotation, foot);
        let choices = &materials[&organ.material];
        let choice = shape.child(Purpose::Leaf, 1 << 20 | u64::from(organ.leaf)).index(choices.len());
        let chosen = &choices[choice];
        let pigments = &desc.materials[&organ.material].pigments;
        let cut = matches!(organ.kind, OrganKind::Blade | OrganKind::Cotyledon);
        let age = plant.ages.get(&organ.leaf).filter(|_| cut);
        let material = aged(&chosen.material, pigments, age);
        let bare = HealthyOrgan {
            kind: organ.kind,
            material: &material,
            choice: chosen,
            pigments,
            green,
            ground: z,
            last,
            senescence: organ.senescence,
        };
        let grown = GrownOrgan {
            part: Part {
                mesh: Arc::new(mesh),
                mask: if cut { chosen.mask.clone() } else { None },
                material: 0,
                tag: Tag { class, plant: 0, leaf: organ.leaf },
                instance: None,
            },
            kind: organ.kind,
            key: organ.material,
            choice,
            chlorophyll: pigments.chlorophyll.f32() * green,
            material: material.with_chlorophyll(pigments.chlorophyll.f32(), green),
            own: age.is_some(),
        };
        match &ailing {
            Some(ailing) => ailing.dress(&grown, &bare),
            None => vec![condition::fade(grown, &bare, shape)],
        }
    });
    let organs = organs.collect();
    Ok((record, Some(organs)))
}

/// Draws the first two properties of a plant: the stage (`None` before emergence), and its chlorophyll relative to the species' mean.
fn begun(s: &Seedling, stream: &mut Stream) -> (Option<Stage>, f32) {
    let stage = stage(s, stream);
    let green = (1.0 + s.species.desc.chlorophyll_sd.get() * stream.normal()).clamp(0.6, 1.5);
    (stage, green.to_f32())
}

/// Returns a plant's chlorophyll relative to the species' mean. The value is the same whether the plant is grown or is an instance.
pub(super) fn greenness(s: &Seedling) -> f32 {
    begun(s, &mut s.stream.clone()).1
}

/// Draws the stage that a plant has reached; `None` before it emerges.
fn stage(s: &Seedling, stream: &mut Stream) -> Option<Stage> {
    match &s.today {
        None => Some(s.growth.draw(s.season, stream)),
        Some(today) => {
            let shape = s.individual.as_ref().map_or(&s.stream, Individual::shape);
            today.stage((&s.growth, s.season), &s.species.desc.plant, stream, shape)
        }
    }
}

/// Returns the record of a plant that has not emerged: identity, species and position.
fn unborn(s: &Seedling, normal: Vec3, height: f32) -> PlantRecord {
    let desc: &SpeciesDesc = &s.species.desc;
    PlantRecord {
        number: 0,
        id: s.id,
        leaf_ids: Vec::new(),
        species: desc.name.clone(),
        eppo: desc.eppo.clone(),
        kind: 0,
        class: s.class,
        position: s.position.extend(height),
        axis: normal,
        bbch: 0,
        age_days: 0.0,
        height: 0.0,
        radius: 0.0,
        leaves: 0,
        leaf_axes: Vec::new(),
        rig: Vec::new(),
        condition: None,
    }
}

/// Tints a material for the age of a leaf. Without an age (organs other than blades of the main shoot), the species file's colour stays.
fn aged(material: &LeafMaterial, pigments: &Pigments, age: Option<&LeafAge>) -> LeafMaterial {
    age.map_or_else(|| material.clone(), |age| material.tinted(ageing::tint(pigments, age.unfolded, age.days)))
}
