//! Marks of one leaf: the parts that are missing, and the tissue at each point of the rest.
//!
//! Coordinates are mm on the flat leaf's texture, x to the right of the midrib, y up from the lower edge, so a hole of
//! 2 mm has this size on any leaf. Marks are not stored as images: discs, cuts and noise functions are evaluated at any
//! point.

mod edge;
#[cfg(test)]
mod tests;
mod until;

use super::Condition;
use crate::plant::ConditionDesc;
use furrow_base::geometry::{AlphaMask, Margin};
use furrow_base::math::{Vec2, lerp, smoothstep, vec2};
use furrow_base::ron_file::{Positive, Vary};
use furrow_base::sampling::rng::mix;
use furrow_base::sampling::{Purpose, Stream};
use furrow_optics::texture::noise::Perlin;
use std::sync::Arc;

/// Fraction of the oldest leaf's marks that the youngest has.
const YOUNG: f32 = 0.2;
/// Fraction of a cotyledon's flea-beetle holes that a true leaf has.
const BEETLE: f32 = 0.33;
/// Area of a leaf with the full number of holes, mm²: for slug holes, for flea-beetle holes on cotyledons, and on true
/// leaves. Based on a beet with four leaves, and its cotyledon. Smaller leaves have proportionally fewer holes; larger
/// leaves do not have more.
const MEETS_MM2: [f32; 3] = [800.0, 150.0, 400.0];
/// Largest fraction of a blade that holes may remove: a leaf that has lost more would have been shed or have stayed
/// smaller.
const MOST_EATEN: f32 = 0.12;
/// Width of the dead rim of a hole, mm.
const RIM_MM: f32 = 0.35;
/// Height above the soil at which splash, and the dust in excess of that at the top, have fallen to 1/e, metres.
const LOW: f32 = 0.06;
/// Ratio of the dust on leaves far above the soil to that at the soil.
const HIGH_DUST: f32 = 0.15;
/// Side of the squares that each hold at most one speck of soil, mm; specks of 0.3–2 mm fit in.
const SPECK_MM: f32 = 2.4;
/// Amplitude of a ragged outline's deviation from its ellipse.
const RAGGED: f32 = 0.25;

/// Square of the distance from a patch's centre, in radii, beyond which the patch has no effect.
const FAR_SQUARED: f32 = 6.0;

/// Properties of a leaf that its marks depend on.
#[derive(Clone, Copy, Debug)]
pub struct Bearer<'a> {
    /// Relative age: 0 the youngest of its plant, 1 the oldest.
    pub age: f32,
    /// Whether it is a cotyledon.
    pub cotyledon: bool,
    /// Fraction of the leaf that this part represents; below 1 for a leaflet.
    pub share: f32,
    /// Height of its centre above the soil, metres.
    pub height: f32,
    /// Fraction of its marks that the leaf has received so far, for a leaf that is rendered on several days. `image_mm`
    /// is then its final size, so that marks keep their places and grow with the leaf.
    pub met: Option<f32>,
    /// Width and height that its texture covers, mm.
    pub image_mm: Vec2,
    /// Mask of the undamaged blade; `None` if the texture covers it entirely.
    pub mask: Option<&'a AlphaMask>,
    /// Distances to the margin of the same mask.
    pub margin: Option<&'a Arc<Margin>>,
}

/// Ellipse with a ragged outline.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Patch {
    centre: Vec2,
    radius: f32,
    /// Direction of its long axis, unit vector.
    turn: Vec2,
    stretch: f32,
    phase: Vec2,
}

impl Patch {
    fn new(centre: Vec2, radius: f32, s: &mut Stream) -> Self {
        let angle = s.range32(0.0, std::f32::consts::TAU);
        let (turn, stretch) = (vec2(angle.cos(), angle.sin()), s.range32(1.0, 1.35));
        Self { centre, radius, turn, stretch, phase: vec2(s.range32(0.0, 99.0), s.range32(0.0, 99.0)) }
    }

    /// Returns the distance from its centre beyond which the patch has no effect, mm.
    fn reach(&self) -> f32 {
        FAR_SQUARED.sqrt() * self.radius * 1.001
    }

