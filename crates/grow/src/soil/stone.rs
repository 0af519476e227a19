//! Stones: worn bodies, placed before anything else.

use super::body::{self, Placed, Pose, Shape, ShapeParameters};
use super::stone_cover::{cover, own};
use super::{Debris, DebrisKind, Ground, Pile, Rect, StonesDesc, cell_stream, cells};
use furrow_base::geometry::{Cost, Mesh};
use furrow_base::math::{RoundTo, ToFloat, Vec2, vec2, vec3};
use furrow_base::sampling::{Purpose, Stream};
use furrow_optics::optics::Rock;

/// Shape parameters of stones.
const CUT: ShapeParameters =
    ShapeParameters { planes: (5, 9), distance: (0.7, 1.0), sharpness: (4.0, 9.0), lumps: 0.12, rough: 0.04 };

/// Ratios of the middle to the long axis and of the short to the middle axis: an estimate for field stones.
const AXES: (f32, f32) = (0.75, 0.65);

/// Standard deviation of the distance of a group's pieces along each axis, in lengths of its first piece. Estimated by
/// eye from fertiliser on images of a robot.
const APART: f32 = 0.8;

/// Core seconds per triangle of a shape, for the noise at its vertices.
const SHAPE_SECONDS: f64 = 1e-6;

/// Side of the cells that address the stones, metres.
const CELL_M: f32 = 0.1;

/// Places all populations of stones of a scene file on the pile, largest first within each.
pub fn stones(desc: &[StonesDesc], ground: &Ground, pile: &mut Pile, stream: &Stream) -> Vec<Debris> {
    let mut all = Vec::new();
    for (i, population) in desc.iter().enumerate() {
        let stream = own(stream, i);
        for (at, mm, mut s) in sizes(population, ground.area(), &stream) {
            if pile.given_up() {
                break;
            }
            all.push(stone(population, ground, pile, at, mm, &mut s));
        }
    }
    all
}

/// Draws a length in mm: lognormal, truncated.
fn length(desc: &StonesDesc, stream: &mut Stream) -> f32 {
    let (min, max) = (desc.min_mm.f32(), desc.max_mm.f32());
    for _ in 0..50 {
        let mm = desc.median_mm.f32() * (desc.sigma.f32() * stream.normal().to_f32()).exp();
        if mm >= min && mm <= max {
            return mm;
        }
    }
    desc.median_mm.f32().clamp(min, max.max(min))
}

/// Returns the number of pieces of a group; `s` is the group's random stream.
fn together(desc: &StonesDesc, s: &Stream) -> u64 {
    desc.together.draw32(&mut s.child(Purpose::Page, 0)).trunc_to::<u64>()
}

/// Returns the number of groups of a population, m⁻², and the mean number of stones in one.
fn density(desc: &StonesDesc, stream: &Stream) -> (f32, f32) {
    let cover = cover(desc, stream);
    // Mean covered area of one stone, from 512 stones.
    let mut s = stream.child(Purpose::Page, 1);
    let disc = (0..512).map(|_| disc_m2(length(desc, &mut s))).sum::<f32>() / 512.0;
    let group = (0..512).map(|k| together(desc, &s.child(Purpose::Debris, k))).sum::<u64>().to_f32() / 512.0;
    // Discs fall independently: 1 − exp(−λ·disc) of the ground is covered. Stones of a group are assumed not to overlap.
    (-(1.0 - cover.min(0.98)).ln() / (disc * group), group)
}

/// Estimates the cost of a population on `area`, a fraction `made` of which gets meshes; `resolved_mm` is the smallest
/// resolved length, mm.
pub(super) fn cost(desc: &StonesDesc, (area, made): (Rect, f64), resolved_mm: f32, stream: &Stream) -> Cost {
    let (per_m2, group) = density(desc, stream);
    let number = f64::from(area.area()) * f64::from(per_m2) * f64::from(group);
    let mut s = stream.child(Purpose::Page, 2);
    let triangles =
        (0..512).map(|_| body::triangles(level(length(desc, &mut s), resolved_mm))).sum::<usize>().to_f64() / 512.0;
    // Each stone builds its whole shape; triangles below the ground are then left out of the mesh.
    Cost::of(0.75 * triangles, 1.0) * (number * made) + Cost::work(0.0, SHAPE_SECONDS * triangles * number)
}

/// Returns positions, lengths and streams of all stones, largest first.
fn sizes(desc: &StonesDesc, area: Rect, stream: &Stream) -> Vec<(Vec2, f32, Stream)> {
    let (per_m2, _) = density(desc, stream);
    let mut all = Vec::new();
    for (i, j) in cells(area, CELL_M) {
        let mut cell = cell_stream(stream, i, j);
        for k in 0..cell.poisson(f64::from(per_m2 * CELL_M * CELL_M)) {
            let mut s = cell.child(Purpose::Debris, k);
            let at = (vec2(i.to_f32(), j.to_f32()) + vec2(s.uniform32(), s.uniform32())) * CELL_M;
            let mm = length(desc, &mut s);
            for piece in 1..together(desc, &s) {
                let mut s = s.child(Purpose::Debris, piece);
                let apart = vec2(s.normal().to_f32(), s.normal().to_f32()) * (APART * 1e-3 * mm);
                let mm = length(desc, &mut s);
                if area.contains(at + apart) {
                    all.push((at + apart, mm, s));
                }
            }
            if area.contains(at) {
                all.push((at, mm, s));
            }
        }
    }
    all.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.x.total_cmp(&b.0.x)));
    all
}

