//! Desiccation cracks of a crusted ground.
//!
//! Drying soil breaks in steps: a new crack starts and ends at right angles to older ones and divides the domain between them,
//! until the plates are too narrow to break (Bohn, Pauchard & Couder 2005, "Hierarchical crack pattern as formed by
//! successive domain divisions", Phys. Rev. E 71:046214). Older cracks have opened longer and are wider. The surface dries
//! first and shrinks most, so the rims of plates curl up (Style, Peppin & Cocks 2011, "Mud peeling and horizontal crack
//! formation in drying clays", J. Geophys. Res. 116:F01025).
//!
//! The first domains are tiles of a jittered brick pattern with addresses in the world; each is divided across its long axis.
//! Noise then displaces all cracks, so that they wander.

use super::crumb::Raster;
use super::pigments::quantile;
use super::record::CracksRecord;
use super::{CracksDesc, Rect, cell_stream, cells};
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec2, lerp, smoothstep, vec2};
use furrow_base::sampling::{Purpose, Stream};
use furrow_optics::texture::noise::Perlin;
use rayon::prelude::*;

/// Side of a tile, plates.
const TILE: f32 = 6.0;
/// Largest displacement of a tile's corners, tiles.
const JITTER: f32 = 0.14;
/// Area of the largest plate that does not break, relative to the square of the plates' width.
const WHOLE: f32 = 1.5;
/// Ratio of the widths of successive generations of cracks, and standard deviation of the logarithm of the width.
const THINNER: f32 = 0.78;
const WIDTH_SD: f32 = 0.25;
/// Fraction of the youngest cracks that end within a plate.
const BLIND: f64 = 0.3;
/// Exponent of a crack's depth as a function of its width.
const SHALLOWER: f32 = 0.7;
/// Largest number of generations, a limit for degenerate domains.
const GENERATIONS: i32 = 14;
/// Points of a crack between its ends.
const POINTS: u8 = 8;
/// Displacement by noise: wavelength and amplitude, plates.
const WANDER: [(f32, f32); 2] = [(1.1, 0.16), (0.25, 0.05)];
/// Length of a straight piece of a crack, plates.
const PIECE: f32 = 0.15;
/// Size of the cracked patches, plates; standard deviation of their noise; half-width of their borders.
const PATCH: f32 = 5.0;
const PATCH_SD: f32 = 0.33;
const BORDER: f32 = 0.15;
/// Distance from a crack at which a rim's height falls to 1/e, plates.
const RIM: f32 = 0.07;
/// Distances from the middle of a crack where its floor ends and where its crumbled shoulder ends, half-widths; the depth
/// at half a width is half.
const WALL: (f32, f32) = (0.3, 1.6);
/// Largest distance from the middle of a crack that its ragged shoulder reaches, widths.
const SHOULDER: f32 = 0.5 * WALL.1 + 0.3;
/// Ragged edges: wavelength in metres, and amplitude relative to the half-width.
const RAGGED: [(f32, f32); 2] = [(0.009, 0.35), (0.004, 0.3)];
/// Crumbs that have fallen into cracks: largest fraction of the depth that they fill, wavelengths in metres along which it
/// varies, and their shares.
const RUBBLE: f32 = 0.6;
const RUBBLE_M: [(f32, f32); 2] = [(0.05, 0.6), (0.007, 0.4)];
/// Width of the narrowest crack that a raster resolves, samples: narrower ones are shown wider and less deep.
const NARROWEST: f32 = 1.5;
/// Approximate number of bands of a raster that are computed in parallel.
const BANDS: usize = 32;

/// Cracks of one ground, in metres.
#[derive(Clone, Debug)]
pub(super) struct Cracks {
    cover: f32,
    plate: f32,
    width: f32,
    depth: f32,
    curl: f32,
    noise: Perlin,
    stream: Stream,
}

/// One crack before its displacement.
struct Crack {
    path: Vec<Vec2>,
    /// Width in metres.
    width: f32,
    /// Whether it ends within a plate, with no width.
    blind: bool,
}

/// Straight piece of a crack: its ends, and its width and its strength (0 where the ground is whole) there.
#[derive(Clone, Copy)]
struct Piece {
    ends: [Vec2; 2],
    width: [f32; 2],
    strength: [f32; 2],
}