    /// Returns the distance from its centre, 1 on its outline; `f32::MAX` far outside.
    fn at(&self, p: Vec2, noise: &Perlin) -> f32 {
        let q = (p - self.centre) / self.radius;
        if q.length_squared() > FAR_SQUARED {
            return f32::MAX;
        }
        let q = vec2(q.dot(self.turn) / self.stretch, q.perp_dot(self.turn) * self.stretch);
        let n = noise.at2(f64::from(q.x * 1.3 + self.phase.x), f64::from(q.y * 1.3 + self.phase.y));
        q.length() / (1.0 + RAGGED * n as f32)
    }
}

/// Tear: a wedge from the margin inwards.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Tear {
    from: Vec2,
    /// Direction inwards, unit vector.
    along: Vec2,
    length: f32,
    width: f32,
}

impl Tear {
    /// Returns the distance from its start beyond which the tear has no effect, mm. Its sides deviate by less than a
    /// millimetre.
    fn reach(&self) -> f32 {
        self.length + self.width + 1.0
    }

    /// Returns `true` if a point is inside the tear or within `beside` mm of its sides.
    fn holds(&self, p: Vec2, noise: &Perlin, beside: f32) -> bool {
        let q = p - self.from;
        let s = q.dot(self.along) / self.length;
        if !(-0.6..1.0 + beside / self.length).contains(&s) {
            return false;
        }
        let stray = 0.8 * noise.at2(f64::from(p.x * 0.35), f64::from(p.y * 0.35)) as f32 * s.max(0.0);
        (q.perp_dot(self.along) + stray).abs() < 0.5 * self.width * (1.0 - s.max(0.0)) + beside
    }
}

/// Tissue at a point of a leaf; all values but `shade` are in 0–1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tissue {
    /// Yellowness between veins.
    pub interveinal: f32,
    /// Yellowness independent of the veins.
    pub yellow: f32,
    /// Dead tissue.
    pub brown: f32,
    /// Reddish rim around dead tissue.
    pub rim: f32,
    /// Fraction covered by soil.
    pub soil: f32,
    /// Brightness factor of dead tissue and soil at this point, about 1.
    pub shade: f32,
}

/// Marks of one leaf.
#[derive(Clone, Debug, PartialEq)]
pub struct Marks {
    image_mm: Vec2,
    seed: u32,
    holes: Vec<Patch>,
    bites: usize,
    tears: Vec<Tear>,
    blotches: Vec<Patch>,
    spots: Vec<Patch>,
    chlorosis: f32,
    scorch_mm: f32,
    dust: f32,
    /// Expected number of specks in a square of side [`SPECK_MM`].
    splash: f32,
    margin: Option<Arc<Margin>>,
}

impl Marks {
    /// Draws the marks of a leaf; `stream` is the leaf's, see [`super::leaf_stream`].
    pub fn draw(desc: &ConditionDesc, condition: &Condition, bearer: &Bearer<'_>, stream: &Stream) -> Self {
        let of = |k: u64| stream.child(Purpose::Condition, k);
        let worn = if bearer.met.is_some() { 1.0 } else { lerp(YOUNG, 1.0, bearer.age) };
        let often = worn * bearer.share;
        let on_leaf = |radii: &Vary<Positive>, mean: f32, k: u64| {
            let mut s = of(k);
            let n = s.poisson(f64::from(mean * often));
            (0..n).filter_map(|_| patch(bearer, radii, &mut s)).collect::<Vec<Patch>>()
        };
        let [slugs, seed_leaf, true_leaf] = MEETS_MM2;
        let (shots, beetles) = if bearer.cotyledon { (1.0 / worn, seed_leaf) } else { (BEETLE, true_leaf) };
        let slugged = (on_leaf(&desc.hole_mm, condition.holes, 1), slugs);
        let shot = (on_leaf(&desc.shot_hole_mm, condition.shot_holes * shots, 2), beetles);
        let mut holes = met([slugged, shot], bearer, &mut of(9));
        let whole = holes.len();
        let mut s = of(3);
        for _ in 0..s.poisson(f64::from(condition.bites * often)) {
            bite(bearer, &desc.bite_mm, &mut holes, &mut s);
        }
        let mut s = of(4);
        let tears = (0..s.poisson(f64::from(condition.tears * often))).filter_map(|_| tear(bearer, &mut s)).collect();
        let low = (-bearer.height.max(0.0) / LOW).exp();
        let mut s = of(7);
        let uneven = |s: &mut Stream| (0.4 * s.normal() as f32).exp();
        // Old leaves turn yellow first, with random variation between leaves of equal age.
        let chlorosis = (condition.chlorosis * bearer.age.powf(1.5) * uneven(&mut s)).min(1.0);
        let scorch_mm = scorch_mm(condition, bearer, &mut of(10)) * uneven(&mut s);
        let dust = (condition.dust * lerp(HIGH_DUST, 1.0, low) * uneven(&mut s)).min(0.9);
        let splash = condition.splash * low * SPECK_MM * SPECK_MM / 100.0;
        let marks = Self {
            image_mm: bearer.image_mm,
            seed: of(8).seed32(),
            bites: holes.len() - whole,
            holes,
            tears,
            blotches: on_leaf(&desc.blotch_mm, condition.blotches, 5),
            spots: on_leaf(&desc.spot_mm, condition.spots, 6),
            chlorosis,
            scorch_mm,
            dust,
            splash,
            margin: bearer.margin.cloned(),
        };
        match bearer.met {
            Some(share) => marks.until(share, stream),
            None => marks,
        }
    }

