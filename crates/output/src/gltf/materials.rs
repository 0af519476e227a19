//! Conversion of materials and masks to glTF materials, textures and images; each image is written once.

use super::image_choice::ImageChoice;
use super::images::{self, Colors, SharedColors};
use super::pack::Pack;
use furrow_base::Result;
use furrow_base::geometry::AlphaMask;
use furrow_base::math::{ToInt, Vec3};
use furrow_grow::model::document::{
    CLAMP_TO_EDGE, DIFFUSE_TRANSMISSION, DiffuseTransmission, Document, Image, LINEAR, LINEAR_MIPMAP_LINEAR, Material,
    NEAREST, NormalInfo, Pbr, Sampler, Texture, TextureInfo,
};
use furrow_render::material::swatch::{Dye, Swatch};
use furrow_render::scene::{Part, Scene};
use rayon::prelude::*;
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Identity of an image of colours. For a plain material, which has none, the number of the glTF material.
type ColorKey = [usize; 2];
/// Identity of a texture of reflected colours: the image, and the mask's address. All plain materials with one mask
/// share a white image.
type ReflectedKey = (ColorKey, usize);

/// Index of the glTF sampler of images with a mask, which are not filtered, as in this renderer.
const UNFILTERED: usize = 0;
/// Index of the glTF sampler of other images.
const FILTERED: usize = 1;

/// Materials used by the parts, in order of first use.
pub(super) struct Materials<'a> {
    scene: &'a Scene,
    /// Material, tint and mask of each glTF material.
    used: Vec<MaterialVariant<'a>>,
    known: BTreeMap<(u32, [u32; 3], usize), usize>,
}

/// Material with a tint and a mask.
type MaterialVariant<'a> = (u32, Vec3, Option<&'a Arc<AlphaMask>>);

fn address(mask: Option<&Arc<AlphaMask>>) -> usize {
    mask.map_or(0, |m| Arc::as_ptr(m).addr())
}

impl<'a> Materials<'a> {
    pub(super) fn new(scene: &'a Scene) -> Self {
        Self { scene, used: Vec::new(), known: BTreeMap::new() }
    }

    /// Returns the index of a part's glTF material.
    pub(super) fn add(&mut self, part: &'a Part) -> usize {
        let (used, tint, mask) = (&mut self.used, part.tint(), part.mask.as_ref());
        let key = (part.material, tint.to_array().map(f32::to_bits), address(mask));
        *self.known.entry(key).or_insert_with(|| {
            used.push((part.material, tint, mask));
            used.len() - 1
        })
    }