/// Side of a domain at which a crack starts or ends.
#[derive(Clone, Copy)]
struct Hit {
    at: Vec2,
    /// Index of the side.
    side: usize,
    /// Normal of the side, into the domain.
    inward: Vec2,
}

impl Cracks {
    /// Draws the cracks of a ground; `None` if it has none.
    pub(super) fn draw(desc: &CracksDesc, stream: &Stream) -> Option<Self> {
        let child = |k: u64| stream.child(Purpose::Soil, 71 + k);
        let cover = desc.cover.draw32(&mut child(0));
        (cover > 0.0).then(|| Self {
            cover,
            plate: 1e-3 * desc.plate_mm.draw32(&mut child(1)),
            width: 1e-3 * desc.width_mm.draw32(&mut child(2)),
            depth: 1e-3 * desc.depth_mm.draw32(&mut child(3)),
            curl: 1e-3 * desc.curl_mm.draw32(&mut child(4)),
            noise: Perlin::new(child(5).seed32()),
            stream: child(6),
        })
    }

    /// Returns the record of the drawn parameters.
    pub(super) fn record(&self) -> CracksRecord {
        CracksRecord {
            cover: self.cover,
            plate_mm: 1e3 * self.plate,
            width_mm: 1e3 * self.width,
            depth_mm: 1e3 * self.depth,
            curl_mm: 1e3 * self.curl,
        }
    }

    /// Returns the heights of cracks and rims at the samples of a raster, metres: below 0 in cracks. None are resolved if
    /// plates are narrower than two samples.
    pub(super) fn heights(&self, raster: Raster) -> Vec<f32> {
        let mut heights = vec![0.0; raster.width * raster.height];
        if self.plate < 2.0 * raster.step {
            return heights;
        }
        let pieces = self.pieces(raster.area());
        let rows = raster.height.div_ceil(BANDS).max(1);
        heights.par_chunks_mut(rows * raster.width).enumerate().for_each(|(band, heights)| {
            for piece in &pieces {
                self.cut(piece, raster, band * rows, heights);
            }
        });
        heights
    }

    /// Returns the pieces of all cracks that may reach into an area.
    fn pieces(&self, area: Rect) -> Vec<Piece> {
        let tile = TILE * self.plate;
        let mut all = Vec::new();
        for (i, j) in cells(area.grown(tile), tile) {
            for crack in self.tile(i, j) {
                self.displace(&crack, &mut all);
            }
        }
        all
    }

    /// Returns the node (k, j) of the brick pattern, of half a tile along x and one along y.
    fn node(&self, k: i32, j: i32) -> Vec2 {
        let mut s = cell_stream(&self.stream.child(Purpose::Page, 0), k, j);
        let jitter = vec2(s.range32(-JITTER, JITTER), s.range32(-JITTER, JITTER));
        (vec2(0.5 * k.to_f32(), j.to_f32()) + jitter) * (TILE * self.plate)
    }

    /// Returns the cracks of a tile: its lower and its left sides, and those within.
    fn tile(&self, i: i32, j: i32) -> Vec<Crack> {
        let k = 2 * i + (j & 1);
        let domain =
            [(k, j), (k + 1, j), (k + 2, j), (k + 2, j + 1), (k + 1, j + 1), (k, j + 1)].map(|(k, j)| self.node(k, j));
        let mut s = cell_stream(&self.stream, i, j);
        let sides = [vec![domain[5], domain[0], domain[1]], vec![domain[1], domain[2]]];
        let mut all: Vec<Crack> =
            sides.into_iter().map(|path| Crack { path, width: self.width_of(0, &mut s), blind: false }).collect();
        self.divide(&domain, 1, &mut s, &mut all);
        all
    }

    /// Draws the width of a crack of a generation.
    fn width_of(&self, generation: i32, s: &mut Stream) -> f32 {
        self.width * THINNER.powi(generation) * (WIDTH_SD * s.normal().to_f32()).exp()
    }

