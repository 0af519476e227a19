//! One piece of ground: heights, their interpolation, and the derived fields.

use super::blend::{Blend, Weights};
use super::color::{ColorTransform, mean};
use super::crack::Cracks;
use super::crumb::{CLODS_DRY, Crumbs, Raster, SizeDistribution, SizeRange};
use super::grid::Grid;
use super::pigments::Pigments;
use super::record::{ClodsRecord, LayerRecord, LitterRecord, MoistureRecord, SoilRecord};
use super::relief::Relief;
use super::site::{FULL_CELL_M, Site, Sizes};
use super::stone_cover;
use super::{LayerMaps, MAX_LAYERS, Rect, SoilDesc};
use furrow_base::error::{Error, Result};
use furrow_base::math::{RoundTo, Spectrum, ToFloat, ToInt, Vec2, Vec3, vec2};
use furrow_base::sampling::{Purpose, Stream};
use furrow_optics::optics::soil::at;
use furrow_optics::texture::noise::Perlin;
use rayon::prelude::*;
use std::path::Path;
use std::sync::OnceLock;

/// Number of rows of vertices that are computed at once, which limits the temporary memory.
const BLOCK_ROWS: usize = 64;

/// Standard deviation of [`Perlin::fbm2`] with four octaves and gain 0.6.
const FBM4_SD: f32 = 0.245;

/// Fraction of its moisture that ground under a complete cover of dry fine aggregates has lost relative to bare ground.
const MULCH: f32 = 1.2;

/// Fraction of the clods and crumbs that are visible where a tool or wheel has pressed the ground flat.
const PRESSED_VISIBLE: f32 = 0.33;

/// Fraction of the height of crumbs that is gone if fine earth fills all joints.
const FILLED_CRUMBS: f32 = 0.5;

/// Fractions of the layers' heights and of the crumbs that a fully slaked surface has lost.
const SLAKED_RELIEF: f32 = 0.7;
const SLAKED_CRUMBS: f32 = 0.92;

/// Returns the effect of rain on a ground since its last tillage, 0..1.
pub(super) fn slaked(desc: &SoilDesc, stream: &Stream) -> f32 {
    desc.slaked.draw32(&mut stream.child(Purpose::Soil, 70))
}

/// Returns the fraction of the crumbs that the size distribution gives, after rain.
pub(super) fn crumbs_amount(desc: &SoilDesc, stream: &Stream) -> f32 {
    desc.crumbs.amount.draw32(&mut stream.child(Purpose::Soil, 20)) * (1.0 - SLAKED_CRUMBS * slaked(desc, stream))
}

/// Data at each vertex of the fine grid.
#[derive(Clone, Debug, Default)]
pub(super) struct FineGridPoint {
    /// Noise of each layer.
    pub(super) noise: Vec<Weights>,
    /// Height of layers and crumbs: the part of the relief that the baked maps contain at higher resolution.
    pub(super) detail: Vec<f32>,
    /// Fraction of the aggregates that the layers hold.
    pub(super) share: Vec<f32>,
}

/// Moisture and colour at each vertex of the fine grid.
#[derive(Clone, Debug)]
pub(super) struct Appearance {
    /// Moisture, 0..1.
    pub(super) moisture: Vec<f32>,
    /// Factors on the reflectance.
    pub(super) tint: Vec<Spectrum>,
}

/// Number of levels of the clods' moisture.
pub const MOISTURE_LEVELS: usize = 4;

/// One piece of ground.
#[derive(Clone, Debug)]
pub struct Ground {
    pub(super) grid: Grid,
    pub(super) heights: Vec<f32>,
    pub(super) slopes: Vec<Vec2>,
    /// Relief without layers and crumbs.
    pub(super) shape: Relief,
    cracks: Option<Cracks>,
    /// Effect of rain since the last tillage, 0..1.
    pub(super) slaked: f32,
    pub(super) fine: FineGridPoint,
    pub(super) blend: Blend,
    pub(super) law: SizeDistribution,
    pub(super) color: ColorTransform,
    pub(super) pigments: Pigments,
    pub(super) sizes: Sizes,
    pub(super) crumbs_amount: f32,
    pub(super) stream: Stream,
    pub(super) step: f32,
    moisture: MoistureRecord,
    /// Decrease of the moisture per standard deviation of height above the surroundings.
    drying: f32,
    /// Whether it is rendered as a plane.
    pub(super) flat: bool,
    /// Computed on first use, because scenes that are never shaded do not need it.
    look: OnceLock<Appearance>,
}

