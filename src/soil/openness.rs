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
use super::lit::{Heights, Lit, Reach};
use super::pile::Pile;
use super::site::{FULL_CELL_M, FULL_TEXEL_M, Sizes};
use super::{Canopy, InView, LayerMaps, Rect};
use crate::math::{Vec2, Vec3, vec2};
use crate::optics::{LostRelief, SUNS, Shadowing};
use rayon::prelude::*;

/// Patches along each side of the ground, their sides, and what is made around each, metres.
const PATCHES: usize = 4;
const PATCH_M: f32 = 0.12;
const AROUND_M: f32 = 0.06;

/// Places in each patch whose light is reckoned, and how near and far horizons are searched there, metres.
const SAMPLES: usize = 800;
const HORIZON: Reach = Reach { from: 1.5e-3, to: AROUND_M };

/// Squares on which clods are laid along each side of the ground: as many as measure this together, metres, within limits.
const CLODS_M: f32 = 0.6;
const CLOD_SQUARES: (usize, usize) = (2, 5);

/// Side of such a square, in lengths of the longest, and at least, metres; samples of their heights along it, and every how many
/// of them the light is reckoned, in the middle half.
const LONGEST_CLODS: f32 = 8.0;
const LEAST_CLOD_M: f32 = 0.1;
const CLOD_SAMPLES: usize = 800;
const CLOD_EVERY: usize = 7;

/// Limits of the depths, metres: what is finer than full detail's pits is as deep as they are.
const LEAST_M: f32 = super::bake::HALF_SKY_M;
const MOST_M: f32 = 10.0;

/// Most of what ground reflects that it may meet again.
const MOST_BACK: f32 = 0.9;

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

/// Clods that are bodies in full detail, but not here.
pub(super) struct LostClods {
    /// Places of level ground under them.
    samples: Vec<Sample>,
    /// Share of the ground that they cover.
    cover: f32,
    /// Share of those too small to be drawn that stay where the law says, as far as their cover tells: the others roll off what lies there.
    pub(super) laid: f32,
}