    /// Divides a counter-clockwise domain until its plates are whole.
    fn divide(&self, domain: &[Vec2], generation: i32, s: &mut Stream, all: &mut Vec<Crack>) {
        let Moments { area, centre, long } = Moments::of(domain);
        let whole = WHOLE * self.plate * self.plate;
        if area < whole || generation > GENERATIONS {
            return;
        }
        let aside = 0.12 * s.normal().to_f32().clamp(-1.5, 1.5) * area.sqrt();
        let across = Vec2::from_angle(0.12 * s.normal().to_f32()).rotate(long.perp());
        let width = self.width_of(generation, s);
        let at = centre + long * aside;
        let (Some(from), Some(to)) = (hit(domain, at, -across), hit(domain, at, across)) else { return };
        let mut path = bend(from, to);
        if area < 2.0 * whole && s.chance(BLIND) {
            path.truncate(s.index(path.len() / 2) + path.len() / 2);
            all.push(Crack { path, width, blind: true });
            return;
        }
        let [left, right] = split(domain, from, to, &path);
        all.push(Crack { path, width, blind: false });
        self.divide(&left, generation + 1, s, all);
        self.divide(&right, generation + 1, s, all);
    }

    /// Displaces a crack by noise and adds its straight pieces.
    fn displace(&self, crack: &Crack, all: &mut Vec<Piece>) {
        let total: f32 = crack.path.windows(2).map(|ends| ends[0].distance(ends[1])).sum();
        let mut along = 0.0;
        let point = |p: Vec2, along: f32| {
            let left = if crack.blind { 1.0 - along / total.max(f32::MIN_POSITIVE) } else { 1.0 };
            let varied = 1.0 + 0.6 * self.noise_at(p, 0.6, 71.3);
            (self.wander(p), crack.width * left.max(0.0).sqrt() * varied, self.strength(p))
        };
        for ends in crack.path.windows(2) {
            let length = ends[0].distance(ends[1]);
            let parts = (length / (PIECE * self.plate)).ceil().max(1.0);
            for part in 0..parts.trunc_to::<u16>() {
                let [a, b] = [f32::from(part), f32::from(part) + 1.0].map(|k| k / parts);
                let [a, b] = [a, b].map(|t| point(ends[0].lerp(ends[1], t), along + t * length));
                if a.2 > 0.0 || b.2 > 0.0 {
                    all.push(Piece { ends: [a.0, b.0], width: [a.1, b.1], strength: [a.2, b.2] });
                }
            }
            along += length;
        }
    }

    /// Returns noise with a wavelength in plates.
    fn noise_at(&self, p: Vec2, wavelength: f32, shift: f32) -> f32 {
        let q = p / (wavelength * self.plate) + shift;
        self.noise.at2(f64::from(q.x), f64::from(q.y)).to_f32()
    }

    fn wander(&self, p: Vec2) -> Vec2 {
        WANDER.iter().fold(p, |sum, (wavelength, amplitude)| {
            let by = vec2(self.noise_at(p, *wavelength, 0.37), self.noise_at(p, *wavelength, 31.61));
            sum + by * (*amplitude * self.plate)
        })
    }

    /// Returns the degree to which the ground is cracked at a point, 0..1.
    fn strength(&self, p: Vec2) -> f32 {
        if self.cover >= 1.0 {
            return 1.0;
        }
        let q = p / (PATCH * self.plate) + 11.7;
        let noise = self.noise.fbm2(f64::from(q.x), f64::from(q.y), 2, 0.5).to_f32() / PATCH_SD;
        let limit = -quantile(self.cover);
        smoothstep(limit - BORDER, limit + BORDER, noise)
    }

