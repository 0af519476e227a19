//! The leaf's kinematic tree.
//!
//! The chain runs from the first stem joint ST1 along the stalk to the leaf's base B, then along the midrib through the
//! vein joints VN1…VNn to the peak PK. At every vein joint two mirrored branches STL and STR follow the secondary veins.
//! Source: Di Cicco et al. 2017, "Automatic model based dataset generation for fast and accurate crop and weeds
//! detection", IROS, §III-A.
//!
//! Posture follows Denavit and Hartenberg: every joint turns about its own z axis only. In the notation for trees (a frame
//! stands at its joint; Khalil & Kleinfinger 1986, "A new geometric notation for open and closed-loop robots", ICRA)
//!
//! ```text
//! pose(j) = pose(parent) · Tx(a) · Rx(α) · Rz(θ)
//! ```
//!
//! where link length a and offset α belong to the leaf and θ = rest + bend is the posture. A joint's frame has its x axis
//! along the vein, its z axis along the hinge and its y axis out of the upper side: a positive bend raises the leaf.
//! A branch needs three such joints: one that turns the vein's direction within the blade (α = −90° brings the hinge out
//! of the blade), one at the midrib and one half-way out (α = +90° brings it back) that bend the blade sideways.

use crate::math::{Mat3, Vec3, vec3};
use std::f32::consts::FRAC_PI_2;
use std::fmt;

/// A rigid motion: rotation, then offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Rotation; its columns are the frame's axes.
    pub rotation: Mat3,
    /// Where the frame's origin goes, metres.
    pub origin: Vec3,
}

impl Pose {
    /// The frame of a leaf's chain in the leaf's own coordinates (y along the midrib, z out of the upper side, x right):
    /// vein along y, hinge along x.
    pub fn leaf(y: f32) -> Self {
        Self { rotation: Mat3::from_cols(Vec3::Y, Vec3::Z, Vec3::X), origin: vec3(0.0, y, 0.0) }
    }

    /// `self` after `inner`.
    #[must_use]
    pub fn then(self, inner: Self) -> Self {
        Self { rotation: self.rotation * inner.rotation, origin: self.point(inner.origin) }
    }

    /// The motion back; the rotation must be a pure one.
    #[must_use]
    pub fn inverse(self) -> Self {
        let rotation = self.rotation.transpose();
        Self { rotation, origin: -(rotation * self.origin) }
    }

    /// Where a point goes.
    #[inline]
    pub fn point(self, p: Vec3) -> Vec3 {
        self.rotation * p + self.origin
    }
}

/// A joint's place in the tree. Numbers count from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Name {
    /// Joint of the stalk.
    St(u8),
    /// The base of the blade.
    B,
    /// Joint of the midrib.
    Vn(u8),
    /// The tip.
    Pk,
    /// Branch to the left at a vein joint: its turn (1), the hinge at the midrib (2), the hinge half-way out (3).
    StL(u8, u8),
    /// Branch to the right.
    StR(u8, u8),
}

impl fmt::Display for Name {
    /// As the paper writes them; of a branch the side and the vein joint.
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

/// A joint as the posture has put it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedJoint {
    /// What it is called; of a branch, the hinge half-way out.
    pub name: Name,
    /// Place of its parent in the same list; `None` for the first.
    pub parent: Option<u16>,
    /// Where it is, metres.
    pub at: Vec3,
}

/// One joint: one rotation about its own z axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// What it is called.
    pub name: Name,
    /// Index of its parent, always smaller than its own; `None` for ST1.
    pub parent: Option<usize>,
    /// Link length: distance from the parent's origin along the parent's x axis, metres.
    pub a: f32,
    /// Fixed turn about the parent's x axis, radians.
    pub alpha: f32,
    /// θ of the flat leaf, radians: zero but for a branch's turn.
    pub rest: f32,
    /// What posture adds to θ, radians.
    pub bend: f32,
}

/// The measures of a skeleton.
#[derive(Clone, Debug)]
pub struct Measures {
    /// Length of the stalk, metres; 0 for a sessile leaf.
    pub stalk: f32,
    /// Number of stalk joints, at least 1.
    pub stalk_joints: usize,
    /// Length of the blade, metres.
    pub length: f32,
    /// Positions of the vein joints as fractions of the blade's length, rising, strictly between 0 and 1.
    pub veins: Vec<f32>,
    /// Angle between midrib and secondary veins, radians, and the blade's half-width at each vein joint, metres;
    /// `None` for a blade without branches.
    pub secondaries: Option<(f32, Vec<f32>)>,
}

/// The weights of up to four joints on one corner; they sum to one.
pub type Weights = crate::geometry::JointWeights;

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
    /// Sine of the secondaries' angle; cotangent for the way back to the midrib; 0 branches when `None`.
    cotangent: Option<f32>,
}

/// Share of the half-width over which a corner passes from the midrib's joint to the branch's inner hinge.
const INNER: f32 = 0.4;
/// Share of the half-width where the outer hinge begins to carry.
const OUTER: (f32, f32) = (0.45, 0.95);

