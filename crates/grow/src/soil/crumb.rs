//! Size distribution of the aggregates, and the aggregates that are too small to be bodies.
//!
//! The number longer than L is N₅ · (5 mm / L)^D per m² (Aubertot et al. 1999). N₅ and D both vary over the ground:
//! some patches have more aggregates of all sizes, some are coarser, as after a harrow's tines.
//!
//! A crumb is part of the ground's surface: a half-sunk ellipsoid with two flat faces, represented by its height and
//! tint.

use super::{ClodsDesc, Rect, cell_stream, cells};
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec2, vec2};
use furrow_base::sampling::{Purpose, Stream};
use furrow_optics::texture::noise::Perlin;
use rayon::prelude::*;
use std::ops::Range;

/// Length at which the number of aggregates does not depend on the local exponent.
const PIVOT_MM: f32 = 5.0;

/// Standard deviation of [`Perlin::fbm2`] with three octaves and gain 0.5.
const FBM3_SD: f32 = 0.28;

/// Logarithm of the brightness of a clod lying loosely on top relative to one that is sunk to the [`MEAN_SINK`].
pub(super) const LOOSE_GAIN: f32 = 0.14;

/// Buried fraction of the height of clods: its range, the exponent of its distribution and its mean.
const SINK: (f32, f32) = (0.03, 0.7);
const SINK_POWER: f32 = 1.4;
const MEAN_SINK: f32 = SINK.0 + (SINK.1 - SINK.0) / (1.0 + SINK_POWER);

/// Fraction of the moisture that dry clods have lost that clods have lost on average: some are half dry, and bases are
/// moist.
pub(super) const CLODS_DRY: f32 = 0.8;

/// Lengths of the aggregates that fill the gaps between clods, mm.
const FINES_MM: (f32, f32) = (1.0, 5.0);

/// Ratio of the mean area of a crumb's outline to the square of its length, measured on 4000 crumbs: the ellipse has
/// 0.62, and a quarter is cut off.
const OUTLINE: f32 = 0.476;

/// Number of straight breaks in the outline of a crumb.
const BREAKS: usize = 6;

/// Side of the cells that address the aggregates, metres.
const CELL_M: f32 = 0.02;

/// Approximate number of bands of a raster, and the minimum number of cell rows per band: aggregates at band borders
/// are rasterized twice.
const BANDS: i32 = 32;
const LEAST_CELLS: i32 = 8;

/// Size distribution of the aggregates of one ground.
#[derive(Clone, Debug)]
pub(super) struct SizeDistribution {
    pub(super) over_pivot: f32,
    pub(super) exponent: f32,
    clustering: f32,
    sorting: f32,
    frequency: f64,
    noise: Perlin,
    /// Standard deviation of the logarithm of brightness.
    pub(super) tint_sigma: f32,
    /// Scale of the logarithms of the colour ratios.
    pub(super) hue_sigma: f32,
    /// Fraction of the ground's moisture that dry aggregates have lost.
    pub(super) dryness: f32,
    /// Fraction of aggregates that have lost none.
    pub(super) damp: f32,
    /// Looseness of the clods: 0 for normal sinking, 1 for none.
    pub(super) loose: f32,
    /// Fraction of joints and pores that fine earth fills.
    pub(super) filled: f32,
}

/// Part of the aggregates of a ground.
#[derive(Clone, Copy, Debug)]
pub(super) struct SizeRange {
    /// Range of lengths, mm; empty if its ends are equal.
    pub(super) mm: (f32, f32),
    /// Fraction of the number that the size distribution gives.
    pub(super) amount: f32,
    /// Fraction of the moisture that dry aggregates have lost that these have lost on average.
    pub(super) dry: f32,
}

impl SizeRange {
    fn is_some(&self) -> bool {
        self.mm.0 < self.mm.1 && self.amount > 0.0
    }
}

/// Returns the fraction of a clod's height below the surface, from u in 0..1.
pub(super) fn sink(u: f32) -> f32 {
    SINK.0 + (SINK.1 - SINK.0) * u.powf(SINK_POWER)
}

/// Returns the logarithm of a clod's brightness relative to one that is sunk to the [`MEAN_SINK`].
pub(super) fn loose_gain(sink: f32) -> f32 {
    LOOSE_GAIN * (MEAN_SINK - sink) / MEAN_SINK
}

