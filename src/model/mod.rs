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
mod files;
pub mod glb;
mod gltf;
mod obj;
mod parts;
mod settle;
mod uri;

pub use parts::{Label, Model, NormalTexture, Part, Surface, Transmission, Up};

use crate::input::Scope;
use crate::texture::Allowance;
use crate::{Error, Result};
use files::Files;
use settle::Wrong;
use std::path::Path;

impl Model {
    /// Reads a model. Formats are told by the name: `.glb`, `.gltf`, `.obj`. An [`Error`] about the file says what is wrong with it.
    /// The files that it names must lie in its folder or below.
    pub fn load(path: &Path, up: Up) -> Result<Self> {
        Self::load_within(path, up, None, Allowance::UNLIMITED)
    }

    /// The same of a model whose files may lie in this scope instead of its folder, and whose pictures may take so much memory: they are
    /// refused before they are decoded.
    pub fn load_within(path: &Path, up: Up, lifted: Option<&Scope>, allowance: Allowance) -> Result<Self> {
        let wrong = |Wrong { what, help }: Wrong| Error::input(what).help(help).in_file(path);
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let files = Files::of(path, lifted, allowance);
        let model = match extension.as_str() {
            "glb" | "gltf" => gltf::read(files, up).map_err(wrong)?,
            "obj" => obj::read(files, up).map_err(wrong)?,
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
