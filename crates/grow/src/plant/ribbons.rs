//! Finely divided blades: bipinnate, built recursively of ribbons.
//!
//! A ribbon is a narrow strip with a keel, three vertices across, so that light falls on two faces and it never
//! degenerates to a line in side view. The blade's axis carries pairs of pinnae, each pinna pairs of lobes; their
//! lengths follow sin(πt)^0.7 along the axis, which gives the whole a leaf's outline.
//!
//! Pinnae are tilted out of the blade's plane by varying angles, as in mayweed, and curl: the displacement of a point
//! grows with the square of its distance from the base.

use super::blade::RestMesh;
use super::growth::CELL;
use super::skeleton::{Skeleton, Weights};
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec3, lerp, smoothstep, vec2, vec3};
use furrow_base::sampling::{Purpose, Stream};
use std::f32::consts::PI;

/// Largest sideways displacement of a pinna's tip, as a fraction of its length; lobes also bend up or down by twice
/// this. Estimated from pictures of mayweed.
const CURL: f32 = 0.2;
/// Maximum number of ribbons of one blade, a guard against species files that ask for a million lobes.
pub(super) const MOST: usize = 600;

/// Largest width of a lobe that is a strip, in segments.
const NARROW: f32 = 1.4;
/// Depth of a ribbon's keel, in half-widths.
const KEEL: f32 = 0.55;

/// Smallest fraction of the finest ribbons that a coarse mesh keeps.
const LEAST_DRAWN: f32 = 0.12;
/// Fractional part of the golden ratio.
const GOLDEN: f32 = 0.618_034;

/// Builder of a blade of ribbons.
pub(super) struct Ribbons<'a> {
    /// Rest mesh built so far.
    pub(super) rest: RestMesh,
    /// Skeleton that the vertices are bound to.
    pub(super) skeleton: &'a Skeleton,
    /// Half-width of the blade at a fraction of its length, metres; `None` if only the chain carries the vertices.
    pub(super) half_width: Option<&'a dyn Fn(f32) -> f32>,
    /// Width of a segment, metres.
    pub(super) width: f32,
    /// Number of ribbons so far, including those left out.
    pub(super) count: usize,
    /// Fraction of the finest ribbons that are kept, each widened by the inverse; 1 keeps all.
    pub(super) drawn: f32,
}

/// Returns the fraction of the finest ribbons, `width` metres wide, that a mesh with cells of `cell` metres keeps.
/// Stochastic simplification: where single elements cannot be resolved, a random subset, scaled to the same total area,
/// looks the same. Source: Cook, Halstead, Planck & Ryu 2007, "Stochastic Simplification of Aggregate Detail", ACM
/// Transactions on Graphics 26(3).
fn drawn(width: f32, cell: f32) -> f32 {
    if cell > CELL { (2.0 * width / cell).clamp(LEAST_DRAWN, 1.0) } else { 1.0 }
}

impl<'a> Ribbons<'a> {
    /// Returns an empty builder for a divided blade: `segment` is the width of its segments, `cell` the cell size of
    /// the mesh, both in metres.
    pub(super) fn new(skeleton: &'a Skeleton, half_width: &'a dyn Fn(f32) -> f32, segment: f32, cell: f32) -> Self {
        Self {
            rest: RestMesh::default(),
            skeleton,
            half_width: Some(half_width),
            width: segment,
            count: 0,
            drawn: drawn(segment, cell),
        }
    }

    /// Adds a strip from `start` along `along` (metres), bowed towards `bow` and tapering at both ends.
    pub(super) fn strip(&mut self, start: Vec3, along: Vec3, up: Vec3, bow: Vec3, width: f32, pieces: u32) {
        self.band((start, along, up, bow), pieces, |s| {
            width * (1.0 - 0.8 * s * s * s) * if s == 0.0 { 0.7 } else { 1.0 }
        });
    }

