//! Skins: the joints of leaves and stems, so that plants can be posed in other programs.
//!
//! Each leaf is one skin with a tree of nodes that deforms all its parts (leaflets, petiole). The parts of a plant that
//! belong to no leaf (stems, flowers, fruits) form another skin. A leaf's root joints are children of the stem joint
//! that bears the leaf.
//!
//! A vertex is deformed by up to four joints: Σ wₖ · Gₖ · Iₖ · p, with the global transform Gₖ of joint k and its
//! inverse bind matrix Iₖ. Iₖ is the inverse of Gₖ as written in the file, below the node that converts the axes, so
//! the rest pose is the mesh of the file. A joint rotates about its own z axis; see [`RigJoint::axes`].
//! [`RigJoint::axes`].

use super::pack::Pack;
use crate::skinning::rotation;
use furrow_base::math::{DMat4, DQuat, DVec3};
use furrow_field::PlantRecord;
use furrow_grow::model::document::{Document, Node, Skin};
use furrow_grow::plant::{LeafAxis, RigJoint};
use furrow_render::scene::tag::Tag;
use std::collections::BTreeMap;

/// Plant and leaf number; leaf 0 is the stem.
type PlantLeaf = (u32, u16);

/// Joints of a skin, and the joint of the plant's stem that bears the first one.
#[derive(Clone, Copy)]
struct Rig<'a> {
    joints: &'a [RigJoint],
    bearer: Option<u16>,
}

/// Skin that has been written.
struct WrittenSkin {
    number: usize,
    /// Node index of its first joint.
    first: usize,
    /// Global transforms of its joints as computed by a reader, below the node that converts the axes.
    places: Vec<DMat4>,
}

/// Skins of a document under construction.
pub(super) struct Skins<'a> {
    rigs: BTreeMap<PlantLeaf, Rig<'a>>,
    written: BTreeMap<PlantLeaf, WrittenSkin>,
}

impl<'a> Skins<'a> {
    /// Collects the skins of plants whose leaves and stems have joints.
    pub(super) fn new(plants: &'a [PlantRecord]) -> Self {
        let of = |plant: &'a PlantRecord| {
            let leaf = |axis: &'a LeafAxis| ((plant.number, axis.leaf), Rig { joints: &axis.rig, bearer: axis.bearer });
            plant.leaf_axes.iter().map(leaf).chain([((plant.number, 0), Rig { joints: &plant.rig, bearer: None })])
        };
        let rigs = plants.iter().flat_map(of).filter(|(_, rig)| !rig.joints.is_empty()).collect();
        Self { rigs, written: BTreeMap::new() }
    }

    /// Returns the index of the skin for a part with this tag, if it has one. The joints are written on first use,
    /// after those of the plant's stem. Joints without a parent are appended to `top`. Joint names start with
    /// `name(tag)`.
    pub(super) fn of(
        &mut self,
        tag: Tag,
        name: fn(Tag) -> String,
        document: &mut Document,
        pack: &mut Pack,
        top: &mut Vec<usize>,
    ) -> Option<usize> {
        let whose = (tag.plant, tag.leaf);
        let Rig { joints: rig, bearer } = *self.rigs.get(&whose)?;
        if let Some(skin) = self.written.get(&whose) {
            return Some(skin.number);
        }
        if tag.leaf > 0 {
            self.of(Tag { leaf: 0, ..tag }, name, document, pack, top);
        }
        let name = name(tag);
        let first = document.nodes.len();
        let mut places: Vec<DMat4> = Vec::with_capacity(rig.len());
        for (k, joint) in rig.iter().enumerate() {
            let above = match joint.parent.map(usize::from) {
                Some(k) => Some(ParentJoint { node: first + k, place: places[k], joint: &rig[k] }),
                None => bearer.and_then(|bearer| self.bearer(tag.plant, bearer)),
            };
            let (rotation, translation) = step(joint, above.as_ref().map(|above| above.joint));
            // Computed from the rounded values, as a reader does.
            let turn = DQuat::from_array(rotation.map(f64::from)).normalize();
            let moved = DVec3::from_array(translation.map(f64::from));
            let place = above.as_ref().map_or(DMat4::IDENTITY, |above| above.place);
            places.push(place * DMat4::from_rotation_translation(turn, moved));
            match above {
                Some(above) => document.nodes[above.node].children.push(first + k),
                None => top.push(first + k),
            }
            document.nodes.push(Node {
                name: Some(format!("{name} {}", joint.name)),
                translation: Some(translation.map(f64::from)),
                rotation: Some(rotation.map(f64::from)),
                ..Node::default()
            });
        }
        let binds: Vec<DMat4> = places.iter().map(DMat4::inverse).collect();
        document.skins.push(Skin {
            name: Some(name),
            inverse_bind_matrices: Some(pack.matrices(&binds)),
            // Stems that emerge from the soil separately have no common joint.
            skeleton: (rig.iter().filter(|joint| joint.parent.is_none()).count() == 1).then_some(first),
            joints: (first..document.nodes.len()).collect(),
        });
        let number = document.skins.len() - 1;
        self.written.insert(whose, WrittenSkin { number, first, places });
        Some(number)
    }

    /// Returns a joint of a plant's stems, if they are written.
    fn bearer(&self, plant: u32, bearer: u16) -> Option<ParentJoint<'a>> {
        let (rig, written) = (self.rigs.get(&(plant, 0))?, self.written.get(&(plant, 0))?);
        let k = usize::from(bearer);
        Some(ParentJoint { node: written.first + k, place: *written.places.get(k)?, joint: rig.joints.get(k)? })
    }
}

/// Parent of a joint.
struct ParentJoint<'a> {
    node: usize,
    place: DMat4,
    joint: &'a RigJoint,
}

/// Returns the transform from a joint's parent (or the world) to the joint: a unit quaternion x, y, z, w, and an offset
/// in metres.
fn step(joint: &RigJoint, parent: Option<&RigJoint>) -> ([f32; 4], [f32; 3]) {
    let (turn, at) = (rotation(&joint.axes), joint.at.as_dvec3());
    let Some(parent) = parent else { return (turn.as_quat().to_array(), joint.at.to_array()) };
    let back = rotation(&parent.axes).inverse();
    let moved = back * (at - parent.at.as_dvec3());
    ((back * turn).as_quat().to_array(), moved.as_vec3().to_array())
}