    /// Returns the number of holes, without bites.
    pub fn holes(&self) -> usize {
        self.holes.len() - self.bites
    }

    /// Returns `true` if parts of the leaf are missing.
    pub fn cuts(&self) -> bool {
        !(self.holes.is_empty() && self.tears.is_empty())
    }

    /// Returns `true` if the leaf is complete, healthy and clean.
    pub fn nothing(&self) -> bool {
        let none = [self.chlorosis, self.scorch_mm, self.dust, self.splash].iter().all(|x| *x <= 0.0);
        none && !self.cuts() && self.blotches.is_empty() && self.spots.is_empty()
    }

    /// Returns the mean fraction of the leaf covered by dust, 0–1.
    pub fn dust(&self) -> f32 {
        self.dust
    }

    /// Returns `true` if the tissue between the veins differs from that along them.
    pub fn interveinal(&self) -> bool {
        self.chlorosis > 0.0
    }

    /// Returns the width and height that the leaf's texture covers, mm.
    pub fn image_mm(&self) -> Vec2 {
        self.image_mm
    }

    fn place(&self, uv: Vec2) -> Vec2 {
        vec2(uv.x - 0.5, 1.0 - uv.y) * self.image_mm
    }

    /// Returns the uv bounds around a point of the leaf.
    fn about(&self, centre: Vec2, reach: f32) -> [Vec2; 2] {
        let (lo, hi) = ((centre - reach) / self.image_mm, (centre + reach) / self.image_mm);
        [vec2(lo.x + 0.5, 1.0 - hi.y), vec2(hi.x + 0.5, 1.0 - lo.y)]
    }

    /// Returns the mask with the missing parts cut out. Without a mask, starts from a fully opaque one.
    pub fn cut(&self, mask: Option<&AlphaMask>) -> AlphaMask {
        let noise = Perlin::new(self.seed);
        // The resolution of a generated texture: about 6 texels per mm.
        let texels = |mm: f32| ((mm * 6.0) as u32).clamp(64, 1024);
        let whole = || AlphaMask::new(texels(self.image_mm.x), texels(self.image_mm.y), |_, _| true);
        let mut left = mask.cloned().unwrap_or_else(whole);
        for hole in &self.holes {
            left.cut(self.about(hole.centre, hole.reach()), |uv| hole.at(self.place(uv), &noise) < 1.0);
        }
        for tear in &self.tears {
            left.cut(self.about(tear.from, tear.reach()), |uv| tear.holds(self.place(uv), &noise, 0.0));
        }
        // Bites and tears may cut off parts of the blade; holes rarely do.
        if self.bites > 0 || !self.tears.is_empty() { left.hanging() } else { left }
    }

    /// Returns the noise that [`Marks::tissue`] needs. It is slow to build, so build it once.
    pub fn noise(&self) -> Perlin {
        Perlin::new(self.seed)
    }

