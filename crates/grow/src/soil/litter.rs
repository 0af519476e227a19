//! Straw, sticks and bits of dead plants.
//!
//! All are sweeps of a closed cross-section along a bent path. A straw is a split stalk with a thick arc as its
//! section; a stick is tapered and round with stubs; a bit is a flat lens that curls, a thread of root or a crumb of
//! charcoal. The path is fitted to the pile: stiff pieces bridge hollows and touch the ground only in places. Straw lies in
//! mats, where its density is log-normal noise; stubble stands in the rows of the harvested crop.

use super::record::LitterRecord;
use super::{Debris, DebrisKind, Ground, LitterDesc, Pile, Rect, cell_stream, cells, residue};
use furrow_base::geometry::{Cost, Mesh};
use furrow_base::math::{RoundTo, Spectrum, ToFloat, ToInt, Vec2, Vec3, lerp, vec2};
use furrow_base::ron_file::{Positive, Vary};
use furrow_base::sampling::{Purpose, Stream};
use furrow_optics::texture::noise::Perlin;
use std::f32::consts::{PI, TAU};

/// Reflectance of wood: measured bark. The bits are rotten leaves, redder and darker.
const WOOD: Spectrum = Spectrum::new(0.22, 0.16, 0.12, 0.38);
const ROTTEN: Spectrum = Spectrum::new(0.20, 0.09, 0.05, 0.32);
/// Reflectance of dead roots, washed pale, and of charcoal: estimates.
const ROOT: Spectrum = Spectrum::new(0.34, 0.26, 0.17, 0.46);
const CHARCOAL: Spectrum = Spectrum::new(0.045, 0.042, 0.04, 0.06);

/// Fractions of the bits that are roots and that are charcoal, and width of a root relative to its length.
const ROOTS: f32 = 0.14;
const COALS: f32 = 0.05;
const THREAD: (f32, f32) = (0.03, 0.08);

/// Standard deviation of [`Perlin::fbm2`] with three octaves and gain 0.5, and limit of the mats' noise, standard deviations.
const FBM3_SD: f32 = 0.28;
const MOST_MAT: f32 = 2.0;

/// Stalks of one cereal plant, distance between them and from the row's line, and depth of their foot, metres.
const TILLERS: (f32, f32) = (1.0, 4.0);
const TUFT_M: f32 = 0.006;
const ROW_M: f32 = 0.012;
const FOOT_M: f32 = 0.003;
/// Standard deviation of the stubble's lean, and number of points along a stalk.
const LEAN: f32 = 0.25;
const STALK_POINTS: usize = 4;

/// Number of segments of the wall of straw and bits along its arc, and of vertices around sticks and stubs.
const PARTS: u8 = 6;
const ROUND: u8 = 8;
const STUB: u8 = 6;

/// Width above which sweeps have full detail, in smallest resolved lengths; narrower ones have fewer points and
/// vertices.
const FINE: f32 = 4.0;

/// For narrower sweeps: segments of the wall of straw and bits, vertices around sticks and stubs, and points of a path
/// per point that is kept.
const COARSE_PARTS: u8 = 2;
const COARSE_ROUND: u8 = 4;
const KEPT: usize = 3;

/// Number of points along the path of a stub and of a bit.
const STUB_POINTS: usize = 4;
const BIT_POINTS: usize = 6;

/// Core seconds to raise one cell of the pile.
const HEAP_SECONDS: f64 = 4e-9;

/// Returns the number of points along the path of a straw of `length` metres.
fn straw_points(length: f32) -> usize {
    (length / 0.004).trunc_to::<usize>().clamp(6, 24)
}

/// Returns the number of points along the path of a stick of `length` metres.
fn stick_points(length: f32) -> usize {
    (length / 0.005).trunc_to::<usize>().clamp(8, 32)
}

/// Level of detail of sweeps.
#[derive(Clone, Copy)]
struct Detail {
    /// Whether they have full detail.
    fine: bool,
}

