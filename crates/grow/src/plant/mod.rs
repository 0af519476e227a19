//! Procedural plant models built from a species file: geometry only, no optics.
//!
//! A [`PlantDesc`] describes a species at its growth stages. [`grow`] builds one [`Plant`] from it, for a given stage and
//! a given stream of random numbers. The same stream gives the same individual at every age, only larger or smaller. Each
//! leaf draws from its own stream, so a change to one leaf does not move another.
//!
//! | file | contents |
//! |---|---|
//! | `stage` | growth stages and their layers of leaves, as written in a species file |
//! | `table` | the layers of all stages as a CSV file |
//! | `kind` | parameters shared by all leaves of a kind |
//! | `growth` | interpolation between two stages |
//! | `skeleton` | a leaf's kinematic tree (Denavit–Hartenberg) |
//! | `blade` | flat rest mesh with skin weights, built from an outline |
//! | `margin` | variation of the outline from leaf to leaf |
//! | `age` | age and life span of each leaf |
//! | `skin` | relief and linear blend skinning |
//! | `tube`, `axis`, `leaf` | stems and petioles; the growth axis; one whole leaf |
//! | `leaflets`, `ribbons`, `fern` | compound and divided blades |
//! | `flower` | flowers, heads, ears, tassels, pods, berries |
//! | `inflorescence` | flowering axes and the seats that they grow from |
//! | `flower_desc`, `inflorescence_desc` | flowers and flowering axes, as written in a species file |
//! | `inflorescence_check` | consistency checks of flowering axes; maximum numbers of axes |
//! | `stipules` | stipules at the base of a petiole |
//! | `spines` | spines on a blade's margin |
//! | `twine` | twining shoots |
//! | `rig`, `stem_rig` | joints of leaves and stems, exported for animation |
//! | `stems` | several main stems of one plant |
//! | `senescence`, `wither` | when old leaves yellow, dry and fall; their posture and shape |
//! | `condition` | health and damage of a plant and its leaves |
//! | `rosette`, `whorl`, `erect`, `dissected`, `tuft`, `cane`, `runner` | growth forms |
//!
//! To add a growth form, write a file with a `grow(&Growth) -> Vec<Organ>` and add one line to `forms!` (`desc.rs`).

mod age;
mod axis;
pub mod blade;
mod bound;
mod cane;
pub mod condition;
mod desc;
mod dissected;
mod erect;
mod fern;
mod flower;
mod flower_desc;
mod growth;
mod inflorescence;
mod inflorescence_check;
mod inflorescence_desc;
mod kind;
mod leaf;
mod leaflets;
mod margin;
mod numbers;
mod organ;
mod ribbons;
mod rig;
mod rosette;
mod runner;
mod senescence;
pub mod skeleton;
pub mod skin;
mod spines;
mod stage;
mod stem_rig;
mod stems;
mod stipules;
pub mod table;
mod tube;
mod tuft;
mod twine;
mod whorl;
mod wither;

pub use age::{LeafAge, LeafLife};
pub use bound::most_triangles;
pub use condition::{Condition, ConditionDesc};
pub use desc::{Form, PlantDesc, Stage};
pub use flower_desc::{FlowerDesc, RingDesc};
pub use inflorescence_desc::{FlowersDesc, InflorescenceDesc, Seat, StemLeafDesc};
pub use kind::{LeafKind, Shape, Spines, Stipules};
pub use organ::{LeafAxis, LeafSize, Organ, OrganKind, StemLine, StemPosition, StemVertices};
pub use rig::RigJoint;
pub use senescence::SenescenceDesc;
pub use skeleton::PlacedJoint;
pub use stage::{BUD, LayerDesc, StageDesc};
pub use twine::TwineDesc;

use furrow_base::sampling::Stream;
use growth::Growth;
use std::collections::BTreeMap;

/// One plant: its organs in plant coordinates (metres, growth axis +z, origin where the stem meets the soil).
#[derive(Clone, Debug, PartialEq)]
pub struct Plant {
    /// Organs of the plant: stems and leaves first, then inflorescences, with one organ for each kind and material of
    /// flowers and fruits.
    pub organs: Vec<Organ>,
    /// BBCH code of the stage that the plant has reached.
    pub bbch: u32,
    /// Age in days after emergence.
    pub age_days: f32,
    /// Ages of the leaves of the main shoot, by leaf number; for a plant with several main stems, of the leaves of all
    /// of them.
    pub ages: BTreeMap<u16, LeafAge>,
    /// Height of the highest vertex, metres.
    pub height: f32,
    /// Radius of the smallest vertical cylinder around the origin that contains the plant, metres.
    pub radius: f32,
    /// Joints of the stems; empty unless [`GrowOptions::rigged`] is set.
    pub rig: Vec<RigJoint>,
}

