//! Venation: a midrib, secondary veins that curve towards the tip and loop along the margin, and a tree of finer veins
//! that grows towards points without a vein. Source: Runions et al. 2005, "Modeling and visualization of leaf venation
//! patterns" (open venation, without growth of the blade). Widths follow Murray's law, r³ = Σ rᵢ³.
//!
//! Coordinates as in [`super::shape`].

use super::shape::{Margin, Shape};
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec2, lerp, smoothstep, vec2};
use furrow_base::ron_file::{Count, Fraction, NonNegative, Num, PositiveCount};
use furrow_base::sampling::rng::{Purpose, Stream};
use serde::{Deserialize, Serialize};

/// Venation pattern of a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum Veins {
    /// Midrib with secondary veins on both sides.
    Pinnate {
        /// Pairs of secondary veins; 0 leaves only the midrib.
        pairs: Num<Count>,
        /// Angle between a secondary vein and the midrib at its foot, degrees.
        angle_deg: Num<NonNegative<360>>,
        /// Half-width of the midrib at the base, relative to the leaf's width.
        midrib: Num<Fraction>,
        /// Number of target points for finer veins; 0 for none.
        #[serde(default = "none")]
        fine: Num<Count>,
    },
    /// Parallel veins from base to tip, as in a grass.
    Parallel {
        /// Number of veins on each side of the midrib.
        count: Num<PositiveCount>,
        /// Half-width of the midrib at the base, relative to the leaf's width.
        midrib: Num<Fraction>,
    },
}

fn none() -> Num<Count> {
    Num::new(0.0)
}

/// Straight piece of a vein.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment {
    pub(super) from: Vec2,
    pub(super) to: Vec2,
    /// Half-widths at both ends, in leaf lengths.
    pub(super) radius: (f32, f32),
    /// 1 for the midrib, 2 for secondary veins, 3 for all finer veins.
    pub(super) order: u8,
}

/// Generates all veins of a leaf.
pub(super) fn grow(veins: &Veins, shape: &Shape, aspect: f32, margin: Margin, stream: &Stream) -> Vec<Segment> {
    match *veins {
        Veins::Pinnate { pairs, angle_deg, midrib, fine } => {
            let mut segments = midvein(midrib.f32() * aspect, stream);
            along_lobes(&mut segments, shape, midrib.f32() * aspect);
            // Secondary veins are on the terminal blade of a lyrate leaf, on the whole blade of an unlobed leaf, and
            // absent in a pinnatifid one.
            let foot = match margin {
                Margin::Lobed(_) => None,
                Margin::Lyrate(plan) => Some(1.0 - plan.terminal.f32()),
                _ => Some(shape.sinus_depth()),
            };
            if let Some(foot) = foot {
                let pairs = pairs.get().trunc_to::<usize>();
                secondaries(&mut segments, shape, (pairs, foot), angle_deg.f32(), midrib.f32() * aspect, stream);
            }
            let tree = branch(&segments, shape, fine.get().trunc_to::<usize>(), stream);
            segments.extend(tree);
            segments
        }
        Veins::Parallel { count, midrib } => {
            let mut segments = midvein(midrib.f32() * aspect, stream);
            let n = count.get().trunc_to::<usize>();
            for side in [-1.0, 1.0] {
                for i in 1..=n {
                    let share = side * i.to_f32() / (n.to_f32() + 0.6);
                    // Every fourth vein is stronger.
                    let radius = aspect * if i % 4 == 0 { 0.012 } else { 0.006 };
                    let at = |k: usize| {
                        let y = k.to_f32() / 200.0;
                        vec2(share * shape.half_width(y), y)
                    };
                    segments.extend((0..200).map(|k| Segment {
                        from: at(k),
                        to: at(k + 1),
                        radius: (radius, radius),
                        order: if i % 4 == 0 { 2 } else { 3 },
                    }));
                }
            }
            segments
        }
    }
}

fn midvein(radius: f32, stream: &Stream) -> Vec<Segment> {
    let mut s = stream.child(Purpose::Texture, 1);
    let (phase, wave) = (s.range32(0.0, 6.0), s.range32(0.6, 1.0) * 0.0022);
    let at = |y: f32| vec2(wave * (9.0 * y + phase).sin() * smoothstep(0.0, 0.3, y), y);
    let width = |y: f32| radius * ((1.0 - y).max(0.0).powf(1.25) + 0.07);
    (0..60)
        .map(|i| {
            let (a, b) = (i.to_f32() / 60.0 * 1.02 - 0.04, (i + 1).to_f32() / 60.0 * 1.02 - 0.04);
            Segment { from: at(a), to: at(b), radius: (width(a), width(b)), order: 1 }
        })
        .collect()
}

