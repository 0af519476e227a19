//! The leaf's kinematic tree.
//!
//! The chain runs from the first stem joint ST1 along the stalk to the leaf's base B, then along the midrib through the
//! vein joints VN1…VNn to the peak PK. At every vein joint two mirrored branches STL and STR follow the secondary
//! veins. Source: Di Cicco et al. 2017, "Automatic model based dataset generation for fast and accurate crop and weeds
//! detection", IROS, §III-A.
//!
//! The posture uses Denavit–Hartenberg parameters: every joint turns about its own z axis only. In the notation for
//! trees, where a frame is located at its joint (Khalil & Kleinfinger 1986, "A new geometric notation for open and
//! closed-loop robots", ICRA):
//!
//! ```text
//! pose(j) = pose(parent) · Tx(a) · Rx(α) · Rz(θ)
//! ```
//!
//! where the link length a and the offset α belong to the leaf and θ = rest + bend is the posture. A joint's frame has
//! its x axis along the vein, its z axis along the hinge and its y axis out of the upper side, so a positive bend
//! raises the leaf.
//!
//! A branch needs three joints. The first turns the vein's direction within the blade (α = −90° turns the hinge out of
//! the blade). The second, at the midrib (α = +90° turns the hinge back), and the third, half-way out, bend the blade
//! sideways.

use furrow_base::math::{Mat3, ToFloat, ToInt, Vec3, vec3};
use std::f32::consts::FRAC_PI_2;
use std::fmt;

/// Rigid motion: rotation followed by translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Rotation; its columns are the frame's axes.
    pub rotation: Mat3,
    /// Translation: the position of the frame's origin, metres.
    pub origin: Vec3,
}

impl Pose {
    /// Returns the frame of a leaf's chain in the leaf's own coordinates (y along the midrib, z out of the upper side,
    /// x to the right): vein along y, hinge along x.
    pub fn leaf(y: f32) -> Self {
        Self { rotation: Mat3::from_cols(Vec3::Y, Vec3::Z, Vec3::X), origin: vec3(0.0, y, 0.0) }
    }

    /// Returns the composition that applies `inner` first, then `self`.
    #[must_use]
    pub fn then(self, inner: Self) -> Self {
        Self { rotation: self.rotation * inner.rotation, origin: self.point(inner.origin) }
    }

    /// Returns the inverse motion. The rotation must be orthonormal.
    #[must_use]
    pub fn inverse(self) -> Self {
        let rotation = self.rotation.transpose();
        Self { rotation, origin: -(rotation * self.origin) }
    }

    /// Transforms a point.
    #[inline]
    pub fn point(self, p: Vec3) -> Vec3 {
        self.rotation * p + self.origin
    }
}

/// Name of a joint in the tree. Numbers count from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Name {
    /// Joint of the stalk.
    St(u8),
    /// Base of the blade.
    B,
    /// Joint of the midrib.
    Vn(u8),
    /// Tip of the blade.
    Pk,
    /// Branch to the left at a vein joint (first number): its turn (1), the hinge at the midrib (2) or the hinge
    /// half-way out (3).
    StL(u8, u8),
    /// Branch to the right, likewise.
    StR(u8, u8),
}

impl fmt::Display for Name {
    /// Writes the name as in the paper; for a branch, the side and the vein joint only.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::St(n) => write!(f, "ST{n}"),
            Self::B => write!(f, "B"),
            Self::Vn(n) => write!(f, "VN{n}"),
            Self::Pk => write!(f, "PK"),
            Self::StL(n, _) => write!(f, "STL{n}"),
            Self::StR(n, _) => write!(f, "STR{n}"),
        }
    }
}

/// Joint at its place in the current posture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedJoint {
    /// Name of the joint; a branch is represented by its hinge half-way out.
    pub name: Name,
    /// Index of its parent in the same list; `None` for the first.
    pub parent: Option<u16>,
    /// Position, metres.
    pub at: Vec3,
}

/// Joint: one rotation about its own z axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// Name of the joint.
    pub name: Name,
    /// Index of its parent, always smaller than its own; `None` for ST1.
    pub parent: Option<usize>,
    /// Link length: distance from the parent's origin along the parent's x axis, metres.
    pub a: f32,
    /// Fixed rotation about the parent's x axis, radians.
    pub alpha: f32,
    /// θ of the flat leaf, radians: zero except for the turn of a branch.
    pub rest: f32,
    /// Angle that the posture adds to θ, radians.
    pub bend: f32,
}