/// Local size distribution: the number above 5 mm, m⁻², and the exponent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Local {
    over_pivot: f32,
    exponent: f32,
}

impl Local {
    /// Returns the number between two lengths, m⁻².
    pub(super) fn number(self, min_mm: f32, max_mm: f32) -> f32 {
        let over = |mm: f32| self.over_pivot * (PIVOT_MM / mm).powf(self.exponent);
        (over(min_mm) - over(max_mm)).max(0.0)
    }

    /// Returns the area of the aggregates between two lengths seen from above, relative to the ground's area.
    pub(super) fn cover(self, (min_mm, max_mm): (f32, f32)) -> f32 {
        // Integral of n(L) = D N₅ 5^D L^{−D−1} outlines with the area OUTLINE · L².
        let by = 2.0 - self.exponent;
        let powers = if by.abs() < 1e-3 { (max_mm / min_mm).ln() } else { (max_mm.powf(by) - min_mm.powf(by)) / by };
        OUTLINE * 1e-6 * self.exponent * self.over_pivot * PIVOT_MM.powf(self.exponent) * powers
    }

    /// Returns a length between two bounds for u in 0..1.
    pub(super) fn length_mm(self, min_mm: f32, max_mm: f32, u: f32) -> f32 {
        // Inverse of the truncated power law.
        let (a, b) = (min_mm.powf(-self.exponent), max_mm.powf(-self.exponent));
        (a + u * (b - a)).powf(-1.0 / self.exponent).clamp(min_mm, max_mm)
    }
}

impl SizeDistribution {
    pub(super) fn new(desc: &ClodsDesc, stream: &Stream) -> Self {
        let child = |k| stream.child(Purpose::Debris, k);
        Self {
            over_pivot: desc.over_5mm_per_m2.draw32(&mut child(0)),
            exponent: desc.exponent.draw32(&mut child(1)),
            clustering: desc.clustering.draw32(&mut child(2)),
            frequency: 1.0 / desc.cluster_m.draw(&mut child(3)),
            sorting: desc.sorting.f32(),
            noise: Perlin::new(child(4).seed32()),
            tint_sigma: desc.tint_sigma.f32(),
            hue_sigma: desc.hue_sigma.f32(),
            dryness: desc.dryness.draw32(&mut child(5)),
            damp: desc.damp.draw32(&mut child(6)),
            loose: desc.loose.draw32(&mut child(7)),
            filled: desc.filled.draw32(&mut child(8)),
        }
    }

    /// Returns the local size distribution at `p`; `share` is the fraction of the aggregates that the layers hold
    /// there.
    pub(super) fn at(&self, p: Vec2, share: f32) -> Local {
        let (x, y) = (f64::from(p.x) * self.frequency, f64::from(p.y) * self.frequency);
        let normal = |shift: f64| (self.noise.fbm2(x + shift, y - shift, 3, 0.5).to_f32() / FBM3_SD).clamp(-2.0, 2.0);
        let more = if self.clustering > 0.0 { normal(0.43) * self.clustering } else { 0.0 };
        let coarser = if self.sorting > 0.0 { normal(57.91) * self.sorting } else { 0.0 };
        Local {
            over_pivot: share * self.over_pivot * (more - 0.5 * self.clustering * self.clustering).exp(),
            exponent: self.exponent * (1.0 - coarser),
        }
    }

    /// Returns how much more of the ground's surface fine aggregates cover at `p` than on average, −1..1. `amount` is their
    /// fraction of the number that the size distribution gives, `share` as in [`Self::at`].
    pub(super) fn fines(&self, p: Vec2, share: f32, amount: f32) -> f32 {
        let bare = |local: Local| (-amount * local.cover(FINES_MM)).exp();
        let mean = Local { over_pivot: self.over_pivot, exponent: self.exponent };
        bare(mean) - bare(self.at(p, share))
    }

