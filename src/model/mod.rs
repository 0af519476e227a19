//! Models from disk: glTF (`.glb`, `.gltf`) and Wavefront OBJ → meshes, what they look like, and their labels.
//!
//! What is read: triangles with normals and one set of texture coordinates; base colour and picture; opacity, cut at the
//! file's own threshold or ½; roughness; light that passes diffusely (`KHR_materials_diffuse_transmission`, or the thin sheets of
//! `KHR_materials_transmission`); glTF's normal maps. What is not: vertex colours, metal, skins, morphs, animations, cameras, lights.
//! A surface that the file calls one-sided is seen from both sides.
//!
//! Lengths are metres. Files say which axis points up only by custom: glTF has y up, and so have most OBJ files.
//! No optics here: near infrared and scattering are the materials' business.

pub mod document;
pub mod glb;
mod gltf;
mod obj;
mod uri;

use crate::geometry::{AlphaMask, Mesh};
use crate::input::{self, Refusal};
use crate::math::{DMat4, Vec2, Vec3};
use crate::texture::{NormalMap, Texture};
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Most triangles of one model.
const MOST_TRIANGLES: usize = 1 << 25;

/// Which of a file's axes points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Up {
    /// y up, z towards the viewer: glTF, and most OBJ files. The model's front (+z) then looks south.
    #[default]
    Y,
    /// z up: as in our world.
    Z,
}

impl Up {
    /// The rotation into our world: x east, y north, z up.
    fn rotation(self) -> DMat4 {
        match self {
            Self::Z => DMat4::IDENTITY,
            Self::Y => DMat4::from_cols_array(&[1., 0., 0., 0., 0., 0., 1., 0., 0., -1., 0., 0., 0., 0., 0., 1.]),
        }
    }
}

/// A model: its parts in the order of the file, z up, metres.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// Its pieces.
    pub parts: Vec<Part>,
    /// What they look like.
    pub surfaces: Vec<Surface>,
    /// Every file that was read: the model's own, its buffers, pictures and materials.
    pub files: Vec<PathBuf>,
}

/// A piece of a model.
#[derive(Clone, Debug)]
pub struct Part {
    /// Its name in the file.
    pub name: String,
    /// Its triangles.
    pub mesh: Mesh,
    /// Index into [`Model::surfaces`].
    pub surface: usize,
    /// Who it is, where the file says so.
    pub label: Option<Label>,
}

/// Who a part is, as the program writes it into the `extras` of a glTF node.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Label {
    /// Lower-case name of its class: soil, crop, weed.
    pub class: String,
    /// Number of its plant, from 1; 0 for none.
    #[serde(default)]
    pub plant: u16,
    /// Number of its leaf, from 1; 0 for none.
    #[serde(default)]
    pub leaf: u16,
}

/// What a piece looks like. Colours are linear R, G, B.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Its name in the file.
    pub name: String,
    /// Reflectance, times that of the picture.
    pub color: [f32; 3],
    /// Its picture.
    pub picture: Option<Arc<Texture>>,
    /// Where it is there at all; `None` for everywhere.
    pub mask: Option<Arc<AlphaMask>>,
    /// Its relief.
    pub relief: Option<Relief>,
    /// GGX roughness α, where the file says it.
    pub roughness: Option<f32>,
    /// What passes through, where the file says it.
    pub transmission: Option<Transmission>,
    /// Mean reflectance in near infrared, where the program wrote it.
    pub nir: Option<f32>,
    /// Transmittance in near infrared, likewise.
    pub nir_transmission: Option<f32>,
}

impl Default for Surface {
    fn default() -> Self {
        Self {
            name: String::new(),
            color: [1.0; 3],
            picture: None,
            mask: None,
            relief: None,
            roughness: None,
            transmission: None,
            nir: None,
            nir_transmission: None,
        }
    }
}

/// A relief too fine for the triangles.
#[derive(Clone, Debug)]
pub struct Relief {
    /// Its slopes.
    pub normals: Arc<NormalMap>,
    /// Factor on them.
    pub strength: f32,
}

/// Light that a sheet lets through.
#[derive(Clone, Debug)]
pub struct Transmission {
    /// Transmittance, times that of the picture.
    pub color: [f32; 3],
    /// Its picture.
    pub picture: Option<Arc<Texture>>,
}