/// Ground below a plant.
#[derive(Clone, Copy, Debug)]
pub struct Stance {
    /// Height of the plant's foot, metres.
    pub height: f32,
    /// Unit normal of the plane fitted to the ground.
    pub normal: Vec3,
    /// Height of the highest crumb or plate above that plane, metres: a leaf that lies on the ground lies on it.
    pub rise: f32,
}

/// Plane fitted to the ground around a point.
struct Plane {
    /// Height at the point, metres.
    level: f32,
    slope: Vec2,
    /// Height of the highest sample above the plane, metres.
    rise: f32,
}

/// Returns the plane fitted to heights within `radius` of a point.
fn plane(x: f32, y: f32, radius: f32, height: impl Fn(f32, f32) -> f32) -> Plane {
    const RINGS: u8 = 3;
    const POINTS: u8 = 12;
    let mut heights = [[0.0; POINTS as usize]; RINGS as usize];
    let reach = |ring: usize| radius * (ring + 1).to_f32() / f32::from(RINGS);
    let place =
        |ring: usize, k: usize| Vec2::from_angle(k.to_f32() * std::f32::consts::TAU / f32::from(POINTS)) * reach(ring);
    let (mut slope, mut weight, mut level) = (Vec2::ZERO, 0.0, 0.0);
    // Opposite points on three rings: Σ h·d is the least-squares slope times Σ d²/2.
    for (ring, row) in heights.iter_mut().enumerate() {
        for (k, h) in row.iter_mut().enumerate() {
            let d = place(ring, k);
            *h = height(x + d.x, y + d.y);
            slope += d * *h;
            weight += 0.5 * reach(ring) * reach(ring);
            level += *h;
        }
    }
    let slope = if weight > 0.0 { slope / weight } else { Vec2::ZERO };
    let level = level / f32::from(RINGS * POINTS);
    let above = |ring: usize, k: usize| heights[ring][k] - level - slope.dot(place(ring, k));
    let rise = (0..heights.len()).flat_map(|ring| (0..heights[ring].len()).map(move |k| (ring, k)));
    Plane { level, slope, rise: rise.map(|(ring, k)| above(ring, k)).fold(0.0, f32::max) }
}

impl Ground {
    /// Builds the ground of `desc` from `stream`. `maps` holds the layers' textures, in the order of the scene file.
    ///
    /// About 0.3 s of one core for 600 × 500 mm at 1 mm.
    pub fn new<L: LayerMaps + Sync>(
        desc: &SoilDesc,
        colors: &[Spectrum],
        maps: &[L],
        site: &Site,
        stream: &Stream,
    ) -> Result<Self> {
        check(desc, maps.len(), site)?;
        let slaked = slaked(desc, stream);
        let relief = Relief::new(&desc.relief, slaked, *site, stream);
        let blend = Blend::new(&desc.blend, &desc.layers, stream).with_crust(desc.crust);
        let blend = if slaked > 0.0 { blend.flattened(1.0 - SLAKED_RELIEF * slaked) } else { blend };
        let law = SizeDistribution::new(&desc.clods, stream);
        let grid = Grid::new(site);
        let mut ground = Self {
            heights: Vec::with_capacity(grid.columns() * grid.rows()),
            slopes: Vec::new(),
            fine: FineGridPoint::default(),
            blend,
            law,
            color: ColorTransform::draw(colors, &maps[0], &mut stream.child(Purpose::Soil, 40)),
            pigments: Pigments::new(&desc.pigments, stream),
            sizes: site.sizes(desc),
            crumbs_amount: crumbs_amount(desc, stream),
            stream: stream.clone(),
            step: site.grid_m,
            shape: relief,
            cracks: Cracks::draw(&desc.cracks, stream),
            slaked,
            moisture: MoistureRecord {
                mean: desc.moisture.mean.draw32(&mut stream.child(Purpose::Soil, 30)),
                spread: desc.moisture.spread.draw32(&mut stream.child(Purpose::Soil, 31)),
                patch_m: desc.moisture.patch_m.draw(&mut stream.child(Purpose::Soil, 32)),
            },
            drying: desc.moisture.drying.f32(),
            flat: desc.flat,
            look: OnceLock::new(),
            grid,
        };
        ground.complete(maps);
        Ok(ground)
    }

