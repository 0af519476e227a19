//! Plants, grown from a species file: botany without optics.
//!
//! A [`PlantDesc`] says how a species looks at its stages; [`grow`] makes one [`Plant`] of it, for an age and a stream of
//! random numbers. The same stream gives the same plant at every age, larger or smaller. Leaf i draws only from its own
//! stream, so nothing that happens to one leaf moves another.
//!
//! | file | idea |
//! |---|---|
//! | `stage` | stages and layers; what lies between two stages |
//! | `table` | the layers of all stages as a CSV file |
//! | `kind` | what all leaves of a kind share |
//! | `skeleton` | the leaf's kinematic tree, Denavit–Hartenberg |
//! | `blade` | outline → flat rest mesh with skin weights |
//! | `margin` | how one leaf's outline departs from its kind's |
//! | `age` | how old each leaf is |
//! | `skin` | relief, linear blend skinning |
//! | `tube`, `axis`, `leaf` | stems and stalks; the growth axis; one whole leaf |
//! | `leaflets`, `ribbons`, `fern` | compound and divided blades |
//! | `flower` | flowers, heads, ears, tassels, pods, berries |
//! | `inflorescence` | the axes that bear them, and where these begin |
//! | `stipules` | what stands at the foot of a stalk |
//! | `spines` | spines on a blade's margin |
//! | `twine` | shoots that wind |
//! | `rig`, `stem_rig` | the joints of leaves and stems, for programs that bend them further |
//! | `stems` | several main stems from one place |
//! | `condition` | age, health and damage of a plant and its leaves |
//! | `rosette`, `whorl`, `erect`, `dissected`, `tuft`, `cane`, `runner` | growth forms |
//!
//! A new growth form is a file with a `grow(&Growth) -> Vec<Organ>` and one line in `forms!` (`desc.rs`).

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
mod growth;
mod inflorescence;
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

pub use age::{LeafAge, LeafLife};
pub use bound::most_triangles;
pub use condition::{Condition, ConditionDesc};
pub use desc::{Form, PlantDesc, Stage};
pub use flower::desc::{FlowerDesc, RingDesc};
pub use inflorescence::desc::{FlowersDesc, InflorescenceDesc, Seat, StemLeafDesc};
pub use kind::{LeafKind, Shape, Spines, Stipules};
pub use organ::{Carried, LeafAxis, LeafSize, OnStem, Organ, OrganKind, StemLine};
pub use rig::RigJoint;
pub use skeleton::PlacedJoint;
pub use stage::{BUD, LayerDesc, StageDesc};
pub use twine::TwineDesc;

use crate::sampling::Stream;
use growth::Growth;
use std::collections::BTreeMap;

/// One plant: its organs in plant coordinates (metres, growth axis +z, origin where the stem meets the soil).
#[derive(Clone, Debug, PartialEq)]
pub struct Plant {
    /// Its organs: axis first, then leaf by leaf, then what bears flowers, and these by their sort.
    pub organs: Vec<Organ>,
    /// The stage it has reached.
    pub bbch: u32,
    /// Days after emergence.
    pub age_days: f32,
    /// How old the leaves of its main shoot are, by number; where several stems rise from one place, those of all.
    pub ages: BTreeMap<u16, LeafAge>,
    /// Its highest point, metres.
    pub height: f32,
    /// Radius of the upright cylinder about the origin that holds it, metres.
    pub radius: f32,
    /// The joints of its stems; none unless asked for by [`GrowOptions::rigged`].
    pub rig: Vec<RigJoint>,
}

impl Plant {
    /// The keypoints of its leaves, in plant coordinates, in the order of its organs.
    pub fn leaf_axes(&self) -> impl Iterator<Item = LeafAxis> + '_ {
        self.organs.iter().filter_map(|organ| organ.axis.clone())
    }
}

/// By how much a plant of this stream is turned about its axis, radians clockwise from above: its leaves' azimuths count from there.
pub fn turn(stream: &Stream) -> f32 {
    growth::turn(stream)
}

/// Days after emergence at which a plant has this stage.
pub fn age_days(desc: &PlantDesc, stage: Stage) -> f32 {
    growth::age(desc, stage)
}

/// When the leaves of the plant of `stream` come out, and how large they become, by their numbers; `vigour` is a factor on its sizes.
pub fn leaf_lives(desc: &PlantDesc, stream: &Stream, vigour: f32) -> BTreeMap<u16, LeafLife> {
    age::leaf_lives(desc, stream, vigour)
}

/// What a plant is grown with beyond its species, stage and stream.
#[derive(Clone, Copy, Debug)]
pub struct GrowOptions<'a> {
    /// Factor on its sizes.
    pub vigour: f32,
    /// The condition as which it holds its leaves.
    pub condition: Option<(&'a ConditionDesc, &'a Condition)>,
    /// Shortest cell of a blade's mesh, metres. Coarser meshes change no random number and move a leaf by less than a cell.
    pub cell: f32,
    /// Whether leaves and stems keep the joints by which they bend ([`LeafAxis::rig`], [`Plant::rig`]) and the weights of their corners.
    pub rigged: bool,
}

impl Default for GrowOptions<'_> {
    /// Of usual size, without a condition, as fine as field cameras see.
    fn default() -> Self {
        Self { vigour: 1.0, condition: None, cell: growth::CELL, rigged: false }
    }
}

/// Grows one plant.
pub fn grow(desc: &PlantDesc, stage: Stage, stream: &Stream) -> Plant {
    grow_with(desc, stage, stream, &GrowOptions::default())
}

/// Grows one plant with options.
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
    for leaf in &mut growth.leaves {
        leaf.cell = options.cell.max(leaf.cell);
        leaf.rigged = options.rigged;
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
        /// The organs of a plant that stands like this.
        fn organs_of(form: Form, growth: &Growth<'_>) -> Vec<Organ> {
            match form { $(Form::$name => $file::grow(growth),)* }
        }
    };
}
desc::forms!(grow_by_form);

#[cfg(test)]
mod tests;
