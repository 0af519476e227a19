//! Reader of glTF 2.0 and GLB files.
//!
//! Files are not trusted: every index is checked, every byte range is compared with the available data, and every node
//! is visited once.

use super::document::{
    CLAMP_TO_EDGE, DIFFUSE_TRANSMISSION, DiffuseTransmission, Document, FLOAT, LIGHTS, Material, Primitive, REPEAT,
    TEXTURE_TRANSFORM, TextureInfo, TextureTransform, UNSIGNED_BYTE, UNSIGNED_INT, UNSIGNED_SHORT,
};
use super::files::Files;
use super::glb;
use super::parts::{Label, MOST_TRIANGLES, Model, Part, Up};
use super::settle::{Wrong, faceted, fraction, into_one_tile, settle, too_many_triangles};
use super::uri::{Target, follow};
use furrow_base::geometry::{AlphaMask, Mesh};
use furrow_base::math::{DMat4, DQuat, DVec3, Vec2, Vec3, vec2};
use furrow_optics::texture::{ColorSpace, Header, NormalMap, NormalTexture, Surface, Texture, Transmission, Wrap};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Extensions that a file may require: those that are supported, and those that can be ignored.
const KNOWN: [&str; 9] = [
    DIFFUSE_TRANSMISSION,
    LIGHTS,
    TEXTURE_TRANSFORM,
    "KHR_mesh_quantization",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_volume",
];

/// Reads a model, or returns an error.
pub(super) fn read(mut files: Files<'_>, up: Up) -> Result<Model, Wrong> {
    let file = files.own()?;
    let (json, own) = if glb::is_glb(&file) { glb::split(&file)? } else { (&file[..], None) };
    let document: Document = serde_json::from_slice(json).map_err(|e| format!("its JSON cannot be read: {e}"))?;
    if !document.asset.version.starts_with("2.") {
        return Err(format!("it is glTF \"{}\"; only glTF 2.0 can be read", document.asset.version).into());
    }
    if let Some(name) = document.extensions_required.iter().find(|e| !KNOWN.contains(&e.as_str())) {
        let what = format!("it requires the extension {name}, which cannot be read");
        return Err(Wrong { what, help: "export it without compression and extensions" });
    }
    let buffers = buffers(&document, own, &mut files)?;
    let mut reader = Reader {
        document: &document,
        buffers,
        files,
        textures: BTreeMap::new(),
        masks: BTreeMap::new(),
        normals: BTreeMap::new(),
    };
    let looks = document.materials.iter().map(|m| reader.look(m)).collect::<Result<Vec<_>, _>>()?;
    let mut model = Model { surfaces: looks.iter().map(|l| l.surface.clone()).collect(), ..Model::default() };
    // The last one is for primitives without a material.
    model.surfaces.push(Surface::default());
    reader.walk(up, &looks, &mut model)?;
    model.pictures = reader.files.pictures;
    model.files = reader.files.read;
    Ok(model)
}

/// Returns the bytes of all buffers.
fn buffers<'a>(document: &Document, own: Option<&'a [u8]>, files: &mut Files<'_>) -> Result<Vec<Cow<'a, [u8]>>, Wrong> {
    let mut all = Vec::new();
    for (i, buffer) in document.buffers.iter().enumerate() {
        let data: Cow<'a, [u8]> = match &buffer.uri {
            None => match own {
                Some(own) if i == 0 => own.into(),
                _ => return Err(format!("buffer {i} has no bytes").into()),
            },
            Some(uri) => match follow(uri)? {
                Target::Bytes(data) => data.into(),
                Target::File(name) => files.named(&name)?.into(),
            },
        };
        if data.len() < buffer.byte_length {
            return Err(format!("buffer {i} has {} of its {} bytes", data.len(), buffer.byte_length).into());
        }
        all.push(data);
    }
    Ok(all)
}

/// Surface of a material, and how to read the primitives that use it.
struct Look {
    surface: Surface,
    /// Number of the texture coordinate set.
    coordinates: usize,
    transform: Option<TextureTransform>,
    /// Whether its alpha mask belongs to a repeating texture.
    tiled_mask: bool,
    /// Whether its alpha is below the threshold everywhere.
    absent: bool,
}