fn along_lobes(segments: &mut Vec<Segment>, shape: &Shape, midrib: f32) {
    for (foot, tip) in shape.lobe_axes() {
        if (tip.x - foot.x).abs() < 1e-4 {
            continue;
        }
        // The vein leaves the midrib slightly lower and curves into the lobe.
        let start = vec2(0.0, foot.y - 0.012);
        let at = |t: f32| start.lerp(tip, t) + vec2(0.0, -0.012 * (std::f32::consts::PI * t).sin());
        for i in 0..10 {
            let (a, b) = (i.to_f32() / 10.0, (i + 1).to_f32() / 10.0);
            let width = |t: f32| midrib * lerp(0.34, 0.06, t);
            segments.push(Segment { from: at(a), to: at(b), radius: (width(a), width(b)), order: 2 });
        }
    }
}

fn secondaries(
    out: &mut Vec<Segment>,
    shape: &Shape,
    (pairs, foot): (usize, f32),
    angle_deg: f32,
    midrib: f32,
    stream: &Stream,
) {
    for pair in 0..pairs {
        for side in 0..2 {
            let mut s = stream.child(Purpose::Texture, 100 + pair.to_u64() * 2 + side);
            let sign = if side == 0 { -1.0 } else { 1.0 };
            // Veins become denser towards the tip; left and right alternate by up to half the spacing.
            let even = (pair.to_f32() + 0.35 + 0.22 * sign + s.range32(-0.16, 0.16)) / pairs.to_f32();
            let base = shape.sinus_depth();
            let y = lerp(0.015_f32.max(foot), 0.9, even.clamp(0.0, 1.0).powf(1.12));
            // The lowest pair runs back into the lobes of a heart-shaped base.
            let back = if pair == 0 { 260.0 * base } else { 0.0 };
            let angle = (angle_deg * lerp(1.12, 0.8, y) + back + s.range32(-5.0, 5.0)).to_radians();
            let radius = midrib * lerp(0.42, 0.16, y) * s.range32(0.85, 1.1);
            let path = Path { sign, angle, curl: s.range32(0.32, 0.5), reach: s.range32(0.9, 0.95) };
            run(out, shape, &path, vec2(0.0, y), radius, 1, &mut s);
        }
    }
}

/// Course of a secondary vein.
#[derive(Clone, Copy)]
struct Path {
    sign: f32,
    angle: f32,
    curl: f32,
    /// Fraction of the half-width at which the vein ends.
    reach: f32,
}

/// Traces a secondary vein from its foot to near the margin; it may fork on the way.
fn run(out: &mut Vec<Segment>, shape: &Shape, path: &Path, foot: Vec2, radius: f32, forks: u32, s: &mut Stream) {
    const STEP: f32 = 0.008;
    let mut p = foot;
    let start = (p.x.abs() / shape.half_width(p.y).max(1e-4)).min(1.0);
    let (mut drift, mut forked) = (0.0f32, forks == 0);
    let fork_at = s.range32(0.42, 0.72);
    let mut last = radius;
    let mut along_margin = 0;
    for _ in 0..160 {
        let half = shape.half_width(p.y);
        let progress = p.x.abs() / half.max(1e-4);
        along_margin += u32::from(progress > 0.84);
        if progress > path.reach || p.y > 0.985 || half < 0.01 || along_margin > 12 {
            break;
        }
        drift = 0.9 * drift + s.range32(-0.07, 0.07);
        // Near the margin the vein turns along it, towards the next vein.
        let turn = path.curl * progress.powf(1.4) + 0.65 * smoothstep(0.74, 0.95, progress);
        let angle = path.angle * (1.0 - turn) + drift * 0.5;
        let next = p + vec2(path.sign * angle.sin(), angle.cos()) * STEP;
        let left = ((path.reach - progress) / (path.reach - start).max(0.05)).clamp(0.0, 1.0);
        let width = radius * lerp(0.16, 1.0, left);
        out.push(Segment { from: p, to: next, radius: (last, width), order: 2 });
        last = width;
        p = next;
        if !forked && progress > fork_at {
            forked = true;
            // The fork bends away from the tip, into the space below the vein's curve.
            let angle = angle + s.range32(0.45, 0.75);
            let fork = Path { angle, curl: path.curl * 0.9, reach: path.reach - 0.02, ..*path };
            run(out, shape, &fork, p, width * 0.62, 0, s);
        }
    }
}

