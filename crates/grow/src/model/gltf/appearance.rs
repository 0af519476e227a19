//! Materials of glTF files: colours, pictures, opacity, and where their pictures lie.

use super::super::document::{
    CLAMP_TO_EDGE, DIFFUSE_TRANSMISSION, DiffuseTransmission, Document, MIRRORED_REPEAT, Material, REPEAT,
    SPECULAR_GLOSSINESS, SpecularGlossiness, TEXTURE_TRANSFORM, TRANSMISSION, TextureInfo, TextureTransform, item,
};
use super::super::files::Files;
use super::super::notes::Notes;
use super::super::settle::{ModelError, fraction, warn_of_color};
use super::super::uri::{Target, follow};
use super::accessors::Accessors;
use super::passed_over::warn_of_material;
use furrow_base::geometry::AlphaMask;
use furrow_base::math::{RoundTo, ToFloat, Vec2, vec2};
use furrow_optics::texture::{ColorSpace, Header, NormalMap, Texture, Wrap};
use furrow_optics::texture::{NormalTexture, Surface, Transmission};
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Surface of a material, and how to read the primitives that use it.
pub(super) struct Appearance {
    pub(super) surface: Surface,
    pub(super) slot: Slot,
    /// Wrap modes of the alpha mask's picture.
    pub(super) wrap: [Wrap; 2],
    /// Whether its alpha is below the threshold everywhere.
    pub(super) absent: bool,
}

impl Appearance {
    /// Returns whether the surface has any picture.
    pub(super) fn has_pictures(&self) -> bool {
        let Surface { picture, mask, relief, transmission, .. } = &self.surface;
        let passed = transmission.as_ref().is_some_and(|sheet| sheet.picture.is_some());
        picture.is_some() || mask.is_some() || relief.is_some() || passed
    }

    /// Makes the fraction `share` of the light transmitted instead of reflected.
    fn pass(&mut self, share: f32, color: [f32; 3], picture: Option<Arc<Texture>>) {
        if share > 0.0 {
            self.surface.color = self.surface.color.map(|c| c * (1.0 - share));
            self.surface.transmission = Some(Transmission { color: color.map(|c| c * share), picture });
        }
    }
}

/// Texture coordinates of a picture: the number of their set, and their transform.
#[derive(Clone, Default, PartialEq)]
pub(super) struct Slot {
    pub(super) set: usize,
    transform: Option<TextureTransform>,
}

impl Slot {
    fn of(set: usize, extensions: &Map<String, Value>) -> Result<Self, ModelError> {
        let transform: Option<TextureTransform> = extension(extensions, TEXTURE_TRANSFORM)?;
        let set = transform.as_ref().and_then(|t| t.tex_coord).unwrap_or(set);
        Ok(Self { set, transform: transform.map(|t| TextureTransform { tex_coord: None, ..t }) })
    }

    /// Transforms a texture coordinate.
    pub(super) fn transformed(&self, uv: Vec2) -> Vec2 {
        let Some(t) = &self.transform else { return uv };
        let scaled = uv * Vec2::from(t.scale.unwrap_or([1.0; 2]));
        let (sin, cos) = t.rotation.sin_cos();
        vec2(cos * scaled.x + sin * scaled.y, cos * scaled.y - sin * scaled.x) + Vec2::from(t.offset)
    }
}

/// Base colour of a material in either of its models.
struct Base<'a> {
    factor: [f32; 4],
    picture: Option<Cow<'a, TextureInfo>>,
    roughness: f32,
}

impl<'a> Base<'a> {
    fn of(material: &'a Material) -> Result<Self, ModelError> {
        if let Some(of) = extension::<SpecularGlossiness>(&material.extensions, SPECULAR_GLOSSINESS)? {
            return Ok(Self {
                factor: of.diffuse_factor.unwrap_or([1.0; 4]),
                picture: of.diffuse_texture.map(Cow::Owned),
                roughness: 1.0 - of.glossiness_factor.unwrap_or(1.0),
            });
        }
        let pbr = &material.pbr_metallic_roughness;
        Ok(Self {
            factor: pbr.base_color_factor.unwrap_or([1.0; 4]),
            picture: pbr.base_color_texture.as_ref().map(Cow::Borrowed),
            roughness: pbr.roughness_factor.unwrap_or(1.0),
        })
    }
}

/// A decoded picture.
#[derive(Clone)]
struct Pictured {
    /// Index of its image.
    image: usize,
    texture: Arc<Texture>,
}

/// Image, wrap modes in u and in v, and whether alpha is dropped.
type Key = (usize, [u32; 2], bool);

/// Reader of materials, which decodes each picture once.
pub(super) struct AppearanceReader<'a, 'f> {
    document: &'a Document,
    accessors: &'a Accessors<'a>,
    pub(super) files: Files<'f>,
    pub(super) notes: Notes,
    textures: BTreeMap<Key, Arc<Texture>>,
    normals: BTreeMap<Key, Arc<NormalMap>>,
    /// Alpha masks by image and threshold.
    masks: BTreeMap<(usize, u8), Option<Arc<AlphaMask>>>,
}

