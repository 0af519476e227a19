//! The growth axis: the hypocotyl, the stem above it, and the seats of the leaves.

use super::growth::{Growth, LeafState};
use super::leaf::Seat;
use super::organ::{self, Organ, OrganKind, StemLine, StemPosition, StemVertices};
use super::tube::{self, Profile, Ring};
use furrow_base::math::{Frame, ToFloat, Vec3, direction, lerp, smoothstep, vec3};
use furrow_base::sampling::{Purpose, Stream};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// Depth of the buried part of stems and sheaths, metres.
pub(super) const ROOT: f32 = 0.008;

/// Ratio of the height of a crown's dome to its radius.
const CROWN: f32 = 0.5;

/// Number of segments of a hypocotyl.
const HYPOCOTYL: usize = 5;

/// Parameters of a growth form's axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Section {
    /// Cross-section of the stem above the cotyledons.
    pub(super) profile: Profile,
    /// Ratio of the stem's width at the top to that at the base.
    pub(super) taper: f32,
    /// Standard deviation of the change of direction from one internode to the next.
    pub(super) wander: f32,
    /// Distance of the leaf seats from the centre line for the oldest and the youngest layer, as a fraction of the
    /// stem's radius.
    pub(super) seat: (f32, f32),
}

/// Axis of a plant.
pub(super) struct Axis {
    /// One point per layer and the direction of the axis there.
    nodes: Vec<(Vec3, Vec3)>,
    radii: Vec<f32>,
    section: Section,
    /// Position of each node on the plant's stems.
    on: Vec<StemPosition>,
    /// Ratio of the height of the crown's dome to its radius; 0 where a stem continues.
    crown: f32,
}

impl Axis {
    /// Returns the seat of a leaf: just inside the stem's surface, on the leaf's side.
    pub(super) fn seat(&self, leaf: &LeafState<'_>) -> Seat {
        let last = self.nodes.len().saturating_sub(1);
        let (point, axis) = self.nodes[leaf.layer.min(last)];
        let out = direction(FRAC_PI_2, leaf.azimuth);
        let share = leaf.layer.to_f32() / last.max(1).to_f32();
        let r = self.radii[leaf.layer.min(last)] * lerp(self.section.seat.0, self.section.seat.1, share);
        // On a crown the younger leaves sit higher up the dome, just under its surface.
        let whole = self.radii[0];
        let lift = whole * (self.crown * (1.0 - (r / whole).powi(2)).max(0.0).sqrt() - 0.1 * self.crown);
        let on = self.on.get(leaf.layer.min(last)).copied();
        Seat { point: point + (out - axis * out.dot(axis)) * r + axis * lift, axis, out, on }
    }
}

/// Base of a stem: where it leaves the soil, and its size.
#[derive(Clone, Debug)]
pub(super) struct StemBase {
    /// Position, metres.
    pub(super) point: Vec3,
    /// Direction of the stem there, unit vector.
    pub(super) along: Vec3,
    /// Ratio of its sizes to those of the first stem.
    pub(super) size: f32,
    /// Depth of its buried part, metres.
    pub(super) root: f32,
    /// Random stream of its hypocotyl.
    pub(super) stream: Stream,
}

impl StemBase {
    /// Returns the base of a plant's first stem.
    pub(super) fn first(growth: &Growth<'_>, along: Vec3) -> Self {
        Self { point: Vec3::ZERO, along, size: 1.0, root: ROOT, stream: growth.stream.child(Purpose::Plant, 2) }
    }
}

/// Builds the hypocotyl and the first stem.
pub(super) fn grow(organs: &mut Vec<Organ>, growth: &Growth<'_>, section: Section) -> Axis {
    let mut stream = growth.stream.child(Purpose::Plant, 1);
    let lean = growth.lean(&mut stream);
    let towards = stream.range32(0.0, TAU);
    stem(organs, growth, section, StemBase::first(growth, direction(lean, towards)), &mut stream)
}

