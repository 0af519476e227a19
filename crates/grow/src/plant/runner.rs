//! Plants with side shoots from their lowest axils, whose stems lie down when they become too long for their width:
//! chickweed, black bindweed, peanut.
//!
//! A stem supports itself up to about forty times its width ([`super::PlantDesc::lies_at`]). Beyond that it sinks and
//! creeps along the soil, and only its tip turns towards the light. A twining stem ([`super::twine`]) does not lie
//! down. Along a creeping stem the leaves turn to its two sides and face the sky, whatever their azimuth on it.

use super::axis;
use super::growth::{self, Growth, LeafState};
use super::leaf::{self, Lower, Seat};
use super::organ::{self, Organ, OrganKind, StemLine, StemPosition};
use super::stage::MOST_SHOOTS;
use super::tube::{self, Profile};
use super::twine::Helix;
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec2, Vec3, direction, lerp, smoothstep};
use furrow_base::sampling::{Purpose, Stream};
use std::f32::consts::{FRAC_PI_2, TAU};

/// Elevation angle of a sinking stem until the soil supports it, radians.
const CREEP: f32 = -0.35;
/// Ratio of a side shoot's size to the main shoot's: range drawn from.
const SIDE: (f32, f32) = (0.7, 0.95);
/// Angle between a side shoot and the vertical at its base, radians: range drawn from.
const SPREAD: (f32, f32) = (0.95, 1.3);
/// Number of rings of one internode.
const PIECES: usize = 4;
/// Ratio of a stem's width at the top to that at the base.
const TAPER: f32 = 0.6;
/// Index of a stem's child stream for its helix.
const TWINE: u64 = 1 << 16;
/// Ratio of the cells of a side shoot's blades to those of the main shoot's, larger because there are many of them.
const SIDE_CELL: f32 = 1.2;

/// A stem that has been built.
struct Stem {
    /// Number of its line among the plant's stems.
    line: u32,
    /// Nodes, where leaves sit: position, direction and radius of the stem.
    nodes: Vec<(Vec3, Vec3, f32)>,
}

impl Stem {
    /// Returns a node and its position on the plant's stems; the last node for an index beyond it.
    fn node(&self, node: usize) -> Option<((Vec3, Vec3, f32), StemPosition)> {
        let k = node.min(self.nodes.len().saturating_sub(1));
        // The line starts at the stem's base, before its first node.
        Some((*self.nodes.get(k)?, StemPosition { line: self.line, at: (k + 1).to_f32() }))
    }
}

/// Parameters of a growth form with side shoots.
#[derive(Clone, Copy, Debug)]
pub(super) struct ShootParameters {
    /// Cross-section of its stems.
    pub(super) profile: Profile,
    /// Number of vertices around its stems.
    pub(super) sides: u32,
    /// Whether leaves keep their place around a lying stem, instead of turning to its two sides.
    pub(super) whorled: bool,
    /// Standard deviation of a stem's turn to its left or right from one node to the next, radians.
    pub(super) swerve: f32,
}

/// Round stems whose leaves turn towards the light.
const HABIT: ShootParameters =
    ShootParameters { profile: Profile::Channelled(1.0), sides: 10, whorled: false, swerve: 0.16 };

/// Builds a plant.
pub(super) fn grow(growth: &Growth<'_>) -> Vec<Organ> {
    shoots(growth, HABIT)
}

/// Builds the main shoot, its side shoots and the side shoots of these.
pub(super) fn shoots(growth: &Growth<'_>, habit: ShootParameters) -> Vec<Organ> {
    let mut plant = ShootBuilder {
        organs: Vec::with_capacity(2 + 2 * growth.leaves.len() * (1 + growth.tillers.trunc_to::<usize>())),
        growth,
        habit,
        line: Vec2::ZERO,
    };
    let mut stream = growth.stream.child(Purpose::Plant, 1);
    let lean = growth.lean(&mut stream);
    let towards = stream.range32(0.0, TAU);
    let upright = direction(lean, towards);
    let radius = (0.5 * growth.stem).max(2e-4);
    let on = axis::hypocotyl(&mut plant.organs, growth, axis::StemBase::first(growth, upright), radius);
    let foot = StemBase { point: upright * growth.hypocotyl, along: upright, radius, length: growth.hypocotyl, on };
    plant.line = foot.point.truncate();
    let stem = plant.stem(&foot, &growth.rise, &mut stream);
    for leaf in &growth.leaves {
        plant.seat(leaf, &stem, leaf.layer);
    }
    let axils = axils(growth, habit);
    // The lowest axils sprout first.
    for ((k, there), axil) in growth::shoots(growth.tillers).zip(&axils) {
        let Some(above) = growth.numbers.side(k) else { break };
        let stream = growth.stream.child(Purpose::Plant, 100 + k.to_u64());
        let size = 0.95_f32.powi(k.to_i32()) * there;
        let Some(shoot) = plant.side(&stem, Axil { layer: axil.0, node: axil.0, azimuth: axil.1, size }, above, stream)
        else {
            continue;
        };
        // Its own lowest axils, from its second layer on, so that its side shoots are clear of the parent stem's leaves.
        let own = axils.iter().filter(|a| a.0 > axil.0 + 1);
        for ((m, there), (layer, azimuth)) in growth::shoots(growth.branches).zip(own) {
            let Some(above) = growth.numbers.branch(k, m) else { break };
            let stream = growth.stream.child(Purpose::Plant, 200 + (MOST_SHOOTS * k + m).to_u64());
            let azimuth = azimuth + shoot.turn;
            let axil = Axil { layer: *layer, node: layer - axil.0 - 1, azimuth, size: 0.8 * shoot.size * there };
            plant.side(&shoot.stem, axil, above, stream);
        }
    }
    plant.organs
}