    /// Lowers the samples in a piece and raises those at its rims; `heights` are those of a raster from row `first` on.
    fn cut(&self, piece: &Piece, raster: Raster, first: usize, heights: &mut [f32]) {
        let rim = RIM * self.plate;
        let widest = piece.width[0].max(piece.width[1]).max(NARROWEST * raster.step);
        let reach = SHOULDER * widest + if self.curl > 0.0 { 3.0 * rim } else { 0.0 };
        let [a, b] = piece.ends.map(|end| end - raster.origin);
        let rows = (first.to_f32(), (first + heights.len() / raster.width).to_f32() - 1.0);
        let lo = ((a.min(b) - reach) / raster.step).ceil().max(vec2(0.0, rows.0));
        let hi = ((a.max(b) + reach) / raster.step).floor().min(vec2(raster.width.to_f32() - 1.0, rows.1));
        let (along, length) = (b - a, (b - a).length_squared().max(f32::MIN_POSITIVE));
        for y in lo.y.trunc_to::<i32>()..=hi.y.trunc_to::<i32>() {
            for x in lo.x.trunc_to::<i32>()..=hi.x.trunc_to::<i32>() {
                let d = vec2(x.to_f32(), y.to_f32()) * raster.step - a;
                let t = (d.dot(along) / length).clamp(0.0, 1.0);
                let [width, strength] = [piece.width, piece.strength].map(|ends| lerp(ends[0], ends[1], t));
                let distance = d.distance(along * t);
                // Noise only where it matters: within the crack and its shoulders.
                let near = distance < SHOULDER * width.max(NARROWEST * raster.step);
                let (ragged, rubble) = if near { self.crumbled(d + a + raster.origin) } else { (1.0, 0.0) };
                let new = self.profile(distance * ragged, width, raster.step) * strength;
                let new = if new < 0.0 { new * (1.0 - rubble) } else { new };
                let old = &mut heights[(y.to_usize() - first) * raster.width + x.to_usize()];
                // The deepest crack counts; outside of cracks, the highest rim.
                *old = match (new < 0.0, *old < 0.0) {
                    (true, _) => new.min(*old),
                    (false, true) => *old,
                    (false, false) => new.max(*old),
                };
            }
        }
    }

    /// Returns the factor on the distance from a crack's middle that makes its edges ragged, and the fraction of its depth
    /// that crumbs fill.
    fn crumbled(&self, p: Vec2) -> (f32, f32) {
        let noise = |wavelength: f32, shift: f32| {
            let q = p / wavelength + shift;
            self.noise.at2(f64::from(q.x), f64::from(q.y)).to_f32()
        };
        let ragged: f32 = RAGGED.iter().map(|(wavelength, amplitude)| amplitude * noise(*wavelength, 5.3)).sum();
        let filled: f32 =
            RUBBLE_M.iter().map(|(wavelength, share)| share * (0.5 + 1.2 * noise(*wavelength, 47.9))).sum();
        (1.0 + ragged, RUBBLE * filled.clamp(0.0, 1.0))
    }

    /// Returns the height at a distance from the middle of a crack of a width, for samples `step` apart.
    fn profile(&self, distance: f32, width: f32, step: f32) -> f32 {
        let shown = width.max(NARROWEST * step);
        let depth = self.depth * (width / self.width.max(f32::MIN_POSITIVE)).powf(SHALLOWER) * (width / shown);
        let from_middle = distance / (0.5 * shown);
        if from_middle < WALL.1 {
            -depth * (1.0 - smoothstep(WALL.0, WALL.1, from_middle))
        } else {
            self.curl * ((0.5 * WALL.1 * shown - distance) / (RIM * self.plate)).exp()
        }
    }
}

/// Area, centroid and direction of the long axis of a polygon.
struct Moments {
    area: f32,
    centre: Vec2,
    long: Vec2,
}

impl Moments {
    /// Source: Green's theorem over the triangles between the first corner and each side.
    fn of(polygon: &[Vec2]) -> Self {
        let origin = polygon[0];
        let (mut area, mut first, mut second) = (0.0, Vec2::ZERO, [0.0; 3]);
        for (a, b) in polygon.iter().zip(polygon.iter().cycle().skip(1)) {
            let (a, b) = (*a - origin, *b - origin);
            let twice = a.perp_dot(b);
            area += 0.5 * twice;
            first += (a + b) * (twice / 6.0);
            let product = |i: usize, j: usize| {
                let (a, b) = (a.to_array(), b.to_array());
                twice / 24.0 * (2.0 * a[i] * a[j] + a[i] * b[j] + b[i] * a[j] + 2.0 * b[i] * b[j])
            };
            second = [second[0] + product(0, 0), second[1] + product(0, 1), second[2] + product(1, 1)];
        }
        let area = area.max(f32::MIN_POSITIVE);
        let mean = first / area;
        let [xx, xy, yy] = [
            second[0] / area - mean.x * mean.x,
            second[1] / area - mean.x * mean.y,
            second[2] / area - mean.y * mean.y,
        ];
        Self { area, centre: origin + mean, long: Vec2::from_angle(0.5 * (2.0 * xy).atan2(xx - yy)) }
    }
}

