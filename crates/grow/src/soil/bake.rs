//! Baked texture of the ground: colour, wetness and all relief that is finer than its grid.

use super::blend::Weights;
use super::crumb::{Crumbs, Raster, SizeRange};
use super::ground::blur;
use super::pigments::quantile;
use super::{Ground, LayerMaps, MAX_LAYERS, MOISTURE_LEVELS};
use furrow_base::math::{RoundTo, Spectrum, ToFloat, ToInt, Vec2, Vec3, vec2};
use furrow_base::sampling::Purpose;
use furrow_optics::optics::UnmeshedRelief;
use furrow_optics::optics::soil::at as four_bands;
use furrow_optics::texture::ground::GroundMaps;
use furrow_optics::texture::noise::Perlin;
use rayon::prelude::*;

/// Depth of a pit between crumbs that hides half of the sky, metres; for coarse ground [`Ground::shade`] computes it.
pub(super) const HALF_SKY_M: f32 = 0.0005;

/// Side of the material texture of clods, metres (see [`Ground::fabrics`]): larger than the longest clod of usual scene
/// files.
const FABRIC_M: f32 = 0.12;

/// Increase of the moisture in such a pit.
const PIT_WETTING: f32 = 0.2;

/// Crumbs on the surface of clods: range of lengths, mm, and the area of all relative to that of the surface. An aggregate
/// consists of smaller ones, down to grains of silt.
const GRAINS_MM: (f32, f32) = (0.6, 4.0);
const GRAINS_COVER: f32 = 1.2;
/// Variation of their colour relative to that of crumbs on the ground: the soil of one clod is mixed.
const GRAINS_TINT: f32 = 0.35;
/// Fractions of this relief and of this variation of colour that are gone if fine earth fills all pores.
const FILLED_PORES: f32 = 0.75;
const FILLED_TINT: f32 = 0.5;
/// Moisture of the soil that clods consist of, in standard deviations from the mean: they come from below the surface, where
/// no lime is deposited.
const CLODS_MOIST: f32 = 1.0;
/// Length of the finest relief of clods, texels.
const FINEST_TEXELS: f32 = 2.0;
/// Longest wavelength and height of the roughness between these crumbs, metres.
const ROUGH_M: f32 = 0.006;
const ROUGH_HEIGHT_M: f32 = 0.0006;
/// Largest slope of this relief.
const STEEPEST_PORE: f32 = 1.0;

/// Maps of the ground before ambient occlusion and moisture are computed from its pits.
pub(super) struct UnshadedMaps {
    pub(super) maps: GroundMaps,
    /// Depth of each texel below its surroundings, metres; 0 where it is not below them.
    pub(super) pits: Vec<f32>,
    /// Fraction of the ground's moisture that its crumb has lost, times 255.
    dry: Vec<u8>,
    /// Number of texels along each step of the grid.
    split: usize,
}

/// Darkening of a ground by pits and missing relief.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shade {
    /// Depth of a pit that hides half of the sky, metres.
    pub(super) sky: f32,
    /// Depth of a pit that keeps all of its wetness, metres.
    pub(super) wet: f32,
    /// Relief that is in neither the mesh nor the pits.
    pub(super) lost: Option<UnmeshedRelief>,
}

impl Shade {
    /// Values at full detail.
    pub(super) const FULL: Self = Self { sky: HALF_SKY_M, wet: HALF_SKY_M, lost: None };
}

impl UnshadedMaps {
    /// Returns the texel at a point, and the slope there, bilinearly interpolated between four texel centres as in a
    /// texture lookup.
    pub(super) fn at(&self, p: Vec2) -> (usize, Vec2) {
        let GroundMaps { slope, width, height, origin, texel_m, .. } = &self.maps;
        let index = |x: f32, count: usize| x.max(0.0).trunc_to::<usize>().min(count - 1);
        let q = (p - *origin) / *texel_m;
        let nearest = index(q.y, *height) * width + index(q.x, *width);
        let (floor, t) = ((q - 0.5).floor(), (q - 0.5).fract());
        let at = |i: f32, j: f32| Vec2::from(slope[index(j, *height) * width + index(i, *width)].map(f32::from));
        let row = |j: f32| at(floor.x, j).lerp(at(floor.x + 1.0, j), t.x);
        (nearest, row(floor.y).lerp(row(floor.y + 1.0), t.y) / GroundMaps::SLOPE_STEPS)
    }

    /// Returns the fraction of the moisture that the crumb of a texel has left.
    pub(super) fn left(&self, k: usize) -> f32 {
        1.0 - f32::from(self.dry[k]) / 255.0
    }
}