    /// Returns the images of all materials in use.
    fn choices(&self) -> BTreeMap<u32, ImageChoice<'a>> {
        let mut masks: BTreeMap<u32, Option<&'a Arc<AlphaMask>>> = BTreeMap::new();
        let mut users: BTreeMap<usize, BTreeSet<u32>> = BTreeMap::new();
        for (material, _, mask) in &self.used {
            masks.entry(*material).or_insert(*mask);
            users.entry(address(*mask)).or_default().insert(*material);
        }
        let choice = |(material, mask): (u32, Option<&'a Arc<AlphaMask>>)| {
            let of = &self.scene.materials[material.to_usize()];
            // Opacity and colour are one image, so a leaf with a mask of its own has no image to share.
            let choice = if users[&address(mask)].len() > 1 {
                ImageChoice::of(of, mask.map(|m| &**m))
            } else {
                ImageChoice::own(of)
            };
            (material, choice)
        };
        masks.into_par_iter().map(choice).collect()
    }

    /// Writes materials, textures, samplers and images.
    pub(super) fn write(&self, document: &mut Document, pack: &mut Pack) -> Result<()> {
        let choices = self.choices();
        let shared = self.shared(&choices);
        // Masks are sampled without filtering, as in this renderer.
        document.samplers = vec![sampler(NEAREST, NEAREST), sampler(LINEAR, LINEAR_MIPMAP_LINEAR)];
        let textures = self.draw(&choices, &shared, &mut Textures { document, pack })?;
        for (i, (material, tint, mask)) in self.used.iter().enumerate() {
            let (choice, dye) = (&choices[material], self.dye(&choices, *material, *tint));
            let key = color_key(&choice.swatch, i);
            let own = MaterialTextures {
                reflected: textures.reflected.get(&reflected_key(&choice.swatch, *mask)).copied(),
                transmitted: textures.transmitted.get(&key).copied(),
                relief: textures
                    .relief
                    .get(&choice.relief().relief_key)
                    .copied()
                    .filter(|_| choice.swatch.relief > 0.0),
            };
            document.materials.push(shared[&key].material(&choice.swatch, dye, own, mask.is_some(), i));
        }
        Ok(())
    }

    fn dye(&self, choices: &BTreeMap<u32, ImageChoice<'a>>, material: u32, tint: Vec3) -> Dye {
        choices[&material].swatch.dyed(self.scene.materials[material.to_usize()].tint_factors(tint))
    }

    /// Collects the images of colours with the tints of all their users.
    fn shared<'b>(&self, choices: &'b BTreeMap<u32, ImageChoice<'a>>) -> BTreeMap<ColorKey, SharedColors<'b>> {
        let mut shared: BTreeMap<ColorKey, SharedColors<'b>> = BTreeMap::new();
        for (i, (material, tint, _)) in self.used.iter().enumerate() {
            let (choice, dye) = (&choices[material], self.dye(choices, *material, *tint));
            let key = color_key(&choice.swatch, i);
            shared.entry(key).or_insert_with(|| SharedColors::new(&choice.swatch)).add_user(dye);
        }
        shared
    }

    /// Computes all images and adds them to the document in the order of the materials, not of addresses, which differ
    /// from run to run.
    fn draw<'b>(
        &self,
        choices: &'b BTreeMap<u32, ImageChoice<'a>>,
        shared: &BTreeMap<ColorKey, SharedColors<'b>>,
        textures: &mut Textures<'_>,
    ) -> Result<TextureIndices> {
        let mut colors: Ordered<ColorKey, &SharedColors<'b>> = Ordered::default();
        let mut reflected: Ordered<ReflectedKey, (ColorKey, Option<&AlphaMask>)> = Ordered::default();
        let mut reliefs: Ordered<usize, &Swatch<'a>> = Ordered::default();
        for (i, (material, _, mask)) in self.used.iter().enumerate() {
            let choice = &choices[material];
            let key = color_key(&choice.swatch, i);
            colors.add(key, || &shared[&key]);
            reflected.add(reflected_key(&choice.swatch, *mask), || (key, mask.map(|m| &**m)));
            if choice.swatch.relief > 0.0 {
                reliefs.add(choice.relief().relief_key, || choice.relief());
            }
        }
        let drawn: Vec<Option<Colors>> = colors.items.par_iter().map(|(_, of)| of.draw()).collect::<Result<_>>()?;
        let encode = |(_, (key, mask)): &(ReflectedKey, (ColorKey, Option<&AlphaMask>))| {
            images::reflected(drawn[colors.places[key]].as_ref(), *mask)
        };
        let encoded: Vec<Option<Vec<u8>>> = reflected.items.par_iter().map(encode).collect::<Result<_>>()?;
        let normals: Vec<Option<Vec<u8>>> =
            reliefs.items.par_iter().map(|(_, swatch)| images::relief(swatch)).collect::<Result<_>>()?;
        let mut indices = TextureIndices::default();
        for ((key, (_, mask)), bytes) in reflected.items.into_iter().zip(encoded) {
            let sampler = if mask.is_some() { UNFILTERED } else { FILTERED };
            indices.reflected.extend(bytes.map(|bytes| (key, textures.add(bytes, "reflected", sampler))));
        }
        for ((key, _), of) in colors.items.into_iter().zip(drawn) {
            let bytes = of.and_then(|of| of.transmitted);
            indices.transmitted.extend(bytes.map(|bytes| (key, textures.add(bytes, "transmitted", FILTERED))));
        }
        for ((key, _), bytes) in reliefs.items.into_iter().zip(normals) {
            indices.relief.extend(bytes.map(|bytes| (key, textures.add(bytes, "relief", FILTERED))));
        }
        Ok(indices)
    }
}

