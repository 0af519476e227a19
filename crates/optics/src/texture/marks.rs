//! Marks of one leaf as a procedural texture: the parts that are missing, and the tissue at each point of the rest.
//!
//! Coordinates are mm on the flat leaf's texture, x to the right of the midrib, y up from the lower edge, so a hole of
//! 2 mm has this size on any leaf. Marks are not stored as images: discs, cuts and noise functions are evaluated at any
//! point.

use super::noise::Perlin;
use furrow_base::geometry::{AlphaMask, Margin};
use furrow_base::math::{RoundTo, ToFloat, Vec2, smoothstep, vec2};
use furrow_base::sampling::rng::mix;
use std::sync::Arc;

/// Width of the dead rim of a hole, mm.
const RIM_MM: f32 = 0.35;
/// Side of the squares that each hold at most one speck of soil, mm; specks of 0.3–2 mm fit in.
pub const SPECK_MM: f32 = 2.4;
/// Amplitude of a ragged outline's deviation from its ellipse.
const RAGGED: f32 = 0.25;

/// Square of the distance from a patch's centre, in radii, beyond which the patch has no effect.
const FAR_SQUARED: f32 = 6.0;

/// Ellipse with a ragged outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// Centre, mm.
    pub centre: Vec2,
    /// Mean radius, mm.
    pub radius: f32,
    /// Direction of its long axis, unit vector.
    pub turn: Vec2,
    /// Ratio of the long semi-axis to the radius.
    pub stretch: f32,
    /// Offset of its outline in the noise.
    pub phase: Vec2,
}

impl Patch {
    /// Returns the distance from its centre beyond which the patch has no effect, mm.
    fn reach(&self) -> f32 {
        FAR_SQUARED.sqrt() * self.radius * 1.001
    }

    /// Returns the distance from its centre, 1 on its outline; `f32::MAX` far outside.
    fn at(&self, p: Vec2, noise: &Perlin) -> f32 {
        self.local(p).map_or(f32::MAX, |q| q.length() / self.outline(q, noise))
    }

    /// Returns `true` if `at(p, noise) < 1`. The noise is evaluated only near the outline.
    fn holds(&self, p: Vec2, noise: &Perlin) -> bool {
        let Some(q) = self.local(p) else { return false };
        let distance = q.length();
        // One percent exceeds the rounding of the division.
        if (distance - 1.0).abs() > RAGGED + 0.01 { distance < 1.0 } else { distance / self.outline(q, noise) < 1.0 }
    }

    /// Returns the position relative to the ellipse, which becomes the unit circle; `None` far outside.
    fn local(&self, p: Vec2) -> Option<Vec2> {
        let q = (p - self.centre) / self.radius;
        if q.length_squared() > FAR_SQUARED {
            return None;
        }
        Some(vec2(q.dot(self.turn) / self.stretch, q.perp_dot(self.turn) * self.stretch))
    }

    /// Returns the distance of the outline in the direction of `q`, 1 ± [`RAGGED`].
    fn outline(&self, q: Vec2, noise: &Perlin) -> f32 {
        let n = noise.at2(f64::from(q.x * 1.3 + self.phase.x), f64::from(q.y * 1.3 + self.phase.y));
        1.0 + RAGGED * n.to_f32()
    }
}

/// Tear: a wedge from the margin inwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tear {
    /// Start on the margin, mm.
    pub from: Vec2,
    /// Direction inwards, unit vector.
    pub along: Vec2,
    /// Length, mm.
    pub length: f32,
    /// Width at the start, mm.
    pub width: f32,
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
        let stray = 0.8 * noise.at2(f64::from(p.x * 0.35), f64::from(p.y * 0.35)).to_f32() * s.max(0.0);
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

/// Marks of one leaf; by default none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Marks {
    /// Width and height that the leaf's texture covers, mm.
    pub image_mm: Vec2,
    /// Seed of [`Marks::noise`] and of the specks of soil.
    pub seed: u32,
    /// Missing patches: holes, then the mouthfuls of bites.
    pub holes: Vec<Patch>,
    /// Number of the last of `holes` that belong to bites.
    pub bites: usize,
    /// Tears from the margin.
    pub tears: Vec<Tear>,
    /// Yellow blotches.
    pub blotches: Vec<Patch>,
    /// Dead spots.
    pub spots: Vec<Patch>,
    /// Yellowness between the veins, 0–1.
    pub chlorosis: f32,
    /// Width of the dead margin, mm.
    pub scorch_mm: f32,
    /// Mean fraction covered by dust, 0–1.
    pub dust: f32,
    /// Expected number of specks of soil in a square of side [`SPECK_MM`].
    pub splash: f32,
    /// Progress of senescence: 0 green, 1 dead. Tip and margin yellow and brown first.
    pub senescence: f32,
    /// Whether it proceeds everywhere at once, as in a stalk.
    pub whole: bool,
    /// Distances to the margin; `None` if the texture covers the leaf entirely.
    pub margin: Option<Arc<Margin>>,
}

