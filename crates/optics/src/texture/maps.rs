//! Height, normal and ambient-occlusion maps derived from one texture, so that a photographed leaf needs no other
//! input.
//!
//! Height is the texture's brightness, band-passed between two feature sizes: finer features are camera noise, coarser
//! ones are illumination and age. On a leaf's upper side veins are paler than the blade and recessed, so bright is low.
//!
//! All lengths and heights are fractions of the image's height ("image lengths"). Slopes are then dimensionless and
//! correct for any leaf size, as long as the surface keeps the image's proportions.

use super::Texture;
use super::height::Height;
use super::pyramid::{Level, Plane, Pyramid, Wrap, halve};
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec2};

/// Parameters for deriving height from a texture's brightness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeightFromBrightness {
    /// Height of a strong feature above or below the mean, in image lengths. If positive, bright is high; if negative,
    /// bright is low (veins recessed in a leaf's upper side).
    pub amplitude: f32,
    /// Size of the finest features kept, in image lengths.
    pub finest: f32,
    /// Size of the coarsest features kept, in image lengths.
    pub coarsest: f32,
}

impl HeightFromBrightness {
    /// Upper side of a leaf: veins recessed by about 0.2 mm on a leaf of 100 mm.
    pub const LEAF: Self = Self { amplitude: -0.002, finest: 0.003, coarsest: 0.05 };
    /// Crumbly soil: bright crumbs rise 1.5 mm on an image of half a metre.
    pub const SOIL: Self = Self { amplitude: 0.003, finest: 0.002, coarsest: 0.03 };
}

/// Height, normal and ambient-occlusion maps.
#[derive(Clone, Debug)]
pub struct Maps {
    /// Heights in image lengths.
    pub height: Height,
    /// Normal map, stored as slopes.
    pub normal: NormalMap,
    /// Ambient occlusion (1 where the whole sky is visible).
    pub occlusion: AmbientOcclusion,
}

impl Maps {
    /// Derives the maps from a texture's brightness.
    pub fn derive(texture: &Texture, relief: &HeightFromBrightness) -> Self {
        let (width, height) = (texture.width(), texture.height());
        let mut values = Vec::with_capacity(width.to_usize() * height.to_usize());
        for y in 0..height {
            for x in 0..width {
                let [r, g, b, _] = texture.texel(x, y);
                // The cube root approximates perceived brightness, so shadows and highlights have similar weight.
                values.push((0.2126 * r + 0.7152 * g + 0.0722 * b).max(0.0).cbrt());
            }
        }
        let radius = |size: f32| (size * height.to_f32() * 0.5).round_to::<usize>();
        let [wrap, _] = texture.wrap();
        let size = (width.to_usize(), height.to_usize());
        let coarse = soften(&values, size, radius(relief.coarsest), wrap);
        let mut fine = soften(&values, size, radius(relief.finest), wrap);
        let mut power = 0.0;
        let mut weight = 0.0;
        for (i, (f, c)) in fine.iter_mut().zip(&coarse).enumerate() {
            *f -= c;
            let alpha = texture.texel(i.to_u32() % width, i.to_u32() / width)[3];
            power += f64::from(alpha * *f * *f);
            weight += f64::from(alpha);
        }
        // A strong feature is two standard deviations. Beyond that the height saturates, so a single speck does not
        // become a spike.
        let strong = 2.0 * (power / weight.max(1.0)).sqrt().max(1e-4).to_f32();
        for f in &mut fine {
            let x = *f / strong;
            *f = relief.amplitude * x / (1.0 + x * x).sqrt();
        }
        Self::from_height(Height::from_values(width, height, fine).wrapped(wrap))
    }

    /// Derives the maps from generated or measured heights in image lengths.
    pub fn from_height(height: Height) -> Self {
        let (normal, occlusion) = rayon::join(|| NormalMap::new(&height), || AmbientOcclusion::new(&height));
        Self { height, normal, occlusion }
    }
}

/// Slopes over uv with their mip pyramid. Averaging slopes is exact, averaging encoded normals is not.
#[derive(Clone, Debug)]
pub struct NormalMap {
    pyramid: Pyramid<[f32; 2]>,
    wrap: [Wrap; 2],
}

impl NormalMap {
    fn new(height: &Height) -> Self {
        let (width, rows) = height.size();
        let wrap = height.wrap();
        let values = height.values();
        let get = |x: i32, y: i32| {
            values[wrap.index(y, rows).to_usize() * width.to_usize() + wrap.index(x, width).to_usize()]
        };
        let scale = 0.5 * rows.to_f32();
        let mut plane = Plane { width, height: rows, values: Vec::with_capacity(values.len()) };
        for y in 0..rows.to_i32() {
            for x in 0..width.to_i32() {
                plane.values.push([(get(x + 1, y) - get(x - 1, y)) * scale, (get(x, y - 1) - get(x, y + 1)) * scale]);
            }
        }
        Self { pyramid: build(plane), wrap: [wrap; 2] }
    }

    /// Converts a tangent-space normal map that was read as [`ColorSpace::Linear`](super::ColorSpace): R right, G up in
    /// the image, B out of the surface, each 0..1 for −1..1. Slopes are clamped to ±10.
    pub fn from_picture(picture: &Texture) -> Self {
        let (width, height) = (picture.width(), picture.height());
        let slope = |x, y| {
            let [r, g, b, _] = picture.texel(x, y).map(|c| 2.0 * c - 1.0);
            let z = b.max(0.1);
            [(-r / z).clamp(-10.0, 10.0), (-g / z).clamp(-10.0, 10.0)]
        };
        let values = (0..height).flat_map(|y| (0..width).map(move |x| slope(x, y))).collect();
        Self { pyramid: build(Plane { width, height, values }), wrap: picture.wrap() }
    }