/// Distinct items in the order of their addition.
struct Ordered<K, V> {
    items: Vec<(K, V)>,
    places: BTreeMap<K, usize>,
}

impl<K, V> Default for Ordered<K, V> {
    fn default() -> Self {
        Self { items: Vec::new(), places: BTreeMap::new() }
    }
}

impl<K: Copy + Ord, V> Ordered<K, V> {
    /// Adds an item unless one with this key is there.
    fn add(&mut self, key: K, item: impl FnOnce() -> V) {
        let items = &mut self.items;
        self.places.entry(key).or_insert_with(|| {
            items.push((key, item()));
            items.len() - 1
        });
    }
}

/// Textures of a document under construction.
struct Textures<'a> {
    document: &'a mut Document,
    pack: &'a mut Pack,
}

impl Textures<'_> {
    /// Adds a PNG file as a texture and returns the texture's index.
    fn add(&mut self, bytes: Vec<u8>, what: &str, sampler: usize) -> usize {
        let document = &mut *self.document;
        document.images.push(Image {
            name: Some(format!("{what} {}", document.images.len())),
            mime_type: Some("image/png".into()),
            buffer_view: Some(self.pack.picture(bytes)),
            uri: None,
        });
        let source = Some(document.images.len() - 1);
        document.textures.push(Texture { sampler: Some(sampler), source, ..Texture::default() });
        document.textures.len() - 1
    }
}

/// Index of the texture of each image.
#[derive(Default)]
struct TextureIndices {
    reflected: BTreeMap<ReflectedKey, usize>,
    transmitted: BTreeMap<ColorKey, usize>,
    relief: BTreeMap<usize, usize>,
}

/// Indices of the textures of one material.
#[derive(Clone, Copy)]
struct MaterialTextures {
    reflected: Option<usize>,
    transmitted: Option<usize>,
    relief: Option<usize>,
}

fn sampler(near: u32, far: u32) -> Sampler {
    let edge = Some(CLAMP_TO_EDGE);
    Sampler { mag_filter: Some(near), min_filter: Some(far), wrap_s: edge, wrap_t: edge }
}

/// Returns the key of a material's colours. Plain materials do not share them: their colour is a factor.
fn color_key(swatch: &Swatch<'_>, number: usize) -> ColorKey {
    if swatch.size.is_some() { swatch.key } else { [0, number] }
}

fn reflected_key(swatch: &Swatch<'_>, mask: Option<&Arc<AlphaMask>>) -> ReflectedKey {
    (if swatch.size.is_some() { swatch.key } else { [0; 2] }, address(mask))
}

impl SharedColors<'_> {
    fn material(
        &self,
        swatch: &Swatch<'_>,
        dye: Dye,
        textures: MaterialTextures,
        masked: bool,
        number: usize,
    ) -> Material {
        let [reflected, transmitted] = [textures.reflected, textures.transmitted]
            .map(|t| t.map(|index| TextureInfo { index, ..TextureInfo::default() }));
        let factors = self.factors(dye);
        let [r, g, b] = factors.reflected.to_array();
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
            normal_texture: textures.relief.map(|index| NormalInfo {
                index,
                scale: Some(swatch.relief),
                ..NormalInfo::default()
            }),
            double_sided: true,
            extras: json!({ "nir_reflectance": mean.reflectance.0.w, "nir_transmittance": mean.transmittance.0.w }),
            ..Material::default()
        };
        if masked {
            material.alpha_mode = Some("MASK".into());
            material.alpha_cutoff = Some(0.5);
        }
        if factors.share > 0.0 {
            let of = DiffuseTransmission {
                diffuse_transmission_factor: factors.share,
                diffuse_transmission_color_factor: Some(factors.transmitted.to_array()),
                diffuse_transmission_color_texture: transmitted,
            };
            material.extensions.insert(DIFFUSE_TRANSMISSION.into(), json!(of));
        }
        material
    }
}
