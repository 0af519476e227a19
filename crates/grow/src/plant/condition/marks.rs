//! Draws the marks of one leaf from the condition of its plant. [`Marks`] defines their coordinates.

#[cfg(test)]
mod tests;
mod until;

use super::Condition;
use crate::plant::ConditionDesc;
use furrow_base::geometry::{AlphaMask, Margin};
use furrow_base::math::{ToFloat, Vec2, lerp, vec2};
use furrow_base::ron_file::{Positive, Vary};
use furrow_base::sampling::{Purpose, Stream};
use furrow_optics::texture::marks::{Marks, Patch, SPECK_MM, Tear};
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
/// Height above the soil at which splash, and the dust in excess of that at the top, have fallen to 1/e, metres.
const LOW: f32 = 0.06;
/// Ratio of the dust on leaves far above the soil to that at the soil.
const HIGH_DUST: f32 = 0.15;

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

impl Bearer<'_> {
    /// Draws the marks of this leaf; `stream` is the leaf's, see [`super::leaf_stream`].
    pub fn draw_marks(&self, desc: &ConditionDesc, condition: &Condition, stream: &Stream) -> Marks {
        let of = |k: u64| stream.child(Purpose::Condition, k);
        let worn = if self.met.is_some() { 1.0 } else { lerp(YOUNG, 1.0, self.age) };
        let often = worn * self.share;
        let on_leaf = |radii: &Vary<Positive<1000>>, mean: f32, k: u64| {
            let mut s = of(k);
            let n = s.poisson(f64::from(mean * often));
            (0..n).filter_map(|_| patch(self, radii, &mut s)).collect::<Vec<Patch>>()
        };
        let [slugs, seed_leaf, true_leaf] = MEETS_MM2;
        let (shots, beetles) = if self.cotyledon { (1.0 / worn, seed_leaf) } else { (BEETLE, true_leaf) };
        let slugged = (on_leaf(&desc.hole_mm, condition.holes, 1), slugs);
        let shot = (on_leaf(&desc.shot_hole_mm, condition.shot_holes * shots, 2), beetles);
        let mut holes = met([slugged, shot], self, &mut of(9));
        let whole = holes.len();
        let mut s = of(3);
        for _ in 0..s.poisson(f64::from(condition.bites * often)) {
            bite(self, &desc.bite_mm, &mut holes, &mut s);
        }
        let mut s = of(4);
        let tears = (0..s.poisson(f64::from(condition.tears * often))).filter_map(|_| tear(self, &mut s)).collect();
        let low = (-self.height.max(0.0) / LOW).exp();
        let mut s = of(7);
        let uneven = |s: &mut Stream| (0.4 * s.normal().to_f32()).exp();
        // Old leaves turn yellow first, with random variation between leaves of equal age.
        let chlorosis = (condition.chlorosis * self.age.powf(1.5) * uneven(&mut s)).min(1.0);
        let scorch_mm = scorch_mm(condition, self, &mut of(10)) * uneven(&mut s);
        let dust = (condition.dust * lerp(HIGH_DUST, 1.0, low) * uneven(&mut s)).min(0.9);
        let splash = condition.splash * low * SPECK_MM * SPECK_MM / 100.0;
        let marks = Marks {
            image_mm: self.image_mm,
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
            margin: self.margin.cloned(),
            senescence: 0.0,
            whole: false,
        };
        match self.met {
            Some(share) => until::until(marks, share, stream),
            None => marks,
        }
    }
}

/// Draws the direction and the outline of a patch.
fn ragged(centre: Vec2, radius: f32, s: &mut Stream) -> Patch {
    let angle = s.range32(0.0, std::f32::consts::TAU);
    let (turn, stretch) = (vec2(angle.cos(), angle.sin()), s.range32(1.0, 1.35));
    Patch { centre, radius, turn, stretch, phase: vec2(s.range32(0.0, 99.0), s.range32(0.0, 99.0)) }
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
    let at = |i: usize| (i.to_f32() + 0.5) / SIDE.to_f32();
    let opaque = |k: &usize| bearer.mask.is_none_or(|m| m.opaque_at(vec2(at(k % SIDE), at(k / SIDE))));
    let share = (0..SIDE * SIDE).filter(opaque).count().to_f32() / (SIDE * SIDE).to_f32();
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
fn patch(bearer: &Bearer<'_>, radii: &Vary<Positive<1000>>, s: &mut Stream) -> Option<Patch> {
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
    last.map(|p| ragged(p, radius, s))
}

/// Draws a point on the margin, on either side, and returns it with its side (−1 or 1).
fn edge(bearer: &Bearer<'_>, s: &mut Stream) -> Option<(Vec2, f32)> {
    let side = if s.chance(0.5) { 1.0 } else { -1.0 };
    let y = s.range32(0.12, 0.92) * bearer.image_mm.y;
    let half = 0.5 * bearer.image_mm.x;
    let steps = 200;
    (0..steps)
        .map(|i| vec2(side * half * (1.0 - i.to_f32() / steps.to_f32()), y))
        .find(|p| there(bearer, *p))
        .map(|p| (p, side))
}

/// Adds the mouthfuls of a bite, side by side along the margin.
fn bite(bearer: &Bearer<'_>, radii: &Vary<Positive<1000>>, holes: &mut Vec<Patch>, s: &mut Stream) {
    let Some((mut at, side)) = edge(bearer, s) else { return };
    for _ in 0..=s.index(4) {
        let radius = radii.draw32(s).min(0.22 * narrow(bearer));
        holes.push(ragged(at, radius, s));
        let y = at.y + 1.1 * radius;
        let reach = (0..200).map(|i| vec2(side * 0.5 * bearer.image_mm.x * (1.0 - i.to_f32() / 200.0), y));
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
