//! Skins: the joints by which leaves were bent and along which stems stand, so that plants can be bent further.
//!
//! A leaf is one skin, a tree of nodes; all its parts (leaflets, petiole) are bent by it. So is all of a plant that belongs to no leaf: its
//! stems, flowers and fruits. A leaf's joints hang on the one of its plant's stems that bears it, and go with it. A corner is carried by up to four joints:
//! Σ wₖ · Gₖ · Iₖ · p, with Gₖ the place of joint k and Iₖ its inverse bind matrix. Iₖ is the inverse of Gₖ as the file is written, below
//! the node that turns the axes, so the pose of the file is the mesh of the file. A joint turns about its own z axis; see
//! [`RigJoint::axes`].

use super::pack::Pack;
use crate::math::{DMat4, DQuat, DVec3, Mat3, Quat};
use crate::model::document::{Document, Node, Skin};
use crate::plant::{LeafAxis, RigJoint};
use crate::scene::PlantRecord;
use crate::scene::tag::Tag;
use std::collections::BTreeMap;

/// A plant's stem, leaf 0, or one of its leaves.
type Whose = (u32, u16);

/// The joints of a skin, and the joint of its plant's stem on which the first hangs.
#[derive(Clone, Copy)]
struct Rig<'a> {
    joints: &'a [RigJoint],
    bearer: Option<u16>,
}

/// A skin that is written.
struct Written {
    number: usize,
    /// Node of its first joint.
    first: usize,
    /// Its joints as a reader finds them, below the node that turns the axes.
    places: Vec<DMat4>,
}

/// The skins of a document while it grows.
pub(super) struct Skins<'a> {
    rigs: BTreeMap<Whose, Rig<'a>>,
    written: BTreeMap<Whose, Written>,
}

impl<'a> Skins<'a> {
    /// Those of plants whose leaves and stems keep their joints.
    pub(super) fn new(plants: &'a [PlantRecord]) -> Self {
        let of = |plant: &'a PlantRecord| {
            let leaf = |axis: &'a LeafAxis| ((plant.number, axis.leaf), Rig { joints: &axis.rig, bearer: axis.bearer });
            plant.leaf_axes.iter().map(leaf).chain([((plant.number, 0), Rig { joints: &plant.rig, bearer: None })])
        };
        let rigs = plants.iter().flat_map(of).filter(|(_, rig)| !rig.joints.is_empty()).collect();
        Self { rigs, written: BTreeMap::new() }
    }

    /// Number of the skin of what has this tag, if it has one; its joints are written the first time, those of its plant's stem before, and
    /// what hangs on no other joint is told to `top`. Their names begin with what `name` makes of the tag.
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
                Some(k) => Some(Above { node: first + k, place: places[k], joint: &rig[k] }),
                None => bearer.and_then(|bearer| self.bearer(tag.plant, bearer)),
            };
            let (rotation, translation) = step(joint, above.as_ref().map(|above| above.joint));
            // As a reader finds it, whatever was rounded.
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
            // Stems that leave the soil by themselves have no joint in common.
            skeleton: (rig.iter().filter(|joint| joint.parent.is_none()).count() == 1).then_some(first),
            joints: (first..document.nodes.len()).collect(),
        });
        let number = document.skins.len() - 1;
        self.written.insert(whose, Written { number, first, places });
        Some(number)
    }

    /// A joint of a plant's stems, if they are written.
    fn bearer(&self, plant: u32, bearer: u16) -> Option<Above<'a>> {
        let (rig, written) = (self.rigs.get(&(plant, 0))?, self.written.get(&(plant, 0))?);
        let k = usize::from(bearer);
        Some(Above { node: written.first + k, place: *written.places.get(k)?, joint: rig.joints.get(k)? })
    }
}

/// The joint on which another hangs.
struct Above<'a> {
    node: usize,
    place: DMat4,
    joint: &'a RigJoint,
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