/// Returns the layer and azimuth of each axil from below that has at least two younger layers above it; for a whorl,
/// one axil on each side.
fn axils(growth: &Growth<'_>, habit: ShootParameters) -> Vec<(usize, f32)> {
    let youngest = growth.leaves.iter().map(|l| l.layer).max().unwrap_or(0);
    let mut all = Vec::new();
    for layer in growth.axils.chunk_by(|a, b| a.0 == b.0) {
        let half = if habit.whorled { layer.len().div_ceil(2) } else { 1 };
        all.extend(layer.iter().step_by(half).filter(|a| a.0 + 2 <= youngest));
    }
    all
}

/// Base of a stem.
struct StemBase {
    point: Vec3,
    along: Vec3,
    radius: f32,
    /// Length of the stem below the base, metres; it counts towards the stem's slenderness.
    length: f32,
    /// Position on the plant's stems.
    on: StemPosition,
}

/// Axil of a side shoot: the layer of the plant, the node of the stem that bears it, its azimuth, and the ratio of its
/// size to the main shoot's.
#[derive(Clone, Copy)]
struct Axil {
    layer: usize,
    node: usize,
    azimuth: f32,
    size: f32,
}

/// Side shoot.
struct Shoot {
    stem: Stem,
    /// Offset added to the azimuths of its leaves.
    turn: f32,
    size: f32,
}

/// Builder of a plant.
struct ShootBuilder<'a> {
    organs: Vec<Organ>,
    growth: &'a Growth<'a>,
    habit: ShootParameters,
    /// Horizontal position of the main shoot, which twining shoots wind around, metres.
    line: Vec2,
}

impl ShootBuilder<'_> {
    /// Builds a stem. `rise` holds the positions of its nodes along it.
    fn stem(&mut self, foot: &StemBase, rise: &[f32], stream: &mut Stream) -> Stem {
        let ShootParameters { profile, sides, swerve, .. } = self.habit;
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
            let step = (rise - below) / pieces.to_f32();
            let (swerve, sway) = (swerve * stream.normal().to_f32(), 0.07 * stream.normal().to_f32());
            for piece in 1..=if step > 1e-6 { pieces } else { 0 } {
                let t = (below + step * piece.to_f32()) / whole;
                heading += swerve / pieces.to_f32();
                // An upright stem turns towards the light; a sinking one descends from its base, and only its tip rises.
                let stands = start + (1.0 - sunk) * 0.6 * t * start.cos();
                let lies = lerp(stands, CREEP, sunk * smoothstep(0.0, 0.45, t));
                let elevation = lies + sway + 1.1 * sunk * smoothstep(0.82, 1.0, t);
                // The stem must not enter the soil.
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

    /// Builds a leaf at a node.
    fn seat(&mut self, leaf: &LeafState<'_>, stem: &Stem, node: usize) {
        let Some(((point, along, radius), on)) = stem.node(node) else { return };
        let out = direction(FRAC_PI_2, leaf.azimuth);
        let (out, stands) = if self.habit.whorled {
            // Rotated with the stem by the smallest rotation from vertical; leaves that point into the soil are flattened.
            let out = out - (Vec3::Z + along) * (along.dot(out) / (1.0 + along.z).max(0.1));
            (out.with_z(out.z.max(-0.22)).normalize_or(out), along)
        } else {
            let lying = smoothstep(0.75, 0.3, along.z);
            let across = along.cross(Vec3::Z).normalize_or(out);
            let across = if across.dot(out) < 0.0 { -across } else { across };
            // Not quite perpendicular: leaves of a creeping stem lean towards its tip.
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

    /// Builds a side shoot in an axil: a smaller copy of the main shoot above that axil. `above` is added to its leaf
    /// numbers. Returns `None` if it is still hidden in the axil.
    fn side(&mut self, mother: &Stem, axil: Axil, above: u16, mut stream: Stream) -> Option<Shoot> {
        let growth = self.growth;
        let size = stream.range32(SIDE.0, SIDE.1) * axil.size;
        let ((point, along, radius), on) = mother.node(axil.node)?;
        let out = direction(FRAC_PI_2, axil.azimuth + stream.range32(-0.3, 0.3));
        let spread = stream.range32(SPREAD.0, SPREAD.1);
        let start = (Vec3::Z.lerp(along, 0.3) * spread.cos() + out * spread.sin()).normalize_or(out);
        let foot =
            StemBase { point: point + out * (0.3 * radius), along: start, radius: 0.8 * radius, length: 0.0, on };
        // It is younger than the main shoot: it lacks the cotyledons and all layers up to its axil.
        let skip = axil.layer + 1;
        let shift = growth.rise.get(axil.layer).copied().unwrap_or(0.0);
        let rise: Vec<f32> = growth.rise[skip.min(growth.rise.len())..].iter().map(|r| (r - shift) * size).collect();
        // A very small shoot is still hidden in its axil.
        if rise.is_empty() || size < 0.02 {
            return None;
        }
        let stem = self.stem(&foot, &rise, &mut stream);
        let turn = stream.range32(0.0, TAU);
        for leaf in growth.leaves.iter().filter(|l| l.layer >= skip && l.blade * size >= super::stage::BUD) {
            let number = leaf.number + above;
            let leaf = LeafState {
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