impl Model {
    /// Reads a model. Formats are told by the name: `.glb`, `.gltf`, `.obj`. An [`Error`] about the file says what is wrong with it.
    pub fn load(path: &Path, up: Up) -> Result<Self> {
        let wrong = |Wrong { what, help }: Wrong| Error::input(what).help(help).in_file(path);
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let model = match extension.as_str() {
            "glb" | "gltf" => gltf::read(path, up).map_err(wrong)?,
            "obj" => obj::read(path, up).map_err(wrong)?,
            _ => {
                let help = "export it as glTF binary (.glb) from your program";
                return Err(Error::input("models are .glb, .gltf or .obj files").help(help).in_file(path));
            }
        };
        let triangles: usize = model.parts.iter().map(|p| p.mesh.triangles.len()).sum();
        if triangles == 0 {
            return Err(Error::input("it holds no triangles").in_file(path));
        }
        Ok(model)
    }
}

/// What is wrong with a file, in words.
struct Wrong {
    what: String,
    /// What to do; empty where a fresh export is all that helps.
    help: &'static str,
}

impl From<String> for Wrong {
    fn from(what: String) -> Self {
        Self { what, help: "" }
    }
}

/// What is wrong with a file of too many triangles.
fn too_many_triangles() -> Wrong {
    Wrong { what: format!("it has more than {MOST_TRIANGLES} triangles"), help: "reduce it in your program" }
}

/// A file's bytes, noted in `files`; in words why there are none.
fn bytes(path: &Path, files: &mut Vec<PathBuf>) -> Result<Vec<u8>, String> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let bytes = input::read(path, input::LARGEST).map_err(|refusal| match refusal {
        Refusal::Io(e) if e.kind() == std::io::ErrorKind::NotFound => {
            format!("it needs a file `{name}`, which is not there")
        }
        Refusal::Folder => format!("it needs a file `{name}`, which is a folder"),
        other => format!("{name}: {other}"),
    })?;
    files.push(path.into());
    Ok(bytes)
}

/// Held to 0..1; what is not a number is 0.
fn fraction(x: f32) -> f32 {
    if x > 0.0 { x.min(1.0) } else { 0.0 }
}

/// Brings a part into the model's frame and checks it; in words what is wrong.
fn settle(mesh: &mut Mesh, to: &DMat4, name: &str) -> Result<(), String> {
    // Exact: what the program exported comes back bit for bit.
    if *to != DMat4::IDENTITY {
        let mirrored = to.determinant() < 0.0;
        let normals = to.inverse().transpose();
        for p in &mut mesh.positions {
            *p = to.transform_point3(p.as_dvec3()).as_vec3();
        }
        for n in &mut mesh.normals {
            *n = normals.transform_vector3(n.as_dvec3()).as_vec3();
        }
        if mirrored {
            for t in &mut mesh.triangles {
                t.swap(1, 2);
            }
        }
    }
    if let Some(i) = mesh.positions.iter().position(|p| !p.is_finite()) {
        return Err(format!("corner {i} of `{name}` is not a finite number"));
    }
    let unit = |n: &Vec3| (n.length_squared() - 1.0).abs() <= 1e-3;
    if !mesh.normals.iter().all(unit) {
        for n in &mut mesh.normals {
            *n = n.normalize_or_zero();
        }
        // Scans hold corners without a normal.
        if !mesh.normals.iter().all(unit) {
            mesh.recompute_normals();
        }
    }
    mesh.fault().map_or(Ok(()), |fault| Err(format!("`{name}`: {fault}")))
}

/// A mesh without normals is faceted: every triangle gets corners of its own.
fn faceted(mesh: &mut Mesh) {
    let corners: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
    mesh.positions = corners.iter().map(|i| mesh.positions[*i as usize]).collect();
    mesh.uvs = corners.iter().map(|i| mesh.uvs[*i as usize]).collect();
    mesh.triangles = (0..corners.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    mesh.recompute_normals();
}

/// Moves the coordinates of a cut-out surface whose picture repeats into the one tile that its mask covers; in words where
/// they reach over several.
fn into_one_tile(uvs: &mut [Vec2], name: &str) -> Result<(), String> {
    let Some(low) = uvs.iter().copied().reduce(Vec2::min) else { return Ok(()) };
    let high = uvs.iter().copied().fold(low, Vec2::max);
    // A thousandth for writers that round.
    let tile = (low + 1e-3).floor();
    if (high - tile).max_element() > 1.001 {
        return Err(format!(
            "the texture coordinates of `{name}`, which a picture's opacity cuts, run from {:.2}, {:.2} to {:.2}, {:.2}: they must lie within one tile",
            low.x, low.y, high.x, high.y
        ));
    }
    if tile != Vec2::ZERO {
        for uv in uvs {
            *uv -= tile;
        }
    }
    Ok(())
}
