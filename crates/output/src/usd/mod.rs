//! Export of a field as USD (OpenUSD, <https://openusd.org>), for Isaac Sim, Omniverse, Houdini, Blender and other
//! programs.
//!
//! | file | contents |
//! |---|---|
//! | `scene.usda` | the stage: camera, lights, and the other files as sublayers |
//! | `plants.usda` | `/field/plants/plant_12`: one component for each plant, with its parts as meshes |
//! | `ground.usda` | `/field/ground`: soil, stones, litter; `/field/objects`: models and what stands on the horizon |
//! | `materials.usda` | `/field/materials` |
//! | `textures/*.png` | colours with opacity, transmitted colours, normal maps |
//! | `textures/sky.exr` | radiance of the sky, unless it is uniform |
//!
//! The unit is the metre and z is up. Positions, normals and indices are bit-identical, and so is the first texture
//! coordinate; the second is 1 − v. Labels are `SemanticsLabelsAPI` of OpenUSD 24.11. With joints, a plant is a
//! `SkelRoot` (`skeleton`).
//!
//! All layers are text: no crate that this compiler builds writes the binary form. `usdcat -o` converts them.

mod material;
mod parts;
mod skeleton;
mod stage;
mod text;

use super::appearance::{Strength, Surfaces};
use super::{Export, unsupported, write_together};
use furrow_base::Result;
use furrow_field::Field;
use parts::Item;
use std::path::Path;
use text::{Text, quoted};

/// Layers that `scene.usda` names, the strongest first.
const LAYERS: [&str; 3] = ["plants.usda", "ground.usda", "materials.usda"];

/// Writes a field into `folder`. Leaves and stems with joints get skeletons. `scene.usda` is written last.
pub fn write(folder: &Path, field: &Field) -> Result<Export> {
    let (files, warnings) = encode(field)?;
    let paths = write_together(folder, |together| {
        files.iter().try_for_each(|(name, bytes)| together.add_unflushed(&folder.join(name), bytes))
    })?;
    Ok(Export { paths, warnings, amount: None })
}

/// Files of the export: path in the folder, and content.
type Files = Vec<(String, Vec<u8>)>;

/// Returns the files of a field, and warnings about the features that they cannot represent.
fn encode(field: &Field) -> Result<(Files, Vec<String>)> {
    let scene = &field.scene;
    let mut surfaces = Surfaces::new(scene, Strength::InImages);
    // Parts without triangles are omitted.
    let parts = scene.parts.iter().zip(&field.kinds).filter(|(part, _)| !part.mesh.triangles.is_empty());
    let items: Vec<Item<'_>> =
        parts.map(|(part, kind)| Item { part, kind: *kind, material: surfaces.add(part) }).collect();
    let appearance = surfaces.draw()?;
    let materials = material::scope(&appearance.surfaces, &appearance.images);
    let transmits = appearance.surfaces.iter().any(|surface| surface.factors.share > 0.0);
    let images = appearance.images.into_iter().enumerate();
    let mut files: Files = images.map(|(k, image)| (material::file(k, &image), image.bytes)).collect();
    for (name, prims) in LAYERS.into_iter().zip([parts::plants(field, &items), parts::others(field, &items), materials])
    {
        files.push((name.to_owned(), layer(field, &[], &prims)));
    }
    let mut prims = Text::at(1);
    stage::camera(scene, &mut prims);
    let sky = stage::lights(scene, &mut prims)?;
    files.extend(sky.map(|bytes| (stage::SKY.to_owned(), bytes)));
    files.push(("scene.usda".to_owned(), layer(field, &LAYERS, &prims)));
    Ok((files, warnings(field, transmits)))
}

/// Returns a layer with these prims below `/field`.
fn layer(field: &Field, below: &[&str], prims: &Text) -> Vec<u8> {
    let mut metadata = vec![
        "customLayerData = {".to_owned(),
        format!("    string creator = {}", quoted(concat!("furrow ", env!("CARGO_PKG_VERSION")))),
        format!("    string provenance = {}", quoted(&field.provenance())),
        "}".to_owned(),
        "defaultPrim = \"field\"".to_owned(),
        "metersPerUnit = 1".to_owned(),
        "upAxis = \"Z\"".to_owned(),
    ];
    if !below.is_empty() {
        let names: Vec<String> = below.iter().map(|name| format!("@./{name}@")).collect();
        metadata.push(format!("subLayers = [{}]", names.join(", ")));
    }
    let mut text = Text::layer(&metadata);
    text.open("Xform", "field", &["kind = \"assembly\"".into()]);
    text.append(prims);
    text.close();
    text.finish()
}

/// Returns warnings about features that the format cannot represent.
fn warnings(field: &Field, transmits: bool) -> Vec<String> {
    let scene = &field.scene;
    let mut warnings = Vec::new();
    let mut say = |is: bool, what: &str| {
        if is {
            warnings.push(what.to_owned());
        }
    };
    say(
        transmits,
        "UsdPreviewSurface has no transmission: no light passes through leaves; see furrow:transmittance of the materials",
    );
    say(
        !scene.camera.distortion().is_none(),
        "USD has no lens distortion: the camera becomes a pinhole; see its furrow:distortion",
    );
    say(scene.haze.is_some(), "the air becomes clear: haze has no counterpart in the file");
    warnings.extend(unsupported(&scene.lights));
    warnings
}