impl Skeleton {
    /// The skeleton of a flat leaf.
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
            chain(Name::St(i as u8 + 1), -m.stalk * (1.0 - i as f32 / stalk_joints as f32));
        }
        chain(Name::B, 0.0);
        for (i, t) in m.veins.iter().enumerate() {
            chain(Name::Vn(i as u8 + 1), t * m.length);
        }
        chain(Name::Pk, m.length);
        let base = stalk_joints;
        if let Some((angle, half_widths)) = &m.secondaries {
            for (i, half_width) in half_widths.iter().enumerate().take(m.veins.len()) {
                let n = i as u8 + 1;
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

    /// Length of the stalk, metres.
    pub fn stalk(&self) -> f32 {
        self.stalk
    }

    /// Length of the blade, metres.
    pub fn length(&self) -> f32 {
        self.length
    }

    /// Index of the blade's base B.
    pub fn base(&self) -> usize {
        self.base
    }

    /// Positions of the chain's joints along the flat leaf's y axis, metres, from ST1 (−stalk) to PK (length); the chain
    /// is joints `0..along().len()`.
    pub fn along(&self) -> &[f32] {
        &self.along
    }

    /// Number of vein joints.
    fn veins(&self) -> usize {
        self.along.len() - self.base - 2
    }

    /// Index of a branch's part (1…3) at vein joint `vein` (from 0).
    fn branch(&self, vein: usize, right: bool, part: usize) -> usize {
        self.along.len() + vein * 6 + usize::from(right) * 3 + part - 1
    }

    /// Adds to the bend of both hinges of every branch: `inner` and `outer` get the side (−1 left, +1 right) and the vein
    /// joint's number from 0, and return radians.
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

    /// Lays the blade straight along its chord, from where its base is towards where its tip is now, with flat sides. The stalk keeps
    /// its posture.
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

    /// Forward kinematics: the pose of every joint when ST1's parent stands at `root`.
    pub fn forward(&self, root: Pose) -> Vec<Pose> {
        self.solve(root, true)
    }

    /// Where the joints stand when ST1's parent stands at `root`: the chain, then the outer hinge of each branch, whose other joints stand
    /// at the midrib.
    pub fn placed(&self, root: Pose) -> Vec<PlacedJoint> {
        let poses = self.forward(root);
        let chain = self.along.len();
        let place = |(k, joint): (usize, &Joint)| match joint.name {
            Name::StL(vein, 3) | Name::StR(vein, 3) => {
                let parent = Some((self.base + usize::from(vein)) as u16);
                Some(PlacedJoint { name: joint.name, parent, at: poses[k].origin })
            }
            _ if k < chain => {
                let parent = joint.parent.map(|parent| parent as u16);
                Some(PlacedJoint { name: joint.name, parent, at: poses[k].origin })
            }
            _ => None,
        };
        self.joints.iter().enumerate().filter_map(place).collect()
    }

    /// The poses of the flat leaf in its own coordinates: blade's base at the origin, midrib along y.
    pub fn flat(&self) -> Vec<Pose> {
        self.solve(Pose::leaf(-self.stalk), false)
    }

    /// What each joint does to a point of the flat leaf.
    pub fn motions(&self, root: Pose) -> Vec<Pose> {
        self.forward(root).into_iter().zip(self.flat()).map(|(posed, flat)| posed.then(flat.inverse())).collect()
    }

    /// The two joints of the chain that carry a point at `y`, and the second one's share. The share passes from one
    /// link's middle to the next one's, so the bend at a joint is spread over half a link on both sides.
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

    /// Skin weights of a point on the stalk or midrib.
    pub fn weights_on_chain(&self, y: f32) -> Weights {
        let (a, b, share) = self.carriers(y);
        [(a as u16, 1.0 - share), (b as u16, share), (0, 0.0), (0, 0.0)]
    }

    /// Skin weights of a point of the flat blade at (x, y), `across` = |x| over the half-width there.
    ///
    /// The chain carries the midrib; further out the branches take over, those of the two vein joints between which the
    /// secondary vein through the point leaves the midrib.
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
        let part = |vein, part| self.branch(vein, right, part) as u16;
        if across < INNER {
            let out = across / INNER;
            let (a, b, along) = self.carriers(y);
            [
                (a as u16, (1.0 - out) * (1.0 - along)),
                (b as u16, (1.0 - out) * along),
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

    /// Row-major 4 × 4 product in double precision.
    fn product(a: [[f64; 4]; 4], b: [[f64; 4]; 4]) -> [[f64; 4]; 4] {
        std::array::from_fn(|i| std::array::from_fn(|j| (0..4).map(|k| a[i][k] * b[k][j]).sum()))
    }

    /// Rationale: the posture is a product of Denavit–Hartenberg matrices. Expected: the same poses as their textbook
    /// form in double precision. Source: Craig, "Introduction to Robotics", equation 3.6 (link transformation, d = 0).
    #[test]
    fn forward_kinematics_is_the_product_of_the_textbook_matrices() {
        let mut skeleton = Skeleton::new(&beet());
        for (i, joint) in skeleton.joints.iter_mut().enumerate() {
            joint.bend = 0.3 * (i as f32 * 1.7).sin();
        }
        let poses = skeleton.forward(Pose::leaf(-0.04));
        let root = [[0., 0., 1., 0.], [1., 0., 0., -0.04f32 as f64], [0., 1., 0., 0.], [0., 0., 0., 1.]];
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
            joint.bend = -0.2 + 0.1 * (i as f32 * 1.7).sin();
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
                let (y, across) = (-0.045 + 0.13 * i as f32 / 60.0, j as f32 / 9.0);
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
