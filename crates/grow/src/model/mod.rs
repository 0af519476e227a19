//! Models from glTF (`.glb`, `.gltf`) and Wavefront OBJ files: meshes, surfaces and labels.
//!
//! Supported: triangles and polygons with normals and one set of texture coordinates; base colour and texture; alpha,
//! cut at the file's threshold or at ½; roughness; diffuse transmission (`KHR_materials_diffuse_transmission`, or the
//! thin sheets of `KHR_materials_transmission`); glTF normal maps; morph targets and skins in their pose at rest. What
//! else a file contains is named in [`Model::warnings`]. One-sided surfaces are rendered from both sides.
//! `docs/reference/foreign-models.md` lists every feature.
//!
//! Lengths are metres. The up axis of a file is only a convention: y in glTF and in most OBJ files. This module
//! contains no optics: near infrared and scattering are defined by the materials.

pub mod document;
mod files;
mod gather;
pub mod glb;
mod gltf;
mod notes;
mod obj;
mod parts;
mod settle;
#[cfg(test)]
mod tests;
mod uri;

pub use parts::{Label, Model, ModelPart, Up};

use files::Files;
use furrow_base::input::{self, Scope};
use furrow_base::{Error, Result};
use furrow_optics::texture::MemoryLimit;
use settle::ModelError;
use std::path::Path;

impl Model {
    /// Reads a model. The file extension selects the format: `.glb`, `.gltf`, `.obj`. An [`Error`] states what is wrong
    /// with the file. Files that the model refers to must be in its folder or below.
    pub fn load(path: &Path, up: Up) -> Result<Self> {
        Self::load_within(path, up, None, MemoryLimit::UNLIMITED)
    }

    /// Reads a model whose files may also be in the scope `lifted` instead of its folder. Textures that exceed the
    /// memory `allowance` are refused before they are decoded.
    pub fn load_within(path: &Path, up: Up, lifted: Option<&Scope>, allowance: MemoryLimit) -> Result<Self> {
        let wrong = |ModelError { what, help }: ModelError| Error::input(what).help(help).in_file(path);
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let files = Files::of(path, lifted, allowance);
        let model = match extension.as_str() {
            "glb" | "gltf" => input::guarded(path, || gltf::read(files, up).map_err(wrong))?,
            "obj" => input::guarded(path, || obj::read(files, up).map_err(wrong))?,
            _ => {
                let help = "export it as glTF binary (.glb) from your program";
                return Err(Error::input("models are .glb, .gltf or .obj files").help(help).in_file(path));
            }
        };
        let triangles: usize = model.parts.iter().map(|p| p.mesh.triangles.len()).sum();
        if triangles == 0 {
            let why: String = model.warnings.iter().flat_map(|what| ["; ", what]).collect();
            return Err(Error::input(format!("it holds no triangles{why}")).in_file(path));
        }
        Ok(model)
    }
}
