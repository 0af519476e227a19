//! A plant to be grown, and how it grows in its place.

use super::condition::{Ailing, Bare};
use super::grown::Grown;
use super::individual::Individual;
use super::member::Member;
use super::today::{Today, emerging};
use crate::material::LeafMaterial;
use crate::math::{Frame, Mat3, Spectrum, Vec2, Vec3};
use crate::optics::{Pigments, ageing};
use crate::plant::{self, ConditionDesc, GrowOptions, LeafAge, LeafAxis, OrganKind, Stage};
use crate::ron_file::{Positive, Vary};
use crate::sampling::{Purpose, Stream};
use crate::scatter;
use crate::scene::desc::{Growth, SpeciesDesc};
use crate::scene::library::Species;
use crate::scene::tag::Tag;
use crate::scene::{Part, PlantRecord};
use std::sync::Arc;

/// Which of a plant's streams its vigour in the field is drawn from.
const VIGOUR: u64 = 1 << 21;
/// White noise on the growth axis, degrees.
const AXIS_NOISE_DEG: f32 = 4.0;

/// A plant to be grown: where, which, how old.
#[derive(Clone, PartialEq)]
pub(super) struct Seedling {
    pub(super) species: Arc<Species>,
    pub(super) growth: Growth,
    /// Place of the field's season in a list of growths.
    pub(super) season: usize,
    /// The field's day, where it has days.
    pub(super) today: Option<Today>,
    pub(super) position: Vec2,
    pub(super) turn: f32,
    pub(super) only_leaf: Option<u16>,
    pub(super) stream: Stream,
    /// Whose shape and age it has, where all of its species are alike.
    pub(super) individual: Option<Individual>,
    /// Factor on its sizes.
    pub(super) vigour: Vary<Positive>,
    pub(super) condition: Option<ConditionDesc>,
    /// See [`super::identity::of`].
    pub(super) id: u32,
    /// What it is an instance of.
    pub(super) member: Option<Member>,
}

impl Seedling {
    /// The same as vigorous as its entry in the scene file says, and in the entry's condition, if it has one.
    pub(super) fn tended(self, vigour: &Vary<Positive>, condition: Option<&ConditionDesc>) -> Self {
        let condition = condition.cloned().or(self.condition);
        Self { vigour: vigour.clone(), condition, ..self }
    }
}

/// Where a plant stands, and what it is meshed for: all that its shape and its materials follow from beside its seedling.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Place {
    /// Height of its foot, metres.
    pub(super) height: f32,
    /// Of the ground about it.
    pub(super) normal: Vec3,
    /// Reflectance of the dry soil that lies on leaves.
    pub(super) dust: Spectrum,
    /// Shortest cell of its mesh, metres.
    pub(super) cell: f32,
    /// Whether its leaves and stems keep their joints.
    pub(super) rigged: bool,
}