/// Dimensions of a skeleton.
#[derive(Clone, Debug)]
pub struct Measures {
    /// Length of the stalk, metres; 0 for a sessile leaf.
    pub stalk: f32,
    /// Number of stalk joints, at least 1.
    pub stalk_joints: usize,
    /// Length of the blade, metres.
    pub length: f32,
    /// Positions of the vein joints as fractions of the blade's length, increasing, strictly between 0 and 1.
    pub veins: Vec<f32>,
    /// Angle between midrib and secondary veins, radians, and the blade's half-width at each vein joint, metres;
    /// `None` for a blade without branches.
    pub secondaries: Option<(f32, Vec<f32>)>,
}

/// Skin weights: up to four joints of one vertex with weights that sum to one.
pub type Weights = furrow_base::geometry::JointWeights;

/// A leaf's kinematic tree.
#[derive(Clone, Debug)]
pub struct Skeleton {
    /// All joints, parents before children; the chain ST1…PK comes first.
    pub joints: Vec<Joint>,
    stalk: f32,
    length: f32,
    base: usize,
    /// Positions of the chain's joints along y, metres; the last is PK.
    along: Vec<f32>,
    /// Cotangent of the angle between midrib and secondary veins; `None` for a skeleton without branches.
    cotangent: Option<f32>,
}

/// Fraction of the half-width over which a vertex passes from the midrib's joint to the branch's inner hinge.
const INNER: f32 = 0.4;
/// Fractions of the half-width between which a vertex passes to the outer hinge.
const OUTER: (f32, f32) = (0.45, 0.95);

impl Skeleton {
    /// Builds the skeleton of a flat leaf.
    pub fn new(m: &Measures) -> Self {
        let stalk_joints = m.stalk_joints.max(1);
        let mut joints = Vec::with_capacity(stalk_joints + 2 + 7 * m.veins.len());
        let mut along = Vec::with_capacity(stalk_joints + 2 + m.veins.len());
        let mut chain = |name, y: f32| {
            let a = along.last().map_or(0.0, |last| y - last);
            let parent = joints.len().checked_sub(1);
            joints.push(Joint { name, parent, a, alpha: 0.0, rest: 0.0, bend: 0.0 });
            along.push(y);
        };
        for i in 0..stalk_joints {
            chain(Name::St(i.to_u8() + 1), -m.stalk * (1.0 - i.to_f32() / stalk_joints.to_f32()));
        }
        chain(Name::B, 0.0);
        for (i, t) in m.veins.iter().enumerate() {
            chain(Name::Vn(i.to_u8() + 1), t * m.length);
        }
        chain(Name::Pk, m.length);
        let base = stalk_joints;
        if let Some((angle, half_widths)) = &m.secondaries {
            for (i, half_width) in half_widths.iter().enumerate().take(m.veins.len()) {
                let n = i.to_u8() + 1;
                let reach = half_width / angle.sin();
                for (name, sign) in [(Name::StL as fn(u8, u8) -> Name, 1.0), (Name::StR as fn(u8, u8) -> Name, -1.0)] {
                    let turn = joints.len();
                    let mut branch = |part, parent, a, alpha, rest| {
                        joints.push(Joint { name: name(n, part), parent: Some(parent), a, alpha, rest, bend: 0.0 });
                    };
                    branch(1, base + 1 + i, 0.0, -FRAC_PI_2, sign * angle);
                    branch(2, turn, 0.0, FRAC_PI_2, 0.0);
                    branch(3, turn + 1, 0.5 * reach, 0.0, 0.0);
                }
            }
        }
        let cotangent = m.secondaries.as_ref().filter(|_| !m.veins.is_empty()).map(|(angle, _)| angle.tan().recip());
        Self { joints, stalk: m.stalk, length: m.length, base, along, cotangent }
    }

    /// Returns the length of the stalk, metres.
    pub fn stalk(&self) -> f32 {
        self.stalk
    }

    /// Returns the length of the blade, metres.
    pub fn length(&self) -> f32 {
        self.length
    }

    /// Returns the index of the blade's base B.
    pub fn base(&self) -> usize {
        self.base
    }

    /// Returns the positions of the chain's joints along the flat leaf's y axis, metres, from ST1 (−stalk) to PK
    /// (length). The chain is the joints `0..along().len()`.
    pub fn along(&self) -> &[f32] {
        &self.along
    }

    /// Returns the number of vein joints.
    fn veins(&self) -> usize {
        self.along.len() - self.base - 2
    }

