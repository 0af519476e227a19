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

mod layer;
mod material;
mod parts;
mod skeleton;
mod stage;
mod text;

use super::appearance::{Appearance, Strength, Surfaces};
use super::{Export, unsupported, write_together};
use furrow_base::Result;
use furrow_field::Field;
use layer::Layer;
use parts::Item;
use std::path::Path;
use text::{Text, quoted};

/// Layers that `scene.usda` names, the strongest first.
const LAYERS: [&str; 3] = ["plants.usda", "ground.usda", "materials.usda"];

/// Writes a field into `folder`. Leaves and stems with joints get skeletons. `scene.usda` is written last.
pub fn write(folder: &Path, field: &Field) -> Result<Export> {
    let scene = &field.scene;
    let mut surfaces = Surfaces::new(scene, Strength::InImages);
    // Parts without triangles are omitted.
    let parts = scene.parts.iter().zip(&field.kinds).filter(|(part, _)| !part.mesh.triangles.is_empty());
    let items: Vec<Item<'_>> =
        parts.map(|(part, kind)| Item { part, kind: *kind, material: surfaces.add(part) }).collect();
    let Appearance { images, surfaces } = surfaces.draw()?;
    let mut stage = Text::at(1);
    stage::camera(scene, &mut stage);
    let sky = stage::lights(scene, &mut stage)?;
    let paths = write_together(folder, |together| {
        for (k, image) in images.iter().enumerate() {
            together.add_unflushed(&folder.join(material::file(k, image)), &image.bytes)?;
        }
        if let Some(sky) = &sky {
            together.add_unflushed(&folder.join(stage::SKY), sky)?;
        }
        let [plants, ground, materials] = LAYERS;
        let mut add = |name, layers: &[&str], prims: &dyn Fn(&mut Layer<'_>) -> Result<()>| {
            let path = folder.join(name);
            together.add_streamed(&path, |out| write_layer(field, layers, &mut Layer { out, path: &path }, prims))
        };
        add(plants, &[], &|layer| parts::plants(field, &items, layer))?;
        add(ground, &[], &|layer| parts::others(field, &items, layer))?;
        add(materials, &[], &|layer| layer.add(&material::scope(&surfaces, &images)))?;
        add("scene.usda", &LAYERS, &|layer| layer.add(&stage))
    })?;
    let transmits = surfaces.iter().any(|surface| surface.factors.share > 0.0);
    Ok(Export { paths, warnings: warnings(field, transmits), amount: None })
}

/// Writes a layer with these prims below `/field`.
fn write_layer(
    field: &Field,
    below: &[&str],
    layer: &mut Layer<'_>,
    prims: &dyn Fn(&mut Layer<'_>) -> Result<()>,
) -> Result<()> {
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
    let mut head = Text::layer(&metadata);
    head.open("Xform", "field", &["kind = \"assembly\"".into()]);
    layer.add(&head)?;
    prims(layer)?;
    layer.add(&Text::end(0))
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
