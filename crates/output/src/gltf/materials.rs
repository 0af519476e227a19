//! Conversion of materials and masks to glTF materials, textures and images; each image is written once.

use super::pack::Pack;
use crate::png::{self, ImageData};
use furrow_base::Result;
use furrow_base::geometry::AlphaMask;
use furrow_base::math::{RoundTo, ToInt, Vec3};
use furrow_grow::model::document::{
    CLAMP_TO_EDGE, DIFFUSE_TRANSMISSION, DiffuseTransmission, Document, Image, LINEAR, LINEAR_MIPMAP_LINEAR, Material,
    NEAREST, NormalInfo, Pbr, Sampler, Texture, TextureInfo,
};
use furrow_optics::texture::ColorSpace;
use furrow_render::material::swatch::{Dye, Swatch};
use furrow_render::scene::{Part, Scene};
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Identity of an image: the swatch's key, and the mask's address.
type Key = ([usize; 2], usize);

/// Materials used by the parts, in order of first use.
pub(super) struct Materials<'a> {
    scene: &'a Scene,
    /// Material, tint and mask of each glTF material.
    worn: Vec<MaterialVariant<'a>>,
    known: BTreeMap<(u32, [u32; 3], usize), usize>,
}

/// Material with a tint and a mask.
type MaterialVariant<'a> = (u32, Vec3, Option<&'a Arc<AlphaMask>>);

/// Image shared by several glTF materials.
struct SharedImage<'a> {
    swatch: Swatch<'a>,
    mask: Option<&'a AlphaMask>,
    /// Component-wise maximum of the tints of all users. The image is multiplied by it so that no factor exceeds one.
    tint: Vec3,
    tint_transmitted: Vec3,
    /// Largest reflectance, then largest transmittance.
    most: [Vec3; 2],
    /// Diffuse transmission factor f: reflected colours are divided by 1 − f, transmitted ones by f.
    share: f32,
    /// Whether any user has a relief.
    raised: bool,
}

fn address(mask: Option<&Arc<AlphaMask>>) -> usize {
    mask.map_or(0, |m| Arc::as_ptr(m).addr())
}

impl<'a> Materials<'a> {
    pub(super) fn new(scene: &'a Scene) -> Self {
        Self { scene, worn: Vec::new(), known: BTreeMap::new() }
    }

    /// Returns the index of a part's glTF material.
    pub(super) fn wear(&mut self, part: &'a Part) -> usize {
        let (worn, tint, mask) = (&mut self.worn, part.tint(), part.mask.as_ref());
        let key = (part.material, tint.to_array().map(f32::to_bits), address(mask));
        *self.known.entry(key).or_insert_with(|| {
            worn.push((part.material, tint, mask));
            worn.len() - 1
        })
    }

