//! Brightness of coarse ground: on average that of the same ground at full detail.
//!
//! Ground with large cells lacks the fine relief that shades itself. The remaining pits between texels are as wide as a
//! texel, so their depth does not determine how much of the sky they hide. A few patches are therefore built as with
//! `detail: Full`. The depth that hides half of the sky, and the one that keeps the full wetness, are then chosen such
//! that both versions reflect the same light and hold the same water.
//!
//! Interreflection: occluded sky is replaced by ground of mean brightness.
//!
//! Clods that are bodies at full detail but not here also shade themselves and each other. Their effect is computed for
//! level ground, from their heights alone.

use super::bake::{Shade, UnshadedMaps, closing, wet};
use super::ground::Ground;
use super::lit::{Heights, HorizonRange, ReflectedLight};
use super::pile::Pile;
use super::site::{FULL_CELL_M, FULL_TEXEL_M, Sizes};
use super::{Canopy, InView, LayerMaps, Rect};
use furrow_base::math::{RoundTo, ToFloat, Vec2, Vec3, vec2};
use furrow_optics::optics::UnmeshedRelief;
use furrow_optics::optics::shadowing::{PAIRS, SLANTS, Shadowing, TURNS, Table};
use furrow_optics::optics::soil::FACETS;
use furrow_optics::texture::ground::GroundMaps;
use rayon::prelude::*;

/// Maximum number of patches along each side of the ground, the side of a patch, and the margin built around each,
/// metres.
const PATCHES: usize = 4;
const PATCH_M: f32 = 0.12;
const AROUND_M: f32 = 0.06;

/// Number of sample points per patch, and the range of the horizon search there, metres.
const SAMPLES: usize = 800;
const HORIZON: HorizonRange = HorizonRange { from: 1.5e-3, to: AROUND_M };

/// Total side length of the sample squares for clods along each side of the ground, metres, and the limits of their
/// number.
const CLODS_M: f32 = 0.6;
const CLOD_SQUARES: (usize, usize) = (2, 5);

/// Side of a sample square: `LONGEST_CLODS` lengths of the longest clod, but at least `LEAST_CLOD_M` metres; reduced so
/// that it holds at most `MOST_CLODS` clods, but not below `LEAST_CLODS` of those lengths. `CLOD_SAMPLES` heights are
/// sampled along the side, and the light is computed at every `CLOD_EVERY`-th of them in the central half.
const LONGEST_CLODS: f32 = 8.0;
const LEAST_CLOD_M: f32 = 0.1;
const MOST_CLODS: f32 = 20_000.0;
const LEAST_CLODS: f32 = 2.0;
const CLOD_SAMPLES: usize = 800;
const CLOD_EVERY: usize = 9;

/// Limits of the depths, metres; the lower one is the depth at full detail.
const LEAST_M: f32 = super::bake::HALF_SKY_M;
const MOST_M: f32 = 10.0;

/// Largest fraction of the reflected light that hits the ground again.
const MOST_BACK: f32 = 0.9;

/// Number of bisection steps of the depth's logarithm, for an accuracy of 10⁻³.
const HALVINGS: usize = 16;

/// Sample of one texel of a ground.
#[derive(Clone, Copy, Debug)]
struct Sample {
    /// Light, shadowed by the relief of the mesh.
    lit: ReflectedLight,
    /// Depth below its surroundings, metres.
    pit: f32,
    /// Fraction of the ground's moisture that is left.
    left: f32,
    /// Reflectance of its dry soil, in arbitrary units.
    albedo: f32,
    /// Whether it is on a clod that has no mesh.
    raised: bool,
}

/// Clods that are bodies at full detail, but not here.
pub(super) struct UnmeshedClods {
    /// Samples of level ground with these clods.
    samples: Vec<Sample>,
    /// Fraction of the ground that they cover.
    cover: f32,
    /// Fraction of the unresolved clods that remain at the density of the size distribution, estimated from their
    /// cover: the others roll off other clods.
    pub(super) laid: f32,
}

/// Sample squares for the shading of clods: their number along each side of a ground, and their side, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Squares {
    pub(super) many: usize,
    pub(super) side: f32,
}

