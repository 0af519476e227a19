//! Skins: the joints by which leaves were bent, so that they can be bent further.
//!
//! A leaf is one skin, a tree of nodes; all its parts (leaflets, petiole) are bent by it, a corner by up to four joints:
//! Σ wₖ · Gₖ · Iₖ · p, with Gₖ the place of joint k and Iₖ its inverse bind matrix. Iₖ is the inverse of Gₖ as the file is written, below
//! the node that turns the axes, so the pose of the file is the mesh of the file. A joint turns about its own z axis; see
//! [`RigJoint::axes`].

use super::pack::Pack;
use crate::math::{DMat4, DQuat, DVec3, Mat3, Quat};
use crate::model::document::{Document, Node, Skin};
use crate::plant::RigJoint;
use crate::scene::PlantRecord;
use crate::scene::tag::Tag;
use std::collections::BTreeMap;

/// The skins of a document while it grows.
pub(super) struct Skins<'a> {
    /// Joints by plant and leaf.
    rigs: BTreeMap<(u32, u16), &'a [RigJoint]>,
    /// Numbers of those that are written.
    written: BTreeMap<(u32, u16), usize>,
}

impl<'a> Skins<'a> {
    /// Those of plants whose leaves keep their joints.
    pub(super) fn new(plants: &'a [PlantRecord]) -> Self {
        let leaves = plants.iter().flat_map(|plant| plant.leaf_axes.iter().map(|axis| (plant.number, axis)));
        let rigs = leaves.filter(|(_, axis)| !axis.rig.is_empty());
        Self { rigs: rigs.map(|(plant, axis)| ((plant, axis.leaf), &*axis.rig)).collect(), written: BTreeMap::new() }
    }

    /// Number of the skin of what has this tag, if it has one; its joints are written the first time, and the first of them is told to
    /// `top`. Their names begin with `name`.
    pub(super) fn of(
        &mut self,
        tag: Tag,
        name: &str,
        document: &mut Document,
        pack: &mut Pack,
        top: &mut Vec<usize>,
    ) -> Option<usize> {
        let leaf = (tag.plant, tag.leaf);
        let rig = self.rigs.get(&leaf)?;
        if let Some(number) = self.written.get(&leaf) {
            return Some(*number);
        }
        let first = document.nodes.len();
        top.push(first);
        let mut places: Vec<DMat4> = Vec::with_capacity(rig.len());
        for (k, joint) in rig.iter().enumerate() {
            let (rotation, translation) = step(joint, joint.parent.map(|parent| &rig[usize::from(parent)]));
            let above = joint.parent.map_or(DMat4::IDENTITY, |parent| places[usize::from(parent)]);
            // As a reader finds it, whatever was rounded.
            let turn = DQuat::from_array(rotation.map(f64::from)).normalize();
            let moved = DVec3::from_array(translation.map(f64::from));
            places.push(above * DMat4::from_rotation_translation(turn, moved));
            if let Some(parent) = joint.parent {
                document.nodes[first + usize::from(parent)].children.push(first + k);
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
            name: Some(name.to_owned()),
            inverse_bind_matrices: Some(pack.matrices(&binds)),
            skeleton: Some(first),
            joints: (first..document.nodes.len()).collect(),
        });
        let number = document.skins.len() - 1;
        self.written.insert(leaf, number);
        Some(number)
    }
}

/// From a joint's parent, or from the world, to the joint: a unit quaternion x, y, z, w, and an offset in metres.
fn step(joint: &RigJoint, parent: Option<&RigJoint>) -> ([f32; 4], [f32; 3]) {
    let turned = |axes: &Mat3| Quat::from_mat3(axes).as_dquat().normalize();
    let (turn, at) = (turned(&joint.axes), joint.at.as_dvec3());
    let Some(parent) = parent else { return (turn.as_quat().to_array(), joint.at.to_array()) };
    let back = turned(&parent.axes).inverse();
    let moved = back * (at - parent.at.as_dvec3());
    ((back * turn).as_quat().to_array(), moved.as_vec3().to_array())
}