/// Returns the side of a polygon that a ray meets first.
fn hit(polygon: &[Vec2], from: Vec2, direction: Vec2) -> Option<Hit> {
    let meets = |side: usize| {
        let (a, b) = (polygon[side], polygon[(side + 1) % polygon.len()]);
        let (edge, to) = (b - a, a - from);
        let turn = direction.perp_dot(edge);
        let (t, u) = (to.perp_dot(edge) / turn, to.perp_dot(direction) / turn);
        let met = turn != 0.0 && t > 0.0 && (0.0..1.0).contains(&u);
        met.then(|| (t, Hit { at: a + edge * u, side, inward: edge.perp().normalize_or_zero() }))
    };
    (0..polygon.len()).filter_map(meets).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, hit)| hit)
}

/// Returns the path of a crack, a cubic Hermite curve that leaves and meets the sides at right angles.
fn bend(from: Hit, to: Hit) -> Vec<Vec2> {
    let length = from.at.distance(to.at);
    let (start, end) = (from.inward * length, to.inward * -length);
    let point = |t: f32| {
        let (t2, t3) = (t * t, t * t * t);
        from.at * (2.0 * t3 - 3.0 * t2 + 1.0)
            + start * (t3 - 2.0 * t2 + t)
            + to.at * (3.0 * t2 - 2.0 * t3)
            + end * (t3 - t2)
    };
    (0..=POINTS + 1).map(|k| point(f32::from(k) / f32::from(POINTS + 1))).collect()
}

