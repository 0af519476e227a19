//! Models: exported glTF files are read back, files of other programs are read, and broken files are refused.
//!
//! Rationale: labels and geometry that change on their way through a file are worse than none, and files from other
//! sources may contain anything.
//!
//! Expected: vertices, normals, texture coordinates, triangles, masks and labels of an exported field, and its label
//! map, are bit-identical after reading; colours are within the precision of eight bits; no bytes make the reader
//! panic. Source: glTF 2.0 specification; Wavefront OBJ as common programs write it. The `gltf` crate, which shares no
//! code with the program, checks the exported files.

use crate::common::pictures;
use crate::common::program::{self, hash, scratch, shoot, small_text, trace};
use furrow_base::error::Kind;
use furrow_base::geometry::Mesh;
use furrow_base::math::{Spectrum, Vec2, Vec3, vec2, vec3};
use furrow_field::Field;
use furrow_field::assemble::{self, Options};
use furrow_grow::model::{Model, Up, glb};
use furrow_optics::light::Light;
use furrow_render::render::LabelMap;
use furrow_render::scene::Part;
use furrow_render::scene::tag::Class;
use proptest::prelude::*;
use serde_json::{Value, json};
use sha2::Digest;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

const CAMERA: &str = "Pinhole(size: (96, 72), intrinsics: FieldOfView(horizontal_deg: 40), pose: Nadir(height_m: 0.45, yaw_deg: 12, pitch_deg: 6))";

/// The field of the small scene file, and its exported file.
fn small() -> &'static (Field, Vec<u8>) {
    static SMALL: OnceLock<(Field, Vec<u8>)> = OnceLock::new();
    SMALL.get_or_init(|| {
        let field = program::field(&small_text(), &Options::default());
        let (bytes, _) = furrow_output::gltf::encode(&field.scene, &[], &field.provenance()).unwrap();
        (field, bytes)
    })
}

/// Builds a field that contains only `models`, from a scene file in `folder`.
fn placed(folder: &Path, models: &str) -> furrow_base::Result<Field> {
    let page = folder.join("page.ron");
    let text =
        format!("Field(seed: 3, camera: {CAMERA}, lights: [Constant(radiance: (1, 1, 1, 1))], models: [{models}])");
    std::fs::write(&page, text).unwrap();
    assemble::field(&page, &Options::default())
}

fn bits(mesh: &Mesh) -> Vec<u32> {
    let vectors = mesh.positions.iter().chain(&mesh.normals).flat_map(Vec3::to_array);
    let numbers = vectors.chain(mesh.uvs.iter().flat_map(Vec2::to_array)).map(f32::to_bits);
    numbers.chain(mesh.triangles.iter().flatten().copied()).collect()
}

fn numbers(map: &LabelMap) -> Vec<u32> {
    map.tags.iter().map(|t| t.plant << 16 | u32::from(t.leaf) << 2 | t.class as u32).collect()
}

#[test]
fn an_exported_field_reads_back_bit_for_bit_with_the_same_label_map() {
    let (field, bytes) = small();
    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("scene.glb"), bytes).unwrap();
    let again = placed(&folder, "(file: \"scene.glb\")").unwrap_or_else(|e| panic!("{e}"));
    let there: Vec<&Part> = field.scene.parts.iter().filter(|p| !p.mesh.triangles.is_empty()).collect();
    assert_eq!(there.len(), again.scene.parts.len());
    assert!(there.iter().any(|p| p.mask.is_some()), "the field must contain masks");
    for (i, (a, b)) in there.iter().zip(&again.scene.parts).enumerate() {
        assert!(bits(&a.mesh) == bits(&b.mesh), "mesh of part {i} changed");
        assert_eq!(a.tag, b.tag, "part {i}");
        assert!(a.mask == b.mask, "mask of part {i} changed");
    }
    let (before, after) = (shoot(field, 1, 2).1, shoot(&again, 1, 2).1);
    pictures::same("gltf-labels", before.window.width(), &numbers(&after), &numbers(&before));
    assert_eq!(hash(numbers(&before)), hash(numbers(&after)));
    assert!(numbers(&after).iter().any(|n| *n > 0), "no pixel is labelled");
    // Its plants keep their numbers.
    let seen: Vec<u32> = again.plants.iter().map(|p| p.number).collect();
    assert_eq!(seen, field.plants.iter().map(|p| p.number).collect::<Vec<_>>());
}

/// Expected: the reflectance and transmittance of visible texels within 2 % and one 8-bit step; for up to one in a
/// hundred within 20 %, the brightest texels of a texture shared by plants of many tints, because glTF stores reflected
/// and transmitted light together; near infrared exactly.
#[test]
fn colours_and_transmission_survive_the_way_through_the_file() {
    let (field, bytes) = small();
    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("scene.glb"), bytes).unwrap();
    let again = placed(&folder, "(file: \"scene.glb\")").unwrap();
    let within = |share: f32, a: Vec3, b: Vec3| (0..3).all(|i| (a[i] - b[i]).abs() < 0.004 + share * a[i]);
    let rgb = |s: Spectrum| s.0.truncate();
    let (mut texels, mut passed, mut cut) = (0, 0, 0);
    let there = field.scene.parts.iter().filter(|p| !p.mesh.triangles.is_empty());
    for (part, other) in there.zip(&again.scene.parts) {
        let material = &field.scene.materials[part.material as usize];
        let (a, b) = (material.swatch(), again.scene.materials[other.material as usize].swatch());
        assert_eq!(a.size, b.size);
        let (w, h) = a.size.unwrap_or((1, 1));
        let tint = |tint: Vec3| if a.size.is_some() { tint } else { Vec3::ONE };
        for (x, y) in (0..64).map(|i| (w * (i % 8) / 8, h * (i / 8) / 8)) {
            if part.mask.as_ref().is_some_and(|m| !m.texel(x as i32, y as i32)) {
                continue;
            }
            let (before, after) = (a.texel(x, y), b.texel(x, y));
            let (reflected, transmitted) =
                (rgb(before.reflectance) * tint(a.tint), rgb(before.transmittance) * tint(a.tint_transmitted));
            let both = [(reflected, rgb(after.reflectance)), (transmitted, rgb(after.transmittance))];
            assert!(both.iter().all(|(a, b)| within(0.2, *a, *b)), "{reflected} and {transmitted} became {after:?}");
            cut += usize::from(!both.iter().all(|(a, b)| within(0.02, *a, *b)));
            texels += 1;
            passed += usize::from(transmitted.max_element() > 0.05);
        }
        let nir = |m: furrow_render::material::swatch::Tone| vec2(m.reflectance.0.w, m.transmittance.0.w);
        assert!((nir(a.mean) - nir(b.mean)).length() < 0.01, "{:?} became {:?}", a.mean, b.mean);
    }
    assert!(texels > 1000 && passed > 300 && 100 * cut < texels, "{texels} {passed} {cut}");
}

