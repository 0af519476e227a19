//! Builds a crop field from a scene file: ground, plants, models, lights, cameras and LiDARs.

pub mod ablation;
mod aliases;
pub mod assemble;
pub mod days;
pub mod desc;
pub mod drive;
pub mod estimate;
pub mod horizon;
mod image_memory;
mod layer;
mod library;
mod named_file;
mod part_kind;
mod poses;
pub mod profile;
mod scene_edit;
pub mod shipped;
mod species;
pub mod species_file;
pub mod species_text;
pub mod traits;

use furrow_base::math::Vec3;
use furrow_grow::plant::{Condition, LeafAxis, RigJoint};
use furrow_render::scene::tag::Class;

pub use assemble::{Field, record};
pub use part_kind::PartKind;

/// Ground truth of one plant: identity, species, position, growth stage, size, leaves and condition.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantRecord {
    /// Number of the plant in label maps, from 1. Numbers are consecutive, so they depend on which other plants are in view.
    pub number: u32,
    /// Identity of the plant in its field, never 0. It does not depend on the camera, the resolution or the other plants in view.
    pub id: u32,
    /// Identities of the leaves; leaf n has index n − 1. All identities of plants and leaves in a field are distinct.
    pub leaf_ids: Vec<u32>,
    /// Scientific name.
    pub species: String,
    /// EPPO code.
    pub eppo: String,
    /// Number of the species: its position in [`Field::species`], counted from 1.
    pub kind: u16,
    /// Crop or weed.
    pub class: Class,
    /// Point where the stem meets the ground, metres.
    pub position: Vec3,
    /// Unit vector of the growth axis that the plant was sown with; the lean of its species is added to it.
    pub axis: Vec3,
    /// Growth stage, BBCH.
    pub bbch: u32,
    /// Days after emergence.
    pub age_days: f32,
    /// Height of the plant, metres.
    pub height: f32,
    /// Radius of the vertical cylinder around the stem that encloses the plant, metres.
    pub radius: f32,
    /// Number of leaves, cotyledons included.
    pub leaves: u16,
    /// Base and tip of each leaf blade in world space, metres, ordered by leaf number. Empty for a model from disk, which has no midribs.
    pub leaf_axes: Vec<LeafAxis>,
    /// Joints of the stems in world space, metres. Empty unless [`assemble::Options::rigged`] is set.
    pub rig: Vec<RigJoint>,
    /// Condition (health, damage, age); `None` if neither the scene file nor the species file describes one.
    pub condition: Option<Condition>,
}

impl PlantRecord {
    /// Returns a one-line description: species, EPPO code, growth stage, age, number of leaves, position.
    pub fn description(&self) -> String {
        // A model from a file has neither code nor age.
        let grown = if self.eppo.is_empty() {
            String::new()
        } else {
            format!(" ({}), BBCH {}, {:.0} days", self.eppo, self.bbch, self.age_days)
        };
        let Vec3 { x, y, z } = self.position;
        format!("{}{grown}, {} leaves, stands at {x:.3}, {y:.3}, {z:.3} m", self.species, self.leaves)
    }
}