struct Reader<'a> {
    document: &'a Document,
    buffers: Vec<Cow<'a, [u8]>>,
    files: Files<'a>,
    /// Textures by image and whether they repeat.
    textures: BTreeMap<(usize, bool), Arc<Texture>>,
    /// Normal maps by image and whether they repeat.
    normals: BTreeMap<(usize, bool), Arc<NormalMap>>,
    /// Alpha masks by image and threshold.
    masks: BTreeMap<(usize, u8), Option<Arc<AlphaMask>>>,
}

fn item<'a, T>(of: &'a [T], index: usize, what: &str) -> Result<&'a T, String> {
    of.get(index).ok_or_else(|| format!("{what} {index} is referenced, but there are {}", of.len()))
}

impl Reader<'_> {
    /// Visits the nodes of the scene, parents before children.
    fn walk(&mut self, up: Up, looks: &[Look], model: &mut Model) -> Result<(), Wrong> {
        let document = self.document;
        let shown = document.scene.or((!document.scenes.is_empty()).then_some(0));
        let roots = if let Some(scene) = shown {
            item(&document.scenes, scene, "scene")?.nodes.clone()
        } else {
            let mut child = vec![false; document.nodes.len()];
            for c in document.nodes.iter().flat_map(|n| &n.children).filter(|c| **c < document.nodes.len()) {
                child[*c] = true;
            }
            (0..child.len()).filter(|i| !child[*i]).collect()
        };
        let mut seen = vec![false; document.nodes.len()];
        let mut open: Vec<(usize, DMat4)> = roots.into_iter().rev().map(|node| (node, up.rotation())).collect();
        let mut triangles = 0;
        while let Some((index, above)) = open.pop() {
            let node = item(&document.nodes, index, "node")?;
            if std::mem::replace(&mut seen[index], true) {
                return Err(format!("node {index} has two parents").into());
            }
            let to = above * placement(node);
            open.extend(node.children.iter().rev().map(|child| (*child, to)));
            let Some(mesh) = node.mesh else { continue };
            let mesh = item(&document.meshes, mesh, "mesh")?;
            let label = label(&node.extras).or_else(|| label(&mesh.extras));
            let name = node.name.as_ref().or(mesh.name.as_ref()).cloned().unwrap_or_else(|| format!("node {index}"));
            for primitive in &mesh.primitives {
                let look = primitive.material.map(|m| item(looks, m, "material")).transpose()?;
                if look.is_some_and(|l| l.absent) {
                    continue;
                }
                let Some(mut mesh) = self.mesh(primitive, look, &name)? else { continue };
                triangles += mesh.triangles.len();
                if triangles > MOST_TRIANGLES {
                    return Err(too_many_triangles());
                }
                settle(&mut mesh, &to, &name)?;
                let surface = primitive.material.unwrap_or(looks.len());
                model.parts.push(Part { name: name.clone(), mesh, surface, label: label.clone() });
            }
        }
        Ok(())
    }

    /// Reads the mesh of one primitive; `None` for points and lines.
    fn mesh(&self, primitive: &Primitive, look: Option<&Look>, name: &str) -> Result<Option<Mesh>, Wrong> {
        let attribute = |what: &str| primitive.attributes.get(what).copied();
        let mode = primitive.mode.unwrap_or(4);
        if mode < 4 {
            return Ok(None);
        }
        let positions = attribute("POSITION").ok_or_else(|| format!("`{name}` has no positions"))?;
        let positions: Vec<Vec3> = self.elements::<3>(positions)?.into_iter().map(Vec3::from).collect();
        let coordinates = look.map_or(0, |l| l.coordinates);
        let mut uvs = match attribute(&format!("TEXCOORD_{coordinates}")) {
            Some(uvs) => self.elements::<2>(uvs)?.into_iter().map(Vec2::from).collect(),
            None => vec![Vec2::ZERO; positions.len()],
        };
        if let Some(transform) = look.and_then(|l| l.transform.as_ref()) {
            for uv in &mut uvs {
                *uv = transformed(transform, *uv);
            }
        }
        if look.is_some_and(|l| l.tiled_mask) {
            into_one_tile(&mut uvs, name)?;
        }
        let corners = match primitive.indices {
            Some(indices) => self.indices(indices)?,
            None => (0..positions.len() as u32).collect(),
        };
        if let Some(i) = corners.iter().find(|i| **i as usize >= positions.len()) {
            return Err(format!("`{name}` refers to vertex {i}, but has {}", positions.len()).into());
        }
        if uvs.len() != positions.len() {
            return Err(
                format!("`{name}` has {} vertices and {} texture coordinates", positions.len(), uvs.len()).into()
            );
        }
        let triangles = match mode {
            4 => corners.as_chunks::<3>().0.to_vec(),
            5 => corners
                .windows(3)
                .enumerate()
                .map(|(i, t)| if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[0], t[2], t[1]] })
                .collect(),
            6 => (2..corners.len()).map(|i| [corners[i - 1], corners[i], corners[0]]).collect(),
            _ => return Err(format!("`{name}` has the unknown primitive mode {mode}").into()),
        };
        let mut mesh = Mesh { positions, uvs, triangles, ..Mesh::default() };
        match attribute("NORMAL") {
            Some(normals) => {
                mesh.normals = self.elements::<3>(normals)?.into_iter().map(Vec3::from).collect();
                if mesh.normals.len() != mesh.positions.len() {
                    let (n, p) = (mesh.normals.len(), mesh.positions.len());
                    return Err(format!("`{name}` has {p} vertices and {n} normals").into());
                }
            }
            None => faceted(&mut mesh),
        }
        Ok(Some(mesh))
    }

    /// Returns the bytes of each element of an accessor, its component type, and whether it is normalised.
    fn span(&self, index: usize, components: usize) -> Result<(impl Iterator<Item = &[u8]>, u32, bool), Wrong> {
        let accessor = item(&self.document.accessors, index, "accessor")?;
        let words = |what: &str| format!("accessor {index} {what}");
        let kind = ["", "SCALAR", "VEC2", "VEC3"][components];
        if accessor.kind != kind {
            return Err(words(&format!("holds {} where {kind} is needed", accessor.kind)).into());
        }
        if !accessor.sparse.is_null() {
            return Err(Wrong {
                what: words("is sparse, which cannot be read"),
                help: "export it without sparse accessors",
            });
        }
        let size = components
            * match accessor.component_type {
                5120 | UNSIGNED_BYTE => 1,
                5122 | UNSIGNED_SHORT => 2,
                UNSIGNED_INT | FLOAT => 4,
                other => return Err(words(&format!("has the unknown component type {other}")).into()),
            };
        let view = accessor.buffer_view.ok_or_else(|| words("has no bytes"))?;
        let view = item(&self.document.buffer_views, view, "buffer view")?;
        let buffer = item(&self.buffers, view.buffer, "buffer")?;
        let past = || words("reaches past its bytes");
        let end = view.byte_offset.checked_add(view.byte_length).ok_or_else(past)?;
        let data = buffer.get(view.byte_offset..end).and_then(|d| d.get(accessor.byte_offset..)).ok_or_else(past)?;
        let stride = view.byte_stride.unwrap_or(size);
        if stride < size {
            return Err(words(&format!("has elements of {size} bytes every {stride} bytes")).into());
        }
        let needed = match accessor.count {
            0 => Some(0),
            n => (n - 1).checked_mul(stride).and_then(|b| b.checked_add(size)),
        };
        if needed.is_none_or(|n| n > data.len()) {
            return Err(past().into());
        }
        let element = move |i: usize| &data[i * stride..i * stride + size];
        Ok(((0..accessor.count).map(element), accessor.component_type, accessor.normalized))
    }

    fn elements<const N: usize>(&self, index: usize) -> Result<Vec<[f32; N]>, Wrong> {
        let (elements, kind, normalized) = self.span(index, N)?;
        let one = |whole: f32, most: f32| if normalized { (whole / most).max(-1.0) } else { whole };
        let component = |e: &[u8], i: usize| match kind {
            5120 => one(f32::from(e[i].cast_signed()), 127.0),
            UNSIGNED_BYTE => one(f32::from(e[i]), 255.0),
            5122 => one(f32::from(i16::from_le_bytes([e[2 * i], e[2 * i + 1]])), 32767.0),
            UNSIGNED_SHORT => one(f32::from(u16::from_le_bytes([e[2 * i], e[2 * i + 1]])), 65535.0),
            UNSIGNED_INT => word(e, i) as f32,
            _ => f32::from_bits(word(e, i)),
        };
        Ok(elements.map(|e| std::array::from_fn(|i| component(e, i))).collect())
    }

    fn indices(&self, index: usize) -> Result<Vec<u32>, Wrong> {
        let (elements, kind, _) = self.span(index, 1)?;
        Ok(match kind {
            UNSIGNED_BYTE => elements.map(|e| u32::from(e[0])).collect(),
            UNSIGNED_SHORT => elements.map(|e| u32::from(u16::from_le_bytes([e[0], e[1]]))).collect(),
            UNSIGNED_INT => elements.map(|e| word(e, 0)).collect(),
            _ => return Err(format!("accessor {index} holds indices that are not integers").into()),
        })
    }

    fn look(&mut self, material: &Material) -> Result<Look, Wrong> {
        let name = material.name.clone().unwrap_or_default();
        let pbr = &material.pbr_metallic_roughness;
        let [r, g, b, opacity] = pbr.base_color_factor.unwrap_or([1.0; 4]);
        let base = [r, g, b].map(fraction);
        let info = pbr.base_color_texture.as_ref();
        let picture = info.map(|i| self.texture(i)).transpose()?;
        let transform = info.and_then(transform);
        let mut look = Look {
            surface: Surface {
                name,
                color: base,
                picture: picture.as_ref().map(|(_, picture, _)| picture.clone()),
                roughness: Some(pbr.roughness_factor.unwrap_or(1.0).clamp(0.0, 1.0).powi(2)),
                nir: number(&material.extras, "nir_reflectance"),
                nir_transmission: number(&material.extras, "nir_transmittance"),
                ..Surface::default()
            },
            coordinates: transform.as_ref().and_then(|t| t.tex_coord).or(info.map(|i| i.tex_coord)).unwrap_or(0),
            transform,
            tiled_mask: false,
            absent: false,
        };
        if let Some(info) = &material.normal_texture {
            let (image, repeats) = self.image(info.index)?;
            if !self.normals.contains_key(&(image, repeats)) {
                let picture = self.decode(image, repeats, ColorSpace::Linear)?;
                self.normals.insert((image, repeats), Arc::new(NormalMap::from_picture(&picture)));
            }
            let strength = info.scale.filter(|s| s.is_finite()).unwrap_or(1.0);
            look.surface.relief = Some(NormalTexture { normals: self.normals[&(image, repeats)].clone(), strength });
        }
        let cutoff = match material.alpha_mode.as_deref() {
            Some("MASK") => material.alpha_cutoff.unwrap_or(0.5),
            Some("BLEND") => 0.5,
            _ => 0.0,
        };
        if cutoff > 0.0 {
            // Smallest opaque alpha of a texel, 0 to 255.
            let least = (cutoff / fraction(opacity) * 255.0).ceil();
            look.absent = least > 255.0;
            if let (Some((image, texture, repeats)), false) = (&picture, look.absent) {
                let mask = || texture.alpha_mask_from(least as u8).map(Arc::new);
                look.surface.mask.clone_from(self.masks.entry((*image, least as u8)).or_insert_with(mask));
                look.tiled_mask = *repeats && look.surface.mask.is_some();
            }
        }
        if let Some(of) = material.extensions.get(DIFFUSE_TRANSMISSION) {
            let of: DiffuseTransmission = serde_json::from_value(of.clone())
                .map_err(|e| format!("{DIFFUSE_TRANSMISSION} of a material cannot be read: {e}"))?;
            let share = fraction(of.diffuse_transmission_factor);
            let color = of.diffuse_transmission_color_factor.unwrap_or([1.0; 3]);
            let picture = of.diffuse_transmission_color_texture.as_ref().map(|i| self.texture(i)).transpose()?;
            look.pass(share, color.map(fraction), picture.map(|(_, picture, _)| picture));
        } else if let Some(share) = material.extensions.get("KHR_materials_transmission") {
            let share = number(share, "transmissionFactor").unwrap_or(0.0);
            look.pass(share, base, look.surface.picture.clone());
        }
        Ok(look)
    }

    /// Returns the index of the image, the texture, and whether it repeats.
    fn texture(&mut self, info: &TextureInfo) -> Result<(usize, Arc<Texture>, bool), Wrong> {
        let (image, repeats) = self.image(info.index)?;
        if let Some(known) = self.textures.get(&(image, repeats)) {
            return Ok((image, known.clone(), repeats));
        }
        let decoded = Arc::new(self.decode(image, repeats, ColorSpace::Srgb)?);
        self.textures.insert((image, repeats), decoded.clone());
        Ok((image, decoded, repeats))
    }

    /// Returns the index of a texture's image, and whether the texture repeats.
    fn image(&self, texture: usize) -> Result<(usize, bool), Wrong> {
        let of = item(&self.document.textures, texture, "texture")?;
        let image = of.source.ok_or_else(|| Wrong {
            what: format!("texture {texture} has no PNG or JPEG image"),
            help: "export its pictures as PNG or JPEG",
        })?;
        let sampler = of.sampler.map(|s| item(&self.document.samplers, s, "sampler")).transpose()?;
        let wraps = |code: Option<u32>| code.unwrap_or(REPEAT) != CLAMP_TO_EDGE;
        Ok((image, sampler.is_none_or(|s| wraps(s.wrap_s) || wraps(s.wrap_t))))
    }

    fn decode(&mut self, image: usize, repeats: bool, space: ColorSpace) -> Result<Texture, Wrong> {
        let source = item(&self.document.images, image, "image")?;
        let data: Cow<'_, [u8]> = match (&source.uri, source.buffer_view) {
            (Some(uri), _) => match follow(uri)? {
                Target::Bytes(data) => data.into(),
                Target::File(name) => self.files.named(&name)?.into(),
            },
            (None, Some(view)) => {
                let view = item(&self.document.buffer_views, view, "buffer view")?;
                let end = view.byte_offset.checked_add(view.byte_length);
                let buffer = item(&self.buffers, view.buffer, "buffer")?;
                let data = end.and_then(|end| buffer.get(view.byte_offset..end));
                data.ok_or_else(|| format!("image {image} reaches past its bytes"))?.into()
            }
            (None, None) => return Err(format!("image {image} has no bytes").into()),
        };
        let name = source.uri.as_deref().filter(|u| !u.starts_with("data:")).or(source.name.as_deref());
        let name = name.map_or_else(|| format!("image {image}"), |n| format!("`{n}`"));
        let need = if space == ColorSpace::Srgb { Header::color } else { Header::normals };
        self.files.count(&name, &data, need)?;
        let decoded = Texture::decode(&data, space).map_err(|what| format!("its picture {name}: {what}"))?;
        Ok(decoded.wrapped(if repeats { Wrap::Repeat } else { Wrap::Clamp }))
    }
}

