//! Contents of a glTF file that are not read: errors for required extensions, warnings for the rest.

use super::super::document::{
    DIFFUSE_TRANSMISSION, Document, LIGHTS, Material, SPECULAR_GLOSSINESS, TEXTURE_TRANSFORM, TRANSMISSION,
};
use super::super::notes::Notes;
use super::super::settle::ModelError;
use serde_json::Value;
use std::collections::BTreeSet;

/// Extensions that are read.
const READ: [&str; 6] = [
    DIFFUSE_TRANSMISSION,
    SPECULAR_GLOSSINESS,
    TEXTURE_TRANSFORM,
    TRANSMISSION,
    "KHR_mesh_quantization",
    // Its colour is read as a reflectance.
    "KHR_materials_unlit",
];
/// Extensions that change neither the shape nor the base colour. A file may require them.
const HARMLESS: [&str; 4] = [LIGHTS, "KHR_materials_ior", "KHR_materials_specular", "KHR_materials_volume"];
/// Extensions of textures and geometry beside which a file stores what a reader without them needs. Those files are
/// checked where the stored data is used.
const WITH_FALLBACK: [&str; 5] = [
    "KHR_texture_basisu",
    "EXT_texture_webp",
    "EXT_texture_avif",
    "KHR_draco_mesh_compression",
    "EXT_meshopt_compression",
];

/// Returns an error if the file requires an extension that is not read.
pub(super) fn check_required(document: &Document) -> Result<(), ModelError> {
    let known = |name: &&String| READ.contains(&name.as_str()) || HARMLESS.contains(&name.as_str());
    match document.extensions_required.iter().find(|name| !known(name)) {
        Some(name) => Err(ModelError {
            what: format!("it requires the extension {name}, which cannot be read"),
            help: "export it without compression and extensions",
        }),
        None => Ok(()),
    }
}

/// Warns of cameras, lights, animations, other scenes, and extensions.
pub(super) fn warn_of_contents(document: &Document, notes: &mut Notes) {
    let lights = document.extensions.get(LIGHTS).and_then(|of| of.get("lights")).and_then(Value::as_array);
    // An export of this program has the camera and the lights of its scene, which nobody expects in another one.
    let foreign = !document.asset.generator.as_ref().is_some_and(|name| name.starts_with("furrow "));
    let counts = [
        (document.cameras.len(), "camera", "cameras"),
        (lights.map_or(0, Vec::len), "light", "lights"),
        (document.animations.len(), "animation", "animations"),
        (document.scenes.len().saturating_sub(1), "other scene", "other scenes"),
    ];
    let counts = counts.iter().filter(|(n, ..)| *n > 0 && foreign);
    let words: Vec<String> = counts.map(|(n, one, more)| format!("{n} {}", if *n == 1 { one } else { more })).collect();
    if !words.is_empty() {
        notes.add(format!("passed over: {}", words.join(", ")));
    }
    for name in used(document) {
        if !READ.contains(&name) && !HARMLESS.contains(&name) && !WITH_FALLBACK.contains(&name) {
            notes.about("passed over: extensions of glTF", name);
        }
    }
}

/// Returns the names of the extensions that a file lists, and of those that its nodes, primitives and materials have without
/// being listed.
fn used(document: &Document) -> BTreeSet<&str> {
    let primitives = document.meshes.iter().flat_map(|mesh| &mesh.primitives).map(|primitive| &primitive.extensions);
    let nodes = document.nodes.iter().map(|node| &node.extensions);
    let materials = document.materials.iter().map(|material| &material.extensions);
    let objects = primitives.chain(nodes).chain(materials).flat_map(|extensions| extensions.keys());
    document.extensions_used.iter().chain(objects).map(String::as_str).collect()
}

/// Warns of what a material loses; `name` is its name.
pub(super) fn warn_of_material(material: &Material, name: &str, notes: &mut Notes) {
    let pbr = &material.pbr_metallic_roughness;
    if !material.extensions.contains_key(SPECULAR_GLOSSINESS) {
        if pbr.metallic_roughness_texture.is_some() {
            notes.about("passed over: pictures of metal and roughness", name);
        } else if pbr.metallic_factor.unwrap_or(1.0) > 0.0 {
            notes.about("passed over: metal, whose base colour becomes its reflectance", name);
        }
    }
    if material.emissive_factor.is_some_and(|light| light.iter().any(|l| *l > 0.0)) {
        notes.about("passed over: emitted light", name);
    }
    if let Some(mode) = material.alpha_mode.as_deref().filter(|mode| !["OPAQUE", "MASK", "BLEND"].contains(mode)) {
        notes.about(format!("the alpha mode {mode} is unknown and read as OPAQUE"), name);
    }
}