/// Returns the reciprocal of the fraction of the sky that is visible from a pit.
pub(super) fn closing(pit: f32, half: f32) -> f32 {
    1.0 + pit / half
}

/// Returns the fraction of the pits' additional wetness that a pit keeps.
pub(super) fn wet(pit: f32, full: f32) -> f32 {
    (pit / full).min(1.0)
}

impl Ground {
    /// Bakes the texture with texels of at most `texel_m`; `maps` are those that the ground was built with.
    pub fn bake<L: LayerMaps + Sync>(&self, maps: &[L], texel_m: f32) -> GroundMaps {
        let clods = self.unmeshed_clods(maps, texel_m);
        let painted = self.paint(maps, texel_m, clods.laid);
        let shade = self.shade(maps, &painted, &clods);
        self.finish(painted, shade)
    }

    /// Bakes everything except ambient occlusion and moisture; `laid` as in [`Ground::crumbs`].
    pub(super) fn paint<L: LayerMaps + Sync>(&self, maps: &[L], texel_m: f32, laid: f32) -> UnshadedMaps {
        let area = self.area();
        // Texels divide the grid's steps evenly, so that the area consists of whole texels and each is in one cell.
        let split = (self.step / texel_m.max(2e-5) - 1e-3).ceil_to::<usize>().max(1);
        let texel = self.step / split.to_f32();
        let (width, height) = (self.grid.x.steps * split, self.grid.y.steps * split);
        let raster = Raster { origin: area.corners()[0] + 0.5 * texel, step: texel, width, height };
        let n = width * height;
        let mut baked = GroundMaps {
            width,
            height,
            origin: area.corners()[0],
            texel_m: texel,
            albedo: vec![[0; 4]; n],
            weights: vec![[0; MAX_LAYERS]; n],
            moisture: Vec::new(),
            slope: Vec::new(),
            ao: Vec::new(),
            lost: None,
        };
        let look = self.appearance();
        let crumbs = self.crumbs(raster, laid);
        let hues = self.crumb_hues();
        let mut detail = crumbs.height;
        let rows = (
            detail.par_chunks_mut(width),
            baked.albedo.par_chunks_mut(width),
            baked.weights.par_chunks_mut(width),
            crumbs.tint.par_chunks(width),
            crumbs.hue.par_chunks(width),
        );
        rows.into_par_iter().enumerate().for_each(|(j, (detail, albedo, weights, tints, hue))| {
            for i in 0..width {
                let p = raster.origin + vec2(i.to_f32(), j.to_f32()) * texel;
                let cell = self.texel_cell(i, j, split);
                let mut noise = [0.0; MAX_LAYERS];
                for (i, n) in noise.iter_mut().enumerate().take(self.blend.layers()) {
                    *n = cell.mix(|v| self.fine.noise[v][i]);
                }
                let heights = self.blend.heights(maps, p);
                let share = self.blend.weights(noise, heights);
                detail[i] += self.blend.displacement(share, heights);
                let crumb = match tints[i] {
                    0 => Spectrum::ONE,
                    t => hues[usize::from(hue[i])] * (f32::from(t) / 128.0),
                };
                albedo[i] = GroundMaps::encode(self.dry(maps, share, p) * crumb * cell.mix_spectra(&look.tint));
                weights[i] = share.map(|w| (w * 255.0 + 0.5).trunc_to::<u8>());
            }
        });
        self.bake_slopes(raster, split, &detail, &mut baked);
        UnshadedMaps { maps: baked, pits: self.pits(raster, split, detail), dry: crumbs.dry, split }
    }

