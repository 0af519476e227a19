//! Plants with side shoots from their lowest axils, whose stems lie down when they are too long for their width: chickweed,
//! black bindweed, peanut.
//!
//! A stem carries itself up to some forty times its width; beyond that it sinks, creeps along the soil, and only its tip
//! turns to the light. Along a creeping stem leaves turn to its two sides and face the sky, whatever their place on it.

use super::axis::{self, ROOT};
use super::growth::{Growth, LeafNow};
use super::leaf::{self, Lower, Seat};
use super::organ::{Organ, OrganKind};
use super::tube::{self, Profile, Ring};
use crate::math::{Vec3, direction, lerp, smoothstep};
use crate::sampling::{Purpose, Stream};
use std::f32::consts::{FRAC_PI_2, TAU};

/// Length over width of a stem that begins to sink, and of one that lies.
const SLENDER: (f32, f32) = (40.0, 105.0);
/// Elevation of a stem that sinks, until the soil holds it, radians.
const CREEP: f32 = -0.35;
/// Size of a side shoot over that of the main one.
const SIDE: (f32, f32) = (0.7, 0.95);
/// Angle between upright and a side shoot at its foot, radians.
const SPREAD: (f32, f32) = (0.95, 1.3);
/// Side shoots stop here, whatever a species file asks for.
const MOST: usize = 24;
/// Rings of one internode.
const PIECES: usize = 4;
/// Width of a stem's top over that of its base.
const TAPER: f32 = 0.6;

/// A stem's nodes: where leaves sit, and the stem's direction and radius there.
type Nodes = Vec<(Vec3, Vec3, f32)>;

/// Grows a plant.
pub(super) fn grow(growth: &Growth<'_>) -> Vec<Organ> {
    let mut organs = Vec::with_capacity(2 + 2 * growth.leaves.len() * (1 + growth.tillers.min(MOST)));
    let mut stream = growth.stream.child(Purpose::Plant, 1);
    let lean = growth.desc.lean_deg.draw32(&mut stream).to_radians();
    let towards = stream.range32(0.0, TAU);
    let upright = direction(lean, towards);
    let radius = (0.5 * growth.stem).max(2e-4);
    let foot = Foot { point: upright * growth.hypocotyl, along: upright, radius, length: growth.hypocotyl };
    hypocotyl(&mut organs, growth, &foot);
    let nodes = stem(&mut organs, growth, &foot, &growth.rise, &mut stream);
    for leaf in &growth.leaves {
        seat(&mut organs, leaf, &nodes, leaf.layer);
    }
    let mut number = growth.leaves.last().map_or(0, |leaf| leaf.number);
    // The lowest axils whose leaves are still there break first.
    for (k, axil) in axils(growth).into_iter().take(growth.tillers.min(MOST)).enumerate() {
        side(&mut organs, growth, &nodes, axil, k, &mut number);
    }
    organs
}

/// Where a stem begins.
struct Foot {
    point: Vec3,
    along: Vec3,
    radius: f32,
    /// Length of the stem below it, metres: it is carried too.
    length: f32,
}

fn material(own: &str) -> String {
    if own.is_empty() { "stalk".to_owned() } else { own.to_owned() }
}

fn hypocotyl(organs: &mut Vec<Organ>, growth: &Growth<'_>, foot: &Foot) {
    let below = -ROOT / foot.along.z.max(0.3);
    let heights = [below, 0.0, 0.5 * growth.hypocotyl, growth.hypocotyl];
    let ring = |h: f32| axis::ring(foot.along * h, foot.along, foot.radius, Profile::Channelled(1.0));
    let mut rings: Vec<Ring> = heights.into_iter().map(ring).collect();
    axis::dome(&mut rings, foot.along, foot.radius, 0.5);
    let (mesh, material) = (tube::rigid(&rings, 10), material(&growth.desc.hypocotyl_material));
    organs.push(Organ { kind: OrganKind::Hypocotyl, leaf: 0, material, mesh, axis: None });
}