    /// Rebuilds a part of this ground with another grid spacing and other aggregate sizes.
    pub(super) fn piece<L: LayerMaps + Sync>(&self, maps: &[L], area: Rect, grid_m: f32, sizes: Sizes) -> Self {
        let site =
            Site { area, grid_m, margin_m: 0.0, growth: 2.0, level_m: f32::INFINITY, smallest_mm: 0.0, rows: None };
        let mut piece = Self {
            heights: Vec::new(),
            slopes: Vec::new(),
            shape: self.shape.clone(),
            cracks: self.cracks.clone(),
            slaked: self.slaked,
            fine: FineGridPoint::default(),
            blend: self.blend.clone(),
            law: self.law.clone(),
            color: self.color,
            pigments: self.pigments.clone(),
            sizes,
            crumbs_amount: self.crumbs_amount,
            stream: self.stream.clone(),
            step: grid_m,
            moisture: self.moisture.clone(),
            drying: self.drying,
            flat: self.flat,
            look: OnceLock::new(),
            grid: Grid::new(&site),
        };
        piece.complete(maps);
        piece
    }

    /// Computes heights and slopes once all parameters are known.
    fn complete<L: LayerMaps + Sync>(&mut self, maps: &[L]) {
        self.raise(maps);
        self.scatter_debris();
        self.slopes = self.differences();
    }

    /// Computes relief and layers.
    fn raise<L: LayerMaps + Sync>(&mut self, maps: &[L]) {
        let raster = self.raster();
        let inside: Vec<Vec<f32>> =
            (0..self.blend.layers()).map(|k| slowly(raster, self.every(), |p| self.blend.noise(k, p))).collect();
        let vertex = |ground: &Self, i: usize, j: usize| {
            let p = vec2(ground.grid.x.at[i], ground.grid.y.at[j]);
            let cell = ground.grid.x.spacing(i).max(ground.grid.y.spacing(j));
            let fine = ground.fine_index(i, j);
            let mut noise = [0.0; MAX_LAYERS];
            for (k, n) in noise.iter_mut().enumerate().take(ground.blend.layers()) {
                *n = fine.map_or_else(|| ground.blend.noise(k, p), |v| inside[k][v]);
            }
            let heights = ground.blend.heights(maps, p);
            let weights = ground.blend.weights(noise, heights);
            let detail = ground.blend.displacement(weights, heights);
            // Elongated cells would turn fine heights into furrows.
            let fade = (2.0 * ground.step / cell).min(1.0);
            let height = ground.shape.height(p, cell) + detail * fade * fade;
            // A third of the clods that are pressed flat are still visible; the others are crushed.
            let left = PRESSED_VISIBLE + (1.0 - PRESSED_VISIBLE) * ground.shape.left(p);
            (height, fine.map(|_| (noise, detail, ground.blend.clods(weights) * left)))
        };
        let (columns, rows) = (self.grid.columns(), self.grid.rows());
        for first in (0..rows).step_by(BLOCK_ROWS) {
            let block = (first * columns..(first + BLOCK_ROWS).min(rows) * columns).into_par_iter();
            let block: Vec<_> = block.map(|k| vertex(self, k % columns, k / columns)).collect();
            for (height, fine) in block {
                self.heights.push(height);
                if let Some((noise, detail, share)) = fine {
                    self.fine.noise.push(noise);
                    self.fine.detail.push(detail);
                    self.fine.share.push(share);
                }
            }
        }
    }