    /// Returns the tissue of the leaf at `uv`.
    pub fn tissue(&self, uv: Vec2, noise: &Perlin) -> Tissue {
        let p = self.place(uv);
        let n =
            |scale: f32, shift: f32| noise.at2(f64::from(p.x / scale + shift), f64::from(p.y / scale - shift)) as f32;
        let mut t = Tissue { shade: 1.0, ..Tissue::default() };
        if self.chlorosis > 0.0 {
            // Patches of one or two cm.
            t.interveinal = (self.chlorosis * (1.0 + 0.6 * n(14.0, 3.1))).clamp(0.0, 1.0);
        }
        for b in &self.blotches {
            let d = b.at(p, noise);
            t.yellow = t.yellow.max(0.75 * smoothstep(1.25, 0.45, d));
        }
        for s in &self.spots {
            let d = s.at(p, noise);
            t.brown = t.brown.max(smoothstep(0.95, 0.7, d));
            t.rim = t.rim.max(smoothstep(0.6, 0.8, d) * smoothstep(1.2, 0.95, d));
            t.yellow = t.yellow.max(0.6 * smoothstep(1.55, 1.1, d));
        }
        for h in &self.holes {
            let d = h.at(p, noise);
            if d < f32::MAX {
                let mm = (d - 1.0) * h.radius;
                t.brown = t.brown.max(0.8 * smoothstep(RIM_MM, 0.3 * RIM_MM, mm));
                t.yellow = t.yellow.max(0.35 * smoothstep(4.0 * RIM_MM, RIM_MM, mm));
            }
        }
        if let Some(margin) = self.margin.as_ref().filter(|_| self.scorch_mm > 0.0) {
            let inward = margin.at(uv) * self.image_mm.y;
            let width = self.scorch_mm * (1.0 + 1.1 * n(9.0, 7.7)).max(0.0);
            // A very narrow strip is faded instead of rendered at full strength.
            let soft = width.min(0.2);
            t.brown = t.brown.max(smoothstep(width + soft, 0.7 * width, inward) * (width / 0.3).min(1.0));
            t.yellow = t.yellow.max(0.8 * smoothstep(3.0 * width + soft, width, inward) * (width / 0.6).min(1.0));
        }
        if self.dust > 0.0 {
            // Dust forms patches of a few mm with fine grain.
            t.soil = (self.dust * (1.0 + 0.8 * n(5.0, 11.0) + 0.6 * n(0.7, 23.0))).clamp(0.0, 0.95);
        }
        if self.splash > 0.0 {
            t.soil = t.soil.max(self.speck(p, noise));
        }
        if t.brown > 0.0 || t.soil > 0.3 {
            t.shade = 1.0 + 0.3 * n(0.9, 31.0) + 0.15 * n(0.3, 5.0);
        }
        t
    }

    /// Returns the cover by a speck of soil at a point: jittered dots in a grid of squares.
    fn speck(&self, p: Vec2, noise: &Perlin) -> f32 {
        let cell = (p / SPECK_MM).floor();
        let mut most = 0.0_f32;
        for j in -1..=1 {
            for i in -1..=1 {
                let c = cell + vec2(i as f32, j as f32);
                let key = mix(mix(u64::from(self.seed) ^ (c.x as i64 as u64)) ^ (c.y as i64 as u64));
                let unit = |k: u32| (mix(key.wrapping_add(u64::from(k))) >> 40) as f32 / (1u64 << 24) as f32;
                if unit(0) >= self.splash {
                    continue;
                }
                // Small specks are more frequent: radii 0.15–1 mm, log-uniform.
                let radius = 0.15 * (unit(1) * 1.9).exp();
                let centre = (c + vec2(unit(2), unit(3))) * SPECK_MM;
                let speck = Patch { centre, radius, turn: Vec2::X, stretch: 1.0, phase: vec2(unit(4), unit(5)) * 99.0 };
                most = most.max(0.95 * smoothstep(1.1, 0.75, speck.at(p, noise)));
            }
        }
        most
    }
}

/// Returns the width of a leaf's dead margin, mm; 0 for most leaves.
fn scorch_mm(condition: &Condition, bearer: &Bearer<'_>, s: &mut Stream) -> f32 {
    let old = bearer.age.powi(2);
    let Some(margin) = bearer.margin.filter(|_| s.chance(f64::from(condition.scorched * old))) else { return 0.0 };
    condition.scorch * bearer.age * margin.deepest() * bearer.image_mm.y
}

/// Returns the area of the blade according to its mask, mm², estimated on a grid of 24 × 24 points.
fn area(bearer: &Bearer<'_>) -> f32 {
    const SIDE: usize = 24;
    let at = |i: usize| (i as f32 + 0.5) / SIDE as f32;
    let opaque = |k: &usize| bearer.mask.is_none_or(|m| m.opaque_at(vec2(at(k % SIDE), at(k / SIDE))));
    let share = (0..SIDE * SIDE).filter(opaque).count() as f32 / (SIDE * SIDE) as f32;
    bearer.image_mm.x * bearer.image_mm.y * share
}