impl Detail {
    /// Returns the level of detail for a width in millimetres; `resolved_mm` is the smallest resolved length, mm.
    fn of(width_mm: f32, resolved_mm: f32) -> Self {
        Self { fine: width_mm >= FINE * resolved_mm }
    }

    fn parts(self) -> u8 {
        if self.fine { PARTS } else { COARSE_PARTS }
    }

    /// Returns the number of vertices of a section that has `fine` of them at full detail.
    fn corners(self, fine: u8) -> u8 {
        if self.fine { fine } else { COARSE_ROUND }
    }

    /// Returns the number of vertices of a split stalk's section.
    fn arc(self) -> usize {
        2 * (usize::from(self.parts()) + 1)
    }

    /// Returns the number of points that are kept of a path of `fine` points.
    fn points(self, fine: usize) -> usize {
        if self.fine { fine } else { (fine - 1).div_ceil(KEPT) + 1 }
    }

    /// Returns the points of a path that are kept; the last one always is.
    fn thinned(self, path: &[Vec3]) -> Vec<Vec3> {
        let last = path.len() - 1;
        let kept = |i: &usize| self.fine || *i == last || i.is_multiple_of(KEPT);
        (0..=last).filter(kept).map(|i| path[i]).collect()
    }
}

/// Returns the number of triangles of a [`sweep`]: its wall and its two ends.
fn swept(points: usize, corners: usize) -> usize {
    2 * (points - 1) * corners + 2 * (corners - 2)
}

/// Side of the cells that address the litter, metres.
const CELL_M: f32 = 0.1;

/// Places the litter of a scene file on the pile.
pub fn litter(desc: &LitterDesc, ground: &Ground, pile: &mut Pile, stream: &Stream) -> Vec<Debris> {
    let mut all = Vec::new();
    let child = |k| own(stream, k);
    let drawn = LitterRecord::draw(desc, stream);
    let resolved_mm = ground.sizes.resolved_mm;
    let straws = straws_per_m2(desc, &drawn, stream);
    let mats = Mats::draw(desc, stream);
    for (kind, per_m2, k) in [
        (DebrisKind::Stick, drawn.sticks_per_m2, 4),
        (DebrisKind::Straw, straws, 5),
        (DebrisKind::Bit, drawn.bits_per_m2, 6),
    ] {
        let density = |p: Vec2| if kind == DebrisKind::Straw { mats.density(p) } else { 1.0 };
        for (at, mut s) in places(ground.area(), per_m2, density, &child(k)) {
            if pile.given_up() {
                break;
            }
            let thing = match kind {
                DebrisKind::Stick => stick(desc, resolved_mm, pile, at, &mut s),
                DebrisKind::Straw => straw(desc, (drawn.weathering, resolved_mm), pile, at, &mut s),
                _ => bit(desc, (drawn.weathering, resolved_mm), pile, at, &mut s),
            };
            all.push(Debris { dust: desc.dust.draw32(&mut s), ..thing });
        }
    }
    all.extend(stubble(desc, &drawn, resolved_mm, pile, stream));
    all
}

/// Mats of straw.
struct Mats {
    noise: Perlin,
    clustering: f32,
    size_m: f32,
}

impl Mats {
    fn draw(desc: &LitterDesc, stream: &Stream) -> Self {
        Self {
            noise: Perlin::new(own(stream, 9).seed32()),
            clustering: desc.straw_clustering.draw32(&mut own(stream, 10)),
            size_m: desc.straw_mat_m.draw32(&mut own(stream, 11)),
        }
    }

    /// Returns the density of straw at a point relative to its mean.
    fn density(&self, p: Vec2) -> f32 {
        let q = p / self.size_m + 0.43;
        let noise = self.noise.fbm2(f64::from(q.x), f64::from(q.y), 3, 0.5).to_f32() / FBM3_SD;
        (self.clustering * noise.clamp(-MOST_MAT, MOST_MAT) - 0.5 * self.clustering * self.clustering).exp()
    }
}

