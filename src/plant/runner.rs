//! Plants with side shoots from their lowest axils, whose stems lie down when they are too long for their width: chickweed,
//! black bindweed, peanut.
//!
//! A stem carries itself up to some forty times its width ([`super::PlantDesc::lies_at`]); beyond that it sinks, creeps along the soil,
//! and only its tip turns to the light. A stem that twines ([`super::twine`]) does not lie. Along a creeping stem leaves turn to its two sides and face the sky, whatever their place on it.

use super::axis;
use super::growth::{self, Growth, LeafNow};
use super::leaf::{self, Lower, Seat};
use super::organ::{self, OnStem, Organ, OrganKind, StemLine};
use super::stage::MOST_SHOOTS;
use super::tube::{self, Profile};
use super::twine::Helix;
use crate::math::{Vec2, Vec3, direction, lerp, smoothstep};
use crate::sampling::{Purpose, Stream};
use std::f32::consts::{FRAC_PI_2, TAU};

/// Elevation of a stem that sinks, until the soil holds it, radians.
const CREEP: f32 = -0.35;
/// Size of a side shoot over that of the main one.
const SIDE: (f32, f32) = (0.7, 0.95);
/// Angle between upright and a side shoot at its foot, radians.
const SPREAD: (f32, f32) = (0.95, 1.3);
/// Rings of one internode.
const PIECES: usize = 4;
/// Width of a stem's top over that of its base.
const TAPER: f32 = 0.6;
/// Which of a stem's streams its helix is drawn from.
const TWINE: u64 = 1 << 16;
/// Cells of a side shoot's blades over those of the main shoot's: there are many of them.
const SIDE_CELL: f32 = 1.2;

/// A grown stem.
struct Stem {
    /// Its number among the plant's stems.
    line: u32,
    /// Its nodes: where leaves sit, and the stem's direction and radius there.
    nodes: Vec<(Vec3, Vec3, f32)>,
}

impl Stem {
    /// A node, and where it is on the plant's stems; the last one beyond it.
    fn node(&self, node: usize) -> Option<((Vec3, Vec3, f32), OnStem)> {
        let k = node.min(self.nodes.len().saturating_sub(1));
        // Its line begins at its foot, before its first node.
        Some((*self.nodes.get(k)?, OnStem { line: self.line, at: (k + 1) as f32 }))
    }
}

/// How a plant of side shoots is built.
#[derive(Clone, Copy, Debug)]
pub(super) struct Habit {
    /// Cross-section of its stems.
    pub(super) profile: Profile,
    /// Corners round them.
    pub(super) sides: u32,
    /// Whether leaves stay where they stand round a lying stem, instead of turning to its two sides.
    pub(super) whorled: bool,
    /// Standard deviation of a stem's turn to its left or right from one node to the next, radians.
    pub(super) swerve: f32,
}

/// Round stems whose leaves turn to the light.
const HABIT: Habit = Habit { profile: Profile::Channelled(1.0), sides: 10, whorled: false, swerve: 0.16 };

/// Grows a plant.
pub(super) fn grow(growth: &Growth<'_>) -> Vec<Organ> {
    shoots(growth, HABIT)
}

/// The main shoot, its side shoots, and theirs.
pub(super) fn shoots(growth: &Growth<'_>, habit: Habit) -> Vec<Organ> {
    let mut plant = Shoots {
        organs: Vec::with_capacity(2 + 2 * growth.leaves.len() * (1 + growth.tillers as usize)),
        growth,
        habit,
        line: Vec2::ZERO,
    };
    let mut stream = growth.stream.child(Purpose::Plant, 1);
    let lean = growth.lean(&mut stream);
    let towards = stream.range32(0.0, TAU);
    let upright = direction(lean, towards);
    let radius = (0.5 * growth.stem).max(2e-4);
    let on = axis::hypocotyl(&mut plant.organs, growth, axis::Foot::first(growth, upright), radius);
    let foot = Foot { point: upright * growth.hypocotyl, along: upright, radius, length: growth.hypocotyl, on };
    plant.line = foot.point.truncate();
    let stem = plant.stem(&foot, &growth.rise, &mut stream);
    for leaf in &growth.leaves {
        plant.seat(leaf, &stem, leaf.layer);
    }
    let axils = axils(growth, habit);
    // The lowest axils break first.
    for ((k, there), axil) in growth::shoots(growth.tillers).zip(&axils) {
        let Some(above) = growth.numbers.side(k) else { break };
        let stream = growth.stream.child(Purpose::Plant, 100 + k as u64);
        let size = 0.95_f32.powi(k as i32) * there;
        let Some(shoot) = plant.side(&stem, Axil { layer: axil.0, node: axil.0, azimuth: axil.1, size }, above, stream)
        else {
            continue;
        };
        // Its own lowest axils, from its second layer on, so that it has left its mother's leaves behind.
        let own = axils.iter().filter(|a| a.0 > axil.0 + 1);
        for ((m, there), (layer, azimuth)) in growth::shoots(growth.branches).zip(own) {
            let Some(above) = growth.numbers.branch(k, m) else { break };
            let stream = growth.stream.child(Purpose::Plant, 200 + (MOST_SHOOTS * k + m) as u64);
            let azimuth = azimuth + shoot.turn;
            let axil = Axil { layer: *layer, node: layer - axil.0 - 1, azimuth, size: 0.8 * shoot.size * there };
            plant.side(&shoot.stem, axil, above, stream);
        }
    }
    plant.organs
}

