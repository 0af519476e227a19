//! Reader of Wavefront OBJ files with their MTL files. The syntax is parsed by `tobj`.
//!
//! Material keywords: `Kd`, `map_Kd`, `d`, `map_d`, `Ns`. The alpha channel of a texture cuts the surface as `map_d`
//! does; `map_d` uses its alpha channel if it has one, else its brightness. v increases upwards in OBJ files and
//! downwards here.

use super::files::Files;
use super::parts::{MOST_TRIANGLES, Model, Part, Up};
use super::settle::{Wrong, faceted, fraction, into_one_tile, settle, too_many_triangles};
use furrow_base::geometry::{AlphaMask, Mesh};
use furrow_base::math::{Vec3, vec2};
use furrow_optics::texture::{ColorSpace, Header, Surface, Texture, Wrap};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// Options of `tobj`: each vertex has one position, normal and texture coordinate; polygons become triangle fans.
const OPTIONS: tobj::LoadOptions =
    tobj::LoadOptions { single_index: true, triangulate: true, ignore_points: true, ignore_lines: true };

/// Returns an error if a face refers to a vertex that does not exist: before the first one, counted backwards with a
/// negative index, or beyond any possible file size. `tobj` multiplies such an index before it checks the range.
fn check_corners(text: &[u8]) -> Result<(), String> {
    let kinds = ["v", "vt", "vn"];
    let mut counts = [0i64; 3];
    for (number, line) in text.split(|byte| *byte == b'\n').enumerate() {
        let line = String::from_utf8_lossy(line);
        let mut words = line.split_whitespace();
        let first = words.next().unwrap_or_default();
        if let Some(kind) = kinds.iter().position(|kind| *kind == first) {
            counts[kind] += 1;
        }
        if !["f", "l", "p"].contains(&first) {
            continue;
        }
        for corner in words {
            for (part, count) in corner.split('/').zip(counts) {
                // `tobj` reports text that is not a number.
                let Ok(index) = part.parse::<i64>() else { continue };
                if index == 0 || index < -count || index > i64::from(u32::MAX) {
                    return Err(format!("line {}: the corner `{corner}` refers to a missing element", number + 1));
                }
            }
        }
    }
    Ok(())
}

/// Returns an error if a material's colour has fewer than three numbers, which `tobj` does not check.
fn check_colors(text: &[u8]) -> Result<(), String> {
    for (number, line) in text.split(|byte| *byte == b'\n').enumerate() {
        let line = String::from_utf8_lossy(line);
        let mut words = line.split_whitespace();
        let first = words.next().unwrap_or_default();
        if ["Ka", "Kd", "Ks", "Ke"].contains(&first) && words.count() < 3 {
            return Err(format!("line {}: the colour {first} has fewer than three numbers", number + 1));
        }
    }
    Ok(())
}

