//! Materials and masks → glTF materials, textures and pictures, each picture once.

use super::pack::Pack;
use crate::Result;
use crate::geometry::AlphaMask;
use crate::material::swatch::{Dye, Swatch};
use crate::math::Vec3;
use crate::model::document::{
    CLAMP_TO_EDGE, DIFFUSE_TRANSMISSION, DiffuseTransmission, Document, Image, LINEAR, LINEAR_MIPMAP_LINEAR, Material,
    NEAREST, NormalInfo, Pbr, Sampler, Texture, TextureInfo,
};
use crate::output::png::{self, Picture};
use crate::scene::{Part, Scene};
use crate::texture::ColorSpace;
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Which picture: the swatch's key, and the mask's address.
type Key = ([usize; 2], usize);

/// What parts wear, as it is met.
pub(super) struct Looks<'a> {
    scene: &'a Scene,
    /// Material, tint and mask of each glTF material.
    worn: Vec<Worn<'a>>,
    known: BTreeMap<(u32, [u32; 3], usize), usize>,
}

/// A material in a tint, under a mask.
type Worn<'a> = (u32, Vec3, Option<&'a Arc<AlphaMask>>);

/// A picture and everything that wears it.
struct Sheet<'a> {
    swatch: Swatch<'a>,
    mask: Option<&'a AlphaMask>,
    /// The largest tints of those that wear it in R, G, B: what the picture is multiplied by so that no factor exceeds one.
    tint: Vec3,
    tint_transmitted: Vec3,
    /// The largest reflectance, and the largest transmittance.
    most: [Vec3; 2],
    /// The part of light that passes: what both are written beside.
    share: f32,
    /// Whether any of them has a relief.
    raised: bool,
}

fn address(mask: Option<&Arc<AlphaMask>>) -> usize {
    mask.map_or(0, |m| Arc::as_ptr(m) as usize)
}

impl<'a> Looks<'a> {
    pub(super) fn new(scene: &'a Scene) -> Self {
        Self { scene, worn: Vec::new(), known: BTreeMap::new() }
    }

    /// Number of the glTF material of a part.
    pub(super) fn wear(&mut self, part: &'a Part) -> usize {
        let (worn, tint, mask) = (&mut self.worn, part.tint(), part.mask.as_ref());
        let key = (part.material, tint.to_array().map(f32::to_bits), address(mask));
        *self.known.entry(key).or_insert_with(|| {
            worn.push((part.material, tint, mask));
            worn.len() - 1
        })
    }

