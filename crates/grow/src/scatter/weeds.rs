//! Weeds: a log-Gaussian Cox process, with clusters where seeds fell next to the mother plant.
//!
//! Counts of seedlings in quadrats are aggregated like a negative binomial distribution (Gold et al. 1996; Cardina et
//! al. 1997): the ratio of variance to mean is 1 + mean/k. A Poisson process whose log-intensity is a Gaussian field
//! with the variance σ² = ln(1 + 1/k) has the same ratio if its range exceeds the quadrat. A fraction of the plants may
//! be in Thomas clusters instead.

use super::field::GaussianField;
use super::record::WeedsRecord;
use super::{Area, Disc, Spot, outside, within};
use furrow_base::math::{RoundTo, ToFloat, Vec2, vec2};
use furrow_base::ron_file::{Fraction, NonNegative, Positive, Vary};
use furrow_base::sampling::{Purpose, Stream};
use serde::{Deserialize, Serialize};

/// One species of weed in a field. Untreated beet fields have 20–130 m⁻² of all species, treated ones 0.1–3.
///
/// ```
/// use furrow_grow::scatter::WeedsDesc;
/// let capsella: WeedsDesc = ron::from_str(
///     "(per_m2: LogNormal(median: 12, sigma: 0.8), k: 0.5, range_m: 0.8, clusters: (share: 0.5, plants: 8, sd_m: 0.05))",
/// ).unwrap();
/// assert!(ron::from_str::<WeedsDesc>("(per_m2: -3)").is_err());
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct WeedsDesc {
    /// Mean number, m⁻².
    pub per_m2: Vary<NonNegative<100_000_000>>,
    /// Aggregation: k of the negative binomial, 0.2–1.5 for seedlings; 1000 is even.
    pub k: Vary<Positive<1_000_000>>,
    /// Size of the patches, metres: 0.3–3.
    pub range_m: Vary<Positive<1000>>,
    /// Clusters around former mother plants.
    pub clusters: ClustersDesc,
    /// Minimum distance between two stems.
    pub min_distance_m: Vary<NonNegative<1>>,
}

impl Default for WeedsDesc {
    fn default() -> Self {
        Self {
            per_m2: Vary::fixed(10.0),
            k: Vary::fixed(0.5),
            range_m: Vary::uniform(0.3, 3.0),
            clusters: ClustersDesc::default(),
            min_distance_m: Vary::fixed(0.006),
        }
    }
}

/// Thomas clusters: a Poisson number of plants, normally distributed around a centre.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ClustersDesc {
    /// Fraction of the plants that are in clusters.
    pub share: Vary<Fraction>,
    /// Mean number of plants in a cluster: 3–15.
    pub plants: Vary<Positive<1_000_000>>,
    /// Standard deviation of their distance along each axis, metres: 0.03–0.08.
    pub sd_m: Vary<Positive<1000>>,
}

impl Default for ClustersDesc {
    fn default() -> Self {
        Self { share: Vary::fixed(0.0), plants: Vary::uniform(3.0, 15.0), sd_m: Vary::uniform(0.03, 0.08) }
    }
}

impl WeedsRecord {
    /// Draws the parameters of a field's weeds; `stream` is that of their positions.
    pub fn draw(desc: &WeedsDesc, stream: &Stream) -> Self {
        // Stream 3 is that of the patches themselves.
        let child = |k| stream.child(Purpose::Page, k);
        Self {
            per_m2: desc.per_m2.draw32(&mut child(0)),
            k: desc.k.draw32(&mut child(1)),
            range_m: desc.range_m.draw32(&mut child(2)),
            clusters_share: desc.clusters.share.draw32(&mut child(4)),
            clusters_plants: desc.clusters.plants.draw32(&mut child(5)),
            clusters_sd_m: desc.clusters.sd_m.draw32(&mut child(6)),
            min_distance_m: desc.min_distance_m.draw32(&mut child(7)),
        }
    }
}

/// Side of the cells that address plants and mother plants, metres; the intensity is evaluated at their centre.
const CELL_M: f32 = 0.1;