    /// Returns the index of part 1, 2 or 3 of a branch at the vein joint with index `vein` (from 0).
    fn branch(&self, vein: usize, right: bool, part: usize) -> usize {
        self.along.len() + vein * 6 + usize::from(right) * 3 + part - 1
    }

    /// Adds to the bend of both hinges of every branch. `hinges` gets the side (−1 left, +1 right) and the index of the
    /// vein joint (from 0) and returns the bends of the inner and the outer hinge, radians.
    pub fn bend_branches(&mut self, mut hinges: impl FnMut(f32, usize) -> (f32, f32)) {
        if self.cotangent.is_none() {
            return;
        }
        for vein in 0..self.veins() {
            for (right, side) in [(false, -1.0), (true, 1.0)] {
                let (inner, outer) = hinges(side, vein);
                let [i, o] = [2, 3].map(|part| self.branch(vein, right, part));
                self.joints[i].bend += inner;
                self.joints[o].bend += outer;
            }
        }
    }

    /// Straightens the blade along its chord, from its current base towards its current tip, with flat halves. The
    /// stalk keeps its posture.
    pub fn straighten(&mut self) {
        let (mut turned, mut forward, mut up) = (0.0_f32, 0.0, 0.0);
        for k in self.base..self.along.len() - 1 {
            turned += self.joints[k].bend;
            forward += self.joints[k + 1].a * turned.cos();
            up += self.joints[k + 1].a * turned.sin();
        }
        for joint in &mut self.joints[self.base..] {
            joint.bend = 0.0;
        }
        self.joints[self.base].bend = up.atan2(forward);
    }

    fn solve(&self, root: Pose, bent: bool) -> Vec<Pose> {
        let mut poses: Vec<Pose> = Vec::with_capacity(self.joints.len());
        for joint in &self.joints {
            let theta = joint.rest + if bent { joint.bend } else { 0.0 };
            let mut rotation = Mat3::from_rotation_z(theta);
            if joint.alpha != 0.0 {
                rotation = Mat3::from_rotation_x(joint.alpha) * rotation;
            }
            let step = Pose { rotation, origin: vec3(joint.a, 0.0, 0.0) };
            poses.push(joint.parent.map_or(root, |p| poses[p]).then(step));
        }
        poses
    }

    /// Returns the pose of every joint if ST1's parent is at `root` (forward kinematics).
    pub fn forward(&self, root: Pose) -> Vec<Pose> {
        self.solve(root, true)
    }

    /// Returns the positions of the joints if ST1's parent is at `root`: the chain, then the outer hinge of each
    /// branch. The other two joints of a branch coincide with its vein joint.
    pub fn placed(&self, root: Pose) -> Vec<PlacedJoint> {
        let poses = self.forward(root);
        let chain = self.along.len();
        let place = |(k, joint): (usize, &Joint)| match joint.name {
            Name::StL(vein, 3) | Name::StR(vein, 3) => {
                let parent = Some((self.base + usize::from(vein)).to_u16());
                Some(PlacedJoint { name: joint.name, parent, at: poses[k].origin })
            }
            _ if k < chain => {
                let parent = joint.parent.map(ToInt::to_u16);
                Some(PlacedJoint { name: joint.name, parent, at: poses[k].origin })
            }
            _ => None,
        };
        self.joints.iter().enumerate().filter_map(place).collect()
    }

    /// Returns the poses of the flat leaf in its own coordinates: blade's base at the origin, midrib along y.
    pub fn flat(&self) -> Vec<Pose> {
        self.solve(Pose::leaf(-self.stalk), false)
    }

    /// Returns for each joint the motion that it applies to a point of the flat leaf.
    pub fn motions(&self, root: Pose) -> Vec<Pose> {
        self.forward(root).into_iter().zip(self.flat()).map(|(posed, flat)| posed.then(flat.inverse())).collect()
    }

    /// Returns the two joints of the chain that carry a point at `y`, and the weight of the second. The weight changes
    /// linearly from the middle of one link to the middle of the next, so the bend at a joint is spread over half a
    /// link on both sides.
    fn carriers(&self, y: f32) -> (usize, usize, f32) {
        let middle = |k: usize| 0.5 * (self.along[k] + self.along[k + 1]);
        let last = self.along.len() - 2;
        let next = (0..=last).find(|k| y < middle(*k)).unwrap_or(last + 1);
        if next == 0 || next > last {
            let k = next.min(last);
            return (k, k, 0.0);
        }
        let (lo, hi) = (middle(next - 1), middle(next));
        (next - 1, next, if hi > lo { (y - lo) / (hi - lo) } else { 1.0 })
    }