/// Places stubble: tufts of cut stalks in rows with a random direction.
fn stubble(desc: &LitterDesc, drawn: &LitterRecord, resolved_mm: f32, pile: &mut Pile, stream: &Stream) -> Vec<Debris> {
    let mut all = Vec::new();
    if drawn.stubble_per_m2 <= 0.0 {
        return all;
    }
    let mut field = own(stream, 12);
    let across = Vec2::from_angle(field.range32(0.0, PI));
    let apart = desc.stubble_rows_m.draw32(&mut field);
    let offset = apart * field.uniform32();
    let tillers = 0.5 * (TILLERS.0 + TILLERS.1);
    for (at, mut s) in places(pile.area(), drawn.stubble_per_m2 / tillers, |_| 1.0, &own(stream, 13)) {
        if pile.given_up() {
            break;
        }
        let aside = at.dot(across) - offset;
        let line = at + across * (apart * (aside / apart).round() - aside + ROW_M * s.normal().to_f32());
        for _ in 0..s.range32(TILLERS.0, TILLERS.1 + 1.0).trunc_to::<u8>() {
            let foot = line + vec2(s.normal().to_f32(), s.normal().to_f32()) * TUFT_M;
            if pile.area().contains(foot) {
                all.push(stalk(desc, (drawn.weathering, resolved_mm), pile, foot, &mut s));
            }
        }
    }
    all
}

/// Returns the number of straws, m⁻².
fn straws_per_m2(desc: &LitterDesc, drawn: &LitterRecord, stream: &Stream) -> f32 {
    // Straws differ in length and width; the mean area gives the number that reaches the requested cover.
    let mut s = own(stream, 1);
    let one = (0..256).map(|_| desc.straw_mm.draw32(&mut s) * desc.straw_width_mm.draw32(&mut s)).sum::<f32>() / 256e6;
    -(1.0 - drawn.straw_cover.min(0.95)).ln() / one
}

/// Estimates the costs of straw, sticks, bits and stubble on `area`, a fraction `made` of which gets meshes; `resolved_mm` is the
/// smallest resolved length, mm.
pub(super) fn costs(desc: &LitterDesc, (area, made): (Rect, f64), resolved_mm: f32, stream: &Stream) -> [Cost; 4] {
    let drawn = LitterRecord::draw(desc, stream);
    let s = own(stream, 8);
    let mean = |of: &dyn Fn(&mut Stream) -> usize| {
        (0..256).map(|k| of(&mut s.child(Purpose::Debris, k))).sum::<usize>().to_f64() / 256.0
    };
    let straw = mean(&|s| {
        let points = straw_points(desc.straw_mm.draw32(s) * 1e-3);
        let detail = Detail::of(desc.straw_width_mm.draw32(s), resolved_mm);
        swept(detail.points(points), detail.arc())
    });
    let stick = mean(&|s| {
        let points = stick_points(desc.stick_mm.draw32(s) * 1e-3);
        let detail = Detail::of(desc.stick_width_mm.draw32(s), resolved_mm);
        swept(detail.points(points), detail.corners(ROUND).into())
    });
    let stubs = mean(&|s| desc.stubs.draw(s).trunc_to::<usize>()) * swept(STUB_POINTS, STUB.into()).to_f64();
    let stalk = mean(&|s| {
        let detail = Detail::of(desc.straw_width_mm.draw32(s), resolved_mm);
        swept(STALK_POINTS, detail.arc())
    });
    let bit = mean(&|s| {
        let detail = Detail::of(0.3 * desc.bit_mm.draw32(s), resolved_mm);
        swept(detail.points(BIT_POINTS), detail.arc())
    });
    // Each piece raises the pile along its path.
    let heaps = |width_mm: f64, points: usize, number: f64| {
        let cells = (width_mm * 1e-3 / 1e-3).powi(2).min(f64::from(area.area()) / 1e-6);
        Cost::work(0.0, HEAP_SECONDS * cells * points.to_f64() * number)
    };
    let on_it = f64::from(area.area());
    let [straws, sticks, bits, stalks] =
        [straws_per_m2(desc, &drawn, stream), drawn.sticks_per_m2, drawn.bits_per_m2, drawn.stubble_per_m2]
            .map(|n| on_it * f64::from(n));
    let widest = |width: &Vary<Positive<1000>>| width.usual().1;
    [
        Cost::of(straw, 1.0) * (straws * made) + heaps(widest(&desc.straw_width_mm), 24, straws),
        Cost::of(stick + stubs, 1.0) * (sticks * made) + heaps(widest(&desc.stick_width_mm), 32, sticks),
        Cost::of(bit, 1.0) * (bits * made),
        Cost::of(stalk, 1.0) * (stalks * made),
    ]
}