impl Marks {
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
        let none = [self.chlorosis, self.scorch_mm, self.dust, self.splash, self.senescence].iter().all(|x| *x <= 0.0);
        none && !self.cuts() && self.blotches.is_empty() && self.spots.is_empty()
    }

    /// Returns `true` if the tissue between the veins differs from that along them.
    pub fn interveinal(&self) -> bool {
        self.chlorosis > 0.0
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
        let texels = |mm: f32| (mm * 6.0).trunc_to::<u32>().clamp(64, 1024);
        let whole = || AlphaMask::new(texels(self.image_mm.x), texels(self.image_mm.y), |_, _| true);
        let mut left = mask.cloned().unwrap_or_else(whole);
        for hole in &self.holes {
            left.cut(self.about(hole.centre, hole.reach()), |uv| hole.holds(self.place(uv), &noise));
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
            |scale: f32, shift: f32| noise.at2(f64::from(p.x / scale + shift), f64::from(p.y / scale - shift)).to_f32();
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
        if self.senescence > 0.0 {
            let (yellow, brown) = self.senescent(uv, n(11.0, 17.3));
            t.yellow = t.yellow.max(yellow);
            t.brown = t.brown.max(brown);
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

    /// Returns yellowness and dead fraction of a senescent leaf at `uv`. Two fronts run from tip and margin to the base:
    /// yellow first, brown after it. `noise` displaces them.
    fn senescent(&self, uv: Vec2, noise: f32) -> (f32, f32) {
        let half_mm = (0.45 * self.image_mm.x).max(1e-3);
        let inward = self.margin.as_ref().map_or(uv.y, |margin| margin.at(uv) * self.image_mm.y / half_mm);
        let late = if self.whole { 0.6 } else { 0.7 * uv.y.clamp(0.0, 1.0) + 0.3 * inward.clamp(0.0, 1.0) };
        let place = (late + 0.14 * noise).clamp(0.0, 1.1);
        let [yellow, brown] = [0.36 * place, 0.42 + 0.34 * place];
        let s = self.senescence;
        (smoothstep(yellow, yellow + 0.24, s), smoothstep(brown, brown + 0.2, s))
    }

    /// Returns `true` if a point of the remaining leaf is within the dead rim of a hole, a bite or a tear. `noise` is
    /// [`Self::noise`].
    pub fn edge(&self, uv: Vec2, noise: &Perlin) -> bool {
        let p = self.place(uv);
        let eaten = self.holes.iter().any(|hole| (hole.at(p, noise) - 1.0) * hole.radius < RIM_MM);
        eaten || self.tears.iter().any(|tear| tear.holds(p, noise, RIM_MM))
    }
    /// Returns the cover by a speck of soil at a point: jittered dots in a grid of squares.
    fn speck(&self, p: Vec2, noise: &Perlin) -> f32 {
        let cell = (p / SPECK_MM).floor();
        let mut most = 0.0_f32;
        for j in -1..=1 {
            for i in -1..=1 {
                let c = cell + vec2(i.to_f32(), j.to_f32());
                let key = mix(mix(u64::from(self.seed) ^ c.x.trunc_to::<i64>().cast_unsigned())
                    ^ c.y.trunc_to::<i64>().cast_unsigned());
                let unit = |k: u32| (mix(key.wrapping_add(u64::from(k))) >> 40).to_f32() / (1u64 << 24).to_f32();
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: the noise of an outline is left out far from it. Expected: a patch holds the same points as by its
    /// distance, on a grid that has points inside, outside and near the outline, for round and long patches.
    #[test]
    fn a_patch_holds_the_points_within_its_outline() {
        let noise = Perlin::new(7);
        for (k, stretch) in [0.5, 1.0, 1.9].into_iter().enumerate() {
            let turn = Vec2::from_angle(k.to_f32());
            let patch = Patch { centre: vec2(3.0, -2.0), radius: 1.7, turn, stretch, phase: vec2(5.3, 61.2) };
            let place = |i: u32| patch.centre + vec2((i % 201).to_f32() - 100.0, (i / 201).to_f32() - 100.0) * 0.05;
            let held = (0..201 * 201).filter(|i| {
                let within = patch.at(place(*i), &noise) < 1.0;
                assert_eq!(patch.holds(place(*i), &noise), within, "{:?}", place(*i));
                within
            });
            let share = held.count().to_f32() * 0.05 * 0.05 / (std::f32::consts::PI * patch.radius * patch.radius);
            assert!((share - 1.0).abs() < 0.2, "{stretch}: {share}");
        }
    }

    /// Rationale: a leaf does not fade as a whole. Expected: its tip yellows before its base and browns before it, the
    /// tissue is first yellow and then brown, a dead leaf is dead everywhere, and a stalk changes everywhere at once.
    /// Source: Botany 87 (2009), 1036–1053 (from apex to base).
    #[test]
    fn a_leaf_yellows_and_browns_from_its_tip() {
        let noise = Perlin::new(3);
        let mean = |senescence: f32, whole: bool, v: f32| {
            let marks = Marks { senescence, whole, image_mm: vec2(20.0, 60.0), ..Marks::default() };
            let points = (0..40).map(|i| marks.tissue(vec2((i.to_f32() + 0.5) / 40.0, v), &noise));
            let sums = points.fold((0.0, 0.0), |sum, t| (sum.0 + t.yellow, sum.1 + t.brown));
            (sums.0 / 40.0, sums.1 / 40.0)
        };
        let [tip, base] = [0.1, 0.9];
        assert!(mean(0.2, false, tip).0 > 0.5 && mean(0.2, false, base).0 < 0.1);
        assert!(mean(0.5, false, base).0 > 0.5 && mean(0.5, false, base).1 < 0.05);
        assert!(mean(0.6, false, tip).1 > 0.5 && mean(0.6, false, base).1 < 0.1);
        assert!([tip, base].iter().all(|v| mean(1.0, false, *v).1 > 0.95));
        assert!((mean(0.5, true, tip).0 - mean(0.5, true, base).0).abs() < 0.1);
        assert_eq!(mean(0.0, false, tip), (0.0, 0.0));
    }
}