/// Reads a model, or returns an error.
pub(super) fn read(mut files: Files<'_>, up: Up) -> Result<Model, Wrong> {
    let text = files.own()?;
    check_corners(&text)?;
    // `tobj` calls the material loader while it parses; the loader stores its error here.
    let asked: RefCell<(&mut Files<'_>, Option<Wrong>)> = RefCell::new((&mut files, None));
    let materials = |name: &Path| {
        let mut asked = asked.borrow_mut();
        let (files, fault) = &mut *asked;
        let name = slashed(&name.to_string_lossy());
        let read = files.named(&name).and_then(|t| {
            let wrong = |e: String| Wrong::from(format!("its materials {name}: {e}"));
            check_colors(&t).map_err(wrong)?;
            tobj::load_mtl_buf(&mut t.as_slice()).map_err(|e| wrong(e.to_string()))
        });
        read.map_err(|e| {
            *fault = Some(e);
            tobj::LoadError::ReadError
        })
    };
    let read = tobj::load_obj_buf(&mut text.as_slice(), &OPTIONS, materials);
    if let (_, Some(fault)) = asked.into_inner() {
        return Err(fault);
    }
    let (objects, materials) = read.map_err(|e| format!("it cannot be read: {e}"))?;
    let materials = materials.map_err(|e| format!("its materials cannot be read: {e}"))?;

    let mut pictures = Pictures { files, known: BTreeMap::new() };
    let mut model = Model::default();
    for material in &materials {
        model.surfaces.push(pictures.surface(material)?);
    }
    // For objects without a material.
    model.surfaces.push(Surface::default());
    let mut triangles = 0;
    for object in objects {
        let surface = object.mesh.material_id.unwrap_or(materials.len());
        let Some(look) = model.surfaces.get(surface) else {
            return Err(format!("`{}` has no such material", object.name).into());
        };
        if materials.get(surface).and_then(|m| m.dissolve).is_some_and(|d| d < 0.5) || object.mesh.indices.is_empty() {
            continue;
        }
        let name = object.name;
        let mut mesh = mesh(&object.mesh, &name)?;
        triangles += mesh.triangles.len();
        if triangles > MOST_TRIANGLES {
            return Err(too_many_triangles());
        }
        if look.mask.is_some() {
            into_one_tile(&mut mesh.uvs, &name)?;
        }
        settle(&mut mesh, &up.rotation(), &name)?;
        model.parts.push(Part { name, mesh, surface, label: None });
    }
    model.pictures = pictures.files.pictures;
    model.files = pictures.files.read;
    Ok(model)
}

fn mesh(of: &tobj::Mesh, name: &str) -> Result<Mesh, String> {
    let positions: Vec<Vec3> = of.positions.as_chunks::<3>().0.iter().map(|p| Vec3::from(*p)).collect();
    let corners = positions.len();
    if let Some(i) = of.indices.iter().find(|i| **i as usize >= corners) {
        return Err(format!("`{name}` refers to vertex {i}, but has {corners}"));
    }
    let uvs = of.texcoords.as_chunks::<2>().0;
    let normals = of.normals.as_chunks::<3>().0;
    let mut mesh = Mesh {
        uvs: if uvs.len() == corners {
            uvs.iter().map(|[u, v]| vec2(*u, 1.0 - v)).collect()
        } else {
            vec![vec2(0.0, 0.0); corners]
        },
        normals: normals.iter().map(|n| Vec3::from(*n)).collect(),
        positions,
        triangles: of.indices.as_chunks::<3>().0.to_vec(),
        weights: Vec::new(),
    };
    if mesh.normals.len() != corners {
        faceted(&mut mesh);
    }
    Ok(mesh)
}

/// Textures of the model, each decoded once.
struct Pictures<'a> {
    files: Files<'a>,
    known: BTreeMap<String, Arc<Texture>>,
}

impl Pictures<'_> {
    fn surface(&mut self, material: &tobj::Material) -> Result<Surface, Wrong> {
        let picture = material.diffuse_texture.as_deref().map(|name| self.picture(name)).transpose()?;
        let cut = material.dissolve_texture.as_deref().map(|name| self.picture(name)).transpose()?;
        let mask = match (&cut, &picture) {
            (Some(cut), _) => cut.alpha_mask().or_else(|| bright(cut)),
            (None, Some(picture)) => picture.alpha_mask(),
            (None, None) => None,
        };
        // Some writers leave the colour black if there is a texture.
        let color = match material.diffuse.unwrap_or([1.0; 3]).map(fraction) {
            [0.0, 0.0, 0.0] if picture.is_some() => [1.0; 3],
            color => color,
        };
        Ok(Surface {
            name: material.name.clone(),
            color,
            picture,
            mask: mask.map(Arc::new),
            // The Blinn–Phong exponent n corresponds to GGX α = √(2 / (n + 2)). Source: Walter et al. 2007.
            roughness: material.shininess.filter(|n| *n >= 0.0).map(|n| (2.0 / (n + 2.0)).sqrt()),
            ..Surface::default()
        })
    }

    fn picture(&mut self, name: &str) -> Result<Arc<Texture>, Wrong> {
        if let Some(known) = self.known.get(name) {
            return Ok(known.clone());
        }
        let data = self.files.named(&slashed(name))?;
        self.files.count(&format!("`{name}`"), &data, Header::color)?;
        let picture =
            Texture::decode(&data, ColorSpace::Srgb).map_err(|what| format!("its picture `{name}`: {what}"))?;
        let picture = Arc::new(picture.wrapped(Wrap::Repeat));
        self.known.insert(name.to_owned(), picture.clone());
        Ok(picture)
    }
}

/// Replaces backslashes in a path by slashes.
fn slashed(path: &str) -> String {
    path.replace('\\', "/")
}

/// Returns the mask where a grey texture is brighter than one half; `None` if it is so everywhere.
fn bright(picture: &Texture) -> Option<AlphaMask> {
    // Half of the byte's range, in linear light.
    let half = ColorSpace::Srgb.table()[127];
    let there = |x, y| picture.texel(x, y)[0] > half;
    let all = (0..picture.height()).all(|y| (0..picture.width()).all(|x| there(x, y)));
    (!all).then(|| AlphaMask::new(picture.width(), picture.height(), there))
}