impl<'a, 'f> AppearanceReader<'a, 'f> {
    pub(super) fn new(document: &'a Document, accessors: &'a Accessors<'a>, files: Files<'f>, notes: Notes) -> Self {
        let (textures, normals, masks) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
        Self { document, accessors, files, notes, textures, normals, masks }
    }

    /// Reads the material with this index.
    pub(super) fn appearance(&mut self, index: usize, material: &Material) -> Result<Appearance, ModelError> {
        let name = material.name.clone().unwrap_or_else(|| format!("material {index}"));
        warn_of_material(material, &name, &mut self.notes);
        let cutoff = match material.alpha_mode.as_deref() {
            Some("MASK") => material.alpha_cutoff.unwrap_or(0.5),
            Some("BLEND") => 0.5,
            _ => 0.0,
        };
        let Base { factor: [r, g, b, opacity], picture: info, roughness } = Base::of(material)?;
        warn_of_color([r, g, b], &name, &mut self.notes);
        let base = [r, g, b].map(fraction);
        let mut slots = Slots::default();
        let slot = info.as_ref().map(|info| Slot::of(info.tex_coord, &info.extensions)).transpose()?;
        let picture = match info.filter(|_| slots.takes(slot.as_ref())) {
            Some(info) => {
                if cutoff <= 0.0 && self.has_holes(info.index)? {
                    let words = "the alpha mode OPAQUE shows transparent parts of the picture; MASK cuts them away";
                    self.notes.about(words, &name);
                }
                Some(self.texture(info.index, cutoff <= 0.0)?)
            }
            None => None,
        };
        let mut appearance = Appearance {
            surface: Surface {
                name,
                color: base,
                picture: picture.as_ref().map(|p| p.texture.clone()),
                roughness: Some(roughness.clamp(0.0, 1.0).powi(2)),
                nir: number(&material.extras, "nir_reflectance"),
                nir_transmission: number(&material.extras, "nir_transmittance"),
                ..Surface::default()
            },
            slot: Slot::default(),
            wrap: picture.as_ref().map_or([Wrap::Repeat; 2], |p| p.texture.wrap()),
            absent: false,
        };
        if cutoff > 0.0 {
            self.cut(&mut appearance, cutoff / fraction(opacity), picture.as_ref());
        }
        self.transmit(&mut appearance, material, base, &mut slots)?;
        self.raise(&mut appearance, material, &mut slots)?;
        appearance.slot = slots.0.unwrap_or_default();
        Ok(appearance)
    }

    /// Cuts a surface where the alpha of its picture is below `least`, 0 to 1.
    fn cut(&mut self, appearance: &mut Appearance, least: f32, picture: Option<&Pictured>) {
        // Smallest opaque alpha of a texel, 0 to 255.
        let least = (least * 255.0).ceil();
        appearance.absent = least > 255.0;
        if let (Some(Pictured { image, texture }), false) = (picture, appearance.absent) {
            let mask = || texture.alpha_mask_from(least.trunc_to::<u8>()).map(Arc::new);
            appearance.surface.mask.clone_from(self.masks.entry((*image, least.trunc_to::<u8>())).or_insert_with(mask));
        }
    }

    /// Reads the transmission of a thin sheet.
    fn transmit(
        &mut self,
        appearance: &mut Appearance,
        material: &Material,
        base: [f32; 3],
        slots: &mut Slots,
    ) -> Result<(), ModelError> {
        if let Some(of) = extension::<DiffuseTransmission>(&material.extensions, DIFFUSE_TRANSMISSION)? {
            let mut picture = None;
            if let Some(info) = &of.diffuse_transmission_color_texture {
                if slots.takes(Some(&Slot::of(info.tex_coord, &info.extensions)?)) {
                    picture = Some(self.texture(info.index, true)?.texture);
                } else {
                    self.other_coordinates("transmission", &appearance.surface.name);
                }
            }
            let color = of.diffuse_transmission_color_factor.unwrap_or([1.0; 3]);
            warn_of_color([of.diffuse_transmission_factor; 3], &appearance.surface.name, &mut self.notes);
            warn_of_color(color, &appearance.surface.name, &mut self.notes);
            appearance.pass(fraction(of.diffuse_transmission_factor), color.map(fraction), picture);
        } else if let Some(share) = material.extensions.get(TRANSMISSION) {
            let share = number(share, "transmissionFactor").unwrap_or(0.0);
            appearance.pass(share, base, appearance.surface.picture.clone());
        }
        Ok(())
    }

    /// Reads the normal map.
    fn raise(&mut self, appearance: &mut Appearance, material: &Material, slots: &mut Slots) -> Result<(), ModelError> {
        let Some(info) = &material.normal_texture else { return Ok(()) };
        if !slots.takes(Some(&Slot::of(info.tex_coord, &info.extensions)?)) {
            self.other_coordinates("normal", &appearance.surface.name);
            return Ok(());
        }
        let (image, wrap) = self.image(info.index)?;
        let key = (image, wrap, true);
        if !self.normals.contains_key(&key) {
            let picture = self.decode(key, ColorSpace::Linear)?;
            self.normals.insert(key, Arc::new(NormalMap::from_picture(&picture)));
        }
        let strength = info.scale.filter(|s| s.is_finite()).unwrap_or(1.0);
        appearance.surface.relief = Some(NormalTexture { normals: self.normals[&key].clone(), strength });
        Ok(())
    }