/// Rationale: the condition of a leaf changes each texel; with images of its own for each leaf, a field has thousands.
/// Expected: leaves share the images of their species, with a factor that keeps their mean colours within 2/255 and
/// their marks missing; leaves with many marks or holes have images of their own, with the relief of the species.
#[test]
fn leaves_with_conditions_share_images() {
    let plant = |k: usize, condition: &str| {
        let x = 0.08 * k as f32 - 0.2;
        format!(
            "(species: \"scenes/species/sugar_beet.ron\", growth: Bbch(14), position_m: ({x}, 0), condition: {condition}),"
        )
    };
    let kinds = ["(dust: 0.03)", "(dust: 0.05)", "(greenness: 0.9)", "(greenness: 1.1)", "(holes: 4)", "(spots: 30)"];
    let plants: String = kinds.iter().enumerate().map(|(k, condition)| plant(k, condition)).collect();
    let text =
        format!("Field(seed: 4, camera: {CAMERA}, lights: [Constant(radiance: (1, 1, 1, 1))], plants: [{plants}])");
    let field = program::field(&text, &Options::default());
    let (bytes, _) = furrow_output::gltf::encode(&field.scene, &[], &field.provenance()).unwrap();
    let file = gltf::Gltf::from_slice(&bytes).unwrap();
    let named = |what: &str| file.images().filter(|image| image.name().unwrap().starts_with(what)).count();
    let [reflected, transmitted, relief] = ["reflected", "transmitted", "relief"].map(named);
    // Of blades and stalks, in the two textures between which the plants choose.
    assert!(relief <= 4, "{relief}");
    assert!(2 * reflected < file.materials().len() && reflected > 2, "{reflected} of {}", file.materials().len());
    assert!(transmitted <= reflected, "{transmitted}");

    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("scene.glb"), &bytes).unwrap();
    let again = placed(&folder, "(file: \"scene.glb\")").unwrap();
    // Mean over the visible texels of a grid.
    let mean = |part: &Part, field: &Field| {
        let swatch = field.scene.materials[part.material as usize].swatch();
        let (w, h) = swatch.size.unwrap_or((1, 1));
        let mask = part.mask.as_ref();
        let (mw, mh) = mask.map_or((w, h), |mask| mask.size());
        let at = |k: u32, n: u32| (2 * k + 1) * n / 64;
        let there = |&(i, j): &(u32, u32)| mask.is_none_or(|m| m.texel(at(i, mw) as i32, at(j, mh) as i32));
        let places: Vec<(u32, u32)> = (0..1024).map(|k| (k % 32, k / 32)).filter(there).collect();
        let tint = if swatch.size.is_some() { [swatch.tint, swatch.tint_transmitted] } else { [Vec3::ONE; 2] };
        let sum = places.iter().fold([Vec3::ZERO; 2], |[r, t], &(i, j)| {
            let tone = swatch.texel(at(i, w), at(j, h));
            [r + tone.reflectance.0.truncate() * tint[0], t + tone.transmittance.0.truncate() * tint[1]]
        });
        sum.map(|sum| sum / places.len().max(1) as f32)
    };
    let code = |c: f32| if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
    let there = field.scene.parts.iter().filter(|p| !p.mesh.triangles.is_empty());
    for (i, (part, other)) in there.zip(&again.scene.parts).enumerate() {
        for (before, after) in mean(part, &field).into_iter().zip(mean(other, &again)) {
            let off = (0..3).map(|k| (code(before[k]) - code(after[k])).abs()).fold(0.0, f32::max);
            assert!(off < 2.0 / 255.0, "part {i}: {before} became {after}");
        }
    }
}

#[test]
fn the_exported_file_is_the_same_bytes_every_time() {
    let again = program::field(&small_text(), &Options::default());
    let (bytes, _) = furrow_output::gltf::encode(&again.scene, &[], &again.provenance()).unwrap();
    assert!(bytes == small().1, "the file depends on addresses or hash order");
}