impl Look {
    /// Makes the fraction `share` of the light transmitted instead of reflected.
    fn pass(&mut self, share: f32, color: [f32; 3], picture: Option<Arc<Texture>>) {
        if share > 0.0 {
            self.surface.color = self.surface.color.map(|c| c * (1.0 - share));
            self.surface.transmission = Some(Transmission { color: color.map(|c| c * share), picture });
        }
    }
}

fn word(bytes: &[u8], i: usize) -> u32 {
    u32::from_le_bytes([bytes[4 * i], bytes[4 * i + 1], bytes[4 * i + 2], bytes[4 * i + 3]])
}

fn number(of: &serde_json::Value, key: &str) -> Option<f32> {
    of.get(key).and_then(serde_json::Value::as_f64).map(|x| fraction(x as f32))
}

fn label(extras: &serde_json::Value) -> Option<Label> {
    serde_json::from_value(extras.clone()).ok()
}

fn transform(info: &TextureInfo) -> Option<TextureTransform> {
    info.extensions.get(TEXTURE_TRANSFORM).and_then(|t| serde_json::from_value(t.clone()).ok())
}

fn transformed(t: &TextureTransform, uv: Vec2) -> Vec2 {
    let scaled = uv * Vec2::from(t.scale.unwrap_or([1.0; 2]));
    let (sin, cos) = t.rotation.sin_cos();
    vec2(cos * scaled.x + sin * scaled.y, cos * scaled.y - sin * scaled.x) + Vec2::from(t.offset)
}

fn placement(node: &super::document::Node) -> DMat4 {
    if let Some(matrix) = &node.matrix {
        return DMat4::from_cols_array(matrix);
    }
    let scale = node.scale.map_or(DVec3::ONE, DVec3::from);
    // A zero quaternion is treated as the identity.
    let rotation = node.rotation.map_or(DQuat::IDENTITY, DQuat::from_array);
    let rotation = if rotation.length_squared() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY };
    let translation = node.translation.map_or(DVec3::ZERO, DVec3::from);
    DMat4::from_scale_rotation_translation(scale, rotation, translation)
}