    /// Returns the brightness times 128 and the loss of moisture times 255 of an aggregate, from three numbers in 0..1;
    /// `dry` as in [`SizeRange`].
    fn shade(&self, u: [f32; 3], dry: f32) -> (u8, u8) {
        // The sum of two uniforms less one has standard deviation 0.408.
        let tint = ((u[0] + u[1] - 1.0) / 0.408 * 1.5 * self.tint_sigma).exp();
        let dry = if u[2] < self.damp { 0 } else { (self.dryness * dry * 255.0).trunc_to::<u8>() };
        ((tint * 128.0).clamp(1.0, 255.0).trunc_to::<u8>(), dry)
    }

    /// Calls `each` for every aggregate between two lengths in the cells of `area`, with its position, its length in mm
    /// (0 if it is outside `area`) and its random stream. `share` returns the fraction of the aggregates that the
    /// layers hold at a point.
    pub(super) fn scatter(
        &self,
        area: Rect,
        mm: (f32, f32),
        stream: &Stream,
        share: impl Fn(Vec2) -> f32,
        mut each: impl FnMut(Vec2, f32, &mut Stream),
    ) {
        for (i, j) in cells(area, CELL_M) {
            let corner = vec2(i.to_f32(), j.to_f32()) * CELL_M;
            let mut s = cell_stream(stream, i, j);
            // The distribution is evaluated at the cell's centre, inside the area or not, so that the area does not change it.
            let local = self.at(corner + 0.5 * CELL_M, share(corner + 0.5 * CELL_M));
            for _ in 0..s.poisson(f64::from(local.number(mm.0, mm.1) * CELL_M * CELL_M)) {
                let p = corner + vec2(s.uniform32(), s.uniform32()) * CELL_M;
                let length = local.length_mm(mm.0, mm.1, s.uniform32());
                if area.contains(p) {
                    each(p, length, &mut s);
                } else {
                    each(p, 0.0, &mut s);
                }
            }
        }
    }
}

/// Raster of the crumbs' heights, tints and loss of moisture.
#[derive(Clone, Debug)]
pub(super) struct Crumbs {
    /// Height above the ground without crumbs, metres.
    pub(super) height: Vec<f32>,
    /// Brightness times 128; 0 where there is no crumb.
    pub(super) tint: Vec<u8>,
    /// Index of the crumb's colour.
    pub(super) hue: Vec<u8>,
    /// Fraction of the ground's moisture that is lost, times 255.
    pub(super) dry: Vec<u8>,
}

/// Returns the index of a crumb's colour from the difference of the two numbers in 0..1 whose sum is its brightness.
fn hue(difference: f32) -> u8 {
    // The difference is independent of the sum to second order; its distribution is triangular.
    let below = 0.5 * (1.0 - difference.abs()).powi(2);
    ((if difference < 0.0 { below } else { 1.0 - below }) * 255.0 + 0.5).trunc_to::<u8>()
}

/// Positions of a raster's samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct Raster {
    pub(super) origin: Vec2,
    pub(super) step: f32,
    pub(super) width: usize,
    pub(super) height: usize,
}

impl Raster {
    /// Returns the area that it covers.
    pub(super) fn area(self) -> Rect {
        let far = self.origin + vec2(self.width.to_f32(), self.height.to_f32()) * self.step;
        Rect::new(self.origin.x, self.origin.y, far.x, far.y)
    }

    /// Returns the first column inside cell column `i`; `first_row` likewise.
    fn first_column(self, i: i32) -> usize {
        ((i.to_f32() * CELL_M - self.origin.x) / self.step).ceil().clamp(0.0, self.width.to_f32()).trunc_to::<usize>()
    }

    fn first_row(self, j: i32) -> usize {
        ((j.to_f32() * CELL_M - self.origin.y) / self.step).ceil().clamp(0.0, self.height.to_f32()).trunc_to::<usize>()
    }
}

/// Rows of a raster that are rasterized together.
struct Band<'a> {
    raster: Raster,
    /// Rows of cells in this band.
    cells: Range<i32>,
    /// Rows of the raster in this band.
    rows: Range<usize>,
    height: &'a mut [f32],
    tint: &'a mut [u8],
    hue: &'a mut [u8],
    dry: &'a mut [u8],
}