    /// Returns the level of detail of a footprint that spans `extent` of uv; see [`Texture::lod`].
    #[inline]
    pub fn lod(&self, extent: f32) -> f32 {
        let finest = &self.pyramid.levels[0];
        (extent * finest.width.max(finest.height).to_f32()).max(1.0).log2()
    }

    /// Returns the slope (∂h/∂x, ∂h/∂y) at `uv`, with x along +u (right) and y along −v (up the image, towards a leaf's
    /// tip), bilinear on the level nearest to `lod`. The tangent-space normal is (−∂h/∂x, −∂h/∂y, 1), normalised.
    #[inline]
    pub fn sample(&self, uv: Vec2, lod: f32) -> Vec2 {
        let mut sum = Vec2::ZERO;
        for (slope, weight) in self.pyramid.taps(uv, lod, self.wrap) {
            sum += Vec2::from(slope) * weight;
        }
        sum
    }
}

/// Ambient occlusion, 0..1, with its mip pyramid: the fraction of the sky visible from a texel past the map's own
/// relief.
#[derive(Clone, Debug)]
pub struct AmbientOcclusion {
    pyramid: Pyramid<[f32; 1]>,
    wrap: Wrap,
}

impl AmbientOcclusion {
    /// Derives ambient occlusion from a height map.
    ///
    /// A point at depth d below a rim at distance r sees r²/(r² + d²) of the sky, as from the bottom of a round shaft.
    /// The rim of a bowl is 1.5 times as high as the mean of the surrounding square. The smallest value over five radii
    /// is kept. This is an estimate; ray tracing is more accurate where the relief is geometry.
    fn new(height: &Height) -> Self {
        let (width, rows) = height.size();
        let size = (width.to_usize(), rows.to_usize());
        let texels = rows.to_f32();
        let mut open = vec![[1.0f32]; height.values().len()];
        for radius in [1, 2, 4, 8, 16] {
            let mean = blur(height.values(), size, radius, height.wrap());
            let r2 = (radius * radius).to_f32();
            for ((o, m), h) in open.iter_mut().zip(&mean).zip(height.values()) {
                let d = (1.5 * (m - h) * texels).max(0.0);
                o[0] = o[0].min(r2 / (r2 + d * d));
            }
        }
        Self { pyramid: build(Plane { width, height: rows, values: open }), wrap: height.wrap() }
    }

    /// Returns the ambient occlusion at `uv`, bilinear on the level nearest to `lod`.
    #[inline]
    pub fn sample(&self, uv: Vec2, lod: f32) -> f32 {
        self.pyramid.taps(uv, lod, [self.wrap; 2]).iter().map(|(v, weight)| v[0] * weight).sum()
    }
}

fn build<const N: usize>(finest: Plane<N>) -> Pyramid<[f32; N]> {
    let mut levels = Vec::new();
    let mut plane = Some(finest);
    while let Some(p) = plane {
        levels.push(Level::new(p.width, p.height, |x, y| p.get(x, y)));
        plane = halve(p.width, p.height, |x, y| p.get(x, y));
    }
    Pyramid { levels }
}

/// Applies two box blurs, which approximate a Gaussian.
fn soften(values: &[f32], size: (usize, usize), radius: usize, wrap: Wrap) -> Vec<f32> {
    let half = radius.div_ceil(2);
    blur(&blur(values, size, half, wrap), size, radius - radius / 2, wrap)
}

/// Returns the mean over the square of side 2·radius + 1 around each texel, in time independent of the radius.
pub(super) fn blur(values: &[f32], (width, height): (usize, usize), radius: usize, wrap: Wrap) -> Vec<f32> {
    if radius == 0 {
        return values.to_vec();
    }
    let r = radius.to_i32();
    let scale = 1.0 / (2 * radius + 1).to_f32();
    let at = |i: i32, n: usize| wrap.index(i, n.to_u32()).to_usize();
    let mut rows = vec![0.0f32; values.len()];
    for (row, out) in values.chunks_exact(width).zip(rows.chunks_exact_mut(width)) {
        let mut sum: f64 = (-r..=r).map(|i| f64::from(row[at(i, width)])).sum();
        for (x, o) in out.iter_mut().enumerate() {
            *o = sum.to_f32() * scale;
            let x = x.to_i32();
            sum += f64::from(row[at(x + r + 1, width)]) - f64::from(row[at(x - r, width)]);
        }
    }
    let mut out = vec![0.0f32; values.len()];
    let mut sums = vec![0.0f64; width];
    let row = |y: i32| &rows[at(y, height) * width..][..width];
    for y in -r..=r {
        for (s, v) in sums.iter_mut().zip(row(y)) {
            *s += f64::from(*v);
        }
    }
    for (y, line) in out.chunks_exact_mut(width).enumerate() {
        let y = y.to_i32();
        let (entering, leaving) = (row(y + r + 1), row(y - r));
        for (x, o) in line.iter_mut().enumerate() {
            *o = sums[x].to_f32() * scale;
            sums[x] += f64::from(entering[x]) - f64::from(leaving[x]);
        }
    }
    out
}
