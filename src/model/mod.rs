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
mod parts;
mod settle;
mod uri;

pub use parts::{Label, Model, NormalTexture, Part, Surface, Transmission, Up};

use crate::{Error, Result};
use settle::Wrong;
use std::path::Path;

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