    /// Adds crumbs and cracks to the heights of the fine grid. The baked maps have the crumbs at higher resolution. Cracks
    /// are in the mesh alone: they are deep, so that the paths of light must find their walls.
    fn scatter_debris(&mut self) {
        let raster = self.raster();
        let crumbs = self.crumbs(raster, 1.0).height;
        let cracks = self.cracks.as_ref().map(|cracks| cracks.heights(raster));
        let columns = self.grid.columns();
        for (k, crumb) in crumbs.iter().enumerate() {
            let (i, j) = (k % self.fine_columns(), k / self.fine_columns());
            // The outermost vertices are shared with the coarse ground, which has no crumbs.
            let inner = i > 0 && j > 0 && i < self.grid.x.steps && j < self.grid.y.steps;
            if inner {
                let crack = cracks.as_ref().map_or(0.0, |cracks| cracks[k]);
                self.heights[(j + self.grid.y.first) * columns + i + self.grid.x.first] += crumb + crack;
                self.fine.detail[k] += crumb;
            }
        }
    }

    /// Rasterizes the crumbs on any raster. `laid` is the fraction of the unresolved clods that is included.
    pub(super) fn crumbs(&self, raster: Raster, laid: f32) -> Crumbs {
        let stream = self.stream.child(Purpose::Debris, 100);
        let Sizes { drawn: larger, unseen, .. } = self.sizes;
        let crumbs = |mm| SizeRange { mm, amount: self.crumbs_amount, dry: 1.0 };
        let clods = |mm, amount| SizeRange { mm, amount, dry: CLODS_DRY };
        let seen = [crumbs(self.sizes.crumbs), clods(larger, 1.0)];
        let unseen = [crumbs(unseen[0]), clods(unseen[1], laid)];
        let mut drawn = Crumbs::draw(raster, &self.law, seen, unseen, &stream, |p| self.share(p));
        let left = 1.0 - FILLED_CRUMBS * self.law.filled;
        drawn.height.iter_mut().for_each(|height| *height *= left);
        drawn
    }

    /// Returns moisture and colour.
    pub(super) fn appearance(&self) -> &Appearance {
        self.look.get_or_init(|| self.wet())
    }

    fn wet(&self) -> Appearance {
        let child = |k| self.stream.child(Purpose::Soil, k);
        let MoistureRecord { mean, spread, patch_m } = self.moisture;
        let drying = self.drying;
        let frequency = 1.0 / patch_m;
        let patches = Perlin::new(child(33).seed32());
        let raster = self.raster();
        let heights: Vec<f32> = (0..raster.height)
            .flat_map(|j| (0..raster.width).map(move |i| (i, j)))
            .map(|(i, j)| self.heights[self.index(i, j)])
            .collect();
        // Soil that protrudes from its surroundings within 2 cm dries first.
        let around = blur(&heights, raster.width, (0.01 / self.step).ceil_to::<usize>());
        let out: Vec<f32> = heights.iter().zip(&around).map(|(h, a)| h - a).collect();
        let sd = (out.iter().map(|x| x * x).sum::<f32>() / out.len().to_f32()).sqrt().max(1e-6);
        let patches = slowly(raster, self.every(), |p| {
            let (x, y) = (f64::from(p.x) * frequency, f64::from(p.y) * frequency);
            patches.fbm2(x + 0.5, y + 0.5, 4, 0.6).to_f32() / FBM4_SD
        });
        let fines = slowly(raster, self.every(), |p| self.fines(p));
        let moisture = (patches.iter().zip(&out).zip(&fines))
            .map(|((patch, out), fines)| {
                let wet = mean + spread * patch - drying * (out / sd).clamp(-2.0, 2.0);
                (wet * (1.0 - MULCH * self.law.dryness * fines)).clamp(0.0, 1.0)
            })
            .collect();
        let tint = self.tints(raster, self.every(), |k| patches[k]);
        Appearance { moisture, tint }
    }