/// Grows finer veins from the given ones to `count` points spread over the blade, in three generations of increasing
/// density. The first veins are therefore long and later ones branch off them, as in a growing leaf.
fn branch(segments: &[Segment], shape: &Shape, count: usize, stream: &Stream) -> Vec<Segment> {
    let mut s = stream.child(Purpose::Texture, 2);
    let finest = (1.0 / count.max(1).to_f32()).sqrt() * 0.5;
    let step = finest * 0.16;
    let mut nodes: Vec<Vec2> = Vec::new();
    for g in segments {
        let pieces = (g.from.distance(g.to) / step).ceil().max(1.0).trunc_to::<usize>();
        nodes.extend((0..pieces).map(|k| g.from.lerp(g.to, k.to_f32() / pieces.to_f32())));
    }
    let first = nodes.len();
    let mut parent = vec![usize::MAX; first];
    for share in [14, 4, 1] {
        let points = scatter(shape, count / share, &mut s);
        extend(&mut nodes, &mut parent, points, finest * share.to_f32().sqrt(), step, &mut s);
    }
    // Applies Murray's law from the tips backwards. The first nodes belong to veins with a known width.
    let mut cubes = vec![0.0f32; nodes.len()];
    for i in (first..nodes.len()).rev() {
        cubes[i] = cubes[i].max(1.0);
        if parent[i] >= first {
            cubes[parent[i]] += cubes[i] * 0.8;
        }
    }
    let thinnest = 0.0004;
    (first..nodes.len())
        .map(|i| {
            let radius = thinnest * cubes[i].cbrt().min(4.0);
            Segment { from: nodes[parent[i]], to: nodes[i], radius: (radius, radius), order: 3 }
        })
        .collect()
}

/// Grows nodes until every point has one within reach; each point attracts its nearest node.
fn extend(
    nodes: &mut Vec<Vec2>,
    parent: &mut Vec<usize>,
    mut points: Vec<Vec2>,
    spacing: f32,
    step: f32,
    s: &mut Stream,
) {
    let kill = (spacing * 0.3).max(step * 1.5);
    let mut grid = Grid::new(spacing);
    for (i, p) in nodes.iter().enumerate() {
        grid.add(i, *p);
    }
    points.retain(|q| grid.nearest(*q, nodes).is_none_or(|i| nodes[i].distance(*q) > kill));
    for _ in 0..240 {
        let mut pull: std::collections::BTreeMap<usize, Vec2> = std::collections::BTreeMap::new();
        for q in &points {
            if let Some(i) = grid.nearest(*q, nodes) {
                *pull.entry(i).or_default() += (*q - nodes[i]).normalize_or_zero();
            }
        }
        let before = nodes.len();
        for (i, direction) in pull {
            let wander = vec2(s.range32(-0.35, 0.35), s.range32(-0.35, 0.35));
            let p = nodes[i] + (direction.normalize_or_zero() + wander).normalize_or_zero() * step;
            grid.add(nodes.len(), p);
            nodes.push(p);
            parent.push(i);
        }
        points.retain(|q| !nodes[before..].iter().any(|p| p.distance_squared(*q) < kill * kill));
        if points.is_empty() || nodes.len() == before {
            break;
        }
    }
}

/// Samples up to `count` points in the blade with a minimum distance between them.
fn scatter(shape: &Shape, count: usize, s: &mut Stream) -> Vec<Vec2> {
    let mut points: Vec<Vec2> = Vec::with_capacity(count);
    let mut apart = (1.0 / count.max(1).to_f32()).sqrt() * 0.75;
    let mut misses = 0;
    let half = (0..50).map(|i| shape.half_width(i.to_f32() / 49.0)).fold(0.0, f32::max);
    // A blade that is too narrow for all points gets fewer.
    for _ in 0..count * 2000 {
        if points.len() == count {
            break;
        }
        let p = vec2(s.range32(-half, half), s.range32(0.0, 1.0));
        if shape.inside(p) > 0.004 && points.iter().all(|q| q.distance_squared(p) > apart * apart) {
            points.push(p);
            misses = 0;
        } else {
            misses += 1;
            if misses > 60 {
                apart *= 0.92;
                misses = 0;
            }
        }
    }
    points
}

/// Nodes by the grid cell that contains them.
struct Grid {
    size: f32,
    squares: std::collections::BTreeMap<(i32, i32), Vec<usize>>,
}

impl Grid {
    fn new(size: f32) -> Self {
        Self { size, squares: std::collections::BTreeMap::new() }
    }

    fn square(&self, p: Vec2) -> (i32, i32) {
        ((p.x / self.size).floor_to::<i32>(), (p.y / self.size).floor_to::<i32>())
    }

    fn add(&mut self, i: usize, p: Vec2) {
        self.squares.entry(self.square(p)).or_default().push(i);
    }

    /// Returns the nearest node within three cells.
    fn nearest(&self, p: Vec2, nodes: &[Vec2]) -> Option<usize> {
        let (cx, cy) = self.square(p);
        let mut best: Option<(f32, usize)> = None;
        for y in cy - 3..=cy + 3 {
            for x in cx - 3..=cx + 3 {
                for &i in self.squares.get(&(x, y)).into_iter().flatten() {
                    let d = nodes[i].distance_squared(p);
                    if best.is_none_or(|(b, _)| d < b) {
                        best = Some((d, i));
                    }
                }
            }
        }
        best.map(|(_, i)| i)
    }
}