/// Expected: another reader accepts the file, and finds our camera, sun, labels and masked materials in it.
#[test]
fn another_reader_finds_camera_sun_labels_and_masks() {
    let (field, bytes) = small();
    let file = gltf::Gltf::from_slice(bytes).unwrap_or_else(|e| panic!("{e}"));
    let camera = file.cameras().next().unwrap();
    let gltf::camera::Projection::Perspective(lens) = camera.projection() else { panic!("a perspective camera") };
    let [fx, fy, ..] = field.scene.camera.intrinsics();
    let (w, h) = (96.0, 72.0);
    assert!((f64::from(lens.yfov()) - 2.0 * (h / 2.0 / fy).atan()).abs() < 1e-6);
    assert!((f64::from(lens.aspect_ratio().unwrap()) - w * fy / (h * fx)).abs() < 1e-6);
    // The file's up axis is y: the camera is at (x, height, −y) and looks along its own −z.
    let root = file.default_scene().unwrap().nodes().next().unwrap();
    let up = |v: Vec3| vec3(v.x, v.z, -v.y);
    let to = |m: [[f32; 4]; 4], v: [f32; 4]| {
        let sum = |i: usize| (0..4).map(|k| m[k][i] * v[k]).sum::<f32>();
        vec3(sum(0), sum(1), sum(2))
    };
    let node = root.children().find(|n| n.camera().is_some()).unwrap();
    let at = to(node.transform().matrix(), [0.0, 0.0, 0.0, 1.0]);
    let forward = to(node.transform().matrix(), [0.0, 0.0, -1.0, 0.0]);
    let pose = field.scene.camera.pose();
    assert!((at - pose.position).length() < 1e-6 && (forward - pose.axes.z_axis).length() < 1e-6);
    let world = to(root.transform().matrix(), at.extend(1.0).to_array());
    assert!((world - up(pose.position)).length() < 1e-6, "{world}");
    let Some(Light::Sun(sun)) = field.scene.lights.iter().find(|l| matches!(l, Light::Sun(_))) else { panic!("a sun") };
    let node = root.children().find(|n| n.light().is_some()).unwrap();
    let shines = to(node.transform().matrix(), [0.0, 0.0, -1.0, 0.0]);
    assert!((shines + sun.direction()).length() < 1e-6);
    let lux = node.light().unwrap().intensity();
    assert!((30_000.0..120_000.0).contains(&lux), "{lux} lx is not the illuminance of the sun");
    // Labels and masks.
    let extras: Value = serde_json::from_str(root.children().next().unwrap().extras().as_ref().unwrap().get()).unwrap();
    assert_eq!(extras, json!({ "class": "soil", "plant": 0, "leaf": 0 }));
    let cut = file.materials().filter(|m| m.alpha_mode() == gltf::material::AlphaMode::Mask);
    for material in cut {
        assert!(material.double_sided() && material.alpha_cutoff() == Some(0.5));
        assert!(material.extension_value("KHR_materials_diffuse_transmission").is_some(), "leaves must transmit light");
        let texture = material.pbr_metallic_roughness().base_color_texture().unwrap().texture();
        assert_eq!(texture.sampler().mag_filter(), Some(gltf::texture::MagFilter::Nearest));
    }
    assert_eq!(root.children().filter(|n| n.mesh().is_some()).count(), file.meshes().count());
}

#[test]
fn the_program_exports_a_scene_and_says_what_is_missing() {
    let (_keep, out) = scratch();
    let done = trace(&["export", "--scene", program::SMALL, "--width", "32", "--format", "gltf", "--out"])
        .arg(&out)
        .output()
        .unwrap();
    let message = String::from_utf8(done.stderr).unwrap();
    assert!(done.status.success(), "{message}");
    assert_eq!(program::names(&out), ["scene.glb"]);
    assert_eq!(String::from_utf8(done.stdout).unwrap().trim(), out.join("scene.glb").display().to_string());
    assert!(message.contains("no sky"), "{message}");
}

/// An OBJ square of two triangles with corners at y = 0 and 1, so that the up axis is visible.
const SQUARE: &str = "mtllib square.mtl\no square\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
    usemtl leaf\nf 1/1 2/2 3/3 4/4\n";

fn write(folder: &Path, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
    std::fs::create_dir_all(folder).unwrap();
    let path = folder.join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

/// Writes a grey 2 × 2 image whose top row is white.
fn picture(folder: &Path, name: &str) {
    furrow_output::write_png(&folder.join(name), 2, 2, &furrow_output::ImageData::Gray(&[255, 255, 0, 0]), "").unwrap();
}

#[test]
fn an_obj_file_is_read_with_its_materials_and_masks() {
    let (_keep, folder) = scratch();
    let path = write(&folder, "square.obj", SQUARE);
    write(&folder, "square.mtl", "newmtl leaf\nKd 0.1 0.3 0.05\nNs 30\nmap_d mask.png\n");
    picture(&folder, "mask.png");
    let model = Model::load(&path, Up::Y).unwrap();
    assert_eq!(model.files.len(), 3, "{:?}", model.files);
    for (file, digest) in &model.files {
        assert_eq!(sha2::Sha256::digest(std::fs::read(file).unwrap()).as_slice(), digest, "{}", file.display());
    }
    let part = &model.parts[0];
    // v increases upwards in the file: its (0, 1) is our (0, 0), the top left of the image.
    let corner = |uv: Vec2| part.mesh.uvs.iter().position(|t| *t == uv).map(|i| part.mesh.positions[i]);
    assert_eq!(corner(vec2(0.0, 0.0)), Some(vec3(0.0, 0.0, 1.0)));
    assert_eq!(corner(vec2(1.0, 1.0)), Some(vec3(1.0, 0.0, 0.0)));
    // Without stored normals, the triangles' normals are used: the file's +z is south.
    assert!(part.mesh.normals.iter().all(|n| (*n - vec3(0.0, -1.0, 0.0)).length() < 1e-6));
    let look = &model.surfaces[part.surface];
    assert_eq!(look.color, [0.1, 0.3, 0.05]);
    assert!((look.roughness.unwrap() - 0.25).abs() < 1e-6, "α = √(2 / 32)");
    let mask = look.mask.as_ref().unwrap();
    assert!(mask.texel(0, 0) && mask.texel(1, 0) && !mask.texel(0, 1) && !mask.texel(1, 1));
    let as_it_is = Model::load(&path, Up::Z).unwrap();
    assert!(as_it_is.parts[0].mesh.positions.contains(&vec3(1.0, 1.0, 0.0)));
}

/// A glTF document with one triangle in an external buffer: positions, texture coordinates as normalised bytes, indices
/// as bytes.
fn triangle(extra: impl FnOnce(&mut Value)) -> (Value, Vec<u8>) {
    let mut bytes: Vec<u8> =
        [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0].iter().flat_map(|f| f.to_le_bytes()).collect();
    bytes.extend([0, 0, 255, 0, 0, 255, 0, 0]);
    bytes.extend([0_u8, 1, 2, 0]);
    let mut document = json!({
        "asset": { "version": "2.0" },
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0, "name": "stone" }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "TEXCOORD_0": 1 }, "indices": 2 }] }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" },
            { "bufferView": 1, "componentType": 5121, "normalized": true, "count": 3, "type": "VEC2" },
            { "bufferView": 2, "componentType": 5121, "count": 3, "type": "SCALAR" },
        ],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": 36 },
            { "buffer": 0, "byteOffset": 36, "byteLength": 6 },
            { "buffer": 0, "byteOffset": 44, "byteLength": 3 },
        ],
        "buffers": [{ "byteLength": 48, "uri": "the%20bytes.bin" }],
    });
    extra(&mut document);
    (document, bytes)
}