/// Layer and azimuth of each axil from below, as far as leaves above it have grown; of a whorl one axil on each side.
fn axils(growth: &Growth<'_>, habit: Habit) -> Vec<(usize, f32)> {
    let youngest = growth.leaves.iter().map(|l| l.layer).max().unwrap_or(0);
    let mut all = Vec::new();
    for layer in growth.axils.chunk_by(|a, b| a.0 == b.0) {
        let half = if habit.whorled { layer.len().div_ceil(2) } else { 1 };
        all.extend(layer.iter().step_by(half).filter(|a| a.0 + 2 <= youngest));
    }
    all
}

/// Where a stem begins.
struct Foot {
    point: Vec3,
    along: Vec3,
    radius: f32,
    /// Length of the stem below it, metres: it is carried too.
    length: f32,
    /// Where that is on the plant's stems.
    on: OnStem,
}

/// Where a side shoot begins: its layer of the plant, the node of the stem that bears it, its azimuth, and its size over that of the main
/// shoot.
#[derive(Clone, Copy)]
struct Axil {
    layer: usize,
    node: usize,
    azimuth: f32,
    size: f32,
}

/// A side shoot.
struct Shoot {
    stem: Stem,
    /// What is added to its leaves' azimuths.
    turn: f32,
    size: f32,
}

/// A plant while it grows.
struct Shoots<'a> {
    organs: Vec<Organ>,
    growth: &'a Growth<'a>,
    habit: Habit,
    /// Where the main shoot stands; what twines winds round it, metres.
    line: Vec2,
}

