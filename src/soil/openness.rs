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
use crate::optics::LostRelief;
use crate::optics::shadowing::{PAIRS, SLANTS, Shadowing, TURNS, Table};
use rayon::prelude::*;

/// Patches along each side of the ground, at most, their sides, and what is made around each, metres.
const PATCHES: usize = 4;
const PATCH_M: f32 = 0.12;
const AROUND_M: f32 = 0.06;

/// Places in each patch whose light is reckoned, and how near and far horizons are searched there, metres.
const SAMPLES: usize = 800;
const HORIZON: Reach = Reach { from: 1.5e-3, to: AROUND_M };

/// Squares on which clods are laid along each side of the ground: as many as measure this together, metres, within limits.
const CLODS_M: f32 = 0.6;
const CLOD_SQUARES: (usize, usize) = (2, 5);

/// Side of such a square, in lengths of the longest, at least, metres, and such that about so many clods lie on it at most, but not less than
/// so many of the longest; samples of their heights along it, and every how many of them the light is reckoned, in the middle half.
const LONGEST_CLODS: f32 = 8.0;
const LEAST_CLOD_M: f32 = 0.1;
const MOST_CLODS: f32 = 20_000.0;
const LEAST_CLODS: f32 = 2.0;
const CLOD_SAMPLES: usize = 800;
const CLOD_EVERY: usize = 9;

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
    /// Whether it is on a clod that is not made.
    raised: bool,
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

/// The squares on which clods are laid whose light is reckoned: how many along each side of a ground, and their side, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Squares {
    pub(super) many: usize,
    pub(super) side: f32,
}

impl Squares {
    /// On a ground of so many metres, on which lie so many clods on a square metre that are `longest_mm` long at most.
    pub(super) fn of(size: Vec2, per_m2: f32, longest_mm: f32) -> Self {
        let longest = 1e-3 * longest_mm;
        let few = (MOST_CLODS / per_m2.max(f32::MIN_POSITIVE)).sqrt().max(LEAST_CLODS * longest);
        let side = (LONGEST_CLODS * longest).max(LEAST_CLOD_M).min(few);
        let many = ((CLODS_M / side) as usize).clamp(CLOD_SQUARES.0, CLOD_SQUARES.1);
        // More would show the same clods again.
        Self { many: many.min((size.max_element() / side).ceil().max(1.0) as usize), side }
    }
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
        let sky = solve(|half| {
            let (sky, level) = Light::sky(&coarse, half, reflectance);
            ((sky / level) as f32) < bright
        });
        let made = Light::of(&coarse, sky, reflectance);
        let target = bright * clod_light.sky;
        let darker = target / made.sky;
        // The flatter the view, the less is seen of the ground between clods.
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
            lost: Some(LostRelief {
                open: darker * (1.0 - reflectance * back),
                back,
                shadowing: Shadowing::new(&factors),
                slope: slope.max(0.0),
            }),
        }
    }

    /// Where both are compared: squares spread evenly over the ground, as large as it at most.
    fn patches(&self) -> Vec<Rect> {
        let (corner, size) = (self.area().corners()[0], self.area().size());
        let side = size.min(Vec2::splat(PATCH_M));
        // On a small ground more would lie one over the other.
        let many = ((size.max_element() / PATCH_M).ceil() as usize).clamp(1, PATCHES);
        let at = |k: usize| (k as f32 + 0.5) / many as f32;
        let place = |k: usize| corner + (size - side) * vec2(at(k % many), at(k / many));
        let square = |lo: Vec2| Rect::new(lo.x, lo.y, lo.x + side.x, lo.y + side.y);
        (0..many * many).map(place).map(square).collect()
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
        let (corner, size) = (self.area().corners()[0], self.area().size());
        let patches = self.patches();
        let here = |patch: &Rect| {
            let middle = 0.5 * (patch.corners()[0] + patch.corners()[1]);
            self.law.at(middle, self.share(middle)).number(shortest, longest)
        };
        let per_m2 = patches.iter().map(here).sum::<f32>() / patches.len() as f32;
        let Squares { many, side } = Squares::of(size, per_m2, longest);
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
            let sample = |place| {
                let raised = heights.raised(place);
                Sample { lit: lit(place), pit: 0.0, left: 1.0, albedo: 1.0, raised }
            };
            (places.iter().copied().map(sample).collect::<Vec<Sample>>(), heights.cover())
        };
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
        Sample {
            lit: Lit::of(normal, FACETS, HORIZON, rise),
            pit: painted.pits[k],
            left: painted.left(k),
            albedo,
            raised: false,
        }
    }
}

/// Light that ground sends, over what level ground of its mean reflectance does: up under an even sky, and from one direction into another.
#[derive(Clone, Copy, Debug)]
struct Light {
    sky: f32,
    sent: Table,
}