/// Returns the area covered by a stone of a length.
fn disc_m2(mm: f32) -> f32 {
    std::f32::consts::FRAC_PI_4 * AXES.0 * (mm * 1e-3).powi(2)
}

/// Returns the level of detail of a stone. `resolved_mm` is the smallest resolved length, mm: about four triangles per such
/// length.
fn level(mm: f32, resolved_mm: f32) -> usize {
    let own = match mm {
        ..2.5 => 0,
        2.5..6.0 => 1,
        6.0..12.0 => 2,
        _ => 3,
    };
    // Without a smallest resolved length the ratio is infinite.
    let seen = match mm / resolved_mm {
        ..4.0 => 0,
        4.0..8.0 => 1,
        8.0..16.0 => 2,
        _ => 3,
    };
    own.min(seen)
}

fn stone(desc: &StonesDesc, ground: &Ground, pile: &mut Pile, at: Vec2, mm: f32, s: &mut Stream) -> Debris {
    let shape = Shape::new(level(mm, ground.sizes.resolved_mm), CUT, s);
    let mut vary = |mean: f32| (mean * (1.0 + 0.12 * s.normal().to_f32())).clamp(0.6 * mean, 1.0);
    let middle = vary(AXES.0);
    let axes = vec3(1.0, middle, middle * vary(AXES.1)) * (0.5e-3 * mm);
    let pose = Pose::lying(&shape, axes, 0.2, s);
    let sink = s.range32(0.2, 0.5);
    let (support, _) = pile.support(at, 0.5 * (axes.x + axes.y));
    let centre = at.extend(support - sink * (pose.high - pose.low) - pose.low);
    let mut mesh = Mesh::default();
    Placed::new(&shape, &pose, centre).emit(
        &mut mesh,
        &shape,
        |corners, _| corners.iter().any(|c| c.z >= ground.height(c.x, c.y) - 1e-3),
        |p, _| {
            let p = p.normalize_or(furrow_base::math::Vec3::Z);
            vec2(p.y.atan2(p.x) / std::f32::consts::TAU + 0.5, p.z.clamp(-1.0, 1.0).acos() / std::f32::consts::PI)
        },
    );
    pile.heap(at, pose.turn, 0.95 * axes.x, 0.95 * axes.y, support, centre.z + pose.high);
    Debris {
        kind: DebrisKind::Stone,
        mesh,
        albedo: rock(&desc.rocks, s).map_or(desc.albedo, Rock::reflectance),
        tint: (desc.tint_sigma.f32() * s.normal().to_f32()).exp(),
        hue: s.uniform32(),
        dust: desc.dust.draw32(s),
        centre,
        radius: axes.x,
    }
}

/// Draws the rock of a stone; `None` if the description lists none.
fn rock(rocks: &[Rock], s: &Stream) -> Option<Rock> {
    (!rocks.is_empty()).then(|| rocks[s.child(Purpose::Page, 1).index(rocks.len())])
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::ron_file::Vary;

    #[test]
    fn stones_cover_what_they_were_asked_to() {
        for cover in [0.01, 0.1] {
            let desc = StonesDesc { cover: Vary::fixed(cover), ..StonesDesc::default() };
            let area = Rect::new(0.0, 0.0, 5.0, 5.0);
            let all = sizes(&desc, area, &Stream::of(3, 0, Purpose::Test, 0));
            let sum: f32 = all.iter().map(|(_, mm, _)| disc_m2(*mm)).sum();
            let covered = 1.0 - (-sum / area.area()).exp();
            assert!((f64::from(covered) / cover - 1.0).abs() < 0.12, "{covered} for {cover}");
            assert!(all.iter().all(|(_, mm, _)| (5.0..=60.0).contains(mm)));
        }
    }

    /// Rationale: broken pieces lie in groups. Expected: with groups of four, the median distance to the nearest
    /// neighbour is below the 20 % quantile of that of single stones; the covered area is the same. Source: the scene
    /// file's definition.
    #[test]
    fn pieces_lie_together() {
        let area = Rect::new(0.0, 0.0, 4.0, 4.0);
        let lay = |together: f64, seed: u64| {
            let desc =
                StonesDesc { cover: Vary::fixed(0.01), together: Vary::fixed(together), ..StonesDesc::default() };
            sizes(&desc, area, &Stream::of(3, seed, Purpose::Test, 0))
        };
        let nearest = |all: &[(Vec2, f32, Stream)]| {
            let of = |(i, (p, ..)): (usize, &(Vec2, f32, Stream))| {
                let others = all.iter().enumerate().filter(|(k, _)| *k != i);
                others.map(|(_, (q, ..))| p.distance(*q)).fold(f32::INFINITY, f32::min)
            };
            let mut all: Vec<f32> = all.iter().enumerate().map(of).collect();
            all.sort_by(f32::total_cmp);
            all
        };
        let covered =
            |all: &[(Vec2, f32, Stream)]| all.iter().map(|(_, mm, _)| disc_m2(*mm)).sum::<f32>() / area.area();
        // The cover of one field varies by a tenth if stones are grouped.
        let cover = |together: f64| (0..16).map(|seed| covered(&lay(together, seed))).sum::<f32>() / 16.0;
        let (even, clustered) = (cover(1.0), cover(4.0));
        assert!((clustered / even - 1.0).abs() < 0.12, "{clustered} {even}");
        let (alone, grouped) = (lay(1.0, 0), lay(4.0, 0));
        let (a, b) = (nearest(&alone), nearest(&grouped));
        assert!(b[b.len() / 2] < a[a.len() / 5], "{} {}", b[b.len() / 2], a[a.len() / 5]);
    }
}