    /// Bakes the material of clods at each moisture level: a square of 12 cm of the ground's soil, with crumbs and pores.
    /// Each clod samples it at its own offset.
    pub fn fabrics<L: LayerMaps + Sync>(&self, maps: &[L], texel_m: f32) -> [GroundMaps; MOISTURE_LEVELS] {
        let side = (FABRIC_M / texel_m).trunc_to::<usize>().clamp(16, 1024);
        let texel = FABRIC_M / side.to_f32();
        let raster = Raster { origin: Vec2::splat(0.5 * texel), step: texel, width: side, height: side };
        let crumbs = self.fabric_crumbs(raster);
        let (pits, slope) = (pores(raster, &crumbs.height), differences(&crumbs.height, raster));
        let slope: Vec<Vec2> = slope.into_iter().map(|slope| slope.clamp_length_max(STEEPEST_PORE)).collect();
        let open = |k: usize| 1.0 / closing(pits[k], HALF_SKY_M);
        // A clod is as bright as without pores: they are part of what was measured as the reflectance of soil.
        let lost = |k: usize| open(k) / (1.0 + slope[k].length_squared()).sqrt();
        let gain = pits.len().to_f32() / (0..pits.len()).map(lost).sum::<f32>();
        let (hues, tints) =
            (self.crumb_hues(), self.tints(raster, (0.004 / texel).trunc_to::<usize>().max(1), |_| CLODS_MOIST));
        let grain = |k: usize| match crumbs.tint[k] {
            0 => Spectrum::ONE,
            t => hues[usize::from(crumbs.hue[k])] * (f32::from(t) / 128.0),
        };
        let varied = GRAINS_TINT * (1.0 - FILLED_TINT * self.law.filled);
        let mixed = |k: usize| grain(k).map(|factor| factor.powf(varied));
        let mixed: Vec<Spectrum> = (0..side * side).into_par_iter().map(mixed).collect();
        // Mixing keeps the mean colour.
        let plain = (0..side * side).fold(Spectrum::ZERO, |sum, k| sum + grain(k));
        let gain = plain / mixed.iter().fold(Spectrum::ZERO, |sum, colour| sum + *colour) * gain;
        let texel_at = |k: usize| {
            let p = raster.origin + vec2((k % side).to_f32(), (k / side).to_f32()) * texel;
            let mut noise = [0.0; MAX_LAYERS];
            for (i, n) in noise.iter_mut().enumerate().take(self.blend.layers()) {
                *n = self.blend.noise(i, p);
            }
            let weights = self.blend.weights(noise, self.blend.heights(maps, p));
            let albedo = self.dry(maps, weights, p) * tints[k] * mixed[k] * gain;
            (GroundMaps::encode(albedo), weights.map(|w| (w * 255.0 + 0.5).trunc_to::<u8>()))
        };
        let (albedo, weights): (Vec<_>, Vec<_>) = (0..side * side).into_par_iter().map(texel_at).unzip();
        let byte = |x: f32| (x.clamp(0.0, 1.0) * 255.0 + 0.5).trunc_to::<u8>();
        let ao: Vec<u8> = (0..pits.len()).map(|k| byte(open(k))).collect();
        let slope: Vec<[i8; 2]> =
            slope.iter().map(|s| (*s * GroundMaps::SLOPE_STEPS).to_array().map(RoundTo::trunc_to::<i8>)).collect();
        self.clods_moisture().map(|moisture| GroundMaps {
            width: side,
            height: side,
            origin: Vec2::ZERO,
            texel_m: texel,
            albedo: albedo.clone(),
            weights: weights.clone(),
            moisture: pits.iter().map(|pit| byte(moisture + PIT_WETTING * moisture * wet(*pit, HALF_SKY_M))).collect(),
            slope: slope.clone(),
            ao: ao.clone(),
            lost: None,
        })
    }

    /// Rasterizes the crumbs on the surface of clods: they cover most of it, and the noise between them is rough.
    fn fabric_crumbs(&self, raster: Raster) -> Crumbs {
        let stream = self.stream.child(Purpose::Debris, 103);
        let finest = (1e3 * FINEST_TEXELS * raster.step).max(GRAINS_MM.0);
        let mm = (finest, GRAINS_MM.1.max(finest));
        let amount = GRAINS_COVER / self.law.at(Vec2::ZERO, 1.0).cover(mm).max(f32::MIN_POSITIVE);
        let [grains, none] = [mm, (mm.1, mm.1)].map(|mm| SizeRange { mm, amount, dry: 1.0 });
        let mut crumbs = Crumbs::draw(raster, &self.law, [grains, none], [none; 2], &stream, |_| 1.0);
        let noise = Perlin::new(stream.child(Purpose::Texture, 0).seed32());
        let octaves = (ROUGH_M / (FINEST_TEXELS * raster.step)).log2().clamp(0.0, 6.0).trunc_to::<u32>();
        let left = 1.0 - FILLED_PORES * self.law.filled;
        crumbs.height.par_iter_mut().enumerate().for_each(|(k, height)| {
            let q = vec2((k % raster.width).to_f32(), (k / raster.width).to_f32()) * (raster.step / ROUGH_M);
            *height = left
                * (*height
                    + ROUGH_HEIGHT_M * noise.fbm2(f64::from(q.x) + 0.3, f64::from(q.y) + 0.7, octaves, 0.6).to_f32());
        });
        crumbs
    }

    /// Returns the colours of crumbs, relative to that of the soil around them.
    fn crumb_hues(&self) -> [Spectrum; 256] {
        // Two permutations of evenly spaced quantiles, so that iron and humus are independent.
        let normal = |byte: u8| quantile((f32::from(byte) + 0.5) / 256.0);
        std::array::from_fn(|k| {
            let byte = k.to_u8();
            self.pigments.aggregate(normal(byte), normal(byte.reverse_bits()))
        })
    }

