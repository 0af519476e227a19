//! Export of a scene as glTF 2.0 in one GLB file, for Blender, for viewers, and for scene files that place it again.
//!
//! Each part becomes one node and mesh, in scene order. Its name is its label, which is also in its `extras` as class,
//! plant and leaf. Leaves and stems with joints have skins (`skins`). Positions, normals, texture coordinates and
//! indices are bit-identical; a node above all others converts z up to the format's y up. Opacity is 0 or 255, cut at ½
//! and read without filtering, so masks are bit-identical too.
//!
//! A leaf reflects R and transmits T in every band. `KHR_materials_diffuse_transmission` mixes both by one factor f:
//! base colour R / (1 − f), transmitted colour T / f. f is the largest T of the leaf, so that no colour exceeds one.
//! Programs without the extension show leaves brighter by 1 / (1 − f), which replaces the light that they cannot
//! transmit.
//!
//! glTF has no sky, no area lamps, no near infrared and no lens distortion, as [`write()`] warns; near infrared and
//! lens parameters are stored in `extras`. Radiance is converted to photometric units with 683 lm/W and the width of
//! the luminous efficiency curve.
//!
//! The document is built here, because the crate `gltf` reads documents but does not write them (tests read these with
//! it).

mod materials;
mod pack;
mod skins;

use super::appearance::{Strength, Surfaces};
use super::{Export, unsupported, write_atomically};
use furrow_base::math::{Spectrum, Vec3};
use furrow_base::{Error, Result};
use furrow_field::PlantRecord;
use furrow_grow::model::document::{
    Asset, Camera, DIFFUSE_TRANSMISSION, Document, LIGHTS, Mesh, Node, Perspective, Primitive, Scene as GltfScene,
};
use furrow_grow::model::{Label, glb};
use furrow_optics::light::Form;
use furrow_optics::sensor::{Lens, OpenCv};
use furrow_render::scene::tag::Tag;
use furrow_render::scene::{Part, Scene};
use pack::Pack;
use serde_json::{Map, Value, json};
use skins::Skins;
use std::path::Path;

/// Rotation from z up to the format's y up: x stays, z becomes y. Its elements are integers, so multiplying it with its
/// inverse is exact.
const Z_UP_TO_Y_UP: [f64; 16] = [1., 0., 0., 0., 0., 0., -1., 0., 0., 1., 0., 0., 0., 0., 0., 1.];

/// Lumens per W·nm⁻¹ of light with a flat spectrum: 683 lm/W times ∫V(λ) dλ = 106.857 nm. Source: CIE 1924.
pub(crate) const LUMENS: f64 = 683.0 * 106.857;

/// Near clipping distance for other programs, metres.
pub(crate) const NEAR: f64 = 0.01;

/// Writes `scene.glb` into `folder`; `provenance` states the source of the scene. Leaves and stems of `plants` with
/// joints get skins.
pub fn write(folder: &Path, scene: &Scene, plants: &[PlantRecord], provenance: &str) -> Result<Export> {
    let (bytes, warnings) = encode(scene, plants, provenance)?;
    let path = folder.join("scene.glb");
    write_atomically(&path, &bytes)?;
    Ok(Export { paths: vec![path], warnings, amount: None })
}

