//! Tissue composition over a blade: chlorophyll in and between veins; red, brown and mealy tissue.

use super::cells::{Cells, unit};
use super::leaf_recipe::{LeafRecipe, TissueVariation};
use super::shape::Shape;
use crate::texture::noise::Tiling;
use furrow_base::math::{RoundTo, ToFloat, Vec2, lerp, smoothstep, vec2};
use furrow_base::sampling::rng::{Purpose, Stream, mix};

/// Tissue composition at one point of the blade.
pub(super) struct Tissue {
    /// Chlorophyll relative to the blade's.
    pub(super) chlorophyll: f32,
    pub(super) red: f32,
    pub(super) brown: f32,
    pub(super) meal: f32,
    /// Factor on the colour, from the fine grain of the epidermis.
    pub(super) shade: f32,
}

pub(super) struct Surface<'a> {
    look: &'a TissueVariation,
    length_mm: f32,
    aspect: f32,
    noise: Tiling,
    areoles: Cells,
    areole: f32,
    blotches: Vec<(Vec2, f32, f32)>,
    spots: Vec<(Vec2, f32, f32)>,
    seed: u64,
}

impl<'a> Surface<'a> {
    pub(super) fn new(recipe: &'a LeafRecipe, stream: &Stream) -> Self {
        let length_mm = recipe.length_mm.f32();
        let aspect = recipe.aspect.f32();
        let mut s = stream.child(Purpose::Texture, 3);
        let mut marks = |mean: f64, lo: f32, hi: f32| -> Vec<(Vec2, f32, f32)> {
            (0..s.poisson(mean))
                .map(|_| {
                    let p = vec2(s.range32(-0.5, 0.5) * aspect, s.range32(0.05, 0.97));
                    (p, s.range32(lo, hi) / length_mm, s.range32(0.35, 1.0))
                })
                .collect()
        };
        let blotches = marks(recipe.look.blotches.get(), 2.5, 9.0);
        let spots = marks(recipe.look.spots.get(), 0.12, 0.4);
        let seed = s.seed32();
        Self {
            look: &recipe.look,
            length_mm,
            aspect,
            noise: Tiling::new(seed.into()),
            areoles: Cells::new(u64::from(seed) + 1, (8192, 8192), 0.85),
            areole: recipe.look.areoles.0.f32() / length_mm,
            blotches,
            spots,
            seed: u64::from(seed),
        }
    }

