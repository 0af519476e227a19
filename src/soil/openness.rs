//! How bright coarse ground is: as bright, on the mean, as the same ground made finely.
//!
//! Ground of large cells has lost the relief that shades itself. What is left of it are pits between its texels, whose depth says nothing about how much of the
//! sky they hide, since their width is that of a texel. So a few patches of the ground are made as `detail: Full` makes them, and the depth that hides half of the
//! sky, like the one that keeps half of the wetness, is chosen such that both send as much light up.
//!
//! What a texel lacks of the light it gets back in part from ground as bright as the mean.
//!
//! Clods that are bodies in full detail, but not here, shade themselves and each other too: what they do on level ground is reckoned from their
//! heights alone.

use super::FACETS;
use super::bake::{Painted, Shade, closing, wet};
use super::ground::Ground;
use super::lit::{Heights, Lit, NEAREST_M};
use super::pile::Pile;
use super::site::{FULL_CELL_M, FULL_TEXEL_M, Sizes};
use super::{Canopy, InView, LayerMaps, Rect};
use crate::math::{Vec2, Vec3, vec2};
use rayon::prelude::*;

/// Patches along each side of the ground, their sides, and what is made around each, metres.
const PATCHES: usize = 4;
const PATCH_M: f32 = 0.12;
const AROUND_M: f32 = 0.06;

/// Places in each patch whose light is reckoned.
const SAMPLES: usize = 800;

/// Side of the square on which clods are laid, in lengths of the longest, and at least, metres; samples of their heights along it, and every how many
/// of them the light is reckoned, in the middle half.
const LONGEST_CLODS: f32 = 8.0;
const LEAST_CLOD_M: f32 = 0.1;
const CLOD_SAMPLES: usize = 800;
const CLOD_EVERY: usize = 7;

/// Limits of the depths, metres: what is finer than full detail's pits is as deep as they are.
const LEAST_M: f32 = super::bake::HALF_SKY_M;
const MOST_M: f32 = 10.0;

/// Most of the light that lost relief may hide.
const MOST_HIDDEN: f32 = 0.9;

/// Halvings of their logarithm: to a part in a thousand.
const HALVINGS: usize = 16;

/// One texel of some ground.
#[derive(Clone, Copy, Debug)]
struct Sample {
    /// Past the relief of the mesh.
    lit: Lit,
    /// Depth below its surroundings, metres.
    pit: f32,
    /// Share of the moisture that it has left.
    left: f32,
    /// Reflectance of its dry soil, over any unit.
    albedo: f32,
}

impl Ground {
    /// How pits and lost relief darken it: [`Shade::FULL`] on ground of full detail; on coarse ground what makes it send as much
    /// light, and hold as much water, as full detail would.
    pub(super) fn shade<L: LayerMaps + Sync>(&self, maps: &[L], painted: &Painted) -> Shade {
        let full = Shade::FULL;
        let as_fine = self.step <= FULL_CELL_M && painted.maps.texel_m <= FULL_TEXEL_M;
        let all_clods = self.sizes.unseen[1].0 >= self.sizes.drawn.1;
        if self.sizes.told <= 0.0 || as_fine && all_clods {
            return full;
        }
        let texel = painted.maps.texel_m.min(FULL_TEXEL_M);
        let patches = self.patches();
        let fine: Vec<Sample> = (patches.iter())
            .flat_map(|patch| {
                let ground = self.finely(maps, patch.grown(AROUND_M));
                let painted = ground.paint(maps, texel);
                ground.samples(&painted, *patch)
            })
            .collect();
        let coarse: Vec<Sample> = patches.iter().flat_map(|patch| self.samples(painted, *patch)).collect();
        let reflectance = self.mean_dry(maps).to_array().iter().sum::<f32>() / 4.0;
        let (clods, cover) = self.clod_samples(maps);
        let clods = if clods.is_empty() { 1.0 } else { light(&clods, full.sky, reflectance) };
        // Pits under clods are not seen.
        let bright = cover + (1.0 - cover) * light(&fine, full.sky, reflectance);
        let damp = (1.0 - cover) * wetness(&fine, full.wet);
        let sky = solve(|half| light(&coarse, half, reflectance) < bright);
        Shade {
            sky,
            wet: solve(|half| wetness(&coarse, half) > damp),
            hidden: hidden(bright * clods / light(&coarse, sky, reflectance), reflectance),
        }
    }

    /// Where both are compared: squares spread evenly over the ground, as large as it at most.
    fn patches(&self) -> Vec<Rect> {
        let (corner, size) = (self.area().corners()[0], self.area().size());
        let side = size.min(Vec2::splat(PATCH_M));
        let at = |k: usize| (k as f32 + 0.5) / PATCHES as f32;
        let place = |k: usize| corner + (size - side) * vec2(at(k % PATCHES), at(k / PATCHES));
        let square = |lo: Vec2| Rect::new(lo.x, lo.y, lo.x + side.x, lo.y + side.y);
        (0..PATCHES * PATCHES).map(place).map(square).collect()
    }

    /// A piece of this ground as full detail makes it, without the clods that are bodies there.
    fn finely<L: LayerMaps + Sync>(&self, maps: &[L], area: Rect) -> Self {
        let Sizes { crumbs, unseen, clods, .. } = self.sizes;
        let (crumb, clod) = (unseen[0].0, unseen[1].0);
        let none = (clod, clod);
        let sizes = Sizes { crumbs: (crumb, crumbs.1), drawn: none, unseen: [(crumb, crumb), none], clods, told: 0.0 };
        self.piece(maps, area, self.step.min(FULL_CELL_M), sizes)
    }