/// Returns the GLB file of a scene, and warnings about the features that it cannot represent.
pub fn encode(scene: &Scene, plants: &[PlantRecord], provenance: &str) -> Result<(Vec<u8>, Vec<String>)> {
    let mut pack = Pack::default();
    let mut skins = Skins::new(plants);
    // Children of the root node.
    let mut top = Vec::new();
    let mut surfaces = Surfaces::new(scene, Strength::OfSurfaces);
    let mut document = Document {
        asset: Asset {
            version: "2.0".into(),
            generator: Some(format!("furrow {}", env!("CARGO_PKG_VERSION"))),
            extras: json!({ "provenance": provenance }),
            ..Asset::default()
        },
        scene: Some(0),
        scenes: vec![GltfScene { name: Some("field".into()), nodes: vec![0] }],
        nodes: vec![Node { name: Some("field".into()), matrix: Some(Z_UP_TO_Y_UP), ..Node::default() }],
        ..Document::default()
    };
    // Parts without triangles are omitted.
    for part in scene.parts.iter().filter(|p| !p.mesh.triangles.is_empty()) {
        let material = surfaces.add(part);
        document.meshes.push(mesh(part, material, &mut pack));
        let mesh = document.meshes.len() - 1;
        let extras = document.meshes[mesh].extras.clone();
        let name = document.meshes[mesh].name.clone();
        let weighted = !part.mesh.weights.is_empty();
        let skin = if weighted { skins.of(part.tag, self::name, &mut document, &mut pack, &mut top) } else { None };
        top.push(document.nodes.len());
        document.nodes.push(Node { name, mesh: Some(mesh), skin, extras, ..Node::default() });
    }
    let others = document.nodes.len();
    document.nodes.push(camera(scene, &mut document.cameras));
    let lights = lights(scene, &mut document.nodes);
    top.extend(others..document.nodes.len());
    document.nodes[0].children = top;
    materials::write(surfaces.draw()?, &mut document, &mut pack);
    if !lights.is_empty() {
        document.extensions.insert(LIGHTS.into(), json!({ "lights": lights }));
        document.extensions_used.push(LIGHTS.into());
    }
    if document.materials.iter().any(|m| m.extensions.contains_key(DIFFUSE_TRANSMISSION)) {
        document.extensions_used.push(DIFFUSE_TRANSMISSION.into());
    }
    let own = pack.finish(&mut document);
    let failed = |what: String| Error::failed(format!("this scene cannot be written as glTF: {what}"));
    let json = serde_json::to_vec(&document).map_err(|e| failed(e.to_string()))?;
    Ok((glb::join(json, own).map_err(failed)?, warnings(scene)))
}

fn name(tag: Tag) -> String {
    match (tag.plant, tag.leaf) {
        (0, _) => tag.class.name().to_owned(),
        (plant, 0) => format!("{} {plant}", tag.class.name()),
        (plant, leaf) => format!("{} {plant} leaf {leaf}", tag.class.name()),
    }
}

fn mesh(part: &Part, material: usize, pack: &mut Pack) -> Mesh {
    let tag = part.tag;
    let label = Label { class: tag.class.name().into(), plant: tag.plant, leaf: tag.leaf };
    let mesh = part.in_world();
    let mut attributes = vec![
        ("POSITION", pack.positions(&mesh.positions)),
        ("NORMAL", pack.normals(&mesh.normals)),
        ("TEXCOORD_0", pack.uvs(&mesh.uvs)),
    ];
    if !mesh.weights.is_empty() {
        let [joints, weights] = pack.weights(&mesh.weights);
        attributes.extend([("JOINTS_0", joints), ("WEIGHTS_0", weights)]);
    }
    Mesh {
        name: Some(name(tag)),
        primitives: vec![Primitive {
            attributes: attributes.into_iter().map(|(what, accessor)| (what.to_owned(), accessor)).collect(),
            indices: Some(pack.indices(&mesh.triangles, mesh.positions.len())),
            material: Some(material),
            ..Primitive::default()
        }],
        extras: json!(label),
        ..Mesh::default()
    }
}

/// Creates a node with the given axes (columns, world) and position.
fn standing(name: &str, x: Vec3, y: Vec3, z: Vec3, at: Vec3) -> Node {
    let column = |v: Vec3, w: f64| [f64::from(v.x), f64::from(v.y), f64::from(v.z), w];
    let columns = [column(x, 0.0), column(y, 0.0), column(z, 0.0), column(at, 1.0)];
    let mut matrix = [0.0; 16];
    matrix.copy_from_slice(columns.as_flattened());
    Node { name: Some(name.into()), matrix: Some(matrix), ..Node::default() }
}