impl Squares {
    /// Returns the squares for a ground of `size` metres with `per_m2` clods per square metre of at most `longest_mm`.
    pub(super) fn of(size: Vec2, per_m2: f32, longest_mm: f32) -> Self {
        let longest = 1e-3 * longest_mm;
        let few = (MOST_CLODS / per_m2.max(f32::MIN_POSITIVE)).sqrt().max(LEAST_CLODS * longest);
        let side = (LONGEST_CLODS * longest).max(LEAST_CLOD_M).min(few);
        let many = (CLODS_M / side).trunc_to::<usize>().clamp(CLOD_SQUARES.0, CLOD_SQUARES.1);
        // More squares would overlap and contain the same clods.
        Self { many: many.min((size.max_element() / side).ceil().max(1.0).trunc_to::<usize>()), side }
    }
}

impl Ground {
    /// Returns the darkening by pits and missing relief: [`Shade::FULL`] at full detail; on coarse ground, the values
    /// with which it reflects the same light and holds the same water as at full detail.
    pub(super) fn shade<L: LayerMaps + Sync>(
        &self,
        maps: &[L],
        painted: &UnshadedMaps,
        clods: &UnmeshedClods,
    ) -> Shade {
        let full = Shade::FULL;
        if self.is_full(painted.maps.texel_m) {
            return full;
        }
        let UnmeshedClods { samples: clods, cover, .. } = clods;
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
        // Pits under clods are hidden.
        let bright = cover + (1.0 - cover) * fine_light.sky;
        let damp = (1.0 - cover) * wetness(&fine, full.wet);
        let sky = solve(|half| {
            let (sky, level) = Light::sky(&coarse, half, reflectance);
            (sky / level).to_f32() < bright
        });
        let made = Light::of(&coarse, sky, reflectance);
        let target = bright * clod_light.sky;
        let darker = target / made.sky;
        // At flatter angles less of the ground between clods is visible.
        let more = raised(clods).map(|share| (share - cover).clamp(0.0, 1.0 - cover));
        let wanted = |j: usize, k: usize, turn: usize| {
            let cover = cover + more[j] * more[k] / (1.0 - cover).max(f32::MIN_POSITIVE);
            let pair = Shadowing::pair(j, k);
            (cover + (1.0 - cover) * fine_light.sent[pair][turn]) * clod_light.sent[pair][turn]
        };
        let from_above = Shadowing::under_even_sky(|k| wanted(k, SLANTS - 1, 0));
        let scale = target / (from_above * darker).max(f32::MIN_POSITIVE);
        let mut factors = [[1.0; TURNS]; PAIRS];
        for k in 0..SLANTS {
            for j in 0..=k {
                let pair = Shadowing::pair(j, k);
                factors[pair] = std::array::from_fn(|turn| {
                    scale * wanted(j, k, turn) / made.sent[pair][turn].max(f32::MIN_POSITIVE)
                });
            }
        }
        let lost = |of: fn(&Sample) -> f32| (1.0 - cover) * mean(&fine, of) + mean(clods, of) - mean(&coarse, of);
        let slope = lost(|s| s.lit.slope);
        let back = lost(|s| s.lit.missed).clamp(0.0, MOST_BACK);
        Shade {
            sky,
            wet: solve(|half| wetness(&coarse, half) > damp),
            lost: Some(UnmeshedRelief {
                open: darker * (1.0 - reflectance * back),
                back,
                shadowing: Shadowing::new(&factors),
                slope: slope.max(0.0),
            }),
        }
    }

    /// Returns the patches on which both versions are compared: squares distributed evenly over the ground and at most
    /// as large as the ground.
    fn patches(&self) -> Vec<Rect> {
        let (corner, size) = (self.area().corners()[0], self.area().size());
        let side = size.min(Vec2::splat(PATCH_M));
        // On a small ground more patches would overlap.
        let many = (size.max_element() / PATCH_M).ceil_to::<usize>().clamp(1, PATCHES);
        let at = |k: usize| (k.to_f32() + 0.5) / many.to_f32();
        let place = |k: usize| corner + (size - side) * vec2(at(k % many), at(k / many));
        let square = |lo: Vec2| Rect::new(lo.x, lo.y, lo.x + side.x, lo.y + side.y);
        (0..many * many).map(place).map(square).collect()
    }