    /// Adds a lobe of `breadth` segments' width: a strip that tapers to its tip, or, if it is broader than [`NARROW`], a
    /// flat blade that is widest in its middle, no wider than three quarters of its length.
    pub(super) fn lobe(&mut self, start: Vec3, along: Vec3, up: Vec3, breadth: f32) {
        let segment = self.width;
        if breadth <= NARROW {
            self.strip(start, along, up, Vec3::ZERO, breadth * segment, 1);
            return;
        }
        let width = (breadth * segment).min(0.75 * along.length()).max(segment);
        let flat = (segment / width).powi(2);
        self.keeled((start, along, up, Vec3::ZERO), 2, KEEL * flat, |s| {
            width * if s == 0.0 { 0.4 } else { (1.0 - smoothstep(0.5, 1.05, s)).sqrt() }
        });
    }

    /// Adds a strip with a width that depends on the fraction of its length. The tuple holds its start, its direction
    /// times length, its upper side and its bow.
    pub(super) fn band(
        &mut self,
        (start, along, up, bow): (Vec3, Vec3, Vec3, Vec3),
        pieces: u32,
        width: impl Fn(f32) -> f32,
    ) {
        self.keeled((start, along, up, bow), pieces, KEEL, width);
    }

    /// Adds such a strip whose middle is sunk by `keel` half-widths.
    fn keeled(
        &mut self,
        (start, along, up, bow): (Vec3, Vec3, Vec3, Vec3),
        pieces: u32,
        keel: f32,
        width: impl Fn(f32) -> f32,
    ) {
        self.count += 1;
        if self.count > MOST {
            return;
        }
        let mut wider = 1.0;
        if pieces == 1 && self.drawn < 1.0 {
            // Additive recurrence with the golden ratio: the kept ribbons are spread evenly over the blade.
            if (self.count.to_f32() * GOLDEN).fract() >= self.drawn {
                return;
            }
            wider = 1.0 / self.drawn;
        }
        let right = along.cross(up).normalize_or(Vec3::X);
        let mut previous = None;
        for i in 0..=pieces {
            let s = i.to_f32() / pieces.to_f32();
            let centre = start + along * s + bow * (s * s);
            let half = 0.5 * wider * width(s);
            let tie = self.tie(centre);
            let first = self.rest.positions.len().to_u32();
            for (k, side) in [-1.0_f32, 0.0, 1.0].into_iter().enumerate() {
                let sunk = if side == 0.0 { -keel * half } else { 0.0 };
                let p = centre + right * (half * side) + up * sunk;
                self.rest.corner(p, vec2(0.5 * k.to_f32(), 1.0 - s), tie);
            }
            if let Some(near) = previous {
                self.rest.stitch(near, first, 2);
            }
            previous = Some(first);
        }
    }

    /// Returns the skin weights of a point: joints of the chain near the rachis, of the nearby branches further out.
    fn tie(&self, p: Vec3) -> Weights {
        let Some(half_width) = self.half_width else { return self.skeleton.weights_on_chain(p.y) };
        let across = p.x.abs() / half_width(p.y / self.skeleton.length()).max(1e-5);
        self.skeleton.weights(p.x, p.y, across)
    }

    /// Adds a pinna with its pairs of lobes; its own tip is the last lobe. Each lobe has its own stream, so that later
    /// lobes do not move earlier ones.
    fn pinna(&mut self, start: Vec3, along: Vec3, up: Vec3, lobes: f32, stream: &mut Stream) {
        let length = along.length();
        let ahead = along / length.max(1e-9);
        let right = ahead.cross(up);
        let bow = (up * stream.range32(-0.12, 0.2) + right * stream.range32(-CURL, CURL)) * length;
        self.strip(start, along, up, bow, self.width, 2);
        for (k, place, grown) in series(lobes) {
            let s = lerp(0.18, 0.88, place) + stream.child(Purpose::Leaf, k.to_u64()).range32(-0.05, 0.05);
            for (far, side) in [-1.0_f32, 1.0].into_iter().enumerate() {
                let mut own = stream.child(Purpose::Leaf, 1 << 10 | (2 * k + far).to_u64());
                let reach = grown * length * own.range32(0.42, 0.68) * (1.2 - s);
                let spread = own.range32(0.55, 0.95);
                let tilt = own.range32(-0.35, 0.5);
                let bend = up * own.range32(-2.0 * CURL, 2.0 * CURL) + right * own.range32(-CURL, CURL);
                let lean = own.range32(-0.5, 0.6);
                if reach < self.width {
                    continue;
                }
                let lobe = (ahead * spread.cos()
                    + right * (side * spread.sin() * tilt.cos())
                    + up * (spread.sin() * tilt.sin()))
                .normalize_or(ahead);
                let from = start + along * s + bow * (s * s);
                let bend = bend * reach;
                let pieces = if reach > 4.5 * self.width { 2 } else { 1 };
                self.strip(from, lobe * reach, up, bend, 0.85 * self.width, pieces);
                // A long lobe bears a tooth on its outer side, which makes the blade tripinnate.
                if reach > 4.5 * self.width {
                    let tooth = (lobe * 0.8 - right * (side * 0.25) + up * lean).normalize_or(lobe);
                    let tooth = if k % 2 == 0 { tooth } else { (lobe + right * (side * 0.7)).normalize_or(lobe) };
                    self.strip(
                        from + lobe * (0.45 * reach) + bend * 0.2,
                        tooth * (0.45 * reach),
                        up,
                        Vec3::ZERO,
                        0.75 * self.width,
                        1,
                    );
                }
            }
        }
    }
}