impl Light {
    const LEVEL: Self = Self { sky: 1.0, sent: [[1.0; TURNS]; PAIRS] };

    /// Of ground of a mean reflectance whose pits of the depth `half` see half of the sky: in place of what a texel does not see of the sky it sees ground as
    /// bright as the mean.
    ///
    /// Of light of one direction that meets ground again, each direction sees as much as it would of light from the zenith: sides that no light reaches
    /// are not black.
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
        // Horizons are not searched without end, and slopes not without width: what all places show at an angle is that of level ground all the same.
        let shown = shown.map(|sum| (sum / samples.len().max(1) as f64).max(f64::MIN_POSITIVE));
        let mut sent = [[0.0; TURNS]; PAIRS];
        for k in 0..SLANTS {
            for j in 0..=k {
                let pair = Shadowing::pair(j, k);
                let seen = shown[j] * shown[k];
                let upright = |k: usize| sums[Shadowing::pair(k, SLANTS - 1)][0];
                let both = upright(j) * upright(k) / upright(SLANTS - 1).max(f64::MIN_POSITIVE);
                let bounced = (1.0 / level - 1.0 / albedos) * both;
                sent[pair] = sums[pair].map(|sum: f64| ((sum / albedos + bounced) / seen) as f32);
            }
        }
        // Both say the same of an even sky that is seen from above.
        let sky = (sky / level) as f32;
        let from_above = Shadowing::under_even_sky(|k| sent[Shadowing::pair(k, SLANTS - 1)][0]);
        let scale = sky / from_above.max(f32::MIN_POSITIVE);
        Self { sky, sent: sent.map(|row| row.map(|factor| factor * scale)) }
    }

    /// What it sends up under the sky, and what level ground would.
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

/// Share of what is seen at each angle that is on clods.
fn raised(clods: &[Sample]) -> [f32; SLANTS] {
    std::array::from_fn(|k| {
        let shown = |all: bool| -> f32 {
            clods.iter().filter(|sample| all || sample.raised).map(|sample| sample.lit.shown[k]).sum()
        };
        shown(false) / shown(true).max(f32::MIN_POSITIVE)
    })
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

    /// Expected: five squares along a side of eight lengths of clods; one where the ground is smaller; smaller ones where very many lie.
    #[test]
    fn squares_are_as_many_as_the_ground_has_room_for() {
        let of = |size: f32, per_m2: f32| Squares::of(Vec2::splat(size), per_m2, 15.0);
        assert_eq!((of(9.0, 1e5).many, of(0.1, 1e5).many), (5, 1));
        assert!((of(9.0, 1e5).side - 0.12).abs() < 1e-6);
        let many = of(9.0, 1e7);
        assert!(many.side < 0.05 && many.side >= 0.03 && 1e7 * many.side * many.side < 2.1e4, "{many:?}");
        assert!((of(9.0, 1e30).side - 0.03).abs() < 1e-6);
    }

    fn light(lit: &Lit) -> Light {
        Light::of(&[Sample { lit: *lit, pit: 0.0, left: 1.0, albedo: 3.0, raised: false }; 3], 1.0, 0.4)
    }

    /// Expected: horizons that are told too low for flat views, so that all show a tenth more of themselves there, make nothing brighter than ground that
    /// shows as much as level ground does.
    #[test]
    fn what_is_shown_too_much_is_put_right() {
        let mut lit = Lit { sky: 1.0, sent: [[1.0; TURNS]; PAIRS], shown: [1.0; SLANTS], missed: 0.0, slope: 0.0 };
        lit.shown[0] = 1.1;
        for k in 0..SLANTS {
            lit.sent[Shadowing::pair(0, k)] = [if k == 0 { 1.21 } else { 1.1 }; TURNS];
        }
        let light = light(&lit);
        assert!(light.sent.iter().flatten().all(|sent| (sent - 1.0).abs() < 1e-3), "{light:?}");
    }

    /// Expected: ground that sees half of the sky, and for the rest ground of its own brightness, B = ρ (½ + ½ B).
    #[test]
    fn what_misses_the_sky_is_lit_by_the_ground() {
        let shown = [1.0; SLANTS];
        let lit = Lit { sky: 0.5, sent: [[0.75; TURNS]; PAIRS], shown, missed: 0.5, slope: 0.0 };
        let dark = Lit { sent: [[0.75, 0.75, 0.75, 0.0]; PAIRS], ..lit };
        let light = light(&lit);
        let e = light.sky;
        assert!((e - 0.5 / 0.8).abs() < 1e-6, "{light:?}");
        // What is lit by the ground alone has a fifth, 0.4 · 0.5, of all light.
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
