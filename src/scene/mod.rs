//! What is out there: parts, materials, lights, a camera.

pub mod assemble;
pub mod days;
pub mod desc;
pub mod drive;
pub mod estimate;
mod growing;
mod layer;
mod library;
mod part;
mod part_kind;
mod pictures;
mod poses;
pub mod record;
pub mod shipped;
pub mod species_file;
pub mod species_text;
pub mod tag;
pub mod traits;

use crate::accel::Surface;
use crate::film::Footprint;
use crate::light::Light;
use crate::material::Material;
use crate::math::Vec3;
use crate::plant::{Condition, LeafAxis, RigJoint};
use crate::sensor::Camera;
use tag::{Class, Tag};

pub use assemble::Field;
pub use part::{Instance, Part};
pub use part_kind::PartKind;

/// What is known of one plant.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantRecord {
    /// Its number in the labels, from 1: dense, so it depends on which others the view holds.
    pub number: u32,
    /// Its identity in its field, never 0: the same whatever the camera, the resolution and the other plants in view.
    pub id: u32,
    /// The identities of its leaves, that of leaf n at place n − 1; no two of a field's plants and leaves are equal.
    pub leaf_ids: Vec<u32>,
    /// Scientific name.
    pub species: String,
    /// EPPO code.
    pub eppo: String,
    /// Number of its species in [`Field::species`], from 1.
    pub kind: u16,
    /// Crop or weed.
    pub class: Class,
    /// Where its stem meets the ground, metres.
    pub position: Vec3,
    /// The axis that it was sown with, unit; what its species leans comes on top.
    pub axis: Vec3,
    /// Growth stage, BBCH.
    pub bbch: u32,
    /// Days after emergence.
    pub age_days: f32,
    /// Its height, metres.
    pub height: f32,
    /// Radius of the upright cylinder about its stem that holds it, metres.
    pub radius: f32,
    /// Number of its leaves, seed leaves included.
    pub leaves: u16,
    /// Base and tip of its leaves' blades, metres, world, by rising leaf; none of a model from disk, which has no midribs.
    pub leaf_axes: Vec<LeafAxis>,
    /// The joints of its stems, metres, world; none unless asked for by [`assemble::Options::rigged`].
    pub rig: Vec<RigJoint>,
    /// Its condition; none where no scene file says any.
    pub condition: Option<Condition>,
}

/// One field.
pub struct Scene {
    /// Everything that rays can hit.
    pub parts: Vec<Part>,
    /// What the parts are made of.
    pub materials: Vec<Material>,
    /// What shines.
    pub lights: Vec<Light>,
    /// Who looks.
    pub camera: Camera,
    /// How its pixels gather light.
    pub filter: Footprint,
}

impl Scene {
    /// The parts as the accelerators see them.
    pub fn surfaces(&self) -> Vec<Surface<'_>> {
        self.parts.iter().map(Part::surface).collect()
    }

    /// One tag a part.
    pub fn tags(&self) -> Vec<Tag> {
        self.parts.iter().map(|p| p.tag).collect()
    }

    /// Number of triangles; of a mesh that several parts share in each of them.
    pub fn triangles(&self) -> usize {
        self.parts.iter().map(|p| p.mesh.triangles.len()).sum()
    }
}