impl Plant {
    /// Returns the keypoints of all leaves in plant coordinates, in the order of the organs.
    pub fn leaf_axes(&self) -> impl Iterator<Item = LeafAxis> + '_ {
        self.organs.iter().filter_map(|organ| organ.axis.clone())
    }
}

/// Returns the plant's rotation about its axis in radians, clockwise seen from above. Leaf azimuths are measured from
/// it.
pub fn turn(stream: &Stream) -> f32 {
    growth::turn(stream)
}

/// Returns the age in days after emergence at which a plant reaches `stage`.
pub fn age_days(desc: &PlantDesc, stage: Stage) -> f32 {
    growth::age(desc, stage)
}

/// Returns, by leaf number, when each leaf of the plant of `stream` appears and how large it becomes. `vigour` is a
/// factor on all its sizes.
pub fn leaf_lives(desc: &PlantDesc, stream: &Stream, vigour: f32) -> BTreeMap<u16, LeafLife> {
    age::leaf_lives(desc, stream, vigour)
}

/// Options for growing a plant, beyond its species, stage and random stream.
#[derive(Clone, Copy, Debug)]
pub struct GrowOptions<'a> {
    /// Factor on all sizes of the plant.
    pub vigour: f32,
    /// Condition of the plant, which changes the posture of its leaves.
    pub condition: Option<(&'a ConditionDesc, &'a Condition)>,
    /// Shortest cell of a blade's mesh, metres. A coarser mesh changes no random number and moves a leaf by less than
    /// one cell.
    pub cell: f32,
    /// Height of the crumbs or plates of the ground around the foot, metres: leaves that lie on the ground lie this much
    /// higher.
    pub rise: f32,
    /// Whether to export the joints of leaves and stems ([`LeafAxis::rig`], [`Plant::rig`]) and the skin weights of the
    /// vertices.
    pub rigged: bool,
}

impl Default for GrowOptions<'_> {
    /// Returns unit vigour, no condition, no rig, and the mesh resolution of field cameras.
    fn default() -> Self {
        Self { vigour: 1.0, condition: None, cell: growth::CELL, rise: 0.0, rigged: false }
    }
}

/// Largest height of the ground around a plant that lifts its leaves, metres.
const MOST_RISE: f32 = 0.012;

/// Grows one plant with default options.
pub fn grow(desc: &PlantDesc, stage: Stage, stream: &Stream) -> Plant {
    grow_with(desc, stage, stream, &GrowOptions::default())
}

/// Grows one plant with the given options. A species without stages gives a plant without organs.
pub fn grow_with(desc: &PlantDesc, stage: Stage, stream: &Stream, options: &GrowOptions<'_>) -> Plant {
    let Some(mut growth) = growth::growth(desc, stage, stream, options.vigour) else {
        return Plant {
            organs: Vec::new(),
            ages: BTreeMap::new(),
            bbch: 0,
            age_days: 0.0,
            height: 0.0,
            radius: 0.0,
            rig: Vec::new(),
        };
    };
    if let Some((desc, condition)) = options.condition {
        condition::Posture::new(desc, condition, stream).apply(&mut growth.leaves);
    }
    growth.leaves.iter_mut().for_each(wither::wither);
    for leaf in &mut growth.leaves {
        leaf.cell = options.cell.max(leaf.cell);
        leaf.rigged = options.rigged;
        leaf.rise = options.rise.clamp(0.0, MOST_RISE);
    }
    growth.rigged = options.rigged;
    let mut organs = organs_of(desc.form, &growth);
    inflorescence::grow(&mut organs, &growth, options.cell);
    let corners = || organs.iter().flat_map(|o| &o.mesh.positions);
    let height = corners().fold(0.0_f32, |h, p| h.max(p.z));
    let radius = corners().fold(0.0_f32, |r, p| r.max(p.x.hypot(p.y)));
    let rig = if options.rigged { stem_rig::rig(&mut organs) } else { Vec::new() };
    Plant { organs, ages: age::ages(&growth), bbch: growth.bbch, age_days: growth.age_days, height, radius, rig }
}

macro_rules! grow_by_form {
    ($($(#[$doc:meta])* $name:ident => $file:ident,)*) => {
        /// Builds the organs of a plant with the given growth form.
        fn organs_of(form: Form, growth: &Growth<'_>) -> Vec<Organ> {
            match form { $(Form::$name => $file::grow(growth),)* }
        }
    };
}
desc::forms!(grow_by_form);

#[cfg(test)]
mod tests;