fn load(folder: &Path, (document, bytes): (Value, Vec<u8>)) -> furrow_base::Result<Model> {
    write(folder, "the bytes.bin", bytes);
    Model::load(&write(folder, "model.gltf", document.to_string()), Up::Y)
}

#[test]
fn a_gltf_file_with_a_buffer_beside_it_is_read() {
    let (_keep, folder) = scratch();
    let model = load(&folder, triangle(|_| ())).unwrap_or_else(|e| panic!("{e}"));
    let mesh = &model.parts[0].mesh;
    // y up becomes z up: the file's −z is north.
    assert_eq!(mesh.positions, [vec3(0.0, 0.0, 0.0), vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0)]);
    assert_eq!(mesh.uvs, [vec2(0.0, 0.0), vec2(1.0, 0.0), vec2(0.0, 1.0)]);
    assert!(mesh.normals.iter().all(|n| (*n - Vec3::Z).length() < 1e-6), "faceted: {:?}", mesh.normals);
    assert_eq!(model.files.len(), 2);
}

#[test]
fn nodes_turn_scale_and_mirror_what_hangs_on_them() {
    let (_keep, folder) = scratch();
    let model = load(
        &folder,
        triangle(|d| {
            d["nodes"] = json!([
                { "children": [1], "translation": [0, 2, 0], "rotation": [0, std::f64::consts::FRAC_1_SQRT_2, 0, std::f64::consts::FRAC_1_SQRT_2] },
                { "mesh": 0, "scale": [-2, 1, 1] },
            ]);
        }),
    )
    .unwrap();
    let mesh = &model.parts[0].mesh;
    // A quarter turn about the vertical axis takes x to −z (north) and −z to −x (west); 2 m up.
    let corners = [vec3(0.0, 0.0, 2.0), vec3(0.0, -2.0, 2.0), vec3(-1.0, 0.0, 2.0)];
    for (is, should) in mesh.positions.iter().zip(corners) {
        assert!((*is - should).length() < 1e-6, "{is} {should}");
    }
    let [a, b, c] = mesh.triangles[0].map(|i| mesh.positions[i as usize]);
    assert!((b - a).cross(c - a).z > 0.0, "a mirrored surface must still face outwards");
    assert!(mesh.normals.iter().all(|n| (*n - Vec3::Z).length() < 1e-6));
}