    /// Returns the moisture of clods at each of [`MOISTURE_LEVELS`], from those that are as dry as the scene file says to
    /// those that are as moist as the ground.
    pub(super) fn clods_moisture(&self) -> [f32; MOISTURE_LEVELS] {
        let dry = |k: usize| 1.0 - k.to_f32() / (MOISTURE_LEVELS - 1).to_f32();
        std::array::from_fn(|k| self.moisture.mean * (1.0 - self.law.dryness * dry(k)))
    }

    /// Returns the factors on the reflectance at the samples of a raster; noise is computed at every `every`-th of them.
    /// `moist` returns the moisture of a sample in standard deviations from the mean.
    pub(super) fn tints(&self, raster: Raster, every: usize, moist: impl Fn(usize) -> f32 + Sync) -> Vec<Spectrum> {
        let noise = [0, 1, 2].map(|of| slowly(raster, every, |p| self.pigments.noise(of, p)));
        let sample = |k: usize| self.pigments.place(noise.each_ref().map(|noise| noise[k]), moist(k));
        (0..raster.width * raster.height).into_par_iter().map(sample).collect()
    }

    /// Returns the record of the drawn parameters. `debris` is the stream of the stones, `litter` that of the litter.
    pub fn record(&self, desc: &SoilDesc, debris: &Stream, litter: &Stream) -> SoilRecord {
        let (blend_scale_m, blend_sharpness) = self.blend.patches();
        let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        SoilRecord {
            moisture: self.moisture.clone(),
            reflectance: self.color.like,
            layers: (desc.layers.iter().zip(self.blend.shares()))
                .map(|(layer, share)| LayerRecord { name: name(&layer.albedo), share })
                .collect(),
            blend_scale_m,
            blend_sharpness,
            relief: self.shape.record.clone(),
            slaked: self.slaked,
            cracks: self.cracks.as_ref().map(Cracks::record),
            clods: ClodsRecord {
                over_5mm_per_m2: self.law.over_pivot,
                exponent: self.law.exponent,
                crumbs_amount: self.crumbs_amount,
                dryness: self.law.dryness,
                damp: self.law.damp,
                loose: self.law.loose,
                filled: self.law.filled,
            },
            stones_cover: stone_cover::covers(&desc.stones, debris),
            litter: LitterRecord::draw(&desc.litter, litter),
        }
    }

    /// Returns the mean reflectance of the dry soil: that of the first layer after the colour shift. It is also the
    /// colour of dust on stones and straw.
    pub fn mean_dry<L: LayerMaps>(&self, maps: &[L]) -> Spectrum {
        let Some(first) = maps.first() else { return self.color.like };
        let mean = mean(first);
        at(std::array::from_fn(|k| mean[k] * self.color.gain[k]), self.color.like)
    }

    /// Returns the number of grid steps between samples of slowly varying noise, about 4 mm.
    fn every(&self) -> usize {
        (0.004 / self.step).trunc_to::<usize>().max(1)
    }

    /// Returns the central differences of the heights.
    fn differences(&self) -> Vec<Vec2> {
        let (columns, rows) = (self.grid.columns(), self.grid.rows());
        let mut slopes = Vec::with_capacity(self.heights.len());
        for j in 0..rows {
            let (south, north) = (j.saturating_sub(1), (j + 1).min(rows - 1));
            let dy = 1.0 / (self.grid.y.at[north] - self.grid.y.at[south]);
            for i in 0..columns {
                let (west, east) = (i.saturating_sub(1), (i + 1).min(columns - 1));
                let dx = 1.0 / (self.grid.x.at[east] - self.grid.x.at[west]);
                let h = |i: usize, j: usize| self.heights[j * columns + i];
                slopes.push(vec2((h(east, j) - h(west, j)) * dx, (h(i, north) - h(i, south)) * dy));
            }
        }
        slopes
    }

    /// Returns the same ground as a plane, with the same moisture, colours and texture.
    #[must_use]
    pub fn levelled(&self) -> Self {
        let n = self.heights.len();
        Self { heights: vec![0.0; n], slopes: vec![Vec2::ZERO; n], ..self.clone() }
    }