/// Iterates over the pairs along an axis, the last of them partially grown: the index of each from the base, its centre
/// as a fraction of the axis, and the fraction of it that has grown. All values are continuous in `pairs`.
pub(super) fn series(pairs: f32) -> impl Iterator<Item = (usize, f32, f32)> {
    (0..pairs.ceil_to::<usize>()).map(move |k| {
        let grown = (pairs - k.to_f32()).min(1.0);
        (k, (k.to_f32() + 0.5 * grown) / pairs, grown)
    })
}

/// Divisions of a bipinnate blade.
#[derive(Clone, Copy, Debug)]
pub(super) struct Division {
    /// Number of pairs of pinnae.
    pub(super) pairs: usize,
    /// Number of pairs of lobes on the longest pinna.
    pub(super) lobes: usize,
    /// Fraction of the rachis, from its base, that bears no pinnae.
    pub(super) bare: f32,
    /// Width of a segment, metres.
    pub(super) segment: f32,
    /// Shortest cell of the mesh, metres.
    pub(super) cell: f32,
}

/// Position of the foremost pinnae on the rachis, as a fraction of its length.
const LAST: f32 = 0.96;

/// Returns the position of the first pinnae on a rachis with this bare fraction.
fn first(bare: f32) -> f32 {
    lerp(0.08, 1.0, bare)
}

/// Returns the length of the pinnae at the fraction `u` of the way from the first to the last, relative to the longest.
fn arch(u: f32) -> f32 {
    (PI * u.powf(0.8)).sin().max(0.05).powf(0.7)
}

/// Returns the half-width of the outline that encloses the pinnae at the fraction `t` of the length, relative to the
/// blade's width.
pub(super) fn half_width(bare: f32, t: f32) -> f32 {
    0.5 * arch(((t - first(bare)) / (LAST - first(bare))).clamp(0.0, 1.0))
}

/// Fraction of the pinnae that are missing on an entirely bare rachis; the actual fraction is proportional to the bare
/// part.
const LACKING: f32 = 0.5;

