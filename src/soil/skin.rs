//! The ground's own texture: colour, wetness and all relief that is finer than its grid.

use super::crumb::Raster;
use super::ground::blur;
use super::{Ground, LayerMaps, MAX_LAYERS};
use crate::math::{Vec2, vec2};

/// A texture over [`Ground::area`], row 0 in the south, so that [`Ground::uv`] reads it with v growing down its rows.
/// All vectors hold `width · height` texels.
#[derive(Clone, Debug, PartialEq)]
pub struct Skin {
    /// Texels along x.
    pub width: usize,
    /// Texels along y.
    pub height: usize,
    /// South-west corner of the first texel, metres.
    pub origin: Vec2,
    /// Side of a texel, metres.
    pub texel_m: f32,
    /// Linear reflectance R, G, B of the dry soil, each stored as 255·√reflectance; see [`Skin::decode`].
    pub albedo: Vec<[u8; 3]>,
    /// Weight of each layer times 255.
    pub weights: Vec<[u8; MAX_LAYERS]>,
    /// 0 air-dry, 255 saturated.
    pub moisture: Vec<u8>,
    /// Slope ∂z/∂x, ∂z/∂y to be added to that of the mesh's shading normal, times [`Skin::SLOPE_STEPS`].
    pub slope: Vec<[i8; 2]>,
    /// Share of the sky that the relief finer than the mesh leaves open, times 255.
    pub ao: Vec<u8>,
}

impl Skin {
    /// Steps of [`Skin::slope`] to a slope of 1.
    pub const SLOPE_STEPS: f32 = 60.0;

    /// Reflectance from a stored albedo.
    pub fn decode(albedo: [u8; 3]) -> [f32; 3] {
        albedo.map(|a| (f32::from(a) / 255.0).powi(2))
    }

    fn encode(albedo: [f32; 3]) -> [u8; 3] {
        albedo.map(|a| (a.max(0.0).sqrt() * 255.0 + 0.5).min(255.0) as u8)
    }
}

/// Depth of a pit between crumbs that hides half of the sky, metres.
const HALF_SKY_M: f32 = 0.0009;

/// How much drier the loose crumbs are than what they lie on.
const CRUMB_DRYING: f32 = 0.08;

impl Ground {
    /// Bakes the texture with texels of at most `texel_m`; `maps` are those the ground was made with.
    pub fn skin<L: LayerMaps>(&self, maps: &[L], texel_m: f32) -> Skin {
        let area = self.area();
        let texel = texel_m.clamp(2e-5, self.step);
        // Texels of one size that fill the area evenly both ways: the area is whole steps, so split the step.
        let texel = self.step / (self.step / texel - 1e-3).ceil();
        let (width, height) = ((area.size().x / texel).round() as usize, (area.size().y / texel).round() as usize);
        let raster = Raster { origin: area.corners()[0] + 0.5 * texel, step: texel, width, height };
        let n = width * height;
        let mut skin = Skin {
            width,
            height,
            origin: area.corners()[0],
            texel_m: texel,
            albedo: Vec::with_capacity(n),
            weights: Vec::with_capacity(n),
            moisture: Vec::with_capacity(n),
            slope: Vec::with_capacity(n),
            ao: Vec::with_capacity(n),
        };
        let crumbs = self.crumbs(raster);
        let mut detail = crumbs.height;
        for (k, detail) in detail.iter_mut().enumerate() {
            let p = place(raster, k);
            let cell = self.fine_cell(p);
            let mut noise = [0.0; MAX_LAYERS];
            for (i, n) in noise.iter_mut().enumerate().take(self.blend.layers()) {
                *n = cell.mix(|v| self.fine.noise[v][i]);
            }
            let heights = self.blend.heights(maps, p);
            let weights = self.blend.weights(noise, heights);
            *detail += self.blend.displacement(weights, heights);
            let (tint, drier) = match crumbs.tint[k] {
                0 => (1.0, 0.0),
                t => (f32::from(t) / 128.0, CRUMB_DRYING),
            };
            let tone = tint * cell.mix(|v| self.fine.tone[v]);
            skin.albedo.push(Skin::encode(self.blend.albedo(maps, weights, p).map(|a| a * tone)));
            skin.weights.push(weights.map(|w| (w * 255.0 + 0.5) as u8));
            let wet = cell.mix(|v| self.fine.moisture[v]) - drier;
            skin.moisture.push((wet.clamp(0.0, 1.0) * 255.0 + 0.5) as u8);
        }
        self.bake_slopes(raster, &detail, &mut skin);
        self.bake_openness(raster, detail, &mut skin);
        skin
    }

    /// Slopes of the detail, less those that the mesh's normals already have.
    fn bake_slopes(&self, raster: Raster, detail: &[f32], skin: &mut Skin) {
        let vertices = self.raster();
        let coarse = differences(&self.fine.detail, vertices);
        for (k, fine) in differences(detail, raster).into_iter().enumerate() {
            let cell = self.fine_cell(place(raster, k));
            let mesh = vec2(cell.mix(|v| coarse[v].x), cell.mix(|v| coarse[v].y));
            let rest = (fine - mesh).clamp_length_max(2.0) * Skin::SLOPE_STEPS;
            skin.slope.push([rest.x.round() as i8, rest.y.round() as i8]);
        }
    }

    fn bake_openness(&self, raster: Raster, mut detail: Vec<f32>, skin: &mut Skin) {
        for (k, d) in detail.iter_mut().enumerate() {
            let cell = self.fine_cell(place(raster, k));
            *d -= cell.mix(|v| self.fine.detail[v]);
        }
        let around = blur(&detail, raster.width, (0.0008 / raster.step).ceil() as usize);
        skin.ao.extend(detail.iter().zip(&around).map(|(d, around)| {
            let pit = (around - d).max(0.0);
            (255.0 / (1.0 + pit / HALF_SKY_M) + 0.5) as u8
        }));
    }
}

fn place(raster: Raster, k: usize) -> Vec2 {
    raster.origin + vec2((k % raster.width) as f32, (k / raster.width) as f32) * raster.step
}

fn differences(values: &[f32], raster: Raster) -> Vec<Vec2> {
    let (w, h) = (raster.width, raster.height);
    let mut out = Vec::with_capacity(values.len());
    for j in 0..h {
        let (south, north) = (j.saturating_sub(1), (j + 1).min(h - 1));
        for i in 0..w {
            let (west, east) = (i.saturating_sub(1), (i + 1).min(w - 1));
            let v = |i: usize, j: usize| values[j * w + i];
            let d = vec2(
                (v(east, j) - v(west, j)) / (east - west).max(1) as f32,
                (v(i, north) - v(i, south)) / (north - south).max(1) as f32,
            );
            out.push(d / raster.step);
        }
    }
    out
}