#[test]
fn opacity_is_cut_where_the_file_says() {
    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).unwrap();
    let texels = [[255, 0, 0, 255], [255, 0, 0, 200], [255, 0, 0, 100], [255, 0, 0, 0]];
    furrow_output::write_png(&folder.join("cut.png"), 2, 2, &furrow_output::ImageData::Rgba(&texels), "").unwrap();
    let there = |mode: &str, cutoff: f32| {
        let document = triangle(|d| {
            d["meshes"][0]["primitives"][0]["material"] = json!(0);
            d["materials"] = json!([{ "alphaMode": mode, "alphaCutoff": cutoff, "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }]);
            d["textures"] = json!([{ "source": 0 }]);
            d["images"] = json!([{ "uri": "cut.png" }]);
        });
        let model = load(&folder, document).unwrap_or_else(|e| panic!("{e}"));
        let mask = model.surfaces[model.parts[0].surface].mask.clone();
        mask.map_or(4, |m| [(0, 0), (1, 0), (0, 1), (1, 1)].into_iter().filter(|(x, y)| m.texel(*x, *y)).count())
    };
    assert_eq!(there("OPAQUE", 0.5), 4);
    assert_eq!(there("MASK", 0.9), 1);
    assert_eq!(there("MASK", 0.5), 2);
    assert_eq!(there("MASK", 0.3), 3);
    assert_eq!(there("BLEND", 0.9), 2);
}

#[test]
fn a_page_gives_class_place_size_and_number() {
    let (_keep, folder) = scratch();
    write(&folder, "square.obj", SQUARE);
    write(&folder, "square.mtl", "newmtl leaf\nKd 0.1 0.3 0.05\n");
    let field = placed(
        &folder,
        "(file: \"square.obj\", up: Z, class: Weed, position_m: (0.5, 1), lift_m: 0.25, turn_deg: 90, scale: 0.1, \
         transmission: (0.05, 0.1, 0.02, 0.4), nir: 0.5, roughness: 0.4), \
         (file: \"square.obj\", class: Soil), (file: \"square.obj\", class: Crop)",
    )
    .unwrap_or_else(|e| panic!("{e}"));
    let [weed, thing, crop] = &field.scene.parts[..] else { panic!("three parts") };
    assert_eq!((weed.tag.class, weed.tag.plant), (Class::Weed, 1));
    assert_eq!((thing.tag.class, thing.tag.plant), (Class::Soil, 0));
    assert_eq!((crop.tag.class, crop.tag.plant), (Class::Crop, 2));
    // Clockwise from above: east becomes south, north becomes east.
    let (lo, hi) = weed.mesh.bounds().unwrap();
    assert!((lo - vec3(0.5, 0.9, 0.25)).length() < 1e-6 && (hi - vec3(0.6, 1.0, 0.25)).length() < 1e-6, "{lo} {hi}");
    assert_eq!(field.plants.len(), 2);
    assert!((field.plants[0].position - vec3(0.5, 1.0, 0.25)).length() < 1e-6);
    let tone = field.scene.materials[weed.material as usize].swatch().mean;
    assert!((tone.transmittance.0 - Spectrum::new(0.05, 0.1, 0.02, 0.4).0).abs().max_element() < 1e-6);
    assert!((tone.reflectance.0 - Spectrum::new(0.1, 0.3, 0.05, 0.5).0).abs().max_element() < 1e-6);
    assert!(
        placed(&folder, "(file: \"square.obj\", class: Crop, scale: 1e9)").is_err(),
        "a model of that size must be refused"
    );
}

/// Expected: labels of a file that contradict each other or name no class are refused with the node, if the scene file gives no
/// class of its own.
#[test]
fn labels_that_contradict_each_other_are_refused() {
    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).unwrap();
    let labelled = |one: Value, other: Value, class: &str| {
        let (mut document, bytes) = triangle(|_| ());
        document["nodes"] =
            json!([{ "mesh": 0, "name": "a", "extras": one }, { "mesh": 0, "name": "b", "extras": other }]);
        document["scenes"] = json!([{ "nodes": [0, 1] }]);
        write(&folder, "m.gltf", document.to_string());
        write(&folder, "the bytes.bin", &bytes);
        placed(&folder, &format!("(file: \"m.gltf\"{class})"))
    };
    let crop = || json!({ "class": "crop", "plant": 1, "leaf": 1 });
    assert!(labelled(crop(), json!({ "class": "soil" }), "").is_ok());
    for (other, words) in [
        (json!({ "class": "weed", "plant": 1 }), "plant 1 is a weed in `b`, but not in `a`"),
        (json!({ "class": "soil", "plant": 5 }), "`b` is soil, but has the number"),
        (json!({ "class": "crop" }), "`b` is a crop, but has no number"),
        (json!({ "class": "tree" }), "`b` has the unknown class `tree`"),
        (json!({ "class": "crop", "plant": -1 }), "the label of `b` is wrong"),
    ] {
        let error = labelled(crop(), other.clone(), "").err().unwrap().to_string();
        assert!(error.contains(words), "{error}");
        assert!(labelled(crop(), other, ", class: Weed").is_ok());
    }
}

#[test]
fn a_model_stands_on_the_ground_and_counts_after_the_plants() {
    let (_keep, folder) = scratch();
    write(&folder, "square.obj", SQUARE);
    write(&folder, "square.mtl", "newmtl leaf\nKd 0.1 0.3 0.05\n");
    let text = small_text().trim_end().strip_suffix(')').unwrap().to_owned()
        + "models: [(file: \"square.obj\", up: Z, class: Weed, position_m: (0.05, -0.03), scale: 0.01)])";
    let page = write(&folder, "page.ron", text);
    let field =
        assemble::field(&page, &Options { width: Some(32), ..Options::default() }).unwrap_or_else(|e| panic!("{e}"));
    let bare = program::field(&small_text(), &Options { width: Some(32), ..Options::default() });
    assert_eq!(field.plants[..bare.plants.len()], bare.plants[..], "a model must not move any plant");
    let model = field.plants.last().unwrap();
    assert!(model.number > bare.plants.last().unwrap().number);
    let ground = field.scene.parts[0].mesh.positions.iter();
    let near = ground.min_by(|a, b| {
        let d = |p: &Vec3| (p.truncate() - vec2(0.05, -0.03)).length();
        d(a).total_cmp(&d(b))
    });
    assert!((model.position.z - near.unwrap().z).abs() < 2e-3, "{} {}", model.position, near.unwrap());
}

/// Builds a field with `soil` and `models`, seen from 0.8 m.
fn sown(folder: &Path, models: &str) -> furrow_base::Result<Field> {
    let camera = "Pinhole(size: (96, 72), intrinsics: FieldOfView(horizontal_deg: 60), pose: Nadir(height_m: 0.8))";
    let litter = "(straw_cover: 0, sticks_per_m2: 0, bits_per_m2: 0)";
    let soil = format!("clods: (over_5mm_per_m2: 300, min_mm: 6), crumbs: (amount: 0), stones: [], litter: {litter}");
    let page = folder.join("sown.ron");
    let text = format!(
        "Field(seed: 3, camera: {camera}, lights: [Constant(radiance: (1, 1, 1, 1))], soil: ({soil}), models: [{models}])"
    );
    std::fs::write(&page, text).unwrap();
    assemble::field(&page, &Options { width: Some(96), ..Options::default() })
}

const ROWS: &str = "(file: \"square.obj\", name: \"mat\", up: Z, class: Crop, scale: Uniform(0.02, 0.04), rows: (spacing_m: 0.25, \
                    in_row_m: 0.1, jitter_along_m: 0, jitter_across_m: 0, emergence: 1, doubles: 0, azimuth_deg: 30))";
const PATCHES: &str =
    "(file: \"square.obj\", up: Z, class: Weed, scale: 0.01, turn_deg: 0, spread: (per_m2: 150, k: 50))";

/// Rationale: a user's plant model is sown as a species is. Expected: copies are on the rows, in the distance of their seeds, with
/// different directions and scales; each is a plant of its own in records and label map; all share one mesh; a weed does not move them.
#[test]
fn models_are_sown_in_rows_and_by_density() {
    let (_keep, folder) = scratch();
    write(&folder, "square.obj", SQUARE);
    write(&folder, "square.mtl", "newmtl leaf\nKd 0.1 0.3 0.05\n");
    let field = sown(&folder, ROWS).unwrap_or_else(|e| panic!("{e}"));
    let plants = &field.plants;
    assert!(
        plants.len() > 20 && plants.iter().all(|p| p.class == Class::Crop && p.species == "mat"),
        "{}",
        plants.len()
    );
    let (sin, cos) = 30f32.to_radians().sin_cos();
    for plant in plants {
        let across = plant.position.truncate().dot(vec2(cos, -sin)) / 0.25;
        assert!((across - across.round()).abs() < 1e-3, "{} is beside its row", plant.position);
        assert!((0.02..0.04).contains(&(plant.radius / 2f32.sqrt())), "{}", plant.radius);
    }
    let has_next = |plant: &&furrow_field::PlantRecord| {
        let others = plants.iter().filter(|other| other.number != plant.number);
        let nearest = others.map(|other| other.position.distance(plant.position)).fold(f32::MAX, f32::min);
        (nearest - 0.1).abs() < 0.02
    };
    // A plant in a corner of the view may be alone in its row.
    assert!(plants.iter().filter(has_next).count() * 10 >= plants.len() * 9);
    let numbers_of = |plants: &[furrow_field::PlantRecord]| {
        let both: std::collections::BTreeSet<(u32, u32)> = plants.iter().map(|p| (p.number, p.id)).collect();
        both.len()
    };
    assert_eq!(numbers_of(plants), plants.len());
    let copies: Vec<&Part> = field.scene.parts.iter().filter(|part| part.tag.plant > 0).collect();
    assert_eq!(copies.len(), plants.len());
    assert!(copies.iter().all(|part| std::sync::Arc::ptr_eq(&part.mesh, &copies[0].mesh)), "copies share their mesh");
    let mut turns: Vec<i32> = copies
        .iter()
        .map(|part| {
            (part.placement().unwrap().direction(Vec3::X).truncate().to_angle() / 0.5).floor().rem_euclid(12.0) as i32
        })
        .collect();
    turns.sort_unstable();
    turns.dedup();
    assert!(turns.len() > 8, "directions are random: {turns:?}");
    assert_eq!(field.conditions.crops.len(), 1);
    assert!((field.conditions.crops[0].rows.spacing_m - 0.25).abs() < 1e-6);

    let both = sown(&folder, &format!("{ROWS}, {PATCHES}")).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(both.plants[..plants.len()], plants[..], "weeds must not move the crop");
    let weeds = both.plants.len() - plants.len();
    // About 1.1 m² are planted. The standard deviation of the number is below 20 % (k = 50, and Poisson).
    assert!((60..300).contains(&weeds), "{weeds}");
    assert_eq!(both.conditions.weeds[0].species, "square");
    let labels = shoot(&both, 1, 2).1;
    let seen = |class| {
        let of = labels.tags.iter().filter(|tag| tag.class == class && tag.plant > 0).map(|tag| tag.plant);
        of.collect::<std::collections::BTreeSet<u32>>().len()
    };
    assert!(seen(Class::Crop) > 10 && seen(Class::Weed) > 10, "{} {}", seen(Class::Crop), seen(Class::Weed));
}

/// Expected: a labelled model with several plants gives each copy as many, all with numbers of their own; its position on the rows is
/// independent of the view.
#[test]
fn copies_of_several_plants_are_numbered_apart() {
    let (_keep, folder) = scratch();
    let (_, bytes) = small();
    write(&folder, "scene.glb", bytes);
    let once = placed(&folder, "(file: \"scene.glb\")").unwrap_or_else(|e| panic!("{e}"));
    let rows = "(file: \"scene.glb\", scale: 0.2, rows: (spacing_m: 0.5, in_row_m: 0.4, emergence: 1, doubles: 0))";
    let field = sown(&folder, rows).unwrap_or_else(|e| panic!("{e}"));
    let numbers: std::collections::BTreeSet<u32> = field.plants.iter().map(|plant| plant.number).collect();
    assert_eq!(numbers.len(), field.plants.len());
    assert!(field.plants.len() >= 4 * once.plants.len() && field.plants.len().is_multiple_of(once.plants.len()));
    let classes = |plants: &[furrow_field::PlantRecord]| plants.iter().map(|plant| plant.class).collect::<Vec<_>>();
    assert_eq!(classes(&field.plants[..once.plants.len()]), classes(&once.plants));
}

/// Expected: contradictory placements are refused where they are written.
#[test]
fn a_sown_model_has_one_placement() {
    let (_keep, folder) = scratch();
    write(&folder, "square.obj", SQUARE);
    write(&folder, "square.mtl", "newmtl leaf\nKd 0.1 0.3 0.05\n");
    let refused = |more: &str| {
        let models = format!("(file: \"square.obj\", up: Z, class: Weed, scale: 0.01, {more})");
        let error = sown(&folder, &models).err().unwrap_or_else(|| panic!("{more} must be refused"));
        assert_eq!(error.exit_code(), 2);
        error.to_string()
    };
    let words = refused("rows: (), spread: (per_m2: 5)");
    assert!(words.contains("`rows` or `spread`, not both") && words.contains("(per_m2: 5)"), "{words}");
    let words = refused("spread: (), position_m: (0.5, 0.25)");
    assert!(words.contains("no position of its own") && words.contains("(0.5, 0.25)"), "{words}");
    let words = refused("spread: (per_m2: 100000000)");
    assert!(words.contains("lower per_m2 here"), "{words}");
}

#[test]
fn what_a_model_needs_counts_into_the_scenes_hash() {
    let (_keep, folder) = scratch();
    write(&folder, "square.obj", SQUARE);
    let hash = |color: &str| {
        write(&folder, "square.mtl", format!("newmtl leaf\nKd {color}\n"));
        placed(&folder, "(file: \"square.obj\", class: Crop)").unwrap().hash
    };
    let first = hash("0.1 0.3 0.05");
    assert_eq!(first, hash("0.1 0.3 0.05"));
    assert_ne!(first, hash("0.1 0.3 0.06"), "the material file must be part of the hash");
}

/// An edit of a document.
type Edit = Box<dyn FnOnce(&mut Value)>;

/// Returns the error message for a scene file with a broken model.
fn refused(folder: &Path, name: &str) -> String {
    let Err(error) = placed(folder, &format!("(file: \"{name}\", class: Weed)")) else { panic!("{name} was read") };
    assert_eq!(error.exit_code(), 2, "{error}");
    assert!(error.place().is_some_and(|place| place.span.is_some()), "{error}");
    let words = error.to_string();
    assert!(
        words.contains("page.ron:1:") && words.contains(&"^".repeat(name.len())) && words.contains("help: "),
        "{words}"
    );
    words
}

#[test]
fn broken_models_get_one_clear_error_at_the_place_that_names_them() {
    let (_keep, folder) = scratch();
    let whole = {
        let (mut document, bytes) = triangle(|_| ());
        document["buffers"][0].as_object_mut().unwrap().remove("uri");
        glb::join(document.to_string().into_bytes(), bytes).unwrap()
    };
    write(&folder, "whole.glb", &whole);
    assert!(placed(&folder, "(file: \"whole.glb\", class: Weed)").is_ok());
    for (name, bytes, word) in [
        ("empty.glb", &[][..], "JSON"),
        ("header.glb", &whole[..10], "header"),
        ("short.glb", &whole[..whole.len() - 9], "ends too early"),
        ("model.fbx", &whole[..], ".glb, .gltf or .obj"),
    ] {
        write(&folder, name, bytes);
        let words = refused(&folder, name);
        assert!(words.contains(word), "{name}: {words}");
    }
    let far = |at: &str, value: Value| {
        let at = at.to_owned();
        move |d: &mut Value| *d.pointer_mut(&at).unwrap() = value
    };
    let edits: Vec<(Edit, &str)> = vec![
        (Box::new(far("/nodes/0/mesh", json!(7))), "mesh 7 is referenced"),
        (Box::new(far("/meshes/0/primitives/0/indices", json!(9))), "accessor 9 is referenced"),
        (Box::new(far("/accessors/0/count", json!(4))), "reaches past its bytes"),
        (Box::new(far("/accessors/0/count", json!(u64::MAX))), "reaches past its bytes"),
        (Box::new(far("/accessors/1/count", json!(2))), "2 texture coordinates"),
        (Box::new(far("/bufferViews/0/byteLength", json!(u64::MAX))), "reaches past its bytes"),
        (Box::new(far("/bufferViews/0/byteOffset", json!(u64::MAX))), "reaches past its bytes"),
        (Box::new(far("/buffers/0/byteLength", json!(1_u64 << 50))), "has 48 of its"),
        (Box::new(far("/buffers/0/uri", json!("gone.bin"))), "`gone.bin`, which does not exist"),
        (Box::new(far("/buffers/0/uri", json!("https://a.b/c.bin"))), "only files can be read"),
        (Box::new(far("/asset/version", json!("1.0"))), "glTF 2.0 can be read"),
        (Box::new(far("/accessors/0/type", json!("VEC4"))), "VEC3 is needed"),
        (Box::new(far("/accessors/0/componentType", json!(1))), "unknown component type"),
        (Box::new(|d| d["nodes"] = json!([{ "mesh": 0, "children": [0] }])), "two parents"),
        (Box::new(|d| d["bufferViews"][2]["byteOffset"] = json!(33)), "refers to vertex"),
        (Box::new(|d| d["extensionsRequired"] = json!(["KHR_draco_mesh_compression"])), "KHR_draco_mesh_compression"),
        (Box::new(|d| d["meshes"][0]["primitives"][0]["mode"] = json!(0)), "no triangles"),
        (Box::new(|d| d["nodes"][0]["scale"] = json!([1e300, 1, 1])), "not a finite number"),
        (
            Box::new(|d| {
                d["materials"] = json!([{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }]);
                d["textures"] = json!([{ "source": 0 }]);
                d["images"] = json!([{ "uri": "no such.png" }]);
            }),
            "`no such.png`, which does not exist",
        ),
    ];
    for (edit, word) in edits {
        let (document, bytes) = triangle(edit);
        write(&folder, "the bytes.bin", bytes);
        write(&folder, "model.gltf", document.to_string());
        let words = refused(&folder, "model.gltf");
        assert!(words.contains(word), "{word}: {words}");
    }
    let (document, mut bytes) = triangle(|_| ());
    bytes[4..8].copy_from_slice(&f32::NAN.to_le_bytes());
    write(&folder, "the bytes.bin", bytes);
    write(&folder, "model.gltf", document.to_string());
    assert!(refused(&folder, "model.gltf").contains("vertex 0 of `stone` is not a finite number"));
    for (text, word) in [
        (SQUARE.replace("square.mtl", "gone.mtl"), "`gone.mtl`, which does not exist"),
        (SQUARE.replace("4/4", "5/4"), "a corner of the face refers to a missing element"),
        (SQUARE.replace("v 1 1 0", "v 1 NaN 0"), "not a finite number"),
        (SQUARE.replace("v 1 1 0", "v one 1 0"), "line 5: `one` is not a number"),
        ("# nothing".to_owned(), "no triangles"),
    ] {
        write(&folder, "square.mtl", "newmtl leaf\nKd 0.1 0.3 0.05\n");
        write(&folder, "square.obj", text);
        let words = refused(&folder, "square.obj");
        assert!(words.contains(word), "{word}: {words}");
    }
}

/// Rationale: models come from other people, and the files they name are read into images and datasets. Expected: a
/// path out of the model's folder is refused in every spelling, before the file is accessed; `allow_outside` permits
/// such paths for trusted models.
#[test]
fn a_model_names_no_file_outside_its_folder_unless_that_is_allowed() {
    let (_keep, around) = scratch();
    let folder = around.join("models");
    std::fs::create_dir_all(&folder).unwrap();
    picture(&around, "leaf.png");
    write(&around, "square.mtl", "newmtl leaf\nKd 0.1 0.3 0.05\n");
    let secret = around.join("leaf.png");
    let absolute = secret.to_str().unwrap();
    let pictured = |uri: &str| {
        let (document, bytes) = triangle(|d| {
            d["materials"] = json!([{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }]);
            d["textures"] = json!([{ "source": 0 }]);
            d["images"] = json!([{ "uri": uri }]);
        });
        write(&folder, "the bytes.bin", bytes);
        write(&folder, "model.gltf", document.to_string());
        "model.gltf"
    };
    let lettered = |library: &str, map: &str| {
        write(&folder, "square.obj", SQUARE.replace("square.mtl", library));
        write(&folder, "square.mtl", format!("newmtl leaf\nmap_Kd {map}\n"));
        "square.obj"
    };
    let outside: [(&str, &dyn Fn() -> &'static str); 8] = [
        ("../leaf.png", &|| pictured("../leaf.png")),
        ("../leaf.png", &|| pictured("%2e%2e/leaf.png")),
        (absolute, &|| pictured(absolute)),
        (absolute, &|| pictured(&absolute.replace('/', "%2F"))),
        ("../square.mtl", &|| lettered("../square.mtl", "leaf.png")),
        ("../square.mtl", &|| lettered("..\\square.mtl", "leaf.png")),
        ("../leaf.png", &|| lettered("square.mtl", "..\\leaf.png")),
        (absolute, &|| lettered("square.mtl", absolute)),
    ];
    for (path, make) in outside {
        let model = make();
        let words = refused(&folder, model);
        assert!(words.contains(&format!("`{path}` does not lie in the folder")), "{words}");
        assert!(words.contains("allow_outside: true"), "{words}");
        let allowed = placed(&folder, &format!("(file: \"{model}\", class: Weed, allow_outside: true)"));
        assert!(allowed.is_ok_and(|field| {
            field.files.iter().any(|file| file.ends_with("leaf.png") || file.ends_with("square.mtl"))
        }));
    }
    // The message does not reveal whether the file exists.
    let words = refused(&folder, pictured("../no such.png"));
    assert!(words.contains("does not lie in the folder") && !words.contains("does not exist"), "{words}");
    // Paths below the model's folder are accepted, also with `..` inside it.
    std::fs::create_dir_all(folder.join("textures")).unwrap();
    picture(&folder.join("textures"), "leaf.png");
    for uri in ["textures/leaf.png", "./textures/../textures/leaf.png"] {
        assert!(placed(&folder, &format!("(file: \"{}\", class: Weed)", pictured(uri))).is_ok(), "{uri}");
    }
}

/// Reads a file of these bytes: the result is a model or a meaningful error.
fn read_as(name: &str, bytes: &[u8]) -> Result<(), TestCaseError> {
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), name, bytes);
    if let Err(e) = Model::load(&path, Up::Y) {
        prop_assert!(e.kind() == Kind::Input && e.place().is_some(), "{e}");
        prop_assert!(!e.to_string().is_empty());
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(300) })]

    #[test]
    fn random_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        for name in ["a.glb", "a.gltf", "a.obj"] {
            read_as(name, &bytes)?;
            read_as(name, &[b"glTF\x02\0\0\0", &bytes[..]].concat())?;
        }
    }

    #[test]
    fn random_lines_of_obj_never_panic(lines in prop::collection::vec("(v|vt|vn|f|o|g|s|usemtl|mtllib|l|p)( [-0-9./einf]{1,6}){0,5}", 0..30)) {
        read_as("a.obj", lines.join("\n").as_bytes())?;
    }

    #[test]
    fn mutilated_files_never_panic(edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6), cut in any::<prop::sample::Index>()) {
        let (mut document, bytes) = triangle(|d| {
            d["materials"] = json!([{ "alphaMode": "MASK", "normalTexture": { "index": 0 }, "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }]);
            d["textures"] = json!([{ "source": 0, "sampler": 0 }]);
            d["samplers"] = json!([{ "wrapS": 33071 }]);
            d["images"] = json!([{ "bufferView": 0 }]);
        });
        document["buffers"][0].as_object_mut().unwrap().remove("uri");
        let mut whole = glb::join(document.to_string().into_bytes(), bytes).unwrap();
        for (at, byte) in edits {
            let at = at.index(whole.len());
            whole[at] = byte;
        }
        read_as("a.glb", &whole)?;
        read_as("a.glb", &whole[..cut.index(whole.len() + 1)])?;
    }

    #[test]
    fn edited_numbers_never_panic(edits in prop::collection::vec((any::<prop::sample::Index>(), prop_oneof![Just("-1"), Just("0"), Just("3"), Just("18446744073709551615"), Just("4294967296"), Just("1e300"), Just("null"), Just("[]"), Just("\"\"")]), 1..4)) {
        let (document, bytes) = triangle(|_| ());
        let mut text = document.to_string();
        for (at, with) in edits {
            let digits: Vec<usize> = text.char_indices().filter(|(_, c)| c.is_ascii_digit()).map(|(i, _)| i).collect();
            let at = digits[at.index(digits.len())];
            text.replace_range(at..=at, with);
        }
        let folder = tempfile::tempdir().unwrap();
        write(folder.path(), "the bytes.bin", &bytes);
        let path = write(folder.path(), "a.gltf", &text);
        if let Err(e) = Model::load(&path, Up::Y) {
            prop_assert!(e.kind() == Kind::Input && e.place().is_some(), "{e}");
        }
    }
}
