//! The joints of a plant's stems: what a program needs to bend them further, with all flowers on them.
//!
//! Every stem organ knows its middle lines ([`Organ::lines`](super::Organ::lines)). A line is a chain of joints, one at each of its points; it
//! hangs on the joint nearest to its foot, of those that were there before. A corner of what belongs to no leaf goes with the nearest link; half-way
//! between two joints it is one's alone, at a joint it is shared evenly by those of the links that meet there, so that a bent stem does not kink.

use super::organ::Organ;
use super::rig::RigJoint;
use crate::geometry::JointWeights;
use crate::math::{Mat3, Vec3};

/// What is nearer to a joint is at it, metres.
const SAME: f32 = 1e-5;

/// The joints of the stems of these organs, parents before children; the organs without a leaf are tied to them.
pub(super) fn rig(organs: &mut [Organ]) -> Vec<RigJoint> {
    let mut joints: Vec<RigJoint> = Vec::new();
    for line in organs.iter().flat_map(|organ| &organ.lines) {
        if u16::try_from(joints.len() + line.len()).is_ok() {
            hang(&mut joints, line);
        }
    }
    if !joints.is_empty() {
        let links = links(&joints);
        for organ in organs.iter_mut().filter(|organ| organ.leaf == 0) {
            organ.mesh.weights = organ.mesh.positions.iter().map(|p| weights(*p, &joints, &links)).collect();
        }
    }
    joints
}

/// Adds the joints of a line.
fn hang(joints: &mut Vec<RigJoint>, line: &[Vec3]) {
    let mut points = line.to_vec();
    points.dedup_by(|a, b| a.distance(*b) < SAME);
    let Some(foot) = points.first() else { return };
    let mut parent = nearest(joints, *foot);
    let there = parent.is_some_and(|k| joints[usize::from(k)].at.distance(*foot) < SAME);
    let first = usize::from(there);
    let mut along = Vec3::Z;
    for (k, at) in points.iter().enumerate() {
        along = points.get(k + 1).map_or(along, |next| (*next - *at).normalize_or(along));
        if k < first {
            continue;
        }
        joints.push(RigJoint { name: format!("stem {}", joints.len() + 1), parent, at: *at, axes: axes(along) });
        parent = Some((joints.len() - 1) as u16);
    }
}

/// The joint nearest to a point.
fn nearest(joints: &[RigJoint], to: Vec3) -> Option<u16> {
    let far = |joint: &RigJoint| joint.at.distance_squared(to);
    (0..joints.len()).min_by(|a, b| far(&joints[*a]).total_cmp(&far(&joints[*b]))).map(|k| k as u16)
}

/// The axes of a joint whose link has this direction: a positive turn about z raises what lies, and bends what stands towards −x of the plant.
fn axes(along: Vec3) -> Mat3 {
    let level = Vec3::Z.cross(along);
    // x × y = z, and y is the upper side of what lies.
    let hinge = if level.length() > 0.05 { -level.normalize() } else { along.cross(Vec3::NEG_X).normalize_or(Vec3::Y) };
    Mat3::from_cols(along, hinge.cross(along), hinge)
}

/// From a joint to one that hangs on it; from one that bears none to itself.
type Link = (u16, u16);

fn links(joints: &[RigJoint]) -> Vec<Link> {
    let mut bears = vec![false; joints.len()];
    let mut links: Vec<Link> = Vec::with_capacity(joints.len());
    for (k, joint) in joints.iter().enumerate() {
        if let Some(parent) = joint.parent {
            bears[usize::from(parent)] = true;
            links.push((parent, k as u16));
        }
    }
    links.extend((0..joints.len()).filter(|k| !bears[*k]).map(|k| (k as u16, k as u16)));
    links
}

/// The joints that carry a corner.
fn weights(p: Vec3, joints: &[RigJoint], links: &[Link]) -> JointWeights {
    let joint = |k: u16| &joints[usize::from(k)];
    let (mut best, mut found) = (f32::INFINITY, ((0, 0), 0.0));
    for link in links {
        let (from, to) = (joint(link.0).at, joint(link.1).at);
        let (way, out) = (to - from, p - from);
        let t = (out.dot(way) / way.length_squared().max(1e-12)).clamp(0.0, 1.0);
        let far = (out - way * t).length_squared();
        if far < best {
            (best, found) = (far, (*link, t));
        }
    }
    let ((from, to), t) = found;
    let (other, share) = match (joint(from).parent, t) {
        _ if from == to => (0, 0.0),
        (Some(parent), t) if t < 0.5 => (parent, 0.5 - t),
        (_, t) if t >= 0.5 => (to, t - 0.5),
        _ => (0, 0.0),
    };
    [(from, 1.0 - share), (if share > 0.0 { other } else { 0 }, share), (0, 0.0), (0, 0.0)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::vec3;

    /// Rationale: a stem that hangs on the wrong joint, or a corner on the wrong link, tears a plant when it is bent. Expected: a stem of three
    /// joints goes on from that below without a joint twice, a side shoot hangs on the joint nearest to its foot; a corner half-way along a link
    /// is its joint's alone, one at a joint is shared evenly. Source: by hand.
    #[test]
    fn stems_hang_on_stems_and_corners_on_the_nearest_link() {
        let mut joints = Vec::new();
        hang(&mut joints, &[Vec3::ZERO, vec3(0.0, 0.0, 0.1)]);
        hang(&mut joints, &[vec3(0.0, 0.0, 0.1), vec3(0.0, 0.0, 0.2), vec3(0.0, 0.0, 0.2), vec3(0.0, 0.0, 0.3)]);
        hang(&mut joints, &[vec3(0.01, 0.0, 0.21), vec3(0.1, 0.0, 0.25)]);
        let parents: Vec<_> = joints.iter().map(|joint| joint.parent).collect();
        assert_eq!(parents, [None, Some(0), Some(1), Some(2), Some(2), Some(4)]);
        let links = links(&joints);
        let at = |x: f32, z: f32| {
            let mut all: Vec<_> =
                weights(vec3(x, 0.0, z), &joints, &links).into_iter().filter(|(_, w)| *w > 1e-6).collect();
            all.sort_by_key(|(k, _)| *k);
            all
        };
        assert_eq!(at(0.002, -0.01), [(0, 1.0)]);
        let [(0, a), (1, b)] = at(0.002, 0.1)[..] else { panic!("{:?}", at(0.002, 0.1)) };
        assert!((a - 0.5).abs() < 1e-5 && (b - 0.5).abs() < 1e-5);
        let [(1, whole)] = at(-0.002, 0.15)[..] else { panic!("{:?}", at(-0.002, 0.15)) };
        assert!((whole - 1.0).abs() < 1e-5);
        assert!(at(0.1, 0.25).iter().any(|(k, _)| *k == 4));
        for joint in &joints {
            let axes = joint.axes;
            assert!((axes.determinant() - 1.0).abs() < 1e-5 && axes.x_axis.is_normalized());
        }
        // A turn about z raises what lies.
        let lying = axes(vec3(1.0, 0.0, 0.1).normalize());
        assert!(lying.z_axis.cross(lying.x_axis).z > 0.9);
    }
}