/// Creates the camera's node; glTF cameras look along −z with y up in the image.
fn camera(scene: &Scene, cameras: &mut Vec<Camera>) -> Node {
    let camera = &scene.camera;
    let [fx, fy, cx, cy] = camera.intrinsics();
    let (w, h) = (f64::from(camera.width()), f64::from(camera.height()));
    let (model, distortion) = lens(camera.distortion());
    cameras.push(Camera {
        name: Some("camera".into()),
        kind: "perspective".into(),
        perspective: Some(Perspective {
            aspect_ratio: w / fx / (h / fy),
            yfov: 2.0 * (h / 2.0 / fy).atan(),
            znear: NEAR,
        }),
        extras: json!({
            "size": [camera.width(), camera.height()],
            "focal": [fx, fy],
            "centre": [cx, cy],
            "distortion_model": model,
            "distortion": distortion,
        }),
    });
    let axes = camera.pose().axes;
    let node = standing("camera", axes.x_axis, -axes.y_axis, -axes.z_axis, camera.pose().position);
    Node { camera: Some(cameras.len() - 1), ..node }
}

/// Returns the name of a lens's model, and its coefficients in OpenCV's order.
pub(crate) fn lens(of: Lens) -> (&'static str, Vec<f64>) {
    match of {
        Lens::BrownConrady(d) => ("opencv", vec![d.k1, d.k2, d.p1, d.p2, d.k3]),
        Lens::OpenCv(OpenCv { k: [k1, k2, k3, k4, k5, k6], p, s, tilt }) => {
            ("opencv", [&[k1, k2, p[0], p[1], k3, k4, k5, k6][..], &s, &tilt].concat())
        }
        Lens::Fisheye(of) => ("opencv_fisheye", of.k.to_vec()),
    }
}

/// Creates the sun and lamps, each with its node; they emit along −z.
fn lights(scene: &Scene, nodes: &mut Vec<Node>) -> Vec<Value> {
    let mut lights = Vec::new();
    for light in &scene.lights {
        let (name, kind, strength, frame, at) = match light.form() {
            Form::Distant { towards, normal_irradiance } => {
                let frame = furrow_base::math::Frame::about(towards);
                ("sun", "directional", normal_irradiance, frame, Vec3::ZERO)
            }
            Form::Area { centre, mut frame, radiance, area, .. } => {
                (frame.y, frame.z) = (-frame.y, -frame.z);
                ("lamp", "spot", radiance * area, frame, centre)
            }
            Form::Dome { .. } | Form::Unsupported => continue,
        };
        let strength = Spectrum(strength.0.truncate().extend(0.0));
        let most = strength.max().max(f32::MIN_POSITIVE);
        let [r, g, b, _] = (strength / most).to_array();
        let mut of = json!({ "name": name, "type": kind, "color": [r, g, b], "intensity": f64::from(most) * LUMENS });
        if kind == "spot" {
            // Covers the whole hemisphere and fades towards its rim.
            of["spot"] = json!({ "innerConeAngle": 0.0, "outerConeAngle": std::f64::consts::FRAC_PI_2 });
        }
        let mut extensions = Map::new();
        extensions.insert(LIGHTS.into(), json!({ "light": lights.len() }));
        nodes.push(Node { extensions, ..standing(name, frame.x, frame.y, frame.z, at) });
        lights.push(of);
    }
    lights
}

/// Returns warnings about features that the format cannot represent.
fn warnings(scene: &Scene) -> Vec<String> {
    let mut warnings = Vec::new();
    let mut say = |is: bool, what: &str| {
        if is {
            warnings.push(what.to_owned());
        }
    };
    let has = |is: fn(&Form) -> bool| scene.lights.iter().any(|light| is(&light.form()));
    say(has(|form| matches!(form, Form::Dome { .. })), "glTF has no sky: shadows will be black");
    say(has(|form| matches!(form, Form::Area { .. })), "glTF has no area lamps: they become spot lights");
    say(
        !scene.camera.distortion().is_none(),
        "glTF has no lens distortion: the camera becomes a pinhole; see its extras",
    );
    warnings.extend(unsupported(&scene.lights));
    warnings
}
