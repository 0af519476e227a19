//! Joints of a plant's stems, for programs that animate the stems with all leaves and flowers on them.
//!
//! A stem is a chain of links along its centre line ([`StemLine`]) with a joint at the start of each link. Stems,
//! leaves, flowers and fruits are children of the link that they are attached to. The vertices of a stem follow the
//! nearest link of their own stem. Near a joint they are shared by both adjacent links, so that a bent stem does not
//! kink.

use super::organ::{Organ, StemLine, StemPosition};
use super::rig::RigJoint;
use furrow_base::geometry::JointWeights;
use furrow_base::math::{Mat3, RoundTo, Vec3};
use std::collections::BTreeMap;

/// Length below which a link has no joint of its own, metres.
const SHORT: f32 = 1e-5;
/// Fraction of a link at each of its ends that the adjacent link moves too.
const SHARED: f32 = 0.2;

/// Returns the joints of the stems of these organs, parents before children. Binds the meshes of organs without a leaf
/// to them, and sets [`super::LeafAxis::bearer`] of every leaf.
pub(super) fn rig(organs: &mut [Organ]) -> Vec<RigJoint> {
    let mut lines: Vec<&StemLine> = organs.iter().flat_map(|organ| &organ.lines).collect();
    lines.sort_by_key(|line| line.number);
    let mut stems = Stems::default();
    for line in lines {
        stems.add(line);
    }
    for organ in organs {
        organ.mesh.weights = stems.weights(organ).unwrap_or_else(|| std::mem::take(&mut organ.mesh.weights));
        if let Some(axis) = &mut organ.axis {
            axis.bearer = axis.on.and_then(|on| stems.bearer(on));
        }
    }
    stems.joints
}

/// Stem as a chain of joints.
struct Chain {
    points: Vec<Vec3>,
    /// Joint of each of its links.
    links: Vec<u16>,
    /// Joint that bears the stem.
    parent: Option<u16>,
}

/// All stems of a plant.
#[derive(Default)]
struct Stems {
    joints: Vec<RigJoint>,
    chains: BTreeMap<u32, Chain>,
}

impl Stems {
    fn add(&mut self, line: &StemLine) {
        let parent = line.on.and_then(|on| self.bearer(on));
        let mut links = Vec::with_capacity(line.points.len());
        for (k, ends) in line.points.windows(2).enumerate() {
            let last = links.last().copied();
            let along = (ends[1] - ends[0]).normalize_or(Vec3::Z);
            match (last, u16::try_from(self.joints.len())) {
                (Some(last), _) if ends[0].distance(ends[1]) < SHORT => links.push(last),
                (_, Ok(number)) => {
                    let name = format!("stem {}.{}", line.number + 1, k + 1);
                    self.joints.push(RigJoint { name, parent: last.or(parent), at: ends[0], axes: axes(along) });
                    links.push(number);
                }
                // Joint indices are exhausted (16 bits): the remaining links follow the last joint.
                (last, Err(_)) => links.extend(last.or(parent)),
            }
        }
        self.chains.insert(line.number, Chain { points: line.points.clone(), links, parent });
    }

    /// Returns the joint of the link that bears an attachment; at a joint, the joint of the link that ends there.
    fn bearer(&self, on: StemPosition) -> Option<u16> {
        let chain = self.chains.get(&on.line)?;
        let Some(last) = chain.links.len().checked_sub(1) else { return chain.parent };
        if on.at <= 0.0 && chain.parent.is_some() {
            return chain.parent;
        }
        let link = on.at.ceil_to::<usize>().saturating_sub(1).min(last);
        Some(chain.links[link])
    }

    /// Returns the skin weights of an organ's vertices; `None` for the organs of a leaf.
    fn weights(&self, organ: &Organ) -> Option<Vec<JointWeights>> {
        if self.joints.is_empty() || organ.carried.is_empty() {
            return None;
        }
        let mut all = Vec::with_capacity(organ.mesh.positions.len());
        for run in &organ.carried {
            let corners = &organ.mesh.positions[all.len()..][..run.corners];
            match run.at {
                Some(at) => {
                    let bearer = self.bearer(StemPosition { line: run.line, at }).unwrap_or(0);
                    all.extend(corners.iter().map(|_| tied((bearer, 1.0), None)));
                }
                None => all.extend(corners.iter().map(|corner| self.along(run.line, *corner))),
            }
        }
        Some(all)
    }