impl Ground {
    /// How pits and lost relief darken it: [`Shade::FULL`] on ground of full detail; on coarse ground what makes it send as much
    /// light, and hold as much water, as full detail would.
    pub(super) fn shade<L: LayerMaps + Sync>(&self, maps: &[L], painted: &Painted, clods: &LostClods) -> Shade {
        let full = Shade::FULL;
        if self.is_full(painted.maps.texel_m) {
            return full;
        }
        let LostClods { samples: clods, cover, .. } = clods;
        let texel = painted.maps.texel_m.min(FULL_TEXEL_M);
        let patches = self.patches();
        let fine: Vec<Sample> = (patches.iter())
            .flat_map(|patch| {
                let ground = self.finely(maps, patch.grown(AROUND_M));
                let painted = ground.paint(maps, texel, 1.0);
                ground.samples(&painted, *patch)
            })
            .collect();
        let coarse: Vec<Sample> = patches.iter().flat_map(|patch| self.samples(painted, *patch)).collect();
        let reflectance = self.mean_dry(maps).to_array().iter().sum::<f32>() / 4.0;
        let fine_light = Light::of(&fine, full.sky, reflectance);
        let clod_light = if clods.is_empty() { Light::LEVEL } else { Light::of(clods, full.sky, reflectance) };
        // Pits under clods are not seen.
        let bright = cover + (1.0 - cover) * fine_light.sky;
        let damp = (1.0 - cover) * wetness(&fine, full.wet);
        let sky = solve(|half| Light::of(&coarse, half, reflectance).sky < bright);
        let made = Light::of(&coarse, sky, reflectance);
        let darker = bright * clod_light.sky / made.sky;
        let by_sun = |k: usize| {
            let wanted = (cover + (1.0 - cover) * fine_light.suns[k]) * clod_light.suns[k];
            wanted / (made.suns[k] * darker)
        };
        let lost = |of: fn(&Sample) -> f32| (1.0 - cover) * mean(&fine, of) + mean(clods, of) - mean(&coarse, of);
        let slope = lost(|s| s.lit.slope);
        let back = lost(|s| s.lit.missed).clamp(0.0, MOST_BACK);
        Shade {
            sky,
            wet: solve(|half| wetness(&coarse, half) > damp),
            lost: Some(LostRelief {
                open: darker * (1.0 - reflectance * back),
                back,
                shadowing: Shadowing::from_above(std::array::from_fn(by_sun)),
                slope: slope.max(0.0),
            }),
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

    /// Whether nothing is lost.
    fn is_full(&self, texel_m: f32) -> bool {
        let as_fine = self.step <= FULL_CELL_M && texel_m <= FULL_TEXEL_M;
        self.sizes.told <= 0.0 || as_fine && self.sizes.unseen[1].0 >= self.sizes.drawn.1
    }

    /// The clods that are bodies in full detail, but not on this ground, whose texels are at most `texel_m` wide.
    pub(super) fn lost_clods<L: LayerMaps + Sync>(&self, maps: &[L], texel_m: f32) -> LostClods {
        let Sizes { drawn, unseen, .. } = self.sizes;
        let (shortest, longest) = (unseen[1].0, drawn.1);
        if self.is_full(texel_m) || self.flat || shortest >= longest {
            return LostClods { samples: Vec::new(), cover: 0.0, laid: 1.0 };
        }
        let side = (LONGEST_CLODS * 1e-3 * longest).max(LEAST_CLOD_M);
        let none = (shortest, shortest);
        let clods = (shortest, longest);
        let sizes = Sizes { crumbs: none, drawn: none, unseen: [none; 2], clods, told: 0.0 };
        let inner = (CLOD_SAMPLES / 4..CLOD_SAMPLES - CLOD_SAMPLES / 4).step_by(CLOD_EVERY);
        let places: Vec<[usize; 2]> = inner.clone().flat_map(|j| inner.clone().map(move |i| [i, j])).collect();
        let square = |middle: Vec2| {
            let (lo, hi) = (middle - 0.5 * side, middle + 0.5 * side);
            let area = Rect::new(lo.x, lo.y, hi.x, hi.y);
            let level = self.piece(maps, area, self.step.min(FULL_CELL_M), sizes).levelled();
            let mut pile = Pile::new(&level);
            let bodies = super::clods(&level, &mut pile, &Canopy::none(&level), &InView::ALL);
            let heights = Heights::over(area, CLOD_SAMPLES, bodies.iter().map(|clods| &clods.mesh));
            let lit = |[i, j]: [usize; 2]| heights.lit(i, j, FACETS);
            let sample = |place| Sample { lit: lit(place), pit: 0.0, left: 1.0, albedo: 1.0 };
            (places.iter().copied().map(sample).collect::<Vec<Sample>>(), heights.cover())
        };
        let (corner, size) = (self.area().corners()[0], self.area().size());
        let many = ((CLODS_M / side) as usize).clamp(CLOD_SQUARES.0, CLOD_SQUARES.1);
        let at = |k: usize| (k as f32 + 0.5) / many as f32;
        let middle = |k: usize| corner + size * vec2(at(k % many), at(k / many));
        let middles: Vec<Vec2> = (0..many * many).map(middle).collect();
        let (samples, covers): (Vec<Vec<Sample>>, Vec<f32>) = middles.par_iter().map(|p| square(*p)).unzip();
        let over_squares = |sum: f32| sum / middles.len() as f32;
        let cover = over_squares(covers.iter().sum());
        let law = |mm| over_squares(middles.iter().map(|p| self.law.at(*p, self.share(*p)).cover(mm)).sum());
        // Those that are drawn lie where the law says, one over the other.
        let left = -(1.0 - cover).max(f32::MIN_POSITIVE).ln() - law(drawn);
        let laid = (left / law(unseen[1]).max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        LostClods { samples: samples.concat(), cover, laid }
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
        Sample { lit: Lit::of(normal, FACETS, HORIZON, rise), pit: painted.pits[k], left: painted.left(k), albedo }
    }
}

/// Light that ground sends up, over what level ground of its mean reflectance does: under an even sky, and under each sun.
#[derive(Clone, Copy, Debug)]
struct Light {
    sky: f32,
    suns: [f32; SUNS],
}

impl Light {
    const LEVEL: Self = Self { sky: 1.0, suns: [1.0; SUNS] };

    /// Of ground of a mean reflectance whose pits of the depth `half` see half of the sky: in place of what a texel does not see of the sky it sees ground as
    /// bright as the mean.
    fn of(samples: &[Sample], half: f32, reflectance: f32) -> Self {
        let (mut albedos, mut sky, mut again) = (0.0, 0.0, 0.0);
        let mut suns = [0.0; SUNS];
        for Sample { lit, pit, albedo, .. } in samples {
            let open = f64::from(albedo / closing(*pit, half));
            albedos += f64::from(*albedo);
            sky += open * f64::from(lit.sky);
            again += open * f64::from(lit.missed);
            for (sum, sun) in suns.iter_mut().zip(lit.suns) {
                *sum += open * f64::from(sun);
            }
        }
        let level = (albedos - f64::from(reflectance) * again).max(f64::MIN_POSITIVE);
        Self { sky: (sky / level) as f32, suns: suns.map(|sun| (sun / level) as f32) }
    }
}

fn mean(samples: &[Sample], of: impl Fn(&Sample) -> f32) -> f32 {
    (samples.iter().map(|s| f64::from(of(s))).sum::<f64>() / samples.len().max(1) as f64) as f32
}

/// Mean wetness that pits keep.
fn wetness(samples: &[Sample], full: f32) -> f32 {
    mean(samples, |s| wet(s.pit, full) * s.left)
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
        let lit = Lit { sky: 0.5, suns: [0.75; SUNS], missed: 0.5, slope: 0.0 };
        let light = Light::of(&[Sample { lit, pit: 0.0, left: 1.0, albedo: 3.0 }; 3], 1.0, 0.4);
        let e = light.sky;
        assert!((e - 0.5 / 0.8).abs() < 1e-6 && (light.suns[0] - 0.75 / 0.8).abs() < 1e-6, "{light:?}");
    }

    #[test]
    fn a_depth_is_found_by_halving() {
        let half = solve(|x| x < 0.003);
        assert!((half / 0.003 - 1.0).abs() < 1e-3, "{half}");
    }
}