/// Builds the rest mesh of a divided blade of `width`.
pub(super) fn blade(division: Division, width: f32, skeleton: &Skeleton, stream: &mut Stream) -> RestMesh {
    let length = skeleton.length();
    let Division { pairs, lobes, bare, segment, cell } = division;
    // Small leaves have fewer, not finer, segments.
    let pairs = pairs.min(MOST).to_f32().min(length * (1.0 - bare) / (1.6 * segment)).max(1.0);
    let lobes = lobes.min(MOST).to_f32().min(0.5 * width / (3.0 * segment));
    let half_width = |t: f32| half_width(bare, t) * width;
    let mut ribbons = Ribbons::new(skeleton, &half_width, segment, cell);
    let rachis = (Vec3::ZERO, vec3(0.0, length, 0.0), Vec3::Z, Vec3::ZERO);
    ribbons.band(rachis, (2 * pairs.min(12.0).trunc_to::<u32>()).max(8), |s| {
        // A thread that widens where the pinnae are; with few of them the tip itself is a small blade.
        let blade = 1.4 * bare * smoothstep(bare, 0.9, s);
        segment * (lerp(0.8, 0.95, s) + blade) * (1.0 - 0.8 * smoothstep(0.88, 1.0, s))
    });
    for (k, place, grown) in series(pairs) {
        for (far, side) in [-1.0_f32, 1.0].into_iter().enumerate() {
            // Each pinna has its own stream, so that it keeps its shape while others grow beside it.
            let mut own = stream.child(Purpose::Leaf, (2 * k + far).to_u64());
            let stray = own.range32(-0.3, 0.3) / (pairs + 1.0);
            let u = (place + stray).clamp(0.03, 0.97);
            let t = lerp(first(bare), LAST, u);
            let reach = grown * 0.5 * width * arch(u) * own.range32(0.8, 1.15);
            let spread = lerp(lerp(1.1, 0.75, bare), 0.5, u) + own.range32(-0.14, 0.14);
            let tilt = own.range32(-0.35, 0.85) * (1.0 - 0.6 * bare);
            let lacking = own.chance(f64::from(LACKING * bare));
            let along = vec3(side * spread.sin() * tilt.cos(), spread.cos(), spread.sin() * tilt.sin());
            let up = vec3(-side * tilt.sin(), 0.0, tilt.cos());
            let up = (up - along * up.dot(along)).normalize_or(Vec3::Z);
            // The outline's width is measured in projection, so pinnae at a small angle to the rachis are lengthened.
            let lobes = lobes * smoothstep(4.5 * segment, 5.5 * segment, reach);
            if !lacking {
                ribbons.pinna(vec3(0.0, t * length, 0.0), along * (reach / spread.sin()), up, lobes, &mut own);
            }
        }
    }
    ribbons.rest
}

#[cfg(test)]
mod tests {
    use super::super::skeleton::Measures;
    use super::*;

    /// Rationale: a leaf that is rebuilt as it grows could lose area and lobes from one day to the next. Expected: a
    /// leaf that is one hundredth longer and wider never has an area smaller by more than a thousandth, whatever its
    /// number of pairs, from the size of a seedling's leaf to that of a grown one.
    #[test]
    fn a_growing_leaf_loses_nothing() {
        let area = |length: f32, seed: u64| {
            let measures = Measures { stalk: 0.0, stalk_joints: 1, length, veins: vec![0.5], secondaries: None };
            let division = Division { pairs: 9, lobes: 4, bare: 0.3, segment: 7e-4, cell: CELL };
            let mut stream = Stream::of(seed, 0, Purpose::Leaf, 0);
            let rest = blade(division, 0.4 * length, &Skeleton::new(&measures), &mut stream);
            let corner = |k: u32| rest.positions[k.to_usize()];
            let double = |[a, b, c]: &[u32; 3]| (corner(*b) - corner(*a)).cross(corner(*c) - corner(*a)).length();
            0.5 * rest.triangles.iter().map(double).sum::<f32>()
        };
        for seed in 0..8 {
            let mut before = 0.0;
            for step in 0..240 {
                let length = 0.006 * 1.01_f32.powi(step);
                let now = area(length, seed);
                assert!(now >= 0.999 * before, "seed {seed}, {length} m: {before} to {now} m²");
                before = now;
            }
        }
    }

    /// Expected: below its first pinna a rachis is a thread no wider than a segment. With a long bare part the pinnae
    /// are near the tip; without one they start near the base.
    #[test]
    fn a_bare_rachis_is_a_thread() {
        let skeleton =
            Skeleton::new(&Measures { stalk: 0.0, stalk_joints: 1, length: 0.02, veins: vec![0.5], secondaries: None });
        for seed in 0..20 {
            for (bare, from) in [(0.5, 0.5), (0.0, 0.05)] {
                let division = Division { pairs: 3, lobes: 1, bare, segment: 0.001, cell: CELL };
                let mut stream = Stream::of(seed, 0, Purpose::Leaf, 0);
                let rest = blade(division, 0.008, &skeleton, &mut stream);
                let wide = rest.positions.iter().filter(|p| p.x.abs() > 0.00051);
                let lowest = wide.map(|p| p.y / 0.02).fold(1.0, f32::min);
                assert!(lowest > from, "seed {seed}, {bare}: {lowest}");
                assert!(bare > 0.0 || lowest < 0.4, "seed {seed}: {lowest}");
            }
        }
    }
}