/// Returns the k-th random stream of the litter.
fn own(stream: &Stream, k: u64) -> Stream {
    stream.child(Purpose::Debris, 300 + k)
}

impl LitterRecord {
    /// Draws the amounts of litter of a field; `stream` is that of its litter.
    pub(super) fn draw(desc: &LitterDesc, stream: &Stream) -> Self {
        Self {
            straw_cover: desc.straw_cover.draw32(&mut own(stream, 2)),
            sticks_per_m2: desc.sticks_per_m2.draw32(&mut own(stream, 0)),
            bits_per_m2: desc.bits_per_m2.draw32(&mut own(stream, 3)),
            stubble_per_m2: desc.stubble_per_m2.draw32(&mut own(stream, 8).child(Purpose::Page, 0)),
            weathering: desc.weathering.draw32(&mut own(stream, 7)),
        }
    }
}

/// Draws the places of pieces, with the random stream of each. `density` returns their density at a point relative to the
/// mean `per_m2`.
fn places(area: Rect, per_m2: f32, density: impl Fn(Vec2) -> f32, stream: &Stream) -> Vec<(Vec2, Stream)> {
    let mut all = Vec::new();
    for (i, j) in cells(area, CELL_M) {
        let mut cell = cell_stream(stream, i, j);
        let here = per_m2 * density(vec2(i.to_f32() + 0.5, j.to_f32() + 0.5) * CELL_M);
        for k in 0..cell.poisson(f64::from(here * CELL_M * CELL_M)) {
            let mut s = cell.child(Purpose::Debris, k);
            let at = (vec2(i.to_f32(), j.to_f32()) + vec2(s.uniform32(), s.uniform32())) * CELL_M;
            if area.contains(at) {
                all.push((at, s));
            }
        }
    }
    all
}

/// Draws a path of `n` points and length `length` through `at`, bent in the plane by about `bend` radians in total.
fn path(at: Vec2, length: f32, bend: f32, n: usize, s: &mut Stream) -> Vec<Vec2> {
    let mut heading = s.range32(0.0, TAU);
    let turn = bend * s.normal().to_f32() / n.to_f32();
    let kink = (s.index(n), bend * s.normal().to_f32());
    let mut points = vec![Vec2::ZERO];
    for i in 1..n {
        heading += turn + if i == kink.0 { kink.1 } else { 0.0 };
        points.push(points[i - 1] + Vec2::from_angle(heading) * (length / (n - 1).to_f32()));
    }
    let middle = points.iter().sum::<Vec2>() / n.to_f32();
    points.iter().map(|p| *p - middle + at).collect()
}

/// Places a path of half-thickness `half` on the pile. With `stiff` = 1 it bridges hollows, with 0 it follows the
/// ground.
fn lay(points: &[Vec2], half: f32, stiff: f32, pile: &Pile) -> Vec<Vec3> {
    let n = points.len().to_f32();
    let under: Vec<f32> = points.iter().map(|p| pile.at(*p)).collect();
    // Straight line fitted to the surface below, raised until a quarter of its points touch.
    let mean = under.iter().sum::<f32>() / n;
    let t = |i: usize| i.to_f32() - 0.5 * (n - 1.0);
    let spread: f32 = (0..points.len()).map(|i| t(i).powi(2)).sum();
    let slope = under.iter().enumerate().map(|(i, h)| t(i) * (h - mean)).sum::<f32>() / spread.max(1e-9);
    let mut gaps: Vec<f32> = under.iter().enumerate().map(|(i, h)| h - mean - slope * t(i)).collect();
    gaps.sort_by(f32::total_cmp);
    let lift = gaps[(gaps.len() * 3 / 4).min(gaps.len() - 1)];
    points
        .iter()
        .enumerate()
        .map(|(i, p)| {
            let line = mean + slope * t(i) + lift;
            p.extend(under[i] + stiff * (line - under[i]) + 0.5 * half)
        })
        .collect()
}