    /// Returns the reflectance of the dry soil where the layers have the weights `share`.
    fn dry<L: LayerMaps>(&self, maps: &[L], share: Weights, p: Vec2) -> Spectrum {
        let painted = self.blend.albedo(maps, share, p);
        four_bands(std::array::from_fn(|k| painted[k] * self.color.gain[k]), self.color.like)
    }

    /// Returns the texture coordinates in [`Ground::fabrics`] of a vertex of a body with the offset `from`. The square
    /// continues mirrored.
    pub(super) fn fabric_uv(from: Vec2, p: Vec3) -> Vec2 {
        let leaning = p.truncate() + GroundMaps::LEAN * p.z;
        let fold = |x: f32| {
            let t = x.rem_euclid(2.0);
            if t > 1.0 { 2.0 - t } else { t }
        };
        let q = (leaning + from) / FABRIC_M;
        vec2(fold(q.x), fold(q.y))
    }

    /// Computes the slopes of the detail, minus those already in the mesh's normals.
    fn bake_slopes(&self, raster: Raster, split: usize, detail: &[f32], baked: &mut GroundMaps) {
        let coarse = differences(&self.fine.detail, self.raster());
        let slope = |(k, fine): (usize, Vec2)| {
            let cell = self.texel_cell(k % raster.width, k / raster.width, split);
            let mesh = vec2(cell.mix(|v| coarse[v].x), cell.mix(|v| coarse[v].y));
            let rest = (fine - mesh).clamp_length_max(2.0) * GroundMaps::SLOPE_STEPS;
            [rest.x.trunc_to::<i8>(), rest.y.trunc_to::<i8>()]
        };
        baked.slope = differences(detail, raster).into_par_iter().enumerate().map(slope).collect();
    }

    /// Returns the depth of each texel below the mean of its surroundings, metres.
    fn pits(&self, raster: Raster, split: usize, mut detail: Vec<f32>) -> Vec<f32> {
        let cell = |k: usize| self.texel_cell(k % raster.width, k / raster.width, split);
        detail.par_iter_mut().enumerate().for_each(|(k, d)| *d -= cell(k).mix(|v| self.fine.detail[v]));
        let around = blur(&detail, raster.width, (0.0008 / raster.step).ceil_to::<usize>());
        detail.par_iter_mut().zip(around).for_each(|(d, around)| *d = (around - *d).max(0.0));
        detail
    }

    /// Computes ambient occlusion and moisture: pits see less of the sky and dry later; crumbs dry first.
    fn finish(&self, painted: UnshadedMaps, shade: Shade) -> GroundMaps {
        let Shade { sky, wet: full, lost } = shade;
        let moistures = &self.appearance().moisture;
        let width = painted.maps.width;
        let shade = |k: usize| (255.0 / closing(painted.pits[k], sky) + 0.5).trunc_to::<u8>();
        let moisture = |k: usize| {
            let cell = self.texel_cell(k % width, k / width, painted.split);
            let wet = cell.mix(|v| moistures[v]) + PIT_WETTING * wet(painted.pits[k], full);
            ((wet * painted.left(k)).clamp(0.0, 1.0) * 255.0 + 0.5).trunc_to::<u8>()
        };
        let (ao, moisture) = (0..painted.pits.len()).into_par_iter().map(|k| (shade(k), moisture(k))).unzip();
        GroundMaps { moisture, ao, lost, ..painted.maps }
    }
}

/// Returns the depth of each sample below the mean of its surroundings, metres.
fn pores(raster: Raster, height: &[f32]) -> Vec<f32> {
    let around = blur(height, raster.width, (0.0008 / raster.step).ceil_to::<usize>());
    height.iter().zip(around).map(|(height, around)| (around - height).max(0.0)).collect()
}

fn differences(values: &[f32], raster: Raster) -> Vec<Vec2> {
    let (w, h) = (raster.width, raster.height);
    let difference = |k: usize| {
        let (i, j) = (k % w, k / w);
        let (south, north) = (j.saturating_sub(1), (j + 1).min(h - 1));
        let (west, east) = (i.saturating_sub(1), (i + 1).min(w - 1));
        let v = |i: usize, j: usize| values[j * w + i];
        let d = vec2(
            (v(east, j) - v(west, j)) / (east - west).max(1).to_f32(),
            (v(i, north) - v(i, south)) / (north - south).max(1).to_f32(),
        );
        d / raster.step
    };
    (0..values.len()).into_par_iter().map(difference).collect()
}