    /// Builds a piece of this ground at full detail, without the clods that are bodies there.
    fn finely<L: LayerMaps + Sync>(&self, maps: &[L], area: Rect) -> Self {
        let Sizes { crumbs, unseen, clods, .. } = self.sizes;
        let (crumb, clod) = (unseen[0].0, unseen[1].0);
        let none = (clod, clod);
        let sizes =
            Sizes { crumbs: (crumb, crumbs.1), drawn: none, unseen: [(crumb, crumb), none], clods, resolved_mm: 0.0 };
        self.piece(maps, area, self.step.min(FULL_CELL_M), sizes)
    }

    /// Returns `true` if no relief is missing.
    fn is_full(&self, texel_m: f32) -> bool {
        let as_fine = self.step <= FULL_CELL_M && texel_m <= FULL_TEXEL_M;
        self.sizes.resolved_mm <= 0.0 || as_fine && self.sizes.unseen[1].0 >= self.sizes.drawn.1
    }

    /// Returns the clods that are bodies at full detail, but not on this ground, whose texels are at most `texel_m`
    /// wide.
    pub(super) fn unmeshed_clods<L: LayerMaps + Sync>(&self, maps: &[L], texel_m: f32) -> UnmeshedClods {
        let Sizes { drawn, unseen, .. } = self.sizes;
        let (shortest, longest) = (unseen[1].0, drawn.1);
        if self.is_full(texel_m) || self.flat || shortest >= longest {
            return UnmeshedClods { samples: Vec::new(), cover: 0.0, laid: 1.0 };
        }
        let (corner, size) = (self.area().corners()[0], self.area().size());
        let patches = self.patches();
        let here = |patch: &Rect| {
            let middle = 0.5 * (patch.corners()[0] + patch.corners()[1]);
            self.law.at(middle, self.share(middle)).number(shortest, longest)
        };
        let per_m2 = patches.iter().map(here).sum::<f32>() / patches.len().to_f32();
        let Squares { many, side } = Squares::of(size, per_m2, longest);
        let none = (shortest, shortest);
        let clods = (shortest, longest);
        let sizes = Sizes { crumbs: none, drawn: none, unseen: [none; 2], clods, resolved_mm: 0.0 };
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
            let sample = |place| {
                let raised = heights.raised(place);
                Sample { lit: lit(place), pit: 0.0, left: 1.0, albedo: 1.0, raised }
            };
            (places.iter().copied().map(sample).collect::<Vec<Sample>>(), heights.cover())
        };
        let at = |k: usize| (k.to_f32() + 0.5) / many.to_f32();
        let middle = |k: usize| corner + size * vec2(at(k % many), at(k / many));
        let middles: Vec<Vec2> = (0..many * many).map(middle).collect();
        let (samples, covers): (Vec<Vec<Sample>>, Vec<f32>) = middles.par_iter().map(|p| square(*p)).unzip();
        let over_squares = |sum: f32| sum / middles.len().to_f32();
        let cover = over_squares(covers.iter().sum());
        let law = |mm| over_squares(middles.iter().map(|p| self.law.at(*p, self.share(*p)).cover(mm)).sum());
        // Resolved clods have the density of the size distribution and may overlap.
        let left = -(1.0 - cover).max(f32::MIN_POSITIVE).ln() - law(drawn);
        let laid = (left / law(unseen[1]).max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        UnmeshedClods { samples: samples.concat(), cover, laid }
    }

    /// Samples a patch, at the same points on every ground: the R₂ sequence (Roberts 2018).
    fn samples(&self, painted: &UnshadedMaps, patch: Rect) -> Vec<Sample> {
        let place =
            |k: usize| patch.corners()[0] + patch.size() * (vec2(0.754_877_7, 0.569_840_3) * k.to_f32()).fract();
        (0..SAMPLES).into_par_iter().map(|k| self.sample(painted, place(k))).collect()
    }

