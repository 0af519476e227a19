//! Seats of flowering axes: tips of shoots and axils of leaves, taken from the organs built so far.

use crate::plant::growth::Growth;
use crate::plant::organ::{Organ, OrganKind, StemPosition};
use furrow_base::math::{ToFloat, Vec3, direction};
use furrow_base::sampling::Purpose;
use std::f32::consts::{FRAC_PI_2, TAU};

/// Cosine of the largest angle between sheaths of one shoot, half a degree.
const PARALLEL: f32 = 0.999_96;

/// Place that can bear an axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct AxisSite {
    /// Position, metres.
    pub(super) point: Vec3,
    /// Direction of the stem that bears it, unit vector.
    pub(super) along: Vec3,
    /// Direction in which the axil opens, perpendicular to the stem, unit vector; `None` for a tip.
    pub(super) out: Option<Vec3>,
    /// Position on the plant's stems; `None` on a grass, whose culms start at the soil.
    pub(super) on: Option<StemPosition>,
}

/// Returns the tips of all shoots, the main shoot's first.
pub(super) fn tips(organs: &[Organ], growth: &Growth<'_>) -> Vec<AxisSite> {
    let stems: Vec<AxisSite> = organs.iter().filter(|o| o.kind == OrganKind::Stem).filter_map(end_of).collect();
    if stems.is_empty() { culms(organs, growth) } else { stems }
}

/// Returns the tip of a stem. Its mesh consists of rings from base to tip, which differ in the texture coordinate v.
fn end_of(stem: &Organ) -> Option<AxisSite> {
    let mesh = &stem.mesh;
    let middle_of = |v: f32| {
        // The last vertex of a ring coincides with its first.
        let ring = || mesh.positions.iter().zip(&mesh.uvs).filter(|(_, uv)| uv.y == v && uv.x < 1.0).map(|(p, _)| *p);
        ring().sum::<Vec3>() / ring().count().max(1).to_f32()
    };
    let last = mesh.uvs.last()?.y;
    let before = mesh.uvs.iter().rev().find(|uv| uv.y != last)?.y;
    let (point, below) = (middle_of(last), middle_of(before));
    Some(AxisSite { point, along: (point - below).normalize_or(Vec3::Z), out: None, on: stem.end() })
}

/// Shoot of a grass.
struct Shoot {
    /// Bases of its sheaths, the oldest first, metres.
    feet: Vec<Vec3>,
    along: Vec3,
}

/// Returns the bases of a grass's shoots, whose culms are hidden in their sheaths. Sheaths that are close to each other
/// and parallel belong to one shoot; its culm is at their centre.
fn culms(organs: &[Organ], growth: &Growth<'_>) -> Vec<AxisSite> {
    let mut shoots: Vec<Shoot> = Vec::new();
    // Sheaths are on two sides of a shoot, whose width is that of the stem.
    let near = 1.05 * growth.stem + 1e-4;
    for axis in organs.iter().filter_map(|o| o.axis.as_ref()) {
        let Some(foot) = axis.joints.first().map(|joint| joint.at) else { continue };
        let along = (axis.base - foot).normalize_or(Vec3::Z);
        let same = |of: &&mut Shoot| of.feet[0].distance(foot) < near && of.along.dot(along) > PARALLEL;
        match shoots.iter_mut().find(same) {
            Some(shoot) => shoot.feet.push(foot),
            None => shoots.push(Shoot { feet: vec![foot], along }),
        }
    }
    let mut stream = growth.stream.child(Purpose::Plant, 1);
    let lean = growth.lean(&mut stream);
    let upright = direction(lean, stream.range32(0.0, TAU));
    let culm = |(k, shoot): (usize, &Shoot)| {
        // The two oldest sheaths are on opposite sides.
        let two = &shoot.feet[..shoot.feet.len().min(2)];
        let foot = two.iter().sum::<Vec3>() / two.len().to_f32();
        let (point, along) = if k == 0 { (Vec3::ZERO, upright) } else { (foot, shoot.along) };
        AxisSite { point, along, out: None, on: None }
    };
    shoots.iter().enumerate().map(culm).collect()
}

/// Returns the axil of leaf `number`, or `None` if the leaf does not exist.
pub(super) fn axil(organs: &[Organ], number: u32) -> Option<AxisSite> {
    let of = |organ: &&Organ| u32::from(organ.leaf) == number;
    let axis = organs.iter().filter(of).find_map(|o| o.axis.as_ref())?;
    let sheathed = organs.iter().filter(of).any(|o| o.kind == OrganKind::Sheath);
    let foot = axis.joints.first().map_or(axis.base, |joint| joint.at);
    let ahead = (axis.tip - axis.base).with_z(0.0).normalize_or(Vec3::X);
    let along = if sheathed { (axis.base - foot).normalize_or(Vec3::Z) } else { Vec3::Z };
    let point = if sheathed { axis.base - along * 0.004 } else { foot };
    Some(AxisSite { point, along, out: Some(ahead), on: axis.on })
}

/// Returns a unit vector perpendicular to `along`, at this azimuth about it.
pub(super) fn across(along: Vec3, azimuth: f32) -> Vec3 {
    let level = direction(FRAC_PI_2, azimuth);
    let across = level - along * level.dot(along);
    // The horizontal direction nearly coincides with the axis: use its side.
    if across.length() < 0.2 { along.cross(Vec3::Z).normalize_or(Vec3::X) } else { across.normalize() }
}