impl Crumbs {
    /// Rasterizes the `seen` parts one after the other. Uncovered samples are then assigned at random to aggregates of
    /// the `unseen` parts, with the probability that these cover the ground, so that unresolved aggregates keep their
    /// share of the ground's colour.
    pub(super) fn draw(
        raster: Raster,
        law: &SizeDistribution,
        seen: [SizeRange; 2],
        unseen: [SizeRange; 2],
        stream: &Stream,
        share: impl Fn(Vec2) -> f32 + Sync,
    ) -> Self {
        let n = raster.width * raster.height;
        let mut crumbs = Self { height: vec![0.0; n], tint: vec![0; n], hue: vec![0; n], dry: vec![0; n] };
        crumbs.bands(raster).into_par_iter().for_each(|mut band| {
            for (k, part) in seen.into_iter().enumerate().filter(|(_, part)| part.is_some()) {
                let stream = if k == 0 { stream.clone() } else { stream.child(Purpose::Debris, k.to_u64()) };
                law.scatter(
                    band.area().grown(part.mm.1 * 1e-3),
                    part.mm,
                    &stream,
                    |p| part.amount * share(p),
                    |p, length, s| band.add(p, length, part, law, s),
                );
            }
            if unseen.iter().any(SizeRange::is_some) {
                band.fill(law, unseen, &stream.child(Purpose::Debris, seen.len().to_u64()), &share);
            }
        });
        crumbs
    }

    /// Splits the raster into bands of rows that contain whole cells and can be processed in parallel.
    fn bands(&mut self, raster: Raster) -> Vec<Band<'_>> {
        let Rect { y0, y1, .. } = raster.area();
        let mut cells = (y0 / CELL_M).floor_to::<i32>()..(y1 / CELL_M).ceil_to::<i32>();
        let mut left =
            (self.height.as_mut_slice(), [&mut self.tint, &mut self.hue, &mut self.dry].map(Vec::as_mut_slice));
        let many = (cells.len().to_i32() / BANDS).max(LEAST_CELLS);
        let mut bands = Vec::new();
        let mut first = 0;
        while !cells.is_empty() {
            let own = cells.start..(cells.start + many).min(cells.end);
            cells.start = own.end;
            let end = if cells.is_empty() { raster.height } else { raster.first_row(own.end) };
            let texels = (end - first) * raster.width;
            let (height, heights) = left.0.split_at_mut(texels);
            let [(tint, tints), (hue, hues), (dry, drys)] = left.1.map(|bytes| bytes.split_at_mut(texels));
            left = (heights, [tints, hues, drys]);
            if texels > 0 {
                bands.push(Band { raster, cells: own, rows: first..end, height, tint, hue, dry });
            }
            first = end;
        }
        bands
    }
}