/// Estimates the number of places that [`weeds`] visits: expected plants, and the cells that may hold them.
pub fn weeds_looked_at(desc: &WeedsDesc, area: Area, stream: &Stream) -> f64 {
    let drawn = WeedsRecord::draw(desc, stream);
    let share = f64::from(drawn.clusters_share);
    let reach = if share > 0.0 { 4.0 * drawn.clusters_sd_m } else { 0.0 };
    let beyond = 2.0 * f64::from(drawn.min_distance_m + reach);
    let size = area[1] - area[0];
    let wide = (f64::from(size.x) + beyond) * (f64::from(size.y) + beyond);
    // A cluster's mother is visited even if it has few children.
    let mothers = 1.0 + share / f64::from(drawn.clusters_plants);
    wide * (f64::from(drawn.per_m2) * mothers + 1.0 / f64::from(CELL_M * CELL_M))
}

/// Returns the positions of the weeds of one species in `area`, none of them in `discs`.
pub fn weeds(desc: &WeedsDesc, area: Area, discs: &[Disc], stream: &Stream) -> Vec<Spot> {
    let drawn = WeedsRecord::draw(desc, stream);
    let (per_m2, share, plants) = (drawn.per_m2, drawn.clusters_share, drawn.clusters_plants);
    let (sd, apart) = (drawn.clusters_sd_m, drawn.min_distance_m);
    let variance = (1.0 + 1.0 / drawn.k).ln();
    let field = GaussianField::new(drawn.range_m, &mut stream.child(Purpose::Page, 3));
    let intensity = |p: Vec2| (variance.sqrt() * field.at(p) - 0.5 * variance).exp() * per_m2;

    // Neighbours beyond the border also remove plants that are too close.
    let wide = [area[0] - apart, area[1] + apart];
    let mut all = Vec::new();
    for (i, j) in cells(wide) {
        let mut cell = stream.child(Purpose::Scatter, address(i, j));
        let middle = (vec2(i.to_f32(), j.to_f32()) + 0.5) * CELL_M;
        for k in 0..cell.poisson(f64::from((1.0 - share) * intensity(middle) * CELL_M * CELL_M)) {
            let mut s = cell.child(Purpose::Plant, k);
            let at = (vec2(i.to_f32(), j.to_f32()) + vec2(s.uniform32(), s.uniform32())) * CELL_M;
            all.push(Spot { at, key: key(i, j, 0, k) });
        }
    }
    if share > 0.0 {
        let reach = 4.0 * sd;
        let mothers = stream.child(Purpose::Page, 8);
        for (i, j) in cells([wide[0] - reach, wide[1] + reach]) {
            let mut cell = mothers.child(Purpose::Scatter, address(i, j));
            let middle = (vec2(i.to_f32(), j.to_f32()) + 0.5) * CELL_M;
            for k in 0..cell.poisson(f64::from(share / plants * intensity(middle) * CELL_M * CELL_M)) {
                let mut s = cell.child(Purpose::Plant, k);
                let centre = (vec2(i.to_f32(), j.to_f32()) + vec2(s.uniform32(), s.uniform32())) * CELL_M;
                for n in 0..s.poisson(f64::from(plants)) {
                    let d = vec2(s.normal().to_f32(), s.normal().to_f32()).clamp_length_max(4.0);
                    all.push(Spot { at: centre + d * sd, key: key(i, j, k + 1, n) });
                }
            }
        }
    }
    all.retain(|s| within(wide, s.at));
    let mut spots = thin(&all, apart);
    spots.retain(|s| within(area, s.at));
    outside(spots, discs)
}

/// Removes from each pair that is too close the plant with the larger hash, even if the other one is removed as well.
/// Chains of removals therefore cannot reach in from beyond the border. Source: Matérn's second hard-core process.
fn thin(all: &[Spot], apart: f32) -> Vec<Spot> {
    let mark = |s: &Spot| furrow_base::sampling::rng::mix(s.key);
    let mut order: Vec<usize> = (0..all.len()).collect();
    order.sort_by(|a, b| all[*a].at.x.total_cmp(&all[*b].at.x));
    let mut keep = vec![true; all.len()];
    for (n, a) in order.iter().enumerate() {
        for b in order[n + 1..].iter().take_while(|b| all[**b].at.x - all[*a].at.x < apart) {
            if all[*a].at.distance(all[*b].at) < apart {
                let loser = if mark(&all[*a]) > mark(&all[*b]) { *a } else { *b };
                keep[loser] = false;
            }
        }
    }
    all.iter().zip(keep).filter(|(_, keep)| *keep).map(|(s, _)| *s).collect()
}