    fn sample(&self, painted: &UnshadedMaps, p: Vec2) -> Sample {
        let (k, slope) = painted.at(p);
        let mesh = if self.flat { Vec3::Z } else { self.normal(p.x, p.y) };
        let normal = Vec3::new(mesh.x - slope.x * mesh.z, mesh.y - slope.y * mesh.z, mesh.z).normalize();
        let albedo = GroundMaps::decode(painted.maps.albedo[k]).0.truncate().element_sum();
        let height = self.height(p.x, p.y);
        let rise = |d: Vec2| if self.flat { 0.0 } else { self.height(p.x + d.x, p.y + d.y) - height };
        Sample {
            lit: ReflectedLight::of(normal, FACETS, HORIZON, f32::INFINITY, rise),
            pit: painted.pits[k],
            left: painted.left(k),
            albedo,
            raised: false,
        }
    }
}

/// Light reflected by a ground relative to level ground of its mean reflectance: upwards under a uniform sky, and from
/// one direction into another.
#[derive(Clone, Copy, Debug)]
struct Light {
    sky: f32,
    sent: Table,
}

impl Light {
    const LEVEL: Self = Self { sky: 1.0, sent: [[1.0; TURNS]; PAIRS] };

    /// Computes the light of a ground with this mean reflectance; pits with the depth `half` see half of the sky. The
    /// part of the sky that a texel does not see is replaced by ground of mean brightness.
    ///
    /// For directional light, the interreflected part in each direction is proportional to the light seen from the
    /// zenith, so that unlit sides are not black.
    fn of(samples: &[Sample], half: f32, reflectance: f32) -> Self {
        let (sky, level) = Self::sky(samples, half, reflectance);
        let mut albedos = 0.0;
        let (mut sums, mut shown) = ([[0.0; TURNS]; PAIRS], [0.0; SLANTS]);
        for Sample { lit, pit, albedo, .. } in samples {
            let open = f64::from(albedo / closing(*pit, half));
            albedos += f64::from(*albedo);
            for (sum, sent) in sums.as_flattened_mut().iter_mut().zip(lit.sent.as_flattened()) {
                *sum += open * f64::from(*sent);
            }
            for (sum, shown) in shown.iter_mut().zip(lit.shown) {
                *sum += f64::from(shown);
            }
        }
        // The horizon search is finite, so projected areas may not add up to that of level ground: they are normalised.
        let shown = shown.map(|sum| (sum / samples.len().max(1).to_f64()).max(f64::MIN_POSITIVE));
        let mut sent = [[0.0; TURNS]; PAIRS];
        for k in 0..SLANTS {
            for j in 0..=k {
                let pair = Shadowing::pair(j, k);
                let seen = shown[j] * shown[k];
                let upright = |k: usize| sums[Shadowing::pair(k, SLANTS - 1)][0];
                let both = upright(j) * upright(k) / upright(SLANTS - 1).max(f64::MIN_POSITIVE);
                let bounced = (1.0 / level - 1.0 / albedos) * both;
                sent[pair] = sums[pair].map(|sum: f64| ((sum / albedos + bounced) / seen).to_f32());
            }
        }
        // Both must agree for a uniform sky seen from above.
        let sky = (sky / level).to_f32();
        let from_above = Shadowing::under_even_sky(|k| sent[Shadowing::pair(k, SLANTS - 1)][0]);
        let scale = sky / from_above.max(f32::MIN_POSITIVE);
        Self { sky, sent: sent.map(|row| row.map(|factor| factor * scale)) }
    }

    /// Returns the light reflected upwards under a uniform sky, and that of level ground.
    fn sky(samples: &[Sample], half: f32, reflectance: f32) -> (f64, f64) {
        let (mut albedos, mut sky, mut again) = (0.0, 0.0, 0.0);
        for Sample { lit, pit, albedo, .. } in samples {
            let open = f64::from(albedo / closing(*pit, half));
            albedos += f64::from(*albedo);
            sky += open * f64::from(lit.sky);
            again += open * f64::from(lit.missed);
        }
        (sky, (albedos - f64::from(reflectance) * again).max(f64::MIN_POSITIVE))
    }
}