    /// Returns the skin weights of a point on the stalk or midrib.
    pub fn weights_on_chain(&self, y: f32) -> Weights {
        let (a, b, share) = self.carriers(y);
        [(a.to_u16(), 1.0 - share), (b.to_u16(), share), (0, 0.0), (0, 0.0)]
    }

    /// Returns the skin weights of a point of the flat blade at (x, y); `across` = |x| / half-width at y.
    ///
    /// The chain carries the midrib. Further out the branches take over: those of the two vein joints on either side of
    /// the place where the secondary vein through the point leaves the midrib.
    pub fn weights(&self, x: f32, y: f32, across: f32) -> Weights {
        let (Some(cotangent), true) = (self.cotangent, across > 0.0) else {
            return self.weights_on_chain(y);
        };
        let first = self.base + 1;
        let veins = self.veins();
        let origin = y - x.abs() * cotangent;
        let at = &self.along[first..first + veins];
        let upper = at.partition_point(|v| *v <= origin);
        let (lo, hi) = (upper.saturating_sub(1), upper.min(veins - 1));
        let share = if hi > lo { ((origin - at[lo]) / (at[hi] - at[lo])).clamp(0.0, 1.0) } else { 0.0 };
        let right = x > 0.0;
        let part = |vein, part| self.branch(vein, right, part).to_u16();
        if across < INNER {
            let out = across / INNER;
            let (a, b, along) = self.carriers(y);
            [
                (a.to_u16(), (1.0 - out) * (1.0 - along)),
                (b.to_u16(), (1.0 - out) * along),
                (part(lo, 2), out * (1.0 - share)),
                (part(hi, 2), out * share),
            ]
        } else {
            let out = ((across - OUTER.0) / (OUTER.1 - OUTER.0)).clamp(0.0, 1.0);
            [
                (part(lo, 2), (1.0 - out) * (1.0 - share)),
                (part(hi, 2), (1.0 - out) * share),
                (part(lo, 3), out * (1.0 - share)),
                (part(hi, 3), out * share),
            ]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn beet() -> Measures {
        Measures {
            stalk: 0.04,
            stalk_joints: 3,
            length: 0.08,
            veins: vec![0.15, 0.3, 0.45, 0.6, 0.75],
            secondaries: Some((0.95, vec![0.018, 0.02, 0.019, 0.016, 0.01])),
        }
    }

    /// Returns the product of two row-major 4 × 4 matrices in double precision.
    fn product(a: [[f64; 4]; 4], b: [[f64; 4]; 4]) -> [[f64; 4]; 4] {
        std::array::from_fn(|i| std::array::from_fn(|j| (0..4).map(|k| a[i][k] * b[k][j]).sum()))
    }

    /// Rationale: the posture is a product of Denavit–Hartenberg matrices. Expected: the same poses as their textbook
    /// form in double precision. Source: Craig, "Introduction to Robotics", equation 3.6 (link transformation, d = 0).
    #[test]
    fn forward_kinematics_is_the_product_of_the_textbook_matrices() {
        let mut skeleton = Skeleton::new(&beet());
        for (i, joint) in skeleton.joints.iter_mut().enumerate() {
            joint.bend = 0.3 * (i.to_f32() * 1.7).sin();
        }
        let poses = skeleton.forward(Pose::leaf(-0.04));
        let root = [[0., 0., 1., 0.], [1., 0., 0., f64::from(-0.04f32)], [0., 1., 0., 0.], [0., 0., 0., 1.]];
        let mut matrices: Vec<[[f64; 4]; 4]> = Vec::new();
        for (joint, pose) in skeleton.joints.iter().zip(&poses) {
            let (a, alpha) = (f64::from(joint.a), f64::from(joint.alpha));
            let theta = f64::from(joint.rest) + f64::from(joint.bend);
            let ((st, ct), (sa, ca)) = (theta.sin_cos(), alpha.sin_cos());
            let link = [[ct, -st, 0., a], [st * ca, ct * ca, -sa, 0.], [st * sa, ct * sa, ca, 0.], [0., 0., 0., 1.]];
            let m = product(joint.parent.map_or(root, |p| matrices[p]), link);
            for (r, row) in m.iter().enumerate().take(3) {
                assert!((f64::from(pose.origin[r]) - row[3]).abs() < 1e-7, "{:?}", joint.name);
                for (c, entry) in row.iter().enumerate().take(3) {
                    assert!((f64::from(pose.rotation.col(c)[r]) - entry).abs() < 2e-6, "{:?}", joint.name);
                }
            }
            matrices.push(m);
        }
    }

    #[test]
    fn branches_are_mirrored_and_follow_the_secondary_veins() {
        let skeleton = Skeleton::new(&beet());
        let flat = skeleton.flat();
        for vein in 0..5 {
            let [l, r] = [false, true].map(|right| flat[skeleton.branch(vein, right, 3)].origin);
            assert!((l.x + r.x).abs() < 1e-7 && (l.y - r.y).abs() < 1e-7 && l.z.abs() < 1e-7);
            assert!(r.x > 0.0);
            let angle = r.x.atan2(r.y - skeleton.along()[skeleton.base() + 1 + vein]);
            assert!((angle - 0.95).abs() < 1e-4, "{angle}");
        }
        assert_eq!(skeleton.joints[skeleton.branch(2, false, 1)].name, Name::StL(3, 1));
        assert_eq!(skeleton.joints[skeleton.branch(4, true, 3)].name, Name::StR(5, 3));
    }

    #[test]
    fn a_positive_bend_raises_the_leaf_and_its_sides() {
        let mut skeleton = Skeleton::new(&beet());
        let base = skeleton.base();
        skeleton.joints[base].bend = 0.2;
        skeleton.bend_branches(|_, _| (0.2, 0.0));
        let motions = skeleton.motions(Pose::leaf(-0.04));
        let side = motions[skeleton.branch(0, false, 2)].point(vec3(-0.02, 0.02, 0.0));
        let middle = motions[skeleton.base()].point(vec3(0.0, 0.02, 0.0));
        assert!(middle.z > 0.003 && side.z > middle.z, "{middle} {side}");
    }

    #[test]
    fn a_straightened_blade_is_flat_and_points_where_its_tip_was() {
        let mut skeleton = Skeleton::new(&beet());
        for (i, joint) in skeleton.joints.iter_mut().enumerate() {
            joint.bend = -0.2 + 0.1 * (i.to_f32() * 1.7).sin();
        }
        let tip = skeleton.along().len() - 1;
        let ends = |s: &Skeleton| [s.base(), tip].map(|k| s.forward(Pose::leaf(-0.04))[k].origin);
        let [base, was] = ends(&skeleton);
        skeleton.straighten();
        let [same, is] = ends(&skeleton);
        assert!((same - base).length() < 1e-7, "the stalk moved");
        assert!((is - base).normalize().dot((was - base).normalize()) > 0.99999);
        assert!(((is - base).length() - 0.08).abs() < 1e-6);
        let motions = skeleton.motions(Pose::leaf(-0.04));
        let normal = skeleton.forward(Pose::leaf(-0.04))[skeleton.base()].rotation.col(1);
        for (motion, joint) in motions.iter().zip(&skeleton.joints).skip(skeleton.base()) {
            let at = motion.point(vec3(0.01, 0.05, 0.0));
            assert!((at - base).dot(normal).abs() < 1e-6, "{:?}", joint.name);
        }
    }

    #[test]
    fn skin_weights_sum_to_one_and_are_never_negative() {
        let skeleton = Skeleton::new(&beet());
        for i in 0..=60 {
            for j in -10..=10 {
                let (y, across) = (-0.045 + 0.13 * i.to_f32() / 60.0, j.to_f32() / 9.0);
                let weights = skeleton.weights(0.02 * across, y, across.abs());
                let sum: f32 = weights.iter().map(|(_, w)| w).sum();
                assert!((sum - 1.0).abs() < 1e-5, "{sum}");
                assert!(weights.iter().all(|(k, w)| *w >= 0.0 && usize::from(*k) < skeleton.joints.len()));
            }
        }
    }

    #[test]
    fn a_sessile_leaf_without_branches_has_a_chain_only() {
        let m = Measures { stalk: 0.0, stalk_joints: 1, length: 0.02, veins: vec![0.5], secondaries: None };
        let skeleton = Skeleton::new(&m);
        assert_eq!(skeleton.joints.len(), 4);
        assert!(skeleton.flat().iter().all(|p| p.origin.is_finite()));
        assert!((skeleton.weights(0.002, 0.01, 0.5).iter().map(|(_, w)| w).sum::<f32>() - 1.0).abs() < 1e-6);
    }
}