    /// Returns the skin weights of a stem's vertex.
    fn along(&self, line: u32, corner: Vec3) -> JointWeights {
        let Some(chain) = self.chains.get(&line) else { return tied((0, 1.0), None) };
        if chain.links.is_empty() {
            return tied((chain.parent.unwrap_or(0), 1.0), None);
        }
        let (mut best, mut found) = (f32::INFINITY, (0, 0.0));
        for (k, ends) in chain.points.windows(2).take(chain.links.len()).enumerate() {
            let (way, out) = (ends[1] - ends[0], corner - ends[0]);
            let t = (out.dot(way) / way.length_squared().max(SHORT * SHORT)).clamp(0.0, 1.0);
            let far = (out - way * t).length_squared();
            if far < best {
                (best, found) = (far, (k, t));
            }
        }
        let (k, t) = found;
        let own = chain.links[k];
        let (other, near) = if t < 0.5 {
            (self.joints[usize::from(own)].parent, t)
        } else {
            (chain.links[k..].iter().copied().find(|next| *next != own), 1.0 - t)
        };
        let share = 0.5 * (1.0 - near / SHARED).max(0.0);
        match other {
            Some(other) if share > 0.0 => tied((own, 1.0 - share), Some((other, share))),
            _ => tied((own, 1.0), None),
        }
    }
}

fn tied(one: (u16, f32), other: Option<(u16, f32)>) -> JointWeights {
    [one, other.unwrap_or((0, 0.0)), (0, 0.0), (0, 0.0)]
}

/// Returns the axes of a joint whose link has this direction. A positive rotation about z raises a lying link.
fn axes(along: Vec3) -> Mat3 {
    let level = along.cross(Vec3::Z);
    let hinge = if level.length() > 0.05 { level.normalize() } else { along.cross(Vec3::NEG_X).normalize_or(Vec3::Y) };
    Mat3::from_cols(along, hinge.cross(along), hinge)
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::vec3;

    /// Rationale: a stem bound to the wrong link, or a vertex bound to another stem, tears a plant when it is bent.
    /// Expected: a stem has a joint for each link of non-zero length; a side shoot is a child of the link that bears
    /// it, at a joint of the link that ends there; a vertex in mid-link has only that link's joint, one at a joint has
    /// equal weights, whatever other stem is near. Source: by hand.
    #[test]
    fn stems_hang_on_links_and_corners_on_their_own_stem() {
        let mut stems = Stems::default();
        let up = |z: f32| vec3(0.0, 0.0, z);
        let on = |line: u32, at: f32| Some(StemPosition { line, at });
        for (number, points, on) in [
            (0, vec![Vec3::ZERO, up(0.1)], None),
            (1, vec![up(0.1), up(0.2), up(0.2), up(0.3)], on(0, 1.0)),
            (2, vec![vec3(0.01, 0.0, 0.28), vec3(0.1, 0.0, 0.3)], on(1, 2.8)),
            (3, vec![vec3(0.01, 0.0, 0.2), vec3(0.01, 0.0, 0.3)], on(1, 1.0)),
            (4, vec![vec3(0.5, 0.0, 0.0), vec3(0.5, 0.0, 0.1)], None),
        ] {
            stems.add(&StemLine { number, points, on });
        }
        let parents: Vec<_> = stems.joints.iter().map(|joint| joint.parent).collect();
        assert_eq!(parents, [None, Some(0), Some(1), Some(2), Some(1), None]);
        let near = |line: u32, corner: Vec3| {
            let mut all: Vec<_> = stems.along(line, corner).into_iter().filter(|(_, w)| *w > 1e-6).collect();
            all.sort_by_key(|(k, _)| *k);
            all
        };
        assert_eq!(near(0, vec3(0.002, 0.0, -0.01)), [(0, 1.0)]);
        assert_eq!(near(1, vec3(0.002, 0.0, 0.15)), [(1, 1.0)]);
        assert_eq!(near(1, vec3(0.01, 0.0, 0.25)), [(2, 1.0)]);
        let [(1, a), (2, b)] = near(1, up(0.2))[..] else { panic!("{:?}", near(1, up(0.2))) };
        assert!((a - 0.5).abs() < 1e-5 && (b - 0.5).abs() < 1e-5);
        assert_eq!(stems.bearer(StemPosition { line: 1, at: 0.0 }), Some(0));
        assert_eq!(stems.bearer(StemPosition { line: 1, at: 3.0 }), Some(2));
        for joint in &stems.joints {
            assert!((joint.axes.determinant() - 1.0).abs() < 1e-5 && joint.axes.x_axis.is_normalized());
        }
        // A positive rotation about z raises a lying link.
        let lying = axes(vec3(1.0, 0.0, 0.1).normalize());
        assert!(lying.z_axis.cross(lying.x_axis).z > 0.9);
    }
}