/// Sweeps a closed cross-section (x to the side, y up, counter-clockwise when looking back along the path) along a
/// path. `size` scales it at t in 0..1; `twist` rotates it. uv: u around, v along.
fn sweep(path: &[Vec3], section: &[Vec2], size: impl Fn(f32) -> Vec2, twist: f32) -> Mesh {
    let (n, m) = (path.len(), section.len());
    let (mut positions, mut uvs, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..n {
        let along = (path[(i + 1).min(n - 1)] - path[i.saturating_sub(1)]).normalize_or(Vec3::X);
        let side = Vec3::Z.cross(along).normalize_or(Vec3::Y);
        let up = along.cross(side);
        let t = i.to_f32() / (n - 1).to_f32();
        let turn = Vec2::from_angle(twist * (t - 0.5));
        for k in 0..=m {
            let c = turn.rotate(section[k % m] * size(t));
            positions.push(path[i] + side * c.x + up * c.y);
            uvs.push(vec2(k.to_f32() / m.to_f32(), t));
        }
    }
    let (w, rows) = (m.to_u32() + 1, n.to_u32());
    for i in 0..rows - 1 {
        for k in 0..m.to_u32() {
            let a = i * w + k;
            triangles.push([a, a + 1, a + w + 1]);
            triangles.push([a, a + w + 1, a + w]);
        }
    }
    for (row, flip) in [(0, true), (rows - 1, false)] {
        for k in 1..m.to_u32() - 1 {
            let [a, b, c] = [row * w, row * w + k, row * w + k + 1];
            triangles.push(if flip { [a, c, b] } else { [a, b, c] });
        }
    }
    Mesh::smooth(positions, uvs, triangles)
}

/// Returns a round section of radius 1.
fn round(corners: u8) -> Vec<Vec2> {
    (0..corners).map(|k| Vec2::from_angle(TAU * f32::from(k) / f32::from(corners))).collect()
}

/// Returns the section of a split stalk: a wall of `n` segments along an arc of `opening` radians, half-width 1, with
/// its centre on top.
fn arc(opening: f32, wall: f32, n: u8) -> Vec<Vec2> {
    let radius = 1.0 / (0.5 * opening).min(0.5 * PI).sin();
    let at = |k: u8, r: f32| {
        let angle = 0.5 * PI + opening * (f32::from(k) / f32::from(n) - 0.5);
        Vec2::from_angle(angle) * r - vec2(0.0, radius * (0.5 + 0.5 * (0.5 * opening).cos()))
    };
    (0..=n).map(|k| at(k, radius)).chain((0..=n).rev().map(|k| at(k, radius - wall))).collect()
}

fn debris(kind: DebrisKind, mesh: Mesh, albedo: Spectrum, path: &[Vec3], s: &mut Stream) -> Debris {
    let centre = path[path.len() / 2];
    let radius = mesh.positions.iter().map(|p| p.truncate().distance(centre.truncate())).fold(0.0, f32::max);
    let tint = (0.22 * s.normal().to_f32()).exp();
    Debris { kind, mesh, albedo, tint, dust: 0.0, hue: s.uniform32(), centre, radius }
}

fn straw(
    desc: &LitterDesc,
    (weathering, resolved_mm): (f32, f32),
    pile: &mut Pile,
    at: Vec2,
    s: &mut Stream,
) -> Debris {
    let length = desc.straw_mm.draw32(s) * 1e-3;
    let width = desc.straw_width_mm.draw32(s) * 1e-3;
    let n = straw_points(length);
    let detail = Detail::of(1e3 * width, resolved_mm);
    let opening = s.range32(0.9, 4.2);
    let points = path(at, length, 0.25, n, s);
    let path = lay(&points, 0.2 * width, 0.85, pile);
    let frayed = s.range32(0.55, 1.0);
    let side = if s.chance(0.35) { -1.0 } else { 1.0 };
    let section: Vec<Vec2> = arc(opening, 0.22, detail.parts()).iter().map(|c| *c * side).collect();
    let mesh = sweep(
        &detail.thinned(&path),
        &section,
        |t| Vec2::splat(0.5 * width * (1.0 - (1.0 - frayed) * t.powi(3))),
        0.5 * s.normal().to_f32(),
    );
    raise(pile, &path, 0.5 * width);
    debris(DebrisKind::Straw, mesh, tone(weathering, s), &path, s)
}

/// Builds a standing stalk: an open tube, cut off at the top.
fn stalk(desc: &LitterDesc, (weathering, resolved_mm): (f32, f32), pile: &Pile, at: Vec2, s: &mut Stream) -> Debris {
    let length = desc.stubble_mm.draw32(s) * 1e-3;
    let width = desc.straw_width_mm.draw32(s) * 1e-3;
    let detail = Detail::of(1e3 * width, resolved_mm);
    let lean = Vec2::from_angle(s.range32(0.0, TAU)) * (LEAN * s.normal().to_f32().abs() + 0.02);
    let foot = at.extend(pile.at(at) - FOOT_M);
    let point = |k: usize| {
        let t = k.to_f32() / (STALK_POINTS - 1).to_f32();
        foot + (lean * t * (0.7 + 0.3 * t)).extend(t) * length
    };
    let path: Vec<Vec3> = (0..STALK_POINTS).map(point).collect();
    let section = arc(5.6, 0.2, detail.parts());
    let mesh = sweep(&path, &section, |_| Vec2::splat(0.5 * width), 0.0);
    Debris { centre: foot, ..debris(DebrisKind::Straw, mesh, tone(weathering, s), &path, s) }
}

fn stick(desc: &LitterDesc, resolved_mm: f32, pile: &mut Pile, at: Vec2, s: &mut Stream) -> Debris {
    let length = desc.stick_mm.draw32(s) * 1e-3;
    let half = 0.5e-3 * desc.stick_width_mm.draw32(s);
    let n = stick_points(length);
    let detail = Detail::of(2e3 * half, resolved_mm);
    let points = path(at, length, 0.5, n, s);
    let path = lay(&points, half, 0.9, pile);
    let knots = (s.range32(0.0, TAU), s.range32(20.0, 60.0));
    let taper = s.range32(0.35, 0.75);
    let size = |t: f32| Vec2::splat(half * (1.0 - (1.0 - taper) * t) * (1.0 + 0.08 * (knots.0 + knots.1 * t).sin()));
    let mut mesh = sweep(&detail.thinned(&path), &round(detail.corners(ROUND)), size, 0.0);
    for _ in 0..desc.stubs.draw(s).trunc_to::<u32>() {
        let i = 1 + s.index(n - 2);
        let along = (path[i + 1] - path[i]).normalize_or(Vec3::X);
        let side = along.cross(Vec3::Z).normalize_or(Vec3::Y) * if s.chance(0.5) { 1.0 } else { -1.0 };
        let to = (along + side * s.range32(0.6, 1.4) + Vec3::Z * s.range32(-0.1, 0.5)).normalize_or(Vec3::X);
        let long = half * s.range32(2.5, 9.0);
        let stub: Vec<Vec3> = (0..STUB_POINTS.to_u8()).map(|k| path[i] + to * (long * f32::from(k) / 3.0)).collect();
        let thick = size(i.to_f32() / n.to_f32()).x * s.range32(0.35, 0.65);
        mesh.append(&sweep(&stub, &round(detail.corners(STUB)), |t| Vec2::splat(thick * (1.0 - 0.5 * t)), 0.0));
    }
    raise(pile, &path, half);
    debris(DebrisKind::Stick, mesh, WOOD, &path, s)
}

fn bit(desc: &LitterDesc, (weathering, resolved_mm): (f32, f32), pile: &mut Pile, at: Vec2, s: &mut Stream) -> Debris {
    let length = desc.bit_mm.draw32(s) * 1e-3;
    let kind = s.child(Purpose::Debris, 1).uniform32();
    let (root, coal) = (kind < ROOTS, kind >= 1.0 - COALS);
    let wide = s.range32(0.12, 0.5);
    let half = 0.5 * length * if root { lerp(THREAD.0, THREAD.1, wide) } else { wide };
    let detail = Detail::of(2e3 * half, resolved_mm);
    let points = path(at, length, if root { 1.6 } else { 0.5 }, BIT_POINTS, s);
    let mut path = lay(&points, 1e-4, 0.6, pile);
    // Dry leaves curl up at both ends.
    let curl = length * s.range32(0.0, 0.25) * if coal { 0.0 } else { 1.0 };
    for (i, p) in path.iter_mut().enumerate() {
        p.z += curl * (i.to_f32() / 2.5 - 1.0).powi(2);
    }
    let (from, to) = (s.range32(0.1, 0.6), s.range32(0.05, 0.4));
    let wide = |t: f32| ((1.0 - t) * from + t * to) + (1.0 - 0.5 * (from + to)) * (PI * t).sin();
    let thick = (0.06 * half).max(6e-5);
    let section: Vec<Vec2> = arc(s.range32(0.3, 1.6), 0.12, detail.parts());
    let mesh = sweep(
        &detail.thinned(&path),
        &section,
        |t| vec2(half * wide(t), (half * wide(t)).max(thick)),
        0.8 * s.normal().to_f32(),
    );
    let stalk = s.chance(0.3);
    let albedo = match (root, coal) {
        (true, _) => ROOT,
        (_, true) => CHARCOAL,
        _ if stalk => tone(weathering, s),
        _ => ROTTEN,
    };
    debris(DebrisKind::Bit, mesh, albedo, &path, s)
}

/// Returns the reflectance of a piece of straw; `s` is the piece's random stream.
fn tone(weathering: f32, s: &Stream) -> Spectrum {
    residue::straw(weathering, &mut s.child(Purpose::Debris, 0))
}

fn raise(pile: &mut Pile, path: &[Vec3], half: f32) {
    for p in path {
        pile.heap(p.truncate(), Vec2::X, half, half, p.z, p.z + half);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: mats keep the mean density of straw within 15 %; with a clustering of 1 the
    /// densest tenth of the ground has 1.8 times the mean or more, and the barest less than a third.
    #[test]
    fn straw_lies_in_mats() {
        let desc = LitterDesc { straw_clustering: Vary::fixed(1.0), ..LitterDesc::default() };
        let mats = Mats::draw(&desc, &Stream::of(3, 0, Purpose::Test, 0));
        let mut all: Vec<f32> =
            (0..10_000).map(|k| mats.density(vec2((k % 100).to_f32(), (k / 100).to_f32()) * 0.13)).collect();
        let mean = all.iter().sum::<f32>() / 10_000.0;
        all.sort_by(f32::total_cmp);
        assert!((mean - 1.0).abs() < 0.15, "{mean}");
        assert!(all[9_000] > 1.8 && all[1_000] < 0.3, "{} {}", all[9_000], all[1_000]);
    }

    #[test]
    fn swept_bodies_are_closed_and_face_outward() {
        let path: Vec<Vec3> = (0..9u8).map(|i| Vec3::new(f32::from(i) * 0.1, 0.0, 0.02 * f32::from(i))).collect();
        for section in [round(8), round(4), arc(1.2, 0.2, 6), arc(4.0, 0.2, 6), arc(1.2, 0.2, 2), arc(4.0, 0.2, 2)] {
            let mesh = sweep(&path, &section, |_| Vec2::splat(0.05), 0.3);
            assert_eq!(mesh.fault(), None);
            let volume: f32 = (0..mesh.triangles.len().to_u32())
                .map(|i| {
                    let [a, b, c] = mesh.corners(i);
                    a.cross(b).dot(c) / 6.0
                })
                .sum();
            assert!(volume > 0.0, "{volume}");
        }
    }
}
