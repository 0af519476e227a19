//! Skeletons: the joints of a plant's stems and leaves, so that plants can be posed in other programs.
//!
//! Each plant has one skeleton. Its first joints are those of the stems, then follow those of each leaf; the root
//! joints of a leaf are children of the stem joint that bears it. A vertex follows up to four joints:
//! Σ wₖ · Bₖ⁻¹ · Gₖ, with the transform Gₖ of joint k and its transform Bₖ in the mesh's pose. Without an animation, Gₖ
//! is the product of the rest transforms, which is Bₖ. A joint rotates about its own z axis; see [`RigJoint::axes`].

use super::text::{Names, Text, integers, matrices, numbers, quoted_list};
use crate::skinning::{rotation, tidy};
use furrow_base::geometry::JointWeights;
use furrow_base::math::{DMat4, ToInt};
use furrow_field::PlantRecord;
use furrow_grow::plant::RigJoint;
use std::collections::BTreeMap;

/// Joints of one plant.
pub(super) struct Skeleton {
    joints: Vec<Joint>,
    /// Index of the first joint of each leaf; leaf 0 is the stem.
    first: BTreeMap<u16, usize>,
}

struct Joint {
    /// Names of the joint and of those above it.
    path: String,
    /// Transform to the world.
    bind: DMat4,
    /// Transform to the parent.
    rest: DMat4,
}

impl Skeleton {
    /// Returns the skeleton of a plant; `None` if it has no joints.
    pub(super) fn of(plant: &PlantRecord) -> Option<Self> {
        let mut skeleton = Self { joints: Vec::new(), first: BTreeMap::new() };
        let mut names = Names::default();
        skeleton.add(0, &plant.rig, None, &mut names);
        for axis in &plant.leaf_axes {
            skeleton.add(axis.leaf, &axis.rig, axis.bearer, &mut names);
        }
        (!skeleton.joints.is_empty()).then_some(skeleton)
    }

    /// Adds the joints of a leaf or of the stem; `bearer` is the stem joint that bears them.
    fn add(&mut self, leaf: u16, rig: &[RigJoint], bearer: Option<u16>, names: &mut Names) {
        let first = self.joints.len();
        self.first.insert(leaf, first);
        for joint in rig {
            let parent = joint.parent.map(|k| first + usize::from(k)).or(bearer.map(usize::from));
            let above = parent.and_then(|k| self.joints.get(k));
            let name = if leaf == 0 { joint.name.clone() } else { format!("leaf {leaf} {}", joint.name) };
            let name = names.unique(&name);
            let bind = DMat4::from_rotation_translation(rotation(&joint.axes), joint.at.as_dvec3());
            let joint = match above {
                Some(above) => {
                    Joint { path: format!("{}/{name}", above.path), bind, rest: above.bind.inverse() * bind }
                }
                None => Joint { path: name, bind, rest: bind },
            };
            self.joints.push(joint);
        }
    }

    /// Returns `true` if the parts of a leaf have joints.
    pub(super) fn bends(&self, leaf: u16) -> bool {
        self.first.contains_key(&leaf)
    }

    /// Writes the prim `skeleton`.
    pub(super) fn write(&self, text: &mut Text) {
        text.open("Skeleton", "skeleton", &[]);
        text.set("uniform matrix4d[] bindTransforms", matrices(self.joints.iter().map(|joint| joint.bind)));
        text.set("uniform token[] joints", quoted_list(self.joints.iter().map(|joint| &*joint.path)));
        text.set("uniform matrix4d[] restTransforms", matrices(self.joints.iter().map(|joint| joint.rest)));
        text.close();
    }

    /// Writes joints and weights of a mesh that belongs to a leaf; `plant` is the path of the plant.
    pub(super) fn bind(&self, leaf: u16, weights: &[JointWeights], plant: &str, text: &mut Text) {
        let first = self.first.get(&leaf).copied().unwrap_or(0).to_u32();
        let tidied: Vec<([u16; 4], [f32; 4])> = weights.iter().map(tidy).collect();
        // Unused joints have no weight; they are the leaf's first one.
        let joints = tidied.iter().flat_map(|(joints, _)| joints.map(|joint| first + u32::from(joint)));
        text.set_vertices("int[] primvars:skel:jointIndices", integers(joints), &["elementSize = 4"]);
        let shares = tidied.iter().flat_map(|(_, shares)| *shares);
        text.set_vertices("float[] primvars:skel:jointWeights", numbers(shares), &["elementSize = 4"]);
        text.set("rel skel:skeleton", format_args!("<{plant}/skeleton>"));
    }
}