    pub(super) fn at(&self, p: Vec2, veins: [f32; 3], to_margin_mm: f32, shape: &Shape) -> Tissue {
        let look = self.look;
        let far = vec2(64.0, 64.0);
        let noise = |q: Vec2, octaves: u32| self.noise.fbm(q.x, q.y, 8192, octaves, 0.55);
        let across = (p.x.abs() / shape.half_width(p.y).max(1e-4)).min(1.0);

        let mottle = look.mottle.f32();
        let mut c = 1.0 + mottle * 1.4 * noise(p * 5.0 + far, 5) + mottle * 0.55 * noise(p * 55.0 + far * 2.0, 3);
        c *= 1.0 - look.pale_base.f32() * (1.0 - smoothstep(0.0, 0.55, p.y));
        c *= 1.0 - look.pale_margin.f32() * (-to_margin_mm / (0.016 * self.length_mm)).exp();

        // Areoles at three scales with borders distorted by noise; smaller ones have fainter borders.
        let bend = vec2(noise(p * 40.0 + far * 3.0, 2), noise(p * 40.0 + far * 5.0, 2));
        let mut net = 0.0f32;
        for (k, (size, weight)) in [(4.2, 1.35), (1.8, 1.0), (0.75, 0.55)].into_iter().enumerate() {
            let cell = self.areoles.at(p / (self.areole * size) + bend * 0.35 + far * (k + 7).to_f32());
            let line = 1.0 - smoothstep(0.02, 0.02 + 0.15 / (size * 0.55_f32).max(1.0), cell.border);
            net = net.max(line * weight);
            c *= 1.0 + mottle * 0.8 * (cell.own - 0.5);
        }
        let fades = 1.0 - 0.35 * across;
        c *= 1.0 - look.areoles.1.f32() * net * fades;
        let mut kept = 1.0f32;
        let keeps = [look.veins.0.f32(), look.veins.1.f32(), look.veins.2.f32()];
        for (order, keep) in keeps.into_iter().enumerate().rev() {
            // The midrib becomes greener towards the tip, where it is thin and covered by the blade.
            let keep = if order == 0 {
                lerp(keep, 0.62, smoothstep(0.2, 1.0, p.y))
            } else {
                lerp(keep, 0.85, 0.4 * across * across)
            };
            kept = kept.min(1.0 - (1.0 - keep) * veins[order]);
        }
        c *= kept;
        for (q, radius, depth) in &self.blotches {
            let ragged = radius * (1.0 + 0.5 * noise((p - *q) * 30.0 + far * 9.0, 3));
            c *= 1.0 - 0.5 * depth * (1.0 - smoothstep(0.2, 1.0, p.distance(*q) / ragged.max(1e-5)));
        }
        let mut brown = 0.0f32;
        for (q, radius, depth) in &self.spots {
            let d = p.distance(*q) / (radius * (1.0 + 0.4 * noise((p - *q) * 200.0 + far * 11.0, 2))).max(1e-5);
            brown = brown.max(depth * (1.0 - smoothstep(0.6, 1.0, d)));
            c *= 1.0 - 0.25 * (1.0 - smoothstep(0.8, 1.8, d));
        }
        let rim = (-to_margin_mm / (0.010 * self.length_mm)).exp();
        let foot = veins[0] * (1.0 - smoothstep(0.0, 0.45, p.y));
        let red =
            look.red.f32() * (rim + foot).min(1.0) * (0.7 + 0.6 * noise(p * 16.0 + far * 13.0, 3)).clamp(0.0, 1.0);

        let mark = self.mark(p, across);
        c *= 1.0 + 0.5 * mark;
        let red = red.max(0.6 * mark);
        if shape.is_spine(p) {
            c *= 0.12;
        }
        let meal = self.meal(p);
        let hash = unit(mix(self.seed
            ^ (u64::from((p.x * 6000.0 + 9e5).trunc_to::<u32>()) << 32
                | u64::from((p.y * 6000.0 + 9e5).trunc_to::<u32>()))));
        let shade = 1.0 + look.speckle.f32() * (noise(p * 230.0 + far * 17.0, 2) + 0.8 * (hash - 0.5));
        Tissue { chlorophyll: c.max(0.02), red, brown, meal, shade }
    }

    /// Returns the intensity of the dark mark at `p`.
    fn mark(&self, p: Vec2, across: f32) -> f32 {
        let dark = self.look.mark.f32();
        if dark == 0.0 {
            return 0.0;
        }
        let ragged = 0.03 * self.noise.fbm(p.x * 30.0 + 11.0, p.y * 30.0 + 5.0, 8192, 3, 0.55);
        let from = (p.y - (0.6 - 0.2 * across) + ragged).abs() / lerp(0.13, 0.05, across);
        dark * (1.0 - smoothstep(0.4, 1.0, from)) * (1.0 - smoothstep(0.7, 0.95, across))
    }

    /// Returns the coverage by meal: small round bladder hairs, dense at the base and along the middle.
    fn meal(&self, p: Vec2) -> f32 {
        let cover = self.look.meal.f32();
        if cover == 0.0 {
            return 0.0;
        }
        let size = 0.2 / self.length_mm;
        let across = (p.x.abs() / (0.5 * self.aspect)).min(1.0);
        let place = (1.25 - 1.05 * smoothstep(0.0, 0.8, p.y)) * (1.0 - 0.35 * across);
        let patch = (1.0 + 1.3 * self.noise.fbm(p.x * 9.0 + 31.0, p.y * 9.0 + 77.0, 8192, 4, 0.55)).max(0.0);
        let cell = self.areoles.at(p / size + vec2(501.0, 203.0));
        let grain = (1.0 - smoothstep(0.12, 0.5, cell.away)) * smoothstep(0.2, 0.9, cell.own);
        (cover * place * patch * (0.3 + 2.4 * grain)).clamp(0.0, 0.85)
    }
}
