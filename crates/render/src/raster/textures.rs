//! Uploads materials and masks as textures with mip levels, each image once.
//!
//! In coarser mip levels of a mask that is alpha-tested at ½, thin structures disappear because their coverage of a
//! texel falls below ½. So each mip level is scaled to the same opaque fraction as the finest one. Source: Castaño
//! 2010, "Computing Alpha Mipmaps".

use super::gpu::Gpu;
use crate::material::swatch::{Dye, Swatch};
use crate::scene::Scene;
use furrow_base::geometry::AlphaMask;
use furrow_base::math::{RoundTo, Spectrum, ToFloat, ToInt, Vec4};
use furrow_optics::texture::ColorSpace;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;
use wgpu::{TextureFormat, TextureView};

/// Identity of a sheet: key of the swatch, and address of the mask.
type Key = ([usize; 2], usize);

/// Textures and parameters of the parts.
pub(super) struct SceneTextures {
    /// Index of the sheet of each part.
    pub(super) worn: Vec<usize>,
    /// All sheets.
    pub(super) all: Vec<MaterialTextures>,
    /// Parameters of each part: tints, then roughness, relief, paleness.
    pub(super) wears: Vec<[f32; 12]>,
}

/// Textures of a material with a mask.
pub(super) struct MaterialTextures {
    /// Reflectance; near infrared in the alpha channel.
    pub(super) reflected: TextureView,
    /// Transmittance, likewise.
    pub(super) transmitted: TextureView,
    /// Normal x and y, ambient occlusion, water film.
    pub(super) relief: TextureView,
    /// Opacity.
    pub(super) mask: TextureView,
}

impl SceneTextures {
    /// Builds the textures of a scene's materials, at most `most` texels wide and high.
    pub(super) fn new(scene: &Scene, gpu: &Gpu, most: u32) -> Self {
        let swatches: Vec<Swatch<'_>> = scene.materials.iter().map(crate::material::Material::swatch).collect();
        let mut sheets = Self { worn: Vec::new(), all: Vec::new(), wears: Vec::new() };
        let mut known: BTreeMap<Key, usize> = BTreeMap::new();
        let mut masks: BTreeMap<usize, TextureView> = BTreeMap::new();
        let mut colors: BTreeMap<[usize; 2], [TextureView; 3]> = BTreeMap::new();
        for part in &scene.parts {
            let swatch = &swatches[part.material.to_usize()];
            let of_mask = part.mask.as_ref().map_or(0, |m| Arc::as_ptr(m).addr());
            let of_colors = if swatch.size.is_some() { swatch.key } else { [0; 2] };
            let next = known.len();
            let sheet = *known.entry((of_colors, of_mask)).or_insert(next);
            if sheet == next {
                let mask = masks.entry(of_mask).or_insert_with(|| opacity(gpu, part.mask.as_deref(), most));
                let [reflected, transmitted, relief] =
                    colors.entry(of_colors).or_insert_with(|| pictures(gpu, swatch, most));
                let (reflected, transmitted, relief) = (reflected.clone(), transmitted.clone(), relief.clone());
                sheets.all.push(MaterialTextures { reflected, transmitted, relief, mask: mask.clone() });
            }
            sheets.worn.push(sheet);
            let by = scene.materials[part.material.to_usize()].tint_factors(part.tint());
            sheets.wears.push(wear(swatch, swatch.dyed(by)));
        }
        sheets
    }
}

/// Parameters of a part. A material without an image uses a white one, tinted by its colour.
fn wear(swatch: &Swatch<'_>, dye: Dye) -> [f32; 12] {
    let (tint, passed) = match swatch.size {
        Some(_) => (dye.tint.extend(1.0), dye.tint_transmitted.extend(1.0)),
        None => (dye.mean.reflectance.0, dye.mean.transmittance.0),
    };
    let mut all = [0.0; 12];
    all[..4].copy_from_slice(&tint.to_array());
    all[4..8].copy_from_slice(&passed.to_array());
    all[8..11].copy_from_slice(&[swatch.roughness, swatch.relief, swatch.back_paleness]);
    all
}

/// One mip level of an image: four channels per texel, 0–1, linear.
struct Plane {
    size: (u32, u32),
    texels: Vec<Vec4>,
}

impl Plane {
    fn new(size: (u32, u32), texel: impl Fn(u32, u32) -> Vec4) -> Self {
        let texels = (0..size.1).flat_map(|y| (0..size.0).map(move |x| (x, y))).map(|(x, y)| texel(x, y)).collect();
        Self { size, texels }
    }