    /// Returns the height of the ground, metres: where the ground is in view, exactly that of the mesh. Beyond the
    /// margin the height of the edge continues.
    pub fn height(&self, x: f32, y: f32) -> f32 {
        self.grid.value(&self.heights, vec2(x, y))
    }

    /// Returns the unit normal of the ground at the scale of its grid.
    pub fn normal(&self, x: f32, y: f32) -> Vec3 {
        let (i, tx) = self.grid.x.locate(x);
        let (j, ty) = self.grid.y.locate(y);
        let k = j * self.grid.columns() + i;
        let row = |k: usize| self.slopes[k].lerp(self.slopes[k + 1], tx);
        up(row(k).lerp(row(k + self.grid.columns()), ty))
    }

    /// Returns height and orientation of the ground below a plant, from the plane fitted within `radius` of it. A shoot that emerges in a crack or between crumbs grows to the surface around it, so the height
    /// is at least the plane's. If clods are part of the heights, they are left out and the cells are [`FULL_CELL_M`]
    /// whatever the grid, so that plants stand as they do at full detail.
    pub fn stance<L: LayerMaps>(&self, maps: &[L], x: f32, y: f32, radius: f32) -> Stance {
        let (height, plane) = self.around(maps, x, y, radius);
        Stance { height: height.max(plane.level), normal: up(plane.slope), rise: plane.rise }
    }

    /// Returns the height at a point without clods and the plane fitted around it.
    fn around<L: LayerMaps>(&self, maps: &[L], x: f32, y: f32, radius: f32) -> (f32, Plane) {
        let Sizes { drawn, .. } = self.sizes;
        // Beyond the fine grid, use the mesh as it is: cells as long as a row's width do not resolve its profile.
        if drawn.0 >= drawn.1 || !self.area().contains(vec2(x, y)) {
            return (self.height(x, y), plane(x, y, radius, |x, y| self.height(x, y)));
        }
        let height = |x: f32, y: f32| {
            let p = vec2(x, y);
            let mut noise = [0.0; MAX_LAYERS];
            for (k, n) in noise.iter_mut().enumerate().take(self.blend.layers()) {
                *n = self.blend.noise(k, p);
            }
            let heights = self.blend.heights(maps, p);
            self.shape.height(p, FULL_CELL_M) + self.blend.displacement(self.blend.weights(noise, heights), heights)
        };
        (height(x, y), plane(x, y, radius, height))
    }

    /// Returns the unit normal of the plane fitted to the ground within `radius` of a point.
    pub fn trend(&self, x: f32, y: f32, radius: f32) -> Vec3 {
        up(plane(x, y, radius, |x, y| self.height(x, y)).slope)
    }

    /// Returns the area of the fine grid: the requested one, widened to whole steps.
    pub fn area(&self) -> Rect {
        self.grid.area()
    }

    /// Returns the grid spacing inside the area, metres.
    pub fn step(&self) -> f32 {
        self.step
    }

    /// Returns the moisture at a point, 0..1; beyond the area, that of the mirrored point.
    pub fn moisture(&self, x: f32, y: f32) -> f32 {
        self.fine_value(&self.appearance().moisture, self.mirrored(vec2(x, y)))
    }

    /// Returns the texture coordinates of a point in [`Ground::bake`]; beyond the area the maps are mirrored.
    pub fn uv(&self, x: f32, y: f32) -> Vec2 {
        let area = self.area();
        (self.mirrored(vec2(x, y)) - area.corners()[0]) / area.size()
    }

    /// Returns how much more of the ground's surface fine aggregates cover at `p` than on average, −1..1.
    pub(super) fn fines(&self, p: Vec2) -> f32 {
        self.law.fines(p, self.share(p), self.crumbs_amount)
    }

    /// Returns the fraction of the aggregates that the layers hold at `p`.
    pub(super) fn share(&self, p: Vec2) -> f32 {
        self.fine_value(&self.fine.share, p)
    }

    /// Returns the vertices of the fine grid as a raster.
    pub(super) fn raster(&self) -> Raster {
        let area = self.area();
        Raster { origin: area.corners()[0], step: self.step, width: self.fine_columns(), height: self.grid.y.steps + 1 }
    }