/// Splits a polygon along a path between two of its sides into two polygons of the same orientation.
fn split(polygon: &[Vec2], from: Hit, to: Hit, path: &[Vec2]) -> [Vec<Vec2>; 2] {
    let corners = |first: usize, last: usize| {
        let count = (last + polygon.len() - first) % polygon.len();
        (1..=count).map(move |k| polygon[(first + k) % polygon.len()])
    };
    let left = corners(from.side, to.side).chain(path.iter().rev().copied()).collect();
    let right = corners(to.side, from.side).chain(path.iter().copied()).collect();
    [left, right]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cracks(desc: &str) -> Cracks {
        let desc: CracksDesc = ron::from_str(desc).unwrap();
        Cracks::draw(&desc, &Stream::of(12, 0, Purpose::Test, 0)).unwrap()
    }

    const WIDE: &str = "(cover: 1, plate_mm: 50, width_mm: 3, depth_mm: 12, curl_mm: 0.5)";

    fn raster(x: f32, y: f32, width: usize, height: usize) -> Raster {
        Raster { origin: vec2(x, y), step: 5e-4, width, height }
    }

    /// Expected: cracks leave and meet the sides of a domain within 25° of a right angle, wherever these are.
    #[test]
    fn cracks_meet_older_ones_at_right_angles() {
        let mut s = Stream::of(3, 0, Purpose::Test, 0);
        for _ in 0..200 {
            let angle = |s: &mut Stream| Vec2::from_angle(s.range32(-0.9, 0.9));
            let from = Hit { at: Vec2::ZERO, side: 0, inward: angle(&mut s) };
            let to = Hit { at: vec2(1.0, s.range32(-0.2, 0.2)), side: 2, inward: -angle(&mut s) };
            let path = bend(from, to);
            let leaves = (path[1] - path[0]).normalize().dot(from.inward);
            let meets = (path[path.len() - 1] - path[path.len() - 2]).normalize().dot(-to.inward);
            assert!(leaves.min(meets) > 25f32.to_radians().cos(), "{leaves} {meets}");
        }
    }

    /// Expected: the moments of a rectangle are those of its closed forms.
    #[test]
    fn domains_break_across_their_long_axis() {
        let (sin, cos) = 0.4f32.sin_cos();
        let turned = |x: f32, y: f32| vec2(2.0 + cos * x - sin * y, 1.0 + sin * x + cos * y);
        let Moments { area, centre, long } =
            Moments::of(&[turned(-3.0, -1.0), turned(3.0, -1.0), turned(3.0, 1.0), turned(-3.0, 1.0)]);
        assert!((area - 12.0).abs() < 1e-3 && centre.distance(vec2(2.0, 1.0)) < 1e-4, "{area} {centre}");
        assert!(long.dot(vec2(cos, sin)).abs() > 0.9999, "{long}");
    }

    /// Expected: on 1 m² there are as many plates as their width says, within a third; oldest cracks are the widest.
    #[test]
    fn plates_are_as_wide_as_asked() {
        let cracks = cracks(WIDE);
        let all: Vec<Crack> = cells(Rect::new(0.0, 0.0, 3.0, 3.0), 0.3).flat_map(|(i, j)| cracks.tile(i, j)).collect();
        // Each crack within a tile adds one plate; two of each tile are its sides.
        let plates = all.iter().filter(|crack| !crack.blind).count().to_f32() - 100.0;
        let mm = 1e3 * (9.0 / plates).sqrt();
        assert!((40.0..62.0).contains(&mm), "{mm} mm");
        let width = |from: f32, to: f32| {
            let some: Vec<f32> = all
                .iter()
                .map(|c| (c.path[0].distance(c.path[c.path.len() - 1]), c.width))
                .filter(|(length, _)| (from..to).contains(length))
                .map(|(_, width)| width)
                .collect();
            some.iter().sum::<f32>() / some.len().to_f32()
        };
        assert!(width(0.2, 0.5) > 1.5 * width(0.0, 0.08), "{} {}", width(0.2, 0.5), width(0.0, 0.08));
    }

    /// Expected: the deepest point is as deep as asked, within the variation of widths; rims rise by at most `curl_mm`; a
    /// raster elsewhere holds the same cracks; narrow cracks keep their volume on a coarse raster.
    #[test]
    fn cracks_are_cut_into_the_ground_and_rims_curl() {
        let cracks = cracks(WIDE);
        let whole = cracks.heights(raster(0.0, 0.0, 600, 600));
        let (lo, hi) = whole.iter().fold((0f32, 0f32), |(lo, hi), h| (lo.min(*h), hi.max(*h)));
        assert!((-0.025..-0.008).contains(&lo), "{lo}");
        assert!(hi <= 0.0005 + 1e-6 && hi > 0.0003, "{hi}");
        let part = cracks.heights(raster(0.05, 0.1, 100, 80));
        for (k, height) in part.iter().enumerate() {
            let same = whole[(k / 100 + 200) * 600 + k % 100 + 100];
            assert!((height - same).abs() < 2e-4, "{height} {same}");
        }
        let volume = |step: f32| {
            let fine = self::cracks("(cover: 1, plate_mm: 50, width_mm: 1, depth_mm: 10, curl_mm: 0)");
            let side = (0.3 / step).trunc_to::<usize>();
            let heights = fine.heights(Raster { step, ..raster(0.0, 0.0, side, side) });
            heights.iter().sum::<f32>() * step * step
        };
        assert!((volume(2e-3) / volume(2e-4) - 1.0).abs() < 0.3, "{} {}", volume(2e-3), volume(2e-4));
    }

    /// Expected: the fraction of the ground with cracks is the requested one within 0.15, over many patches.
    #[test]
    fn cracks_cover_what_they_were_asked_to() {
        for cover in [0.2f32, 0.5, 0.8] {
            let cracks = cracks(&format!("(cover: {cover}, plate_mm: 40)"));
            let places = (0..4000).map(|k| vec2((k % 80).to_f32(), (k / 80).to_f32()) * 0.11);
            let cracked = places.filter(|p| cracks.strength(*p) > 0.5).count().to_f32() / 4000.0;
            assert!((cracked - cover).abs() < 0.15, "{cracked} for {cover}");
        }
        let none: CracksDesc = ron::from_str("()").unwrap();
        assert!(Cracks::draw(&none, &Stream::of(1, 0, Purpose::Test, 0)).is_none());
    }
}