    /// Returns the swatches of all materials in use.
    fn swatches(&self) -> BTreeMap<u32, Swatch<'a>> {
        let scene = self.scene;
        let worn: BTreeSet<u32> = self.worn.iter().map(|(material, ..)| *material).collect();
        worn.into_iter().map(|material| (material, scene.materials[material.to_usize()].swatch())).collect()
    }

    /// Writes materials, textures, samplers and images.
    pub(super) fn write(&self, document: &mut Document, pack: &mut Pack) -> Result<()> {
        let scene = self.scene;
        let swatches = self.swatches();
        let dye =
            |material: u32, tint| swatches[&material].dyed(scene.materials[material.to_usize()].tint_factors(tint));
        let mut sheets: BTreeMap<Key, SharedImage<'a>> = BTreeMap::new();
        // Numbered by first use, because addresses differ from run to run and files must not.
        let mut order: Vec<Key> = Vec::new();
        for (i, (material, tint, mask)) in self.worn.iter().enumerate() {
            let (swatch, dye) = (&swatches[material], dye(*material, *tint));
            let key = key(swatch, *mask, i);
            let sheet = sheets.entry(key).or_insert_with(|| {
                order.push(key);
                let own = scene.materials[material.to_usize()].swatch();
                // A plain colour shares no image, so the tinted colour itself is used.
                let mean = || [dye.mean.reflectance, dye.mean.transmittance].map(|s| s.0.truncate());
                let most = if own.size.is_some() { most(&own) } else { mean() };
                let mask = mask.map(|m| &**m);
                SharedImage {
                    swatch: own,
                    mask,
                    tint: Vec3::ONE,
                    tint_transmitted: Vec3::ONE,
                    most,
                    share: 0.0,
                    raised: false,
                }
            });
            sheet.raised |= swatch.relief > 0.0;
            if swatch.size.is_some() {
                sheet.tint = sheet.tint.max(dye.tint);
                sheet.tint_transmitted = sheet.tint_transmitted.max(dye.tint_transmitted);
            }
        }
        for sheet in sheets.values_mut() {
            // Parts that transmit more light than their image need a larger factor. If the brightest texels of both
            // colours exceed one for every factor, both are scaled down equally.
            let [reflected, transmitted] = sheet.most;
            let reflected = (reflected * sheet.tint).max_element();
            let transmitted = (transmitted * sheet.tint_transmitted).max_element();
            sheet.share = (transmitted / (reflected + transmitted).max(1.0)).min(0.9);
        }
        document.samplers = vec![
            // Masks are sampled without filtering, as in this renderer.
            sampler(NEAREST, NEAREST),
            sampler(LINEAR, LINEAR_MIPMAP_LINEAR),
        ];
        let drawn: Vec<EncodedImages> = order.iter().map(|key| sheets[key].draw()).collect::<Result<_>>()?;
        let mut textures: BTreeMap<Key, [Option<usize>; 3]> = BTreeMap::new();
        for (key, EncodedImages { reflected, transmitted, normals }) in order.iter().zip(drawn) {
            let cut = usize::from(sheets[key].mask.is_none());
            let mut add = |bytes: Option<Vec<u8>>, what: &str, sampler: usize| {
                bytes.map(|bytes| {
                    let name = Some(format!("{what} {}", document.images.len()));
                    let view = Some(pack.picture(bytes));
                    document.images.push(Image {
                        name,
                        mime_type: Some("image/png".into()),
                        buffer_view: view,
                        uri: None,
                    });
                    document.textures.push(Texture {
                        sampler: Some(sampler),
                        source: Some(document.images.len() - 1),
                        ..Texture::default()
                    });
                    document.textures.len() - 1
                })
            };
            textures.insert(
                *key,
                [add(reflected, "reflected", cut), add(transmitted, "transmitted", 1), add(normals, "relief", 1)],
            );
        }
        for (i, (material, tint, mask)) in self.worn.iter().enumerate() {
            let (swatch, dye) = (&swatches[material], dye(*material, *tint));
            let key = key(swatch, *mask, i);
            document.materials.push(sheets[&key].material(swatch, dye, textures[&key], i));
        }
        Ok(())
    }
}

fn sampler(near: u32, far: u32) -> Sampler {
    let edge = Some(CLAMP_TO_EDGE);
    Sampler { mag_filter: Some(near), min_filter: Some(far), wrap_s: edge, wrap_t: edge }
}

/// Returns the image key. Plain materials do not share images: their colour is a factor, and their image is at most a
/// mask.
fn key(swatch: &Swatch<'_>, mask: Option<&Arc<AlphaMask>>, number: usize) -> Key {
    if swatch.size.is_some() { (swatch.key, address(mask)) } else { ([0, number], address(mask)) }
}

/// Returns the largest reflectance and transmittance of a swatch in R, G, B, over every fourth texel in both
/// directions.
fn most(swatch: &Swatch<'_>) -> [Vec3; 2] {
    let (w, h) = swatch.size.unwrap_or((1, 1));
    let some = (0..h).step_by(4).flat_map(|y| (0..w).step_by(4).map(move |x| (x, y)));
    some.map(|(x, y)| swatch.texel(x, y)).fold([Vec3::ZERO; 2], |most, tone| {
        let of = [tone.reflectance, tone.transmittance].map(|s| s.0.truncate());
        [most[0].max(of[0]), most[1].max(of[1])]
    })
}

/// Encoded PNG files of an image.
struct EncodedImages {
    reflected: Option<Vec<u8>>,
    transmitted: Option<Vec<u8>>,
    normals: Option<Vec<u8>>,
}