    /// Next mip level (2 × 2 box filter); `None` for a single texel.
    fn halved(&self) -> Option<Self> {
        let (w, h) = self.size;
        if (w, h) == (1, 1) {
            return None;
        }
        let size = ((w / 2).max(1), (h / 2).max(1));
        let row = |y: u32| {
            let rows = [2 * y, (2 * y + 1).min(h - 1)];
            (0..size.0).map(move |x| {
                let columns = [2 * x, (2 * x + 1).min(w - 1)];
                let sum: Vec4 = rows
                    .iter()
                    .flat_map(|y| columns.iter().map(|x| self.texels[y.to_usize() * w.to_usize() + x.to_usize()]))
                    .sum();
                sum * 0.25
            })
        };
        let texels: Vec<Vec<Vec4>> = (0..size.1).into_par_iter().map(|y| row(y).collect()).collect();
        Some(Self { size, texels: texels.concat() })
    }

    /// Returns this level and all coarser ones, without those larger than `most`.
    fn levels(self, most: u32) -> Vec<Self> {
        let mut all = Vec::new();
        let mut next = Some(self);
        while let Some(level) = next {
            next = level.halved();
            if level.size.0.max(level.size.1) <= most {
                all.push(level);
            }
        }
        all
    }
}

fn byte(v: f32) -> u8 {
    (v.clamp(0.0, 1.0) * 255.0 + 0.5).trunc_to::<u8>()
}

/// Uploads mip levels. Colours are sRGB-encoded, so that 8 bits are sufficient in the dark.
fn send(gpu: &Gpu, plane: Plane, most: u32, colors: bool) -> TextureView {
    let levels = plane.levels(most);
    let code = |v: &Vec4| {
        let [r, g, b, a] = v.to_array();
        let three =
            if colors { [r, g, b].map(|c| ColorSpace::Srgb.encode(c.clamp(0.0, 1.0))) } else { [r, g, b].map(byte) };
        [three[0], three[1], three[2], byte(a)]
    };
    let coded = |level: &Plane| {
        let texels: Vec<[u8; 4]> = level.texels.par_iter().map(code).collect();
        texels.concat()
    };
    let bytes: Vec<Vec<u8>> = levels.iter().map(coded).collect();
    let format = if colors { TextureFormat::Rgba8UnormSrgb } else { TextureFormat::Rgba8Unorm };
    gpu.picture(levels[0].size, format, &bytes)
}

/// Uploads reflectance, transmittance and relief of a material.
fn pictures(gpu: &Gpu, swatch: &Swatch<'_>, most: u32) -> [TextureView; 3] {
    let Some(size) = swatch.size else {
        let even = |v: Vec4, colors| send(gpu, Plane::new((1, 1), |_, _| v), most, colors);
        return [even(Vec4::ONE, true), even(Vec4::ONE, true), even(Vec4::new(0.5, 0.5, 1.0, 0.0), false)];
    };
    let four = |s: Spectrum| s.0;
    // Normal components are stored in a byte each; slopes steeper than 60° are clamped.
    let fine = |x, y| {
        let slope = swatch.slope(x, y).clamp_length_max(1.7);
        let n = (-slope).extend(1.0).normalize();
        let grain = swatch.grain(x, y);
        Vec4::new(0.5 * n.x + 0.5, 0.5 * n.y + 0.5, grain.open, grain.film)
    };
    let passes = swatch.mean.transmittance.max() > 0.0;
    let transmitted = if passes {
        Plane::new(size, |x, y| four(swatch.texel(x, y).transmittance))
    } else {
        Plane::new((1, 1), |_, _| Vec4::ZERO)
    };
    [
        send(gpu, Plane::new(size, |x, y| four(swatch.texel(x, y).reflectance)), most, true),
        send(gpu, transmitted, most, true),
        send(gpu, Plane::new(size, fine), most, false),
    ]
}

/// Uploads a mask whose mip levels all have the same opaque fraction.
fn opacity(gpu: &Gpu, mask: Option<&AlphaMask>, most: u32) -> TextureView {
    let Some(mask) = mask else {
        return gpu.picture((1, 1), TextureFormat::R8Unorm, &[vec![255]]);
    };
    let at = |x: u32, y: u32| Vec4::splat(f32::from(u8::from(mask.texel(x.to_i32(), y.to_i32()))));
    let levels = Plane::new(mask.size(), at).levels(most);
    let share = levels[0].texels.iter().filter(|v| v.x >= 0.5).count().to_f64() / levels[0].texels.len().to_f64();
    let bytes: Vec<Vec<u8>> = levels
        .iter()
        .map(|level| {
            let scale = 0.5 / cut(level, share).max(0.02);
            level.texels.iter().map(|v| byte(v.x * scale)).collect()
        })
        .collect();
    gpu.picture(levels[0].size, TextureFormat::R8Unorm, &bytes)
}

/// Returns the value that this fraction of a level's texels reaches.
fn cut(level: &Plane, share: f64) -> f32 {
    let mut values: Vec<f32> = level.texels.iter().map(|v| v.x).collect();
    let rank = (share * values.len().to_f64()).round_to::<usize>().clamp(1, values.len()) - 1;
    let (_, value, _) = values.select_nth_unstable_by(rank, |a, b| b.total_cmp(a));
    // Where many texels have the same value, such as 1, that value does not separate them; the cut is at most ½.
    value.min(0.5)
}