    /// The swatches of all materials that are worn.
    fn swatches(&self) -> BTreeMap<u32, Swatch<'a>> {
        let scene = self.scene;
        let worn: BTreeSet<u32> = self.worn.iter().map(|(material, ..)| *material).collect();
        worn.into_iter().map(|material| (material, scene.materials[material as usize].swatch())).collect()
    }

    /// Writes materials, textures, samplers and pictures.
    pub(super) fn write(&self, document: &mut Document, pack: &mut Pack) -> Result<()> {
        let scene = self.scene;
        let swatches = self.swatches();
        let dye = |material: u32, tint| swatches[&material].dyed(scene.materials[material as usize].tint_factors(tint));
        let mut sheets: BTreeMap<Key, Sheet<'a>> = BTreeMap::new();
        // Numbered as they are met: addresses differ from run to run, files must not.
        let mut order: Vec<Key> = Vec::new();
        for (i, (material, tint, mask)) in self.worn.iter().enumerate() {
            let (swatch, dye) = (&swatches[material], dye(*material, *tint));
            let key = key(swatch, *mask, i);
            let sheet = sheets.entry(key).or_insert_with(|| {
                order.push(key);
                let own = scene.materials[*material as usize].swatch();
                // A plain colour has no picture that others wear, too: it is the tinted one.
                let mean = || [dye.mean.reflectance, dye.mean.transmittance].map(|s| s.0.truncate());
                let most = if own.size.is_some() { most(&own) } else { mean() };
                let mask = mask.map(|m| &**m);
                Sheet {
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
            // Specimens that let more light through than their picture need their part of the share. Where the brightest texels of both leave no
            // share that holds them, both are cut by the same factor.
            let [reflected, transmitted] = sheet.most;
            let reflected = (reflected * sheet.tint).max_element();
            let transmitted = (transmitted * sheet.tint_transmitted).max_element();
            sheet.share = (transmitted / (reflected + transmitted).max(1.0)).min(0.9);
        }
        document.samplers = vec![
            // Masks are cut without a filter: as ours are.
            sampler(NEAREST, NEAREST),
            sampler(LINEAR, LINEAR_MIPMAP_LINEAR),
        ];
        let drawn: Vec<Drawn> = order.iter().map(|key| sheets[key].draw()).collect::<Result<_>>()?;
        let mut textures: BTreeMap<Key, [Option<usize>; 3]> = BTreeMap::new();
        for (key, Drawn { reflected, transmitted, normals }) in order.iter().zip(drawn) {
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
                    document.textures.push(Texture { sampler: Some(sampler), source: Some(document.images.len() - 1) });
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

/// Plain materials have a sheet each: their colour is a factor, their picture at most a mask.
fn key(swatch: &Swatch<'_>, mask: Option<&Arc<AlphaMask>>, number: usize) -> Key {
    if swatch.size.is_some() { (swatch.key, address(mask)) } else { ([0, number], address(mask)) }
}

/// The largest reflectance and transmittance of a swatch in R, G, B: of its picture's texels, every 4th across and down.
fn most(swatch: &Swatch<'_>) -> [Vec3; 2] {
    let (w, h) = swatch.size.unwrap_or((1, 1));
    let some = (0..h).step_by(4).flat_map(|y| (0..w).step_by(4).map(move |x| (x, y)));
    some.map(|(x, y)| swatch.texel(x, y)).fold([Vec3::ZERO; 2], |most, tone| {
        let of = [tone.reflectance, tone.transmittance].map(|s| s.0.truncate());
        [most[0].max(of[0]), most[1].max(of[1])]
    })
}

/// Pictures as PNG files.
struct Drawn {
    reflected: Option<Vec<u8>>,
    transmitted: Option<Vec<u8>>,
    normals: Option<Vec<u8>>,
}

impl Sheet<'_> {
    /// What reflected colours are multiplied by in the document: tints, and the share that does not pass.
    fn lift(&self) -> Vec3 {
        self.tint / (1.0 - self.share)
    }

    /// The same for what passes.
    fn lift_transmitted(&self) -> Vec3 {
        if self.share > 0.0 { self.tint_transmitted / self.share } else { Vec3::ZERO }
    }

    fn draw(&self) -> Result<Drawn> {
        let pictured = self.swatch.size.is_some();
        let Some((w, h)) = self.mask.map(AlphaMask::size).or(self.swatch.size) else {
            return Ok(Drawn { reflected: None, transmitted: None, normals: None });
        };
        let (sw, sh) = self.swatch.size.unwrap_or((1, 1));
        // A mask of another size than its picture decides: the picture's nearest texels are taken.
        let tone = |x: u32, y: u32| self.swatch.texel(scaled(x, w, sw), scaled(y, h, sh));
        let opacity = |x: u32, y: u32| if self.mask.is_none_or(|m| m.texel(x as i32, y as i32)) { 255 } else { 0 };
        let places = || (0..h).flat_map(|y| (0..w).map(move |x| (x, y)));
        let code = |v: Vec3| v.to_array().map(|c| ColorSpace::Srgb.encode(c));
        let reflected =
            |x, y| if pictured { code(tone(x, y).reflectance.0.truncate() * self.lift()) } else { [255; 3] };
        let reflected = if self.mask.is_some() {
            let rgba = |(x, y)| {
                let [r, g, b] = reflected(x, y);
                [r, g, b, opacity(x, y)]
            };
            png::encode(w, h, &Picture::Rgba(&places().map(rgba).collect::<Vec<_>>()), "")?
        } else {
            png::encode(w, h, &Picture::Rgb(&places().map(|(x, y)| reflected(x, y)).collect::<Vec<_>>()), "")?
        };
        let transmitted = |(x, y): (u32, u32)| code(tone(x, y).transmittance.0.truncate() * self.lift_transmitted());
        let transmitted = (pictured && self.share > 0.0)
            .then(|| png::encode(w, h, &Picture::Rgb(&places().map(transmitted).collect::<Vec<_>>()), ""))
            .transpose()?;
        let normal = |(x, y): (u32, u32)| {
            let slope = self.swatch.slope(scaled(x, w, sw), scaled(y, h, sh));
            let n = Vec3::new(-slope.x, -slope.y, 1.0).normalize();
            n.to_array().map(|c| ((0.5 * c + 0.5) * 255.0 + 0.5) as u8)
        };
        let normals = (pictured && self.raised)
            .then(|| png::encode(w, h, &Picture::Linear(&places().map(normal).collect::<Vec<_>>()), ""))
            .transpose()?;
        Ok(Drawn { reflected: Some(reflected), transmitted, normals })
    }

    fn material(&self, swatch: &Swatch<'_>, dye: Dye, textures: [Option<usize>; 3], number: usize) -> Material {
        let relief = textures[2].filter(|_| swatch.relief > 0.0);
        let [reflected, transmitted, _] =
            textures.map(|t| t.map(|index| TextureInfo { index, ..TextureInfo::default() }));
        let pictured = swatch.size.is_some();
        // With a picture the factor is the tint beside the largest tint; without one it is the colour.
        let factor = if pictured { dye.tint / self.tint } else { dye.mean.reflectance.0.truncate() * self.lift() };
        let [r, g, b] = factor.clamp(Vec3::ZERO, Vec3::ONE).to_array();
        let mean = dye.mean;
        let mut material = Material {
            name: Some(format!("material {number}")),
            pbr_metallic_roughness: Pbr {
                base_color_factor: Some([r, g, b, 1.0]),
                base_color_texture: reflected,
                metallic_factor: Some(0.0),
                // glTF's roughness is the root of α.
                roughness_factor: Some(swatch.roughness.sqrt()),
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

/// The texel of `to` that lies where texel `i` of `from` does.
fn scaled(i: u32, from: u32, to: u32) -> u32 {
    if from == to { i } else { ((u64::from(i) * 2 + 1) * u64::from(to) / (u64::from(from) * 2)) as u32 }
}