/// Grows one plant, in its own stream, and stands it in its place. It has no number yet, and no organs where it is not `wanted`.
pub(super) fn grow(
    s: &Seedling,
    place: &Place,
    wanted: impl FnOnce(&PlantRecord) -> bool,
) -> (PlantRecord, Option<Vec<Grown>>) {
    let Place { height: z, normal, dust, cell, rigged } = *place;
    let desc: &SpeciesDesc = &s.species.desc;
    let mut stream = s.stream.clone();
    let (drawn, green) = begun(s, &mut stream);
    let axis = scatter::axis(normal, AXIS_NOISE_DEG, &mut stream);
    let shape = s.individual.as_ref().map_or(&stream, Individual::shape);
    let Some(stage) = s.individual.as_ref().map_or(drawn, |individual| stage(s, &mut individual.age())) else {
        return (unborn(s, normal, z), None);
    };
    let mut ailing = s.condition.as_ref().map(|condition| Ailing::new(condition, shape, dust));
    let mut vigour = s.vigour.draw32(&mut shape.child(Purpose::Plant, VIGOUR));
    if let (Some(_), Stage::Age(days)) = (&s.today, stage) {
        if let Some(ailing) = &mut ailing {
            ailing.over_days(plant::leaf_lives(&desc.plant, shape, vigour), days);
        }
        vigour *= emerging(&desc.plant, days);
    }
    let options = GrowOptions { vigour, condition: ailing.as_ref().map(Ailing::posture), cell, rigged };
    let plant = match &s.individual {
        Some(individual) => individual.plant(desc, stage, &stream, &options),
        None => plant::grow_with(&desc.plant, stage, &stream, &options),
    };
    let foot = s.position.extend(z);
    // Plant coordinates: y to the north before the turn, z along the axis. Growing has given it a turn of its own.
    let ahead = Vec3::new(s.turn.sin(), s.turn.cos(), 0.0);
    let frame = Frame::with_tangent(axis, ahead.cross(axis));
    let rotation = Mat3::from_cols(frame.x, frame.y, frame.z);
    let class = desc.role.class();
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
        condition: ailing.as_ref().map(Ailing::drawn),
        ..unborn(s, normal, z)
    };
    if !wanted(&record) {
        return (record, None);
    }
    let last = plant.organs.iter().map(|o| o.leaf).max().unwrap_or(0);
    let organs = plant.organs.into_iter().filter(|o| kept(o.leaf)).flat_map(|organ| {
        let mut mesh = organ.mesh;
        mesh.transform(rotation, foot);
        let choices = &s.species.materials[&organ.material];
        let choice = shape.child(Purpose::Leaf, 1 << 20 | u64::from(organ.leaf)).index(choices.len());
        let chosen = &choices[choice];
        let pigments = &desc.materials[&organ.material].pigments;
        let cut = matches!(organ.kind, OrganKind::Blade | OrganKind::Cotyledon);
        let age = plant.ages.get(&organ.leaf).filter(|_| cut);
        let material = aged(&chosen.material, pigments, age);
        let bare = Bare { kind: organ.kind, material: &material, choice: chosen, pigments, green, ground: z, last };
        let grown = Grown {
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
            None => vec![grown],
        }
    });
    let organs = organs.collect();
    (record, Some(organs))
}

/// What of a plant is drawn first: the stage by its own stream, none before it emerges, and its chlorophyll over its species'.
fn begun(s: &Seedling, stream: &mut Stream) -> (Option<Stage>, f32) {
    let stage = stage(s, stream);
    let green = (1.0 + s.species.desc.chlorophyll_sd.get() * stream.normal()).clamp(0.6, 1.5);
    (stage, green as f32)
}

/// A plant's chlorophyll over its species': the same whether it grows or is an instance.
pub(super) fn greenness(s: &Seedling) -> f32 {
    begun(s, &mut s.stream.clone()).1
}

/// The stage that a plant has reached, as its growth is drawn from a stream; none before it emerges.
fn stage(s: &Seedling, stream: &mut Stream) -> Option<Stage> {
    match &s.today {
        None => Some(s.growth.draw(s.season, stream)),
        Some(today) => {
            let shape = s.individual.as_ref().map_or(&s.stream, Individual::shape);
            today.stage((&s.growth, s.season), &s.species.desc.plant, stream, shape)
        }
    }
}

/// What is known of a plant that has not emerged: who it is, and where.
fn unborn(s: &Seedling, normal: Vec3, height: f32) -> PlantRecord {
    let desc: &SpeciesDesc = &s.species.desc;
    PlantRecord {
        number: 0,
        id: s.id,
        leaf_ids: Vec::new(),
        species: desc.name.clone(),
        eppo: desc.eppo.clone(),
        kind: 0,
        class: desc.role.class(),
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

/// A blade as old as it is; what is no blade of the main shoot has the species file's colour.
fn aged(material: &LeafMaterial, pigments: &Pigments, age: Option<&LeafAge>) -> LeafMaterial {
    age.map_or_else(|| material.clone(), |age| material.tinted(ageing::tint(pigments, age.unfolded, age.days)))
}