    /// Level ground under the clods that are bodies in full detail, but not here, and the share of it that these cover.
    fn clod_samples<L: LayerMaps + Sync>(&self, maps: &[L]) -> (Vec<Sample>, f32) {
        let (shortest, longest) = (self.sizes.unseen[1].0, self.sizes.drawn.1);
        if self.flat || shortest >= longest {
            return (Vec::new(), 0.0);
        }
        let half = 0.5 * (LONGEST_CLODS * 1e-3 * longest).max(LEAST_CLOD_M);
        let middle = 0.5 * (self.area().corners()[0] + self.area().corners()[1]);
        let area = Rect::new(middle.x - half, middle.y - half, middle.x + half, middle.y + half);
        let none = (shortest, shortest);
        let clods = (shortest, longest);
        let sizes = Sizes { crumbs: none, drawn: none, unseen: [none; 2], clods, told: 0.0 };
        let level = self.piece(maps, area, self.step.min(FULL_CELL_M), sizes).levelled();
        let mut pile = Pile::new(&level);
        let bodies = super::clods(&level, &mut pile, &Canopy::none(&level), &InView::ALL);
        let heights = Heights::over(area, CLOD_SAMPLES, bodies.iter().map(|clods| &clods.mesh));
        let inner = (CLOD_SAMPLES / 4..CLOD_SAMPLES - CLOD_SAMPLES / 4).step_by(CLOD_EVERY);
        let places: Vec<[usize; 2]> = inner.clone().flat_map(|j| inner.clone().map(move |i| [i, j])).collect();
        let sample = |[i, j]: [usize; 2]| Sample { lit: heights.lit(i, j, FACETS), pit: 0.0, left: 1.0, albedo: 1.0 };
        (places.into_par_iter().map(sample).collect(), heights.cover())
    }

    /// Places of a patch, the same on every ground: points of the R₂ sequence (Roberts 2018).
    fn samples(&self, painted: &Painted, patch: Rect) -> Vec<Sample> {
        let place = |k: usize| patch.corners()[0] + patch.size() * (vec2(0.754_877_7, 0.569_840_3) * k as f32).fract();
        (0..SAMPLES).into_par_iter().map(|k| self.sample(painted, place(k))).collect()
    }

    fn sample(&self, painted: &Painted, p: Vec2) -> Sample {
        let (k, slope) = painted.at(p);
        let mesh = if self.flat { Vec3::Z } else { self.normal(p.x, p.y) };
        let normal = Vec3::new(mesh.x - slope.x * mesh.z, mesh.y - slope.y * mesh.z, mesh.z).normalize();
        let albedo = super::GroundMaps::decode(painted.maps.albedo[k]).iter().sum();
        let height = self.height(p.x, p.y);
        let rise = |d: Vec2| if self.flat { 0.0 } else { self.height(p.x + d.x, p.y + d.y) - height };
        Sample { lit: Lit::of(normal, FACETS, NEAREST_M, rise), pit: painted.pits[k], left: painted.left(k), albedo }
    }
}

/// Light that ground of a mean reflectance sends up, over what level ground of it does: what of its light each texel misses it gets from
/// ground as bright as the mean.
fn light(samples: &[Sample], half: f32, reflectance: f32) -> f32 {
    let (mut albedos, mut direct, mut again) = (0.0, 0.0, 0.0);
    for Sample { lit, pit, albedo, .. } in samples {
        let open = f64::from(albedo / closing(*pit, half));
        albedos += f64::from(*albedo);
        direct += open * f64::from(lit.up);
        again += open * f64::from(lit.missed);
    }
    (direct / (albedos - f64::from(reflectance) * again).max(f64::MIN_POSITIVE)) as f32
}

/// Share of the light on ground of a mean reflectance that relief hides where it makes the ground darker by a factor: r = V / (1 − ρ (1 − V)).
fn hidden(darker: f32, reflectance: f32) -> f32 {
    let open = darker * (1.0 - reflectance) / (1.0 - darker * reflectance);
    (1.0 - open).clamp(0.0, MOST_HIDDEN)
}

/// Mean wetness that pits keep.
fn wetness(samples: &[Sample], full: f32) -> f32 {
    let sum = samples.iter().map(|s| f64::from(wet(s.pit, full) * s.left)).sum::<f64>();
    (sum / samples.len().max(1) as f64) as f32
}

/// Where a depth is large enough, by halving.
fn solve(too_small: impl Fn(f32) -> bool) -> f32 {
    let (mut lo, mut hi) = (LEAST_M.ln(), MOST_M.ln());
    for _ in 0..HALVINGS {
        let middle = 0.5 * (lo + hi);
        if too_small(middle.exp()) { lo = middle } else { hi = middle }
    }
    (0.5 * (lo + hi)).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: ground that sees half of the sky, and for the rest ground of its own brightness, B = ρ (½ + ½ B).
    #[test]
    fn what_misses_the_sky_is_lit_by_the_ground() {
        let sample = Sample { lit: Lit { up: 0.5, missed: 0.5 }, pit: 0.0, left: 1.0, albedo: 3.0 };
        let e = light(&[sample; 3], 1.0, 0.4);
        assert!((e - 0.5 / 0.8).abs() < 1e-6, "{e}");
        assert!((hidden(e, 0.4) - 0.5).abs() < 1e-5);
    }

    #[test]
    fn a_depth_is_found_by_halving() {
        let half = solve(|x| x < 0.003);
        assert!((half / 0.003 - 1.0).abs() < 1e-3, "{half}");
    }
}