impl Shoots<'_> {
    /// Grows a stem through nodes at these lengths along it.
    fn stem(&mut self, foot: &Foot, rise: &[f32], stream: &mut Stream) -> Stem {
        let Habit { profile, sides, swerve, .. } = self.habit;
        let (sinks, lies) = (self.growth.desc.lies_at.0.f32(), self.growth.desc.lies_at.1.f32());
        let whole = rise.last().copied().unwrap_or(0.0);
        let sunk = smoothstep(sinks, lies, (foot.length + whole) / (2.0 * foot.radius));
        let mut own = stream.child(Purpose::Plant, TWINE);
        let helix = self.growth.desc.twine.as_ref().and_then(|twine| Helix::draw(twine, self.line, &mut own));
        let start = foot.along.z.clamp(-1.0, 1.0).asin();
        let mut heading = foot.along.x.atan2(foot.along.y);
        let (mut point, mut along, mut below) = (foot.point, foot.along, 0.0);
        let (mut nodes, mut rings) = (Vec::new(), Vec::new());
        rings.push(axis::ring(point - along * (1.2 * foot.radius), along, foot.radius, profile));
        for rise in rise {
            let radius = foot.radius * lerp(1.0, TAPER, if whole > 0.0 { rise / whole } else { 0.0 });
            let pieces = helix.map_or(PIECES, |helix| helix.steps(rise - below).max(PIECES));
            let step = (rise - below) / pieces as f32;
            let (swerve, sway) = (swerve * stream.normal() as f32, 0.07 * stream.normal() as f32);
            for piece in 1..=if step > 1e-6 { pieces } else { 0 } {
                let t = (below + step * piece as f32) / whole;
                heading += swerve / pieces as f32;
                // What stands turns to the light as it grows; what sinks does so from its foot, and only its tip stands up again.
                let stands = start + (1.0 - sunk) * 0.6 * t * start.cos();
                let lies = lerp(stands, CREEP, sunk * smoothstep(0.0, 0.45, t));
                let elevation = lies + sway + 1.1 * sunk * smoothstep(0.82, 1.0, t);
                // It never goes into the soil.
                let floor = (1.5 * radius + 1e-3 - point.z) / step;
                let steep = elevation.min(FRAC_PI_2).sin().max(floor.clamp(-1.0, 0.5));
                along = match helix {
                    Some(helix) => helix.next(point, foot.along, t * whole, step),
                    None => direction(FRAC_PI_2 - steep.asin(), heading),
                };
                point += along * step;
                let thick = if piece == pieces { 1.12 } else { 1.0 };
                rings.push(axis::ring(point, along, thick * radius, profile));
            }
            nodes.push((point, along, radius));
            below = *rise;
        }
        let (_, _, radius) = nodes.last().copied().unwrap_or((point, along, foot.radius));
        axis::dome(&mut rings, along, radius, 1.0);
        let (mesh, material) = (
            tube::rigid(&rings, tube::sides(radius, sides, self.growth.cell())),
            axis::material(&self.growth.desc.stem_material),
        );
        let points = std::iter::once(foot.point).chain(nodes.iter().map(|(point, ..)| *point)).collect();
        let line = organ::next_line(&self.organs);
        let middle = StemLine { number: line, points, on: Some(foot.on) };
        self.organs.push(Organ::stem(OrganKind::Stem, material, mesh, middle));
        Stem { line, nodes }
    }

    /// Seats a leaf at a node and grows it.
    fn seat(&mut self, leaf: &LeafNow<'_>, stem: &Stem, node: usize) {
        let Some(((point, along, radius), on)) = stem.node(node) else { return };
        let out = direction(FRAC_PI_2, leaf.azimuth);
        let (out, stands) = if self.habit.whorled {
            // Carried over with the stem by the shortest turn from upright; what would point into the soil is pressed aside.
            let out = out - (Vec3::Z + along) * (along.dot(out) / (1.0 + along.z).max(0.1));
            (out.with_z(out.z.max(-0.22)).normalize_or(out), along)
        } else {
            let lying = smoothstep(0.75, 0.3, along.z);
            let across = along.cross(Vec3::Z).normalize_or(out);
            let across = if across.dot(out) < 0.0 { -across } else { across };
            // Not quite across: leaves of a creeping stem lean to its tip.
            let across = (across + along.with_z(0.0) * 0.35).normalize_or(across);
            (out.lerp(across, lying).normalize_or(out), along.lerp(Vec3::Z, lying).normalize_or(Vec3::Z))
        };
        let level = (out - along * out.dot(along)).normalize_or(out);
        leaf::grow(
            &mut self.organs,
            leaf,
            Seat { point: point + level * (0.6 * radius), axis: stands, out, on: Some(on) },
            Lower::Petiole,
        );
    }

    /// One side shoot from an axil: the main one's leaves above it, smaller; `above` is added to their numbers.
    fn side(&mut self, mother: &Stem, axil: Axil, above: u16, mut stream: Stream) -> Option<Shoot> {
        let growth = self.growth;
        let size = stream.range32(SIDE.0, SIDE.1) * axil.size;
        let ((point, along, radius), on) = mother.node(axil.node)?;
        let out = direction(FRAC_PI_2, axil.azimuth + stream.range32(-0.3, 0.3));
        let spread = stream.range32(SPREAD.0, SPREAD.1);
        let start = (Vec3::Z.lerp(along, 0.3) * spread.cos() + out * spread.sin()).normalize_or(out);
        let foot = Foot { point: point + out * (0.3 * radius), along: start, radius: 0.8 * radius, length: 0.0, on };
        // It had less time than the main shoot: it lacks seed leaves and as many layers as stand below its axil.
        let skip = axil.layer + 1;
        let shift = growth.rise.get(axil.layer).copied().unwrap_or(0.0);
        let rise: Vec<f32> = growth.rise[skip.min(growth.rise.len())..].iter().map(|r| (r - shift) * size).collect();
        // A shoot that is hardly there yet is hidden in its axil.
        if rise.is_empty() || size < 0.02 {
            return None;
        }
        let stem = self.stem(&foot, &rise, &mut stream);
        let turn = stream.range32(0.0, TAU);
        for leaf in growth.leaves.iter().filter(|l| l.layer >= skip && l.blade * size >= super::stage::BUD) {
            let number = leaf.number + above;
            let leaf = LeafNow {
                number,
                azimuth: leaf.azimuth + turn,
                blade: leaf.blade * size,
                width: leaf.width * size,
                stalk: leaf.stalk * size,
                cell: leaf.cell * SIDE_CELL,
                stream: growth.stream.child(Purpose::Leaf, u64::from(number)),
                ..leaf.clone()
            };
            self.seat(&leaf, &stem, leaf.layer - skip);
        }
        Some(Shoot { stem, turn, size })
    }
}