    /// Returns the index of the vertex (i, j) of the fine grid among all vertices.
    pub(super) fn index(&self, i: usize, j: usize) -> usize {
        (j + self.grid.y.first) * self.grid.columns() + i + self.grid.x.first
    }

    /// Interpolates values of the fine grid's vertices; points outside are clamped to the border.
    pub(super) fn fine_value(&self, values: &[f32], p: Vec2) -> f32 {
        let at = self.fine_cell(p);
        at.mix(|k| values[k])
    }

    pub(super) fn fine_cell(&self, p: Vec2) -> FineCell {
        let origin = vec2(self.grid.x.at[self.grid.x.first], self.grid.y.at[self.grid.y.first]);
        let q = (p - origin) / self.step;
        let (nx, ny) = (self.grid.x.steps, self.grid.y.steps);
        let q = q.clamp(Vec2::ZERO, vec2(nx.to_f32(), ny.to_f32()));
        let (i, j) = (q.x.trunc_to::<usize>().min(nx - 1), q.y.trunc_to::<usize>().min(ny - 1));
        FineCell { k: j * (nx + 1) + i, n: nx + 1, t: q - vec2(i.to_f32(), j.to_f32()) }
    }

    /// Returns the position of texel (i, j) if each step of the grid is split into `split` texels.
    #[inline]
    pub(super) fn texel_cell(&self, i: usize, j: usize, split: usize) -> FineCell {
        let n = self.grid.x.steps + 1;
        let t = |i: usize| ((i % split).to_f32() + 0.5) / split.to_f32();
        FineCell { k: j / split * n + i / split, n, t: vec2(t(i), t(j)) }
    }

    fn fine_columns(&self) -> usize {
        self.grid.x.steps + 1
    }

    fn fine_index(&self, i: usize, j: usize) -> Option<usize> {
        let (i, j) = (i.checked_sub(self.grid.x.first)?, j.checked_sub(self.grid.y.first)?);
        (i <= self.grid.x.steps && j <= self.grid.y.steps).then_some(j * self.fine_columns() + i)
    }

    fn mirrored(&self, p: Vec2) -> Vec2 {
        let area = self.area();
        let fold = |x: f32, lo: f32, size: f32| {
            let t = ((x - lo) / size).rem_euclid(2.0);
            lo + size * if t > 1.0 { 2.0 - t } else { t }
        };
        vec2(fold(p.x, area.x0, area.size().x), fold(p.y, area.y0, area.size().y))
    }
}

/// Cell of the fine grid and the position within it.
#[derive(Clone, Copy, Debug)]
pub(super) struct FineCell {
    k: usize,
    n: usize,
    t: Vec2,
}

impl FineCell {
    /// Returns the bilinear interpolation of the values at the four corners.
    #[inline]
    pub(super) fn mix(self, value: impl Fn(usize) -> f32) -> f32 {
        let south = value(self.k) + self.t.x * (value(self.k + 1) - value(self.k));
        let (c, d) = (value(self.k + self.n), value(self.k + self.n + 1));
        south + self.t.y * (c + self.t.x * (d - c) - south)
    }

    /// Returns the bilinear interpolation of spectra at the four corners.
    #[inline]
    pub(super) fn mix_spectra(self, values: &[Spectrum]) -> Spectrum {
        let row = |k: usize| values[k].lerp(values[k + 1], self.t.x);
        row(self.k).lerp(row(self.k + self.n), self.t.y)
    }
}

/// Returns the unit normal of a slope.
pub(super) fn up(slope: Vec2) -> Vec3 {
    Vec3::new(-slope.x, -slope.y, 1.0).normalize()
}