/// Returns the fraction of the visible area at each zenith angle that is on clods.
fn raised(clods: &[Sample]) -> [f32; SLANTS] {
    std::array::from_fn(|k| {
        let shown = |all: bool| -> f32 {
            clods.iter().filter(|sample| all || sample.raised).map(|sample| sample.lit.shown[k]).sum()
        };
        shown(false) / shown(true).max(f32::MIN_POSITIVE)
    })
}

fn mean(samples: &[Sample], of: impl Fn(&Sample) -> f32) -> f32 {
    (samples.iter().map(|s| f64::from(of(s))).sum::<f64>() / samples.len().max(1).to_f64()).to_f32()
}

/// Returns the mean wetness of the pits.
fn wetness(samples: &[Sample], full: f32) -> f32 {
    mean(samples, |s| wet(s.pit, full) * s.left)
}

/// Finds the smallest sufficient depth by bisection.
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

    /// Expected: five squares along a side of eight clod lengths each; one where the ground is smaller; smaller squares
    /// where there are very many clods.
    #[test]
    fn squares_are_as_many_as_the_ground_has_room_for() {
        let of = |size: f32, per_m2: f32| Squares::of(Vec2::splat(size), per_m2, 15.0);
        assert_eq!((of(9.0, 1e5).many, of(0.1, 1e5).many), (5, 1));
        assert!((of(9.0, 1e5).side - 0.12).abs() < 1e-6);
        let many = of(9.0, 1e7);
        assert!(many.side < 0.05 && many.side >= 0.03 && 1e7 * many.side * many.side < 2.1e4, "{many:?}");
        assert!((of(9.0, 1e30).side - 0.03).abs() < 1e-6);
    }

    fn light(lit: &ReflectedLight) -> Light {
        Light::of(&[Sample { lit: *lit, pit: 0.0, left: 1.0, albedo: 3.0, raised: false }; 3], 1.0, 0.4)
    }

    /// Expected: if underestimated horizons make every point show a tenth more of itself at flat angles, the result is
    /// not brighter than that of level ground.
    #[test]
    fn what_is_shown_too_much_is_put_right() {
        let mut lit =
            ReflectedLight { sky: 1.0, sent: [[1.0; TURNS]; PAIRS], shown: [1.0; SLANTS], missed: 0.0, slope: 0.0 };
        lit.shown[0] = 1.1;
        for k in 0..SLANTS {
            lit.sent[Shadowing::pair(0, k)] = [if k == 0 { 1.21 } else { 1.1 }; TURNS];
        }
        let light = light(&lit);
        assert!(light.sent.iter().flatten().all(|sent| (sent - 1.0).abs() < 1e-3), "{light:?}");
    }

    /// Expected: for ground that sees half of the sky and ground of its own brightness otherwise, B = ρ (½ + ½ B).
    #[test]
    fn what_misses_the_sky_is_lit_by_the_ground() {
        let shown = [1.0; SLANTS];
        let lit = ReflectedLight { sky: 0.5, sent: [[0.75; TURNS]; PAIRS], shown, missed: 0.5, slope: 0.0 };
        let dark = ReflectedLight { sent: [[0.75, 0.75, 0.75, 0.0]; PAIRS], ..lit };
        let light = light(&lit);
        let e = light.sky;
        assert!((e - 0.5 / 0.8).abs() < 1e-6, "{light:?}");
        // Surfaces lit by the ground alone have a fifth, 0.4 · 0.5, of all light.
        let [lit, .., none] = self::light(&dark).sent[0];
        assert!((none / lit - 0.2).abs() < 1e-3, "{none} of {lit}");
        // The same from all directions.
        assert!(light.sent.iter().flatten().all(|sent| (sent / e - 1.0).abs() < 1e-3), "{light:?}");
    }

    #[test]
    fn a_depth_is_found_by_halving() {
        let half = solve(|x| x < 0.003);
        assert!((half / 0.003 - 1.0).abs() < 1e-3, "{half}");
    }
}