/// Grows a stem through nodes at these lengths along it; returns them.
fn stem(organs: &mut Vec<Organ>, growth: &Growth<'_>, foot: &Foot, rise: &[f32], stream: &mut Stream) -> Nodes {
    let whole = rise.last().copied().unwrap_or(0.0);
    let sunk = smoothstep(SLENDER.0, SLENDER.1, (foot.length + whole) / (2.0 * foot.radius));
    let start = foot.along.z.clamp(-1.0, 1.0).asin();
    let mut heading = foot.along.x.atan2(foot.along.y);
    let (mut point, mut along, mut below) = (foot.point, foot.along, 0.0);
    let (mut nodes, mut rings) = (Nodes::new(), Vec::new());
    rings.push(axis::ring(point - along * (1.2 * foot.radius), along, foot.radius, Profile::Channelled(1.0)));
    for rise in rise {
        let radius = foot.radius * lerp(1.0, TAPER, if whole > 0.0 { rise / whole } else { 0.0 });
        let step = (rise - below) / PIECES as f32;
        let (swerve, sway) = (0.16 * stream.normal() as f32, 0.07 * stream.normal() as f32);
        for piece in 1..=if step > 1e-6 { PIECES } else { 0 } {
            let t = (below + step * piece as f32) / whole;
            heading += swerve / PIECES as f32;
            // What stands turns to the light as it grows; what sinks does so from its foot, and only its tip stands up again.
            let stands = start + (1.0 - sunk) * 0.6 * t * start.cos();
            let lies = lerp(stands, CREEP, sunk * smoothstep(0.0, 0.45, t));
            let elevation = lies + sway + 1.1 * sunk * smoothstep(0.82, 1.0, t);
            // It never goes into the soil.
            let floor = (1.5 * radius + 1e-3 - point.z) / step;
            let steep = elevation.min(FRAC_PI_2).sin().max(floor.clamp(-1.0, 0.5));
            along = direction(FRAC_PI_2 - steep.asin(), heading);
            point += along * step;
            let thick = if piece == PIECES { 1.12 } else { 1.0 };
            rings.push(axis::ring(point, along, thick * radius, Profile::Channelled(1.0)));
        }
        nodes.push((point, along, radius));
        below = *rise;
    }
    let (_, _, radius) = nodes.last().copied().unwrap_or((point, along, foot.radius));
    axis::dome(&mut rings, along, radius, 1.0);
    let (mesh, material) = (tube::rigid(&rings, 10), material(&growth.desc.stem_material));
    organs.push(Organ { kind: OrganKind::Stem, leaf: 0, material, mesh, axis: None });
    nodes
}

/// Seats a leaf at a node and grows it.
fn seat(organs: &mut Vec<Organ>, leaf: &LeafNow<'_>, nodes: &Nodes, node: usize) {
    let Some((point, along, radius)) = nodes.get(node.min(nodes.len().saturating_sub(1))).copied() else { return };
    let lying = smoothstep(0.75, 0.3, along.z);
    let out = direction(FRAC_PI_2, leaf.azimuth);
    let across = along.cross(Vec3::Z).normalize_or(out);
    let across = if across.dot(out) < 0.0 { -across } else { across };
    // Not quite across: leaves of a creeping stem lean to its tip.
    let across = (across + along.with_z(0.0) * 0.35).normalize_or(across);
    let out = out.lerp(across, lying).normalize_or(out);
    let stands = along.lerp(Vec3::Z, lying).normalize_or(Vec3::Z);
    let leaf = LeafNow { azimuth: out.x.atan2(out.y), ..leaf.clone() };
    let level = (out - along * out.dot(along)).normalize_or(out);
    leaf::grow(organs, &leaf, Seat { point: point + level * (0.6 * radius), axis: stands }, Lower::Petiole);
}

/// Layer and azimuth of each axil, from below.
fn axils(growth: &Growth<'_>) -> Vec<(usize, f32)> {
    let mut all: Vec<(usize, f32)> = growth.leaves.iter().map(|l| (l.layer, l.azimuth)).collect();
    let youngest = all.iter().map(|a| a.0).max().unwrap_or(0);
    all.retain(|a| a.0 + 2 <= youngest);
    all
}

/// One side shoot from an axil (layer, azimuth): the main one's leaves above it, smaller.
fn side(
    organs: &mut Vec<Organ>,
    growth: &Growth<'_>,
    nodes: &Nodes,
    (layer, azimuth): (usize, f32),
    k: usize,
    number: &mut u16,
) {
    let mut stream = growth.stream.child(Purpose::Plant, 100 + k as u64);
    let size = stream.range32(SIDE.0, SIDE.1) * 0.95_f32.powi(k as i32);
    let Some((point, along, radius)) = nodes.get(layer.min(nodes.len().saturating_sub(1))).copied() else { return };
    let out = direction(FRAC_PI_2, azimuth + stream.range32(-0.3, 0.3));
    let spread = stream.range32(SPREAD.0, SPREAD.1);
    let start = (Vec3::Z.lerp(along, 0.3) * spread.cos() + out * spread.sin()).normalize_or(out);
    let foot = Foot { point: point + out * (0.3 * radius), along: start, radius: 0.8 * radius, length: 0.0 };
    // It had less time than the main shoot: it lacks seed leaves and as many layers as stand below its axil.
    let skip = layer + 1;
    let shift = growth.rise.get(layer).copied().unwrap_or(0.0);
    let rise: Vec<f32> = growth.rise[skip.min(growth.rise.len())..].iter().map(|r| (r - shift) * size).collect();
    if rise.is_empty() {
        return;
    }
    let nodes = stem(organs, growth, &foot, &rise, &mut stream);
    let turn = stream.range32(0.0, TAU);
    for leaf in growth.leaves.iter().filter(|l| l.layer >= skip) {
        *number += 1;
        let leaf = LeafNow {
            number: *number,
            azimuth: leaf.azimuth + turn,
            blade: leaf.blade * size,
            width: leaf.width * size,
            stalk: leaf.stalk * size,
            stream: growth.stream.child(Purpose::Leaf, u64::from(*number)),
            ..leaf.clone()
        };
        if leaf.blade >= super::stage::BUD {
            seat(organs, &leaf, &nodes, leaf.layer - skip);
        } else {
            *number -= 1;
        }
    }
}
