//! Joints of a leaf with their axes, for programs that animate the leaf.

use super::skeleton::{Name, Pose, Skeleton};
use furrow_base::math::{Mat3, ToInt, Vec3};

/// Joint of a leaf's kinematic tree in the current posture. Skin weights refer to it by its index in the list.
#[derive(Clone, Debug, PartialEq)]
pub struct RigJoint {
    /// Name, as in Di Cicco et al. 2017. In a branch, the suffix `.turn` marks the turn within the blade and `.inner`
    /// the hinge at the midrib; the hinge half-way out has no suffix.
    pub name: String,
    /// Index of its parent, always smaller than its own; `None` for the first.
    pub parent: Option<u16>,
    /// Position, metres.
    pub at: Vec3,
    /// Axes, unit vectors: x along the vein, y out of the upper side, z along the hinge. A positive rotation about z
    /// raises the part beyond the joint.
    pub axes: Mat3,
}

impl RigJoint {
    /// Returns the joint moved by a rigid motion.
    #[must_use]
    pub fn moved(&self, motion: impl Fn(Vec3) -> Vec3) -> Self {
        let at = motion(self.at);
        let axis = |k: usize| (motion(self.at + self.axes.col(k)) - at).normalize();
        let axes = Mat3::from_cols(axis(0), axis(1), axis(2));
        Self { name: self.name.clone(), parent: self.parent, at, axes }
    }
}

/// Returns the joints of a skeleton whose ST1's parent is at `root`.
pub(super) fn rig(skeleton: &Skeleton, root: Pose) -> Vec<RigJoint> {
    let named = |name: Name| match name {
        Name::StL(_, 1) | Name::StR(_, 1) => format!("{name}.turn"),
        Name::StL(_, 2) | Name::StR(_, 2) => format!("{name}.inner"),
        _ => name.to_string(),
    };
    let poses = skeleton.forward(root);
    let joint = |(joint, pose): (&super::skeleton::Joint, Pose)| RigJoint {
        name: named(joint.name),
        parent: joint.parent.map(ToInt::to_u16),
        at: pose.origin,
        axes: pose.rotation,
    };
    skeleton.joints.iter().zip(poses).map(joint).collect()
}