/// Builds the hypocotyl and the stem from a base. The directions of the internodes are drawn from `stream`.
pub(super) fn stem(
    organs: &mut Vec<Organ>,
    growth: &Growth<'_>,
    section: Section,
    foot: StemBase,
    stream: &mut Stream,
) -> Axis {
    let mut direction_now = foot.along;
    let radius = (0.5 * growth.stem * foot.size).max(2e-4);
    let base = foot.point + direction_now * (growth.hypocotyl * foot.size);
    let top_rise = growth.rise.last().copied().unwrap_or(0.0) * foot.size;
    let (mut nodes, mut radii) = (Vec::new(), Vec::new());
    let (mut point, mut below) = (base, 0.0);
    // A crown's short internodes make its dome higher; its leaves are seated on the dome.
    let stemless = top_rise < radius;
    let crown = if stemless { CROWN + top_rise / radius } else { 0.0 };
    for rise in &growth.rise {
        let rise = &if stemless { 0.0 } else { *rise * foot.size };
        point += direction_now * (rise - below);
        let share = if top_rise > 0.0 { rise / top_rise } else { 0.0 };
        nodes.push((point, direction_now));
        radii.push(radius * lerp(1.0, section.taper, share));
        // Each internode strays a little and turns back towards the light.
        let wander = vec3(stream.normal().to_f32(), stream.normal().to_f32(), 0.0)
            * if *rise > below { section.wander } else { 0.0 };
        direction_now = (direction_now + wander + Vec3::Z * (0.8 * section.wander)).normalize_or(Vec3::Z);
        below = *rise;
    }
    if nodes.is_empty() {
        nodes.push((base, direction_now));
        radii.push(radius);
    }
    let foot = hypocotyl(organs, growth, foot, radius);
    let mut rings: Vec<Ring> = Vec::with_capacity(2 * nodes.len() + 4);
    if stemless {
        // Leaf bases enclose a crown: it is green like them, even if the hypocotyl below is red.
        let (base, along) = nodes[0];
        rings.push(ring(base - along * (0.5 * radius), along, radius, Profile::Channelled(1.0)));
        rings.push(ring(base, along, 1.04 * radius, Profile::Channelled(1.0)));
        dome(&mut rings, along, 1.04 * radius, crown);
    } else {
        for (i, ((p, d), r)) in nodes.iter().zip(&radii).enumerate() {
            if i > 0 && p.distance(nodes[i - 1].0) < 1e-5 {
                continue;
            }
            // Nodes are a little thicker than the stem between them.
            rings.push(ring(*p - *d * (1.2 * r), *d, *r, section.profile));
            rings.push(ring(*p, *d, 1.12 * r, section.profile));
        }
        // The first ring sinks into the hypocotyl, so the joint shows no gap.
        if let (Some((_, d)), Some(r)) = (nodes.last(), radii.last()) {
            dome(&mut rings, *d, *r, 1.0);
        }
    }
    let mesh = tube::rigid(&rings, tube::sides(radius, if stemless { 10 } else { 12 }, growth.cell()));
    let material = material(&growth.desc.stem_material);
    let on = if stemless {
        let carried = vec![StemVertices { corners: mesh.positions.len(), line: foot.line, at: Some(foot.at) }];
        organs.push(Organ {
            kind: OrganKind::Stem,
            leaf: 0,
            material,
            senescence: 0.0,
            mesh,
            axis: None,
            lines: Vec::new(),
            carried,
        });
        vec![foot; nodes.len()]
    } else {
        let number = organ::next_line(organs);
        let line = StemLine { number, points: nodes.iter().map(|(point, _)| *point).collect(), on: Some(foot) };
        organs.push(Organ::stem(OrganKind::Stem, material, mesh, line));
        (0..nodes.len()).map(|k| StemPosition { line: number, at: k.to_f32() }).collect()
    };
    Axis { nodes, radii, section, on, crown }
}

/// Returns the name of the material as written, or `stalk` if it is empty.
pub(super) fn material(own: &str) -> String {
    if own.is_empty() { "stalk".to_owned() } else { own.to_owned() }
}

/// Adds the hypocotyl from its base upwards: round, with this radius at both ends. A slender hypocotyl is slightly
/// bowed and thinner in its middle, as it is after emergence. Returns the position of its upper end.
pub(super) fn hypocotyl(organs: &mut Vec<Organ>, growth: &Growth<'_>, foot: StemBase, radius: f32) -> StemPosition {
    let StemBase { point, along, size, root, mut stream } = foot;
    let length = growth.hypocotyl * size;
    let side = along.cross(direction(FRAC_PI_2, stream.range32(0.0, TAU))).normalize_or(Vec3::X);
    let bow = 0.05 * stream.normal().clamp(-2.0, 2.0).to_f32() * length;
    let slender = smoothstep(2.0, 6.0, length / (2.0 * radius));
    let below = -root / along.z.max(0.3);
    let mut rings = vec![ring(point + along * below, along, radius, Profile::Channelled(1.0))];
    for i in 0..=HYPOCOTYL {
        let s = i.to_f32() / HYPOCOTYL.to_f32();
        let centre = point + (along * (length * s) + side * (slender * bow * (PI * s).sin()));
        let direction = (along + side * (slender * PI * bow / length.max(1e-4) * (PI * s).cos())).normalize();
        let thick = 1.0 - 0.18 * slender * (PI * s).sin().max(0.0).powf(0.7);
        rings.push(ring(centre, direction, thick * radius, Profile::Channelled(1.0)));
    }
    dome(&mut rings, along, radius, 0.5);
    let (mesh, material) =
        (tube::rigid(&rings, tube::sides(radius, 10, growth.cell())), material(&growth.desc.hypocotyl_material));
    let line = StemLine { number: organ::next_line(organs), points: vec![point, point + along * length], on: None };
    let end = line.end();
    organs.push(Organ::stem(OrganKind::Hypocotyl, material, mesh, line));
    end
}

/// Returns a ring perpendicular to `along`.
pub(super) fn ring(centre: Vec3, along: Vec3, radius: f32, profile: Profile) -> Ring {
    let frame = Frame::with_tangent(along, Vec3::X);
    // up × right must point along the tube.
    Ring { centre, right: frame.x, up: -frame.y, radii: (radius, radius), profile }
}

/// Closes the last ring by half an ellipsoid; `height` is the ratio of its height to `radius`.
pub(super) fn dome(rings: &mut Vec<Ring>, along: Vec3, radius: f32, height: f32) {
    let Some(last) = rings.last().copied() else { return };
    for (rise, wide) in [(0.5, 0.87), (0.87, 0.5), (1.0, 0.02)] {
        let wide = radius * wide;
        rings.push(Ring { centre: last.centre + along * (radius * rise * height), radii: (wide, wide), ..last });
    }
}
