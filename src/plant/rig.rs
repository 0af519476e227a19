//! The joints of a leaf with their axes: what a program needs to bend the leaf further.

use super::skeleton::{Name, Pose, Skeleton};
use crate::math::{Mat3, Vec3};

/// A joint of a leaf's kinematic tree as the posture has put it. Its place in the list is what weights call it by.
#[derive(Clone, Debug, PartialEq)]
pub struct RigJoint {
    /// What it is called, as in Di Cicco et al. 2017; of a branch the turn within the blade and the hinge at the midrib are told apart from
    /// the hinge half-way out by `.turn` and `.inner`.
    pub name: String,
    /// Place of its parent, always smaller than its own; `None` for the first.
    pub parent: Option<u16>,
    /// Where it is, metres.
    pub at: Vec3,
    /// Its axes, unit: x along the vein, y out of the upper side, z along the hinge. A positive turn about z raises what is beyond.
    pub axes: Mat3,
}

impl RigJoint {
    /// The same moved by a rigid motion.
    #[must_use]
    pub fn moved(&self, motion: impl Fn(Vec3) -> Vec3) -> Self {
        let at = motion(self.at);
        let axis = |k: usize| (motion(self.at + self.axes.col(k)) - at).normalize();
        let axes = Mat3::from_cols(axis(0), axis(1), axis(2));
        Self { name: self.name.clone(), parent: self.parent, at, axes }
    }
}

/// The joints of a skeleton, ST1's parent standing at `root`.
pub(super) fn rig(skeleton: &Skeleton, root: Pose) -> Vec<RigJoint> {
    let named = |name: Name| match name {
        Name::StL(_, 1) | Name::StR(_, 1) => format!("{name}.turn"),
        Name::StL(_, 2) | Name::StR(_, 2) => format!("{name}.inner"),
        _ => name.to_string(),
    };
    let poses = skeleton.forward(root);
    let joint = |(joint, pose): (&super::skeleton::Joint, Pose)| RigJoint {
        name: named(joint.name),
        parent: joint.parent.map(|parent| parent as u16),
        at: pose.origin,
        axes: pose.rotation,
    };
    skeleton.joints.iter().zip(poses).map(joint).collect()
}