fn check(desc: &SoilDesc, maps: usize, site: &Site) -> Result<()> {
    let layers = desc.layers.len();
    let fault = |what: String| Err(Error::input(what));
    if layers == 0 || layers > MAX_LAYERS {
        return Err(Error::input(format!("the soil has {layers} layers: give one to {MAX_LAYERS}"))
            .help("a layer is (albedo: \"…\", height: \"…\", size_m: 0.5, height_mm: (-4, 8))"));
    }
    if maps != layers {
        return fault(format!("the soil has {layers} layers but {maps} were loaded"));
    }
    if let Some(l) = desc.layers.iter().find(|l| l.height_mm.0.get() > l.height_mm.1.get()) {
        return fault(format!("height_mm of {} runs from high to low: swap its ends", l.height.display()));
    }
    if desc.clods.min_mm.get() >= desc.clods.max_mm.get() {
        return Err(Error::input("the clods' min_mm is not below their max_mm").help("lower min_mm, or raise max_mm"));
    }
    let size = site.area.size();
    let vertices = (size.x / site.grid_m) * (size.y / site.grid_m);
    if !(size.x > 0.0 && size.y > 0.0 && site.grid_m > 0.0 && site.margin_m >= 0.0 && vertices.is_finite()) {
        return fault(format!("the ground cannot be {} × {} m with cells of {} m", size.x, size.y, site.grid_m));
    }
    if vertices > 3e7 {
        return fault(format!(
            "the ground would have {vertices:.0} vertices: make the cells longer than {} m",
            site.grid_m
        ));
    }
    Ok(())
}

/// Evaluates `f` at every `every`-th sample of a raster and interpolates between them.
fn slowly(raster: Raster, every: usize, f: impl Fn(Vec2) -> f32 + Sync) -> Vec<f32> {
    let lines = |n: usize| (n - 1).div_ceil(every) + 1;
    let (w, h) = (lines(raster.width), lines(raster.height));
    // The last line may be beyond the raster, so that all are evenly spaced.
    let place = |i: usize, j: usize| raster.origin + vec2((i * every).to_f32(), (j * every).to_f32()) * raster.step;
    let coarse: Vec<f32> = (0..w * h).into_par_iter().map(|k| f(place(k % w, k / w))).collect();
    let mut out = Vec::with_capacity(raster.width * raster.height);
    for j in 0..raster.height {
        for i in 0..raster.width {
            let (a, b) = (i / every, j / every);
            let t = vec2((i % every).to_f32(), (j % every).to_f32()) / every.to_f32();
            // A sample on a line uses that line only, because the next one may not exist.
            let (east, north) = (usize::from(t.x > 0.0), w * usize::from(t.y > 0.0));
            let k = b * w + a;
            let south = coarse[k] + t.x * (coarse[k + east] - coarse[k]);
            out.push(south + t.y * (coarse[k + north] + t.x * (coarse[k + north + east] - coarse[k + north]) - south));
        }
    }
    out
}

/// Returns the mean over a square of ±`reach` samples, with clamping at the borders.
pub(super) fn blur(values: &[f32], width: usize, reach: usize) -> Vec<f32> {
    let height = values.len() / width;
    let r = reach.to_i64();
    let held = |i: i64, count: usize| i.clamp(0, count.to_i64() - 1).to_usize();
    let mean = |sum: f64| (sum / (2 * r + 1).to_f64()).to_f32();
    let mut rows = vec![0.0; values.len()];
    rows.par_chunks_mut(width).zip(values.par_chunks(width)).for_each(|(to, from)| {
        let at = |i: i64| f64::from(from[held(i, width)]);
        let mut sum: f64 = (-r..=r).map(at).sum();
        for (i, to) in (0..).zip(to) {
            *to = mean(sum);
            sum += at(i + r + 1) - at(i - r);
        }
    });
    // All columns at once, so that memory is read sequentially.
    let row = |j: i64| &rows[held(j, height) * width..][..width];
    let mut sums = vec![0.0; width];
    for j in -r..=r {
        sums.iter_mut().zip(row(j)).for_each(|(sum, v)| *sum += f64::from(*v));
    }
    let mut both = vec![0.0; values.len()];
    for (j, to) in (0..).zip(both.chunks_mut(width)) {
        for ((to, sum), (next, last)) in to.iter_mut().zip(&mut sums).zip(row(j + r + 1).iter().zip(row(j - r))) {
            *to = mean(*sum);
            *sum += f64::from(*next) - f64::from(*last);
        }
    }
    both
}