    fn other_coordinates(&mut self, what: &str, name: &str) {
        let words = format!("passed over: {what} maps with other texture coordinates than the colour");
        self.notes.about(words, name);
    }

    /// Returns a texture of colours; without its alpha if `opaque`.
    fn texture(&mut self, index: usize, opaque: bool) -> Result<Pictured, ModelError> {
        let (image, wrap) = self.image(index)?;
        let key = (image, wrap, opaque);
        if let Some(known) = self.textures.get(&key) {
            return Ok(Pictured { image, texture: known.clone() });
        }
        let texture = Arc::new(self.decode(key, ColorSpace::Srgb)?);
        self.textures.insert(key, texture.clone());
        Ok(Pictured { image, texture })
    }

    /// Returns whether a picture has texels that are more transparent than opaque.
    fn has_holes(&mut self, index: usize) -> Result<bool, ModelError> {
        let data = self.bytes(self.image(index)?.0)?.1;
        // Faults of the picture are reported when it is read.
        let texture = || Texture::decode(&data, ColorSpace::Srgb).ok();
        Ok(Header::of(&data).is_some_and(|header| header.may_have_alpha())
            && texture().is_some_and(|texture| texture.alpha_mask().is_some()))
    }

    /// Returns the index of a texture's image, and its wrap modes.
    fn image(&self, texture: usize) -> Result<(usize, [u32; 2]), ModelError> {
        let of = item(&self.document.textures, texture, "texture")?;
        let image = of.source.ok_or_else(|| {
            let names: Vec<&str> = of.extensions.keys().map(String::as_str).collect();
            let only = if names.is_empty() { String::new() } else { format!(", only that of {}", names.join(", ")) };
            ModelError {
                what: format!("texture {texture} has no PNG or JPEG image{only}"),
                help: "export its pictures as PNG or JPEG",
            }
        })?;
        let sampler = of.sampler.map(|s| item(&self.document.samplers, s, "sampler")).transpose()?;
        let code = |of: Option<u32>| of.unwrap_or(REPEAT);
        Ok((image, sampler.map_or([REPEAT; 2], |s| [code(s.wrap_s), code(s.wrap_t)])))
    }

    fn decode(&mut self, (image, wrap, opaque): Key, space: ColorSpace) -> Result<Texture, ModelError> {
        let (name, data) = self.bytes(image)?;
        let need = if space == ColorSpace::Srgb { Header::color } else { Header::normals };
        self.files.count(&name, &data, need)?;
        let decode = if opaque { Texture::decode_opaque } else { Texture::decode };
        let decoded = decode(&data, space).map_err(|what| format!("its picture {name}: {what}"))?;
        Ok(decoded.wrapped_by(wrap.map(|code| match code {
            CLAMP_TO_EDGE => Wrap::Clamp,
            MIRRORED_REPEAT => Wrap::Mirror,
            _ => Wrap::Repeat,
        })))
    }

    /// Returns the name of an image for messages, and the bytes of its file.
    fn bytes(&mut self, image: usize) -> Result<(String, Cow<'a, [u8]>), ModelError> {
        let source = item(&self.document.images, image, "image")?;
        let data: Cow<'a, [u8]> = match (&source.uri, source.buffer_view) {
            (Some(uri), _) => match follow(uri)? {
                Target::Bytes(data) => data.into(),
                Target::File(name) => self.files.named(&name)?.into(),
            },
            (None, Some(view)) => {
                let data = self.accessors.view(view)?;
                data.ok_or_else(|| format!("image {image} reaches past its bytes"))?.into()
            }
            (None, None) => return Err(format!("image {image} has no bytes").into()),
        };
        let name = source.uri.as_deref().filter(|u| !u.starts_with("data:")).or(source.name.as_deref());
        Ok((name.map_or_else(|| format!("image {image}"), |n| format!("`{n}`")), data))
    }
}

/// Texture coordinates that all pictures of a material share: those of its first picture.
#[derive(Default)]
struct Slots(Option<Slot>);

impl Slots {
    /// Returns whether a picture with this slot can be read.
    fn takes(&mut self, slot: Option<&Slot>) -> bool {
        slot.is_none_or(|slot| *self.0.get_or_insert_with(|| slot.clone()) == *slot)
    }
}

/// Reads the data of an extension, if the object has it.
fn extension<T: DeserializeOwned>(of: &Map<String, Value>, name: &str) -> Result<Option<T>, ModelError> {
    let read = |data: &Value| serde_json::from_value(data.clone()).map_err(|e| format!("{name} cannot be read: {e}"));
    Ok(of.get(name).map(read).transpose()?)
}

fn number(of: &Value, key: &str) -> Option<f32> {
    of.get(key).and_then(Value::as_f64).map(|x| fraction(x.to_f32()))
}