impl Band<'_> {
    /// Returns the area that it covers.
    fn area(&self) -> Rect {
        let row = |j: usize| self.raster.origin.y + j.to_f32() * self.raster.step;
        Rect { y0: row(self.rows.start), y1: row(self.rows.end), ..self.raster.area() }
    }

    /// Adds aggregates that are smaller than the sample spacing to uncovered samples.
    fn fill(&mut self, law: &SizeDistribution, parts: [SizeRange; 2], stream: &Stream, share: impl Fn(Vec2) -> f32) {
        let Raster { width, .. } = self.raster;
        for (i, j) in cells(self.area(), CELL_M).filter(|(_, j)| self.cells.contains(j)) {
            let centre = (vec2(i.to_f32(), j.to_f32()) + 0.5) * CELL_M;
            let local = law.at(centre, share(centre));
            let cover = parts.map(|part| if part.is_some() { part.amount * local.cover(part.mm) } else { 0.0 });
            let [bare, first] = [(-cover[0] - cover[1]).exp(), cover[0] / (cover[0] + cover[1]).max(f32::MIN_POSITIVE)];
            let mut s = cell_stream(stream, i, j);
            for y in self.raster.first_row(j)..self.raster.first_row(j + 1) {
                for x in self.raster.first_column(i)..self.raster.first_column(i + 1) {
                    let k = (y - self.rows.start) * width + x;
                    if self.tint[k] == 0 && s.uniform32() >= bare {
                        let part = &parts[usize::from(s.uniform32() >= first)];
                        let u = [s.uniform32(), s.uniform32(), s.uniform32()];
                        (self.tint[k], self.dry[k]) = law.shade(u, part.dry);
                        self.hue[k] = hue(u[0] - u[1]);
                    }
                }
            }
        }
    }

    fn add(&mut self, p: Vec2, length_mm: f32, part: SizeRange, law: &SizeDistribution, s: &mut Stream) {
        // Always draws the same number of values, so that a crumb outside the area does not change its neighbours.
        let mut u = [0.0; 18];
        u.fill_with(|| s.uniform32());
        let a = 0.5e-3 * length_mm;
        let b = a * (0.67 + 0.25 * u[0]);
        let turn = Vec2::from_angle(u[1] * std::f32::consts::TAU);
        let top = a * 0.55 * (0.8 + 0.4 * u[2]);
        // Sunk by 20–50 % of the height.
        let centre = top * (0.6 - 0.6 * u[3]);
        let face = |v: f32, w: f32| Vec2::from_angle(v * std::f32::consts::TAU) * (0.4 + 0.9 * w);
        let (f, g) = (face(u[4], u[5]), face(u[6], u[7]));
        let (tint, dry) = law.shade([u[8], u[9], u[10]], part.dry);
        let hue = hue(u[8] - u[9]);
        // The outline is an ellipse cut by straight breaks, so that crumbs are angular and all different.
        let breaks: [Vec2; BREAKS] = std::array::from_fn(|k| {
            let at = (k.to_f32() + 0.8 * u[11 + k]) / BREAKS.to_f32();
            Vec2::from_angle((at + u[17]) * std::f32::consts::TAU) * (1.02 + 0.38 * u[11 + (k + 2) % BREAKS])
        });

        let Self { raster, rows, .. } = self;
        let q = (p - raster.origin) / raster.step;
        let reach = a / raster.step;
        let lo = (q - reach).ceil().max(vec2(0.0, rows.start.to_f32()));
        let hi = (q + reach).floor().min(vec2(raster.width.to_f32(), rows.end.to_f32()) - 1.0);
        let scale = vec2(raster.step / a.max(1e-9), raster.step / b.max(1e-9));
        for y in lo.y.trunc_to::<i32>()..=hi.y.trunc_to::<i32>() {
            for x in lo.x.trunc_to::<i32>()..=hi.x.trunc_to::<i32>() {
                let d = turn.rotate(vec2(x.to_f32(), y.to_f32()) - q) * scale;
                let cut = breaks.iter().fold(0.0f32, |most, b| most.max(b.dot(d)));
                let inside = 1.0 - d.length_squared().max(cut * cut);
                if inside <= 0.0 {
                    continue;
                }
                // Steeper at the rim and flatter on top than an ellipsoid.
                let dome = inside.sqrt() * (1.35 - 0.35 * inside);
                let z = centre + top * dome.min(0.75 + f.dot(d)).min(0.85 + g.dot(d));
                let k = (y.to_usize() - rows.start) * raster.width + x.to_usize();
                if z > self.height[k] {
                    self.height[k] = z;
                    self.tint[k] = tint;
                    self.hue[k] = hue;
                    self.dry[k] = dry;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::ron_file::{Num, Vary};

    fn law(clustering: f64) -> SizeDistribution {
        let desc = ClodsDesc {
            over_5mm_per_m2: Vary::fixed(9400.0),
            exponent: Vary::fixed(3.8),
            clustering: Vary::fixed(clustering),
            sorting: Num::new(0.0),
            ..ClodsDesc::default()
        };
        SizeDistribution::new(&desc, &Stream::of(5, 0, Purpose::Test, 0))
    }

    fn lengths(law: &SizeDistribution, area: Rect) -> Vec<(Vec2, f32)> {
        let mut all = Vec::new();
        law.scatter(
            area,
            (2.5, 60.0),
            &Stream::of(6, 0, Purpose::Test, 0),
            |_| 1.0,
            |p, mm, _| {
                if mm > 0.0 {
                    all.push((p, mm));
                }
            },
        );
        all
    }

    #[test]
    fn sizes_follow_the_power_law_that_was_asked_for() {
        let all = lengths(&law(0.0), Rect::new(-1.0, -0.5, 1.0, 0.5));
        // Maximum likelihood exponent of a Pareto law (Hill 1975); its standard error is D/√n.
        let n = all.len().to_f32();
        let d = n / all.iter().map(|(_, mm)| (mm / 2.5).ln()).sum::<f32>();
        assert!((d - 3.8).abs() < 4.0 * 3.8 / n.sqrt(), "{d} from {n}");
        let over5 = all.iter().filter(|(_, mm)| *mm > 5.0).count().to_f32();
        assert!((over5 / 2.0 - 9400.0).abs() < 4.0 * (9400f32 / 2.0).sqrt(), "{over5}");
    }

    #[test]
    fn clusters_change_the_pattern_but_not_the_mean() {
        let area = Rect::new(0.0, 0.0, 2.0, 2.0);
        let count = |clustering| {
            let mut quadrats = vec![0.0f32; 400];
            for (p, _) in lengths(&law(clustering), area) {
                quadrats[(p.y * 10.0).trunc_to::<usize>() * 20 + (p.x * 10.0).trunc_to::<usize>()] += 1.0;
            }
            let mean = quadrats.iter().sum::<f32>() / 400.0;
            (mean, quadrats.iter().map(|q| (q - mean).powi(2)).sum::<f32>() / 400.0 / mean)
        };
        let (even, clustered) = (count(0.0), count(0.45));
        assert!((clustered.0 / even.0 - 1.0).abs() < 0.15, "{even:?} {clustered:?}");
        assert!(clustered.1 > 5.0 * even.1 && (even.1 - 1.0).abs() < 0.3, "{even:?} {clustered:?}");
    }

    /// Rationale: unresolved aggregates must cover the same area as resolved ones. Expected: the fraction of samples
    /// under crumbs, rasterized at a spacing far below their size and dithered at one far above it, is 1 − e^{−cover}
    /// in both cases. Source: the integral of the size distribution over the outlines.
    #[test]
    fn aggregates_cover_as_much_drawn_or_not() {
        let law = law(0.0);
        let mm = (2.5, 10.0);
        let some = SizeRange { mm, amount: 0.2, dry: 1.0 };
        let none = SizeRange { mm: (2.5, 2.5), ..some };
        let covered = |step: f32, size: usize, seen: SizeRange, unseen: SizeRange| {
            let raster = Raster { origin: vec2(0.0, 0.0), step, width: size, height: size };
            let stream = Stream::of(9, 0, Purpose::Test, 0);
            let crumbs = Crumbs::draw(raster, &law, [seen, none], [unseen, none], &stream, |_| 1.0);
            crumbs.tint.iter().filter(|tint| **tint > 0).count().to_f32() / crumbs.tint.len().to_f32()
        };
        let cover = 0.2 * law.at(Vec2::ZERO, 1.0).cover(mm);
        let expected = 1.0 - (-cover).exp();
        let (drawn, dithered) = (covered(4e-4, 1500, some, none), covered(1.2e-2, 200, none, some));
        assert!(expected > 0.1, "{expected}");
        assert!((drawn / expected - 1.0).abs() < 0.05, "{drawn} of {expected}");
        assert!((dithered / expected - 1.0).abs() < 0.05, "{dithered} of {expected}");
    }

    /// Expected: the mean of the burial over its distribution is the one that the brightness refers to; some clods lie on
    /// the ground, some are mostly buried.
    #[test]
    fn clods_are_buried_by_a_wide_range_of_their_height() {
        let sinks: Vec<f32> = (0..1000).map(|k| sink((k.to_f32() + 0.5) / 1000.0)).collect();
        let mean = |of: &dyn Fn(f32) -> f32| sinks.iter().map(|s| of(*s)).sum::<f32>() / 1000.0;
        let below = |limit: f32| sinks.iter().filter(|s| **s < limit).count();
        assert!((mean(&|s| s) - MEAN_SINK).abs() < 1e-3, "{}", mean(&|s| s));
        assert!(mean(&loose_gain).abs() < 1e-3);
        assert!(
            (120..300).contains(&below(0.12)) && (700..900).contains(&below(0.55)),
            "{} {}",
            below(0.12),
            below(0.55)
        );
    }

    #[test]
    fn a_larger_area_holds_the_same_aggregates() {
        let small = Rect::new(0.1, 0.1, 0.33, 0.27);
        let few = lengths(&law(0.45), small);
        let many: Vec<_> =
            lengths(&law(0.45), small.grown(0.2)).into_iter().filter(|(p, _)| small.contains(*p)).collect();
        assert!(few.len() > 1000);
        assert_eq!(few, many);
    }
}