/// Selects from each kind of holes, given with the area that has the full number, those that a blade of this size has.
/// No two overlap, and their total area stays below [`MOST_EATEN`]. A leaf above these areas has the same holes
/// whatever its size.
fn met(kinds: [(Vec<Patch>, f32); 2], bearer: &Bearer<'_>, s: &mut Stream) -> Vec<Patch> {
    let mut kept: Vec<Patch> = Vec::new();
    if kinds.iter().all(|(holes, _)| holes.is_empty()) {
        return kept;
    }
    let area = area(bearer);
    let mut left = MOST_EATEN * area;
    for (holes, meets) in kinds {
        let chance = (area / meets).min(1.0);
        for hole in holes {
            let eaten = std::f32::consts::PI * hole.radius * hole.radius;
            let apart = |other: &Patch| other.centre.distance(hole.centre) > 1.3 * (other.radius + hole.radius);
            if s.uniform32() < chance && eaten <= left && kept.iter().all(apart) {
                left -= eaten;
                kept.push(hole);
            }
        }
    }
    kept
}

/// Returns the shorter side of the leaf's texture, mm.
fn narrow(bearer: &Bearer<'_>) -> f32 {
    bearer.image_mm.min_element()
}

fn there(bearer: &Bearer<'_>, p: Vec2) -> bool {
    let uv = vec2(0.5 + p.x / bearer.image_mm.x, 1.0 - p.y / bearer.image_mm.y);
    bearer.mask.is_none_or(|m| m.opaque_at(uv))
}

/// Draws a patch on the blade, off the midrib where there is room; `None` if 40 tries miss a very thin leaf.
fn patch(bearer: &Bearer<'_>, radii: &Vary<Positive>, s: &mut Stream) -> Option<Patch> {
    let radius = radii.draw32(s).min(0.2 * narrow(bearer));
    let half = 0.5 * bearer.image_mm;
    let mut last = None;
    for _ in 0..40 {
        let p = vec2(s.range32(-half.x, half.x), s.range32(0.0, bearer.image_mm.y));
        if there(bearer, p) {
            last = Some(p);
            if p.x.abs() > 0.8 * radius {
                break;
            }
        }
    }
    last.map(|p| Patch::new(p, radius, s))
}

/// Draws a point on the margin, on either side, and returns it with its side (−1 or 1).
fn edge(bearer: &Bearer<'_>, s: &mut Stream) -> Option<(Vec2, f32)> {
    let side = if s.chance(0.5) { 1.0 } else { -1.0 };
    let y = s.range32(0.12, 0.92) * bearer.image_mm.y;
    let half = 0.5 * bearer.image_mm.x;
    let steps = 200;
    (0..steps)
        .map(|i| vec2(side * half * (1.0 - i as f32 / steps as f32), y))
        .find(|p| there(bearer, *p))
        .map(|p| (p, side))
}

/// Adds the mouthfuls of a bite, side by side along the margin.
fn bite(bearer: &Bearer<'_>, radii: &Vary<Positive>, holes: &mut Vec<Patch>, s: &mut Stream) {
    let Some((mut at, side)) = edge(bearer, s) else { return };
    for _ in 0..=s.index(4) {
        let radius = radii.draw32(s).min(0.22 * narrow(bearer));
        holes.push(Patch::new(at, radius, s));
        let y = at.y + 1.1 * radius;
        let reach = (0..200).map(|i| vec2(side * 0.5 * bearer.image_mm.x * (1.0 - i as f32 / 200.0), y));
        let Some(next) = reach.into_iter().find(|p| there(bearer, *p)) else { return };
        at = next;
    }
}

/// Draws a tear. It runs between two secondary veins, inwards and down.
fn tear(bearer: &Bearer<'_>, s: &mut Stream) -> Option<Tear> {
    let (from, side) = edge(bearer, s)?;
    let angle = s.range32(0.3, 0.9);
    let along = vec2(-side * angle.cos(), -angle.sin());
    let length = from.x.abs() * s.range32(0.35, 0.85) / angle.cos();
    Some(Tear { from, along, length, width: s.range32(0.06, 0.22) * length })
}