impl SharedImage<'_> {
    /// Returns the factor on reflected colours: the tint divided by 1 − f.
    fn lift(&self) -> Vec3 {
        self.tint / (1.0 - self.share)
    }

    /// Returns the factor on transmitted colours: the tint divided by f.
    fn lift_transmitted(&self) -> Vec3 {
        if self.share > 0.0 { self.tint_transmitted / self.share } else { Vec3::ZERO }
    }

    fn draw(&self) -> Result<EncodedImages> {
        let pictured = self.swatch.size.is_some();
        let Some((w, h)) = self.mask.map(AlphaMask::size).or(self.swatch.size) else {
            return Ok(EncodedImages { reflected: None, transmitted: None, normals: None });
        };
        let (sw, sh) = self.swatch.size.unwrap_or((1, 1));
        // The mask's size is used if it differs from the image's; the image is then sampled by its nearest texels.
        let tone = |x: u32, y: u32| self.swatch.texel(scaled(x, w, sw), scaled(y, h, sh));
        let opacity = |x: u32, y: u32| if self.mask.is_none_or(|m| m.texel(x.to_i32(), y.to_i32())) { 255 } else { 0 };
        let places = || (0..h).flat_map(|y| (0..w).map(move |x| (x, y)));
        let code = |v: Vec3| v.to_array().map(|c| ColorSpace::Srgb.encode(c));
        let reflected =
            |x, y| if pictured { code(tone(x, y).reflectance.0.truncate() * self.lift()) } else { [255; 3] };
        let reflected = if self.mask.is_some() {
            let rgba = |(x, y)| {
                let [r, g, b] = reflected(x, y);
                [r, g, b, opacity(x, y)]
            };
            png::encode(w, h, &ImageData::Rgba(&places().map(rgba).collect::<Vec<_>>()), "")?
        } else {
            png::encode(w, h, &ImageData::Rgb(&places().map(|(x, y)| reflected(x, y)).collect::<Vec<_>>()), "")?
        };
        let transmitted = |(x, y): (u32, u32)| code(tone(x, y).transmittance.0.truncate() * self.lift_transmitted());
        let transmitted = (pictured && self.share > 0.0)
            .then(|| png::encode(w, h, &ImageData::Rgb(&places().map(transmitted).collect::<Vec<_>>()), ""))
            .transpose()?;
        let normal = |(x, y): (u32, u32)| {
            let slope = self.swatch.slope(scaled(x, w, sw), scaled(y, h, sh));
            let n = Vec3::new(-slope.x, -slope.y, 1.0).normalize();
            n.to_array().map(|c| ((0.5 * c + 0.5) * 255.0 + 0.5).trunc_to::<u8>())
        };
        let normals = (pictured && self.raised)
            .then(|| png::encode(w, h, &ImageData::Linear(&places().map(normal).collect::<Vec<_>>()), ""))
            .transpose()?;
        Ok(EncodedImages { reflected: Some(reflected), transmitted, normals })
    }

    fn material(&self, swatch: &Swatch<'_>, dye: Dye, textures: [Option<usize>; 3], number: usize) -> Material {
        let relief = textures[2].filter(|_| swatch.relief > 0.0);
        let [reflected, transmitted, _] =
            textures.map(|t| t.map(|index| TextureInfo { index, ..TextureInfo::default() }));
        let pictured = swatch.size.is_some();
        // With an image the factor is the tint divided by the largest tint; without one it is the colour.
        let factor = if pictured { dye.tint / self.tint } else { dye.mean.reflectance.0.truncate() * self.lift() };
        let [r, g, b] = factor.clamp(Vec3::ZERO, Vec3::ONE).to_array();
        let mean = dye.mean;
        let mut material = Material {
            name: Some(format!("material {number}")),
            pbr_metallic_roughness: Pbr {
                base_color_factor: Some([r, g, b, 1.0]),
                base_color_texture: reflected,
                metallic_factor: Some(0.0),
                // glTF's roughness is the square root of α.
                roughness_factor: Some(swatch.roughness.sqrt()),
                ..Pbr::default()
            },
            normal_texture: relief.map(|index| NormalInfo {
                index,
                scale: Some(swatch.relief),
                ..NormalInfo::default()
            }),
            double_sided: true,
            extras: json!({ "nir_reflectance": mean.reflectance.0.w, "nir_transmittance": mean.transmittance.0.w }),
            ..Material::default()
        };
        if self.mask.is_some() {
            material.alpha_mode = Some("MASK".into());
            material.alpha_cutoff = Some(0.5);
        }
        if self.share > 0.0 {
            let factor = if pictured {
                dye.tint_transmitted / self.tint_transmitted
            } else {
                mean.transmittance.0.truncate() * self.lift_transmitted()
            };
            let of = DiffuseTransmission {
                diffuse_transmission_factor: self.share,
                diffuse_transmission_color_factor: Some(factor.clamp(Vec3::ZERO, Vec3::ONE).to_array()),
                diffuse_transmission_color_texture: transmitted,
            };
            material.extensions.insert(DIFFUSE_TRANSMISSION.into(), json!(of));
        }
        material
    }
}

/// Returns the texel of a row of `to` texels at the position of texel `i` of `from`.
fn scaled(i: u32, from: u32, to: u32) -> u32 {
    if from == to { i } else { ((u64::from(i) * 2 + 1) * u64::from(to) / (u64::from(from) * 2)).to_u32() }
}