fn cells(area: Area) -> impl Iterator<Item = (i32, i32)> {
    let index = |x: f32| (x / CELL_M).floor().clamp(-1e6, 1e6).trunc_to::<i32>();
    let (lo, hi) = ((index(area[0].x), index(area[0].y)), (index(area[1].x), index(area[1].y)));
    (lo.1..=hi.1).flat_map(move |j| (lo.0..=hi.0).map(move |i| (i, j)))
}

fn address(i: i32, j: i32) -> u64 {
    (u64::from(i.cast_unsigned()) << 32) | u64::from(j.cast_unsigned())
}

/// Returns a plant's address from its cell, its mother (0 for none) and its number.
fn key(i: i32, j: i32, mother: u64, n: u64) -> u64 {
    furrow_base::sampling::rng::mix(address(i, j)) ^ furrow_base::sampling::rng::mix((mother << 32 | n) ^ 0x5eed)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn desc(k: f64, share: f64) -> WeedsDesc {
        WeedsDesc {
            per_m2: Vary::fixed(40.0),
            k: Vary::fixed(k),
            range_m: Vary::fixed(1.0),
            clusters: ClustersDesc { share: Vary::fixed(share), plants: Vary::fixed(8.0), sd_m: Vary::fixed(0.05) },
            min_distance_m: Vary::fixed(0.0),
        }
    }

    fn stream(seed: u64) -> Stream {
        Stream::of(seed, 0, Purpose::Test, 0)
    }

    /// Returns the mean and variance of the counts in square quadrats of 0.5 m side over many fields.
    fn quadrats(desc: &WeedsDesc) -> (f64, f64) {
        let mut counts = Vec::new();
        for seed in 0..60 {
            let all = weeds(desc, [vec2(0.0, 0.0), vec2(4.0, 4.0)], &[], &stream(seed));
            let mut field = [0.0f64; 64];
            for s in all {
                field[(s.at.y * 2.0).trunc_to::<usize>() * 8 + (s.at.x * 2.0).trunc_to::<usize>()] += 1.0;
            }
            counts.extend(field);
        }
        let n = counts.len().to_f64();
        let mean = counts.iter().sum::<f64>() / n;
        (mean, counts.iter().map(|c| (c - mean).powi(2)).sum::<f64>() / n)
    }

    #[test]
    fn counts_are_as_aggregated_as_asked() {
        let (mean, variance) = quadrats(&desc(1e6, 0.0));
        assert!((mean - 10.0).abs() < 0.3 && (variance / mean - 1.0).abs() < 0.15, "{mean} {variance}");
        let (mean, variance) = quadrats(&desc(1.5, 0.0));
        // 1 + mean/k for patches much larger than the quadrat; slightly less for a range of two quadrats.
        assert!((mean - 10.0).abs() < 1.5 && variance / mean > 3.0 && variance / mean < 12.0, "{mean} {variance}");
        let (mean, variance) = quadrats(&desc(1e6, 1.0));
        assert!((mean - 10.0).abs() < 0.5 && variance / mean > 4.0, "{mean} {variance}");
    }

    #[test]
    fn a_larger_area_holds_the_same_weeds() {
        let page = WeedsDesc { min_distance_m: Vary::fixed(0.03), ..desc(0.5, 0.5) };
        let small = [vec2(-0.5, 0.1), vec2(0.7, 1.0)];
        let inner = |area| -> Vec<(u64, Vec2)> {
            let mut all: Vec<_> = weeds(&page, area, &[], &stream(4))
                .into_iter()
                .filter(|s| within(small, s.at))
                .map(|s| (s.key, s.at))
                .collect();
            all.sort_by_key(|a| a.0);
            all
        };
        assert!(inner(small).len() > 5);
        assert_eq!(inner(small), inner([vec2(-3.0, -3.0), vec2(3.0, 3.0)]));
    }

    #[test]
    fn stems_keep_their_distance() {
        let page = WeedsDesc { min_distance_m: Vary::fixed(0.04), ..desc(1.0, 0.5) };
        let all = weeds(&page, [vec2(0.0, 0.0), vec2(3.0, 3.0)], &[(vec2(1.0, 1.0), 0.3)], &stream(2));
        assert!(all.len() > 20);
        for (n, a) in all.iter().enumerate() {
            assert!(a.at.distance(vec2(1.0, 1.0)) > 0.3);
            assert!(all[n + 1..].iter().all(|b| a.at.distance(b.at) >= 0.04 && a.key != b.key));
        }
    }
}
