//! Method 12: comparison with another renderer. Fields are exported for Mitsuba 3, and both programs render them.
//!
//! Rationale: two programs that share no code for light transport, sampling or traversal do not make the same mistake.
//! Expected: the same mean over each class and plant within noise, the same pixels, the same labels. Source: Mitsuba
//! 3.9.
//!
//! Features that Mitsuba's own plugins support (Lambertian surfaces, bare sheets, masks, sun, sky, lamps, camera) are
//! compared without any tolerance. Fields have rough soil, wet films and coats; for those `tests/mitsuba/bsdfs.py`
//! provides an independent implementation of the formulas.
//!
//! Mitsuba reads a texture at one mip level, so here our renderer does as well (`fix_levels`): the mip level of a
//! leaf's relief determines its gloss, several percent of a leaf under lamps. The tolerance of fields is 0.3 %: Mitsuba
//! offsets ray origins by 30 µm, interpolates reflectance where our renderer interpolates colour, and has the texture
//! of stones only at vertices. Under lamps on many small clods it is 0.8 %: our ground is 0.6 % darker there at 384
//! samples, 0.05 % without clods; which of the three causes this is not known.
//!
//! `tests/mitsuba/check.py` documents the estimates, their errors, and the false-alarm rate: one in 10⁵ for each scene.

use crate::common::program::{names, scratch, trace};
use crate::common::python::python;
use crate::common::scenes::{camera, shoot};
use furrow_base::geometry::{AlphaMask, Hit, Interaction, Mesh, Window};
use furrow_base::math::{Frame, Mat3, Spectrum, Vec3, vec2, vec3};
use furrow_field::assemble::{self, Options};
use furrow_optics::bsdf::{Bsdf, Leaf, OrenNayar};
use furrow_optics::light::{Constant, Lamp, Light, Outline, daylight};
use furrow_optics::sensor::{Camera, Distortion, Pose};
use furrow_optics::texture::{ColorSpace, HeightFromBrightness, Maps, Texture};
use furrow_render::accel::EmbreeAccel;
use furrow_render::film::{Film, Filter};
use furrow_render::integrator::PathTracer;
use furrow_render::material::{LeafDesc, LeafMaterial, LeafTexture, Material};
use furrow_render::render;
use furrow_render::scene::tag::{Class, Tag};
use furrow_render::scene::{Part, Scene};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;

/// Builds a square of side 2 · `half` in the plane z = 0, facing up.
fn square(half: f32) -> Mesh {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let positions = corners.map(|(x, y)| vec3(x, y, 0.0) * half).to_vec();
    let uvs = corners.map(|(x, y)| vec2(0.5 + 0.5 * x, 0.5 - 0.5 * y)).to_vec();
    Mesh::smooth(positions, uvs, vec![[0, 1, 2], [0, 2, 3]])
}

/// A mask without left-right or top-bottom symmetry.
fn mask() -> Arc<AlphaMask> {
    Arc::new(AlphaMask::new(96, 64, |x, y| {
        let p = vec2(x as f32 / 96.0, y as f32 / 64.0) - 0.5;
        p.length() < 0.48 && !(p.x > 0.1 && p.y > 0.05) && !(p.x < 0.0 && (x / 6 + y / 6) % 3 == 0)
    }))
}

/// A scene of Lambertian soil with four tilted, masked sheets above it that overlap, under sun and sky.
fn sheets() -> Scene {
    let soil = Bsdf::OrenNayar(OrenNayar::new(Spectrum::new(0.3, 0.2, 0.12, 0.4), 0.0));
    let green = Bsdf::Leaf(Leaf::bare(Spectrum::new(0.1, 0.2, 0.05, 0.45), Spectrum::new(0.08, 0.25, 0.03, 0.5)));
    let pale = Bsdf::Leaf(Leaf::bare(Spectrum::new(0.3, 0.6, 0.2, 0.7), Spectrum::new(0.1, 0.1, 0.3, 0.2)));
    let mask = mask();
    let mut parts =
        vec![Part { mesh: Arc::new(square(2.0)), mask: None, material: 0, tag: Tag::default(), instance: None }];
    for (i, (x, y, z, turn)) in
        [(-0.1, -0.08, 0.05, 0.5), (0.12, -0.05, 0.08, -0.6), (-0.05, 0.1, 0.12, 2.6), (0.05, 0.04, 0.16, 0.1)]
            .into_iter()
            .enumerate()
    {
        let mut mesh = square(0.11);
        let rotation = Mat3::from_rotation_z(i as f32) * Mat3::from_rotation_x(turn);
        mesh.transform(rotation, vec3(x, y, z));
        let tag = Tag { class: [Class::Crop, Class::Weed][i % 2], plant: i as u32 + 1, leaf: 1 };
        parts.push(Part {
            mesh: Arc::new(mesh),
            mask: Some(mask.clone()),
            material: 1 + i as u32 % 2,
            tag,
            instance: None,
        });
    }
    let (sun, dome) = daylight(40.0, 130.0, 3.0, 0.2);
    let lights = vec![Light::Sun(sun.expect("a sun")), Light::Sky(Box::new(dome.expect("a sky")))];
    let materials = [soil, green, pale].map(Material::Plain).to_vec();
    let camera = camera((120, 90), vec3(0.2, -0.5, 0.6), vec3(0.0, 0.0, 0.05), 38.0);
    Scene { parts, materials, lights, camera, haze: None, filter: Filter::Box.footprint() }
}

/// A scene of a ball on a plane under two lamps, with the principal point far from the image's centre.
fn lamps() -> Scene {
    let plane = Bsdf::OrenNayar(OrenNayar::new(Spectrum::new(0.6, 0.5, 0.4, 0.8), 0.0));
    let ball = Bsdf::OrenNayar(OrenNayar::new(Spectrum::new(0.8, 0.3, 0.3, 0.5), 0.0));
    let lamp = |outline, centre: Vec3, radiance| {
        Light::Lamp(Lamp::new(outline, centre, Frame::about(-centre.normalize()), radiance))
    };
    let lights = vec![
        lamp(Outline::Rectangle(vec2(0.06, 0.02)), vec3(0.3, 0.1, 0.5), Spectrum::new(20.0, 10.0, 5.0, 8.0)),
        lamp(Outline::Disc(0.05), vec3(-0.2, -0.3, 0.4), Spectrum::new(4.0, 8.0, 16.0, 3.0)),
    ];
    let parts = vec![
        Part { mesh: Arc::new(square(1.0)), mask: None, material: 0, tag: Tag::default(), instance: None },
        Part {
            mesh: Arc::new(crate::common::scenes::sphere(vec3(0.05, 0.0, 0.06), 0.06, 32)),
            mask: None,
            material: 1,
            tag: Tag { class: Class::Crop, plant: 7, leaf: 0 },
            instance: None,
        },
    ];
    let pose = Pose::look_at(vec3(0.1, -0.3, 0.5), vec3(0.0, 0.0, 0.0)).expect("a direction");
    let camera = Camera::new((110, 80), [140.0; 2], [48.3, 52.9], Distortion::default(), pose).expect("a camera");
    Scene {
        parts,
        materials: [plane, ball].map(Material::Plain).to_vec(),
        lights,
        haze: None,
        camera,
        filter: Filter::Box.footprint(),
    }
}

/// Returns an emptied folder below cargo's temporary folder.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("mitsuba").join(name);
    let _ = fs::remove_dir_all(&folder);
    folder
}

/// Exports a scene, renders it with our renderer, and writes `ours.bin` in the format of `check.py`.
fn prepare(name: &str, scene: &Scene, spp: u32) -> PathBuf {
    let folder = folder(name);
    furrow_job::mitsuba::export(&folder, scene, name).unwrap_or_else(|e| panic!("{name}: {e}"));
    let film: Film = shoot(scene, &PathTracer::default(), spp, 5);
    let pool = render::pool(2).expect("a pool");
    let labels = pool.install(|| {
        let geometry = EmbreeAccel::build(&scene.surfaces(), 2).expect("an accelerator");
        render::label(&geometry, &scene.parts, &scene.camera, Window::full(scene.camera.width(), scene.camera.height()))
    });
    let mut bytes = Vec::new();
    for (pixel, tag) in film.pixels.iter().zip(&labels.tags) {
        let ids = [tag.class as u8 as f32, tag.plant as f32, f32::from(tag.leaf)];
        let numbers = pixel.mean.to_array().into_iter().chain(pixel.variance.to_array()).chain(ids);
        bytes.extend(numbers.flat_map(f32::to_le_bytes));
    }
    fs::write(folder.join("ours.bin"), bytes).expect("a file");
    folder
}

/// Builds a field of a scene file without the camera's point spread function, with textures read at the exported mip
/// levels.
fn field(page: &str, width: u32) -> Scene {
    let options = Options { width: Some(width), ..Options::default() };
    let mut field = assemble::field(Path::new(page), &options).unwrap_or_else(|e| panic!("{e}"));
    field.scene.filter = Filter::Box.footprint();
    furrow_output::mitsuba::fix_levels(&mut field.scene);
    field.scene
}

/// Lets Mitsuba render these scenes and compare them; `tolerance` is a fraction of each region's mean.
fn agree(python: &Path, name: &str, tolerance: f32, scenes: &[PathBuf]) {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/mitsuba/check.py");
    let mut command = Command::new(python);
    command.arg(script).arg(crate::common::pictures::folder(name)).arg(tolerance.to_string()).args(scenes);
    let output = command.output().expect("python");
    let words = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    eprintln!("{words}");
    assert!(output.status.success(), "{words}");
}

const PROBE: &str = "import mitsuba, numpy";

#[test]
fn mitsuba_agrees_within_noise_where_it_holds_everything() {
    let Some(python) = python(PROBE) else { return };
    let sheets = prepare("sheets", &sheets(), 128);
    let lamps = prepare("lamps", &lamps(), 128);
    let scenes = [sheets.join("scene.xml"), sheets.join("scene-nir.xml"), lamps.join("scene.xml")];
    agree(&python, "mitsuba-exact", 0.0, &scenes);
}

#[test]
fn mitsuba_agrees_on_fields_when_it_is_given_their_scattering() {
    let Some(python) = python(PROBE) else { return };
    for (page, width, tolerance) in [
        ("scenes/01-one-leaf.ron", 160, 0.003),
        ("scenes/04-weeds.ron", 150, 0.003),
        ("scenes/05-flash-hood.ron", 216, 0.008),
    ] {
        let name = Path::new(page).file_stem().unwrap().to_string_lossy().into_owned();
        let scene = prepare(&name, &field(page, width), 128).join("scene-exact.xml");
        agree(&python, "mitsuba-fields", tolerance, &[scene]);
    }
}

/// Exports a scene; returns the folder and the text of `scene.xml`.
fn exported(scene: &Scene) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().expect("a folder");
    furrow_job::mitsuba::export(folder.path(), scene, "a test -- of <words>").expect("files");
    let text = fs::read_to_string(folder.path().join("scene.xml")).expect("scene.xml");
    (folder, text)
}

/// Rationale: an unclosed element, or a quote inside a value, makes the whole scene unreadable. Expected: every element
/// is closed in order, and the named files are exactly those that exist.
#[test]
fn the_documents_are_well_formed_and_name_files_that_are_there() {
    let (folder, _) = exported(&sheets());
    let mut named = std::collections::BTreeSet::new();
    for document in ["scene.xml", "scene-nir.xml", "scene-exact.xml"] {
        let text = fs::read_to_string(folder.path().join(document)).expect(document);
        let mut open: Vec<String> = Vec::new();
        let mut rest = text.strip_prefix("<?xml version=\"1.0\" encoding=\"utf-8\"?>").expect("a declaration");
        while let Some(at) = rest.find('<') {
            rest = &rest[at..];
            if let Some(comment) = rest.strip_prefix("<!--") {
                let end = comment.find("--").expect("an end");
                assert!(comment[end..].starts_with("-->"), "two hyphens in a comment of {document}");
                rest = &comment[end + 3..];
                continue;
            }
            let end = rest.find('>').expect("an end");
            let tag = &rest[1..end];
            rest = &rest[end + 1..];
            assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
            let name = tag.split([' ', '/']).find(|w| !w.is_empty()).expect("a name").to_owned();
            if tag.starts_with('/') {
                assert_eq!(open.pop(), Some(name), "in {document}");
            } else if !tag.ends_with('/') {
                open.push(name);
            }
            if let Some(file) = tag.strip_prefix("string name=\"filename\" value=\"") {
                named.insert(file.split('"').next().expect("a value").to_owned());
            }
        }
        assert!(open.is_empty(), "{document} leaves {open:?} open");
    }
    let mut there = std::collections::BTreeSet::new();
    for sub in ["meshes", "textures"] {
        there.extend(names(&folder.path().join(sub)).into_iter().map(|n| format!("{sub}/{n}")));
    }
    assert_eq!(named, there);
}

/// Rationale: a header with a wrong number of vertices shifts every byte after it. Expected: header and length agree;
/// all triangles of the scene are present.
#[test]
fn meshes_hold_every_triangle_once() {
    let scene = sheets();
    let (folder, _) = exported(&scene);
    let mut triangles = 0;
    for name in names(&folder.path().join("meshes")) {
        let bytes = fs::read(folder.path().join("meshes").join(&name)).expect("a mesh");
        let end = bytes.windows(11).position(|w| w == b"end_header\n").expect("a header") + 11;
        let header = String::from_utf8(bytes[..end].to_vec()).expect("text");
        let count = |what: &str| -> usize {
            let line = header.lines().find_map(|l| l.strip_prefix(&format!("element {what} "))).expect(what);
            line.parse().expect("a number")
        };
        let floats = header.matches("property float").count();
        let (vertices, faces) = (count("vertex"), count("face"));
        assert_eq!(bytes.len(), end + vertices * floats * 4 + faces * 13, "{name}");
        triangles += faces;
    }
    assert_eq!(triangles, scene.triangles());
}

/// Expected: white where the mask is opaque, black where not, row 0 at v = 0; parts with the same mask share a file.
#[test]
fn masks_are_pictures_of_their_bits() {
    let (folder, text) = exported(&sheets());
    let mask = mask();
    assert_eq!(names(&folder.path().join("textures")).iter().filter(|n| n.starts_with("mask")).count(), 1);
    assert_eq!(text.matches("<bsdf type=\"mask\"").count(), 4);
    let file = fs::File::open(folder.path().join("textures/mask-0.png")).expect("a mask");
    let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().expect("a PNG");
    let mut pixels = vec![0; reader.output_buffer_size().expect("a size")];
    reader.next_frame(&mut pixels).expect("pixels");
    assert_eq!((reader.info().width, reader.info().height), mask.size());
    for (i, pixel) in pixels.iter().enumerate() {
        assert_eq!(*pixel == 255, mask.texel(i as i32 % 96, i as i32 / 96), "texel {i}");
    }
}

/// A large and a small leaf of the same material and plant, 1 m below the camera.
fn large_and_small() -> Scene {
    let texels: Vec<u8> = (0..64 * 64_u32).flat_map(|i| [(i * 37 % 101) as u8 + 40, 120, 30, 255]).collect();
    let color = Texture::from_rgba8(64, 64, &texels, ColorSpace::Srgb);
    let maps = Maps::derive(&color, &HeightFromBrightness::LEAF);
    let leaf = LeafMaterial::new(&LeafDesc::default(), Some(Arc::new(LeafTexture { color, maps })));
    let part = |half: f32, at: Vec3, leaf| {
        let mut mesh = square(half);
        mesh.transform(Mat3::IDENTITY, at);
        Part {
            mesh: Arc::new(mesh),
            mask: None,
            material: 0,
            tag: Tag { class: Class::Crop, plant: 1, leaf },
            instance: None,
        }
    };
    let parts = vec![part(0.1, vec3(-0.1, 0.0, 0.0), 1), part(0.025, vec3(0.1, 0.0, 0.0), 2)];
    let lights = vec![Light::Constant(Constant::new(Spectrum::ONE))];
    let camera = camera((100, 80), vec3(0.0, -0.01, 1.0), Vec3::ZERO, 34.0);
    Scene { parts, materials: vec![Material::Leaf(leaf)], lights, camera, haze: None, filter: Filter::Box.footprint() }
}

/// Rationale: if the relief of a small leaf is exported at the resolution of a large one, its gloss differs from that
/// seen by the camera: 5 % in blue on leaves under lamps. Expected: at a quarter of the size, two mip levels coarser:
/// the large leaf has 64 / 2 = 32 texels (a pixel covers 6 mm, a texel 3 mm), the small one 8.
#[test]
fn pictures_are_written_on_the_level_of_each_organ() {
    let (folder, _) = exported(&large_and_small());
    let pictures = names(&folder.path().join("textures"));
    let sizes: Vec<[u32; 2]> = pictures
        .iter()
        .filter(|name| name.ends_with("-normal.exr"))
        .map(|name| {
            let bytes = fs::read(folder.path().join("textures").join(name)).expect("an image");
            let at = bytes.windows(11).position(|w| w == b"dataWindow\0").expect("a window");
            let number = |i: usize| i32::from_le_bytes(bytes[at + i..at + i + 4].try_into().expect("four bytes"));
            // After the name: type, length, then x0, y0, x1, y1.
            let begin = 11 + b"box2i\0".len() + 4;
            [number(begin + 8) - number(begin) + 1, number(begin + 12) - number(begin + 4) + 1].map(|n| n as u32)
        })
        .collect();
    assert_eq!(sizes, [[32, 32], [8, 8]], "{pictures:?}");
}

/// Rationale: thousands of leaves of a few species would each have files of their own. Expected: images with equal
/// content are one file for all materials.
#[test]
fn equal_images_are_one_file() {
    let mut scene = large_and_small();
    scene.parts[1].mesh = scene.parts[0].mesh.clone();
    scene.parts[1].tag.plant = 2;
    let (folder, text) = exported(&scene);
    let pictures = names(&folder.path().join("textures"));
    let count = |what: &str| pictures.iter().filter(|name| name.ends_with(what)).count();
    assert_eq!([count("-normal.exr"), count("-through.exr"), count("-through-nir.exr")], [1; 3], "{pictures:?}");
    assert_eq!(text.matches("-normal.exr").count(), 2, "{text}");
}

/// Expected: `fix_levels` does not change the export; our rays then use one mip level, whatever their width.
#[test]
fn fixed_levels_are_those_that_are_written() {
    let mut fixed = large_and_small();
    let free = exported(&fixed).0;
    let normal = |scene: &Scene, footprint: f32| {
        let part = &scene.parts[0];
        let at = Interaction::new(&part.mesh, &Hit { part: 0, triangle: 0, u: 0.21, v: 0.37, t: 1.0 }, footprint);
        scene.materials[part.material as usize].scatter(&at, Vec3::Z).1.z
    };
    assert_ne!(normal(&fixed, 1e-4), normal(&fixed, 0.05));
    furrow_output::mitsuba::fix_levels(&mut fixed);
    assert_eq!(normal(&fixed, 1e-4), normal(&fixed, 0.05));
    assert!(files(free.path()) == files(exported(&fixed).0.path()), "fixing the mip levels changed the export");
}

/// Names and contents of the files of an exported scene.
fn files(of: &Path) -> Vec<(String, Vec<u8>)> {
    ["", "meshes", "textures"]
        .iter()
        .flat_map(|sub| names(&of.join(sub)).into_iter().map(move |n| format!("{sub}/{n}")))
        .filter_map(|name| Some((name.clone(), fs::read(of.join(name.trim_start_matches('/'))).ok()?)))
        .collect()
}

#[test]
fn equal_exports_are_equal_bytes() {
    let scene = sheets();
    let (a, b) = (exported(&scene).0, exported(&scene).0);
    assert!(files(a.path()).len() > 10);
    assert!(files(a.path()) == files(b.path()), "two exports of one scene differ");
}

/// Expected: features that Mitsuba does not support are reported, and supported ones cause no warning.
#[test]
fn losses_of_an_export_are_reported() {
    let (folder, _) = exported(&sheets());
    let quiet = furrow_job::mitsuba::export(folder.path(), &sheets(), "").expect("files").warnings;
    assert_eq!(quiet, Vec::<String>::new());
    let mut scene = sheets();
    let distortion = Distortion { k1: -0.05, ..Distortion::default() };
    scene.camera =
        Camera::new((60, 40), [80.0, 81.0], [30.0, 20.0], distortion, *scene.camera.pose()).expect("a camera");
    scene.materials[0] = Material::Plain(Bsdf::OrenNayar(OrenNayar::new(Spectrum::splat(0.3), 0.4)));
    scene.filter = Filter::Gaussian(0.4).footprint();
    let warnings = furrow_job::mitsuba::export(folder.path(), &scene, "").expect("files").warnings.join("\n");
    for word in ["distortion", "square", "Gaussian", "Oren–Nayar"] {
        assert!(warnings.contains(word), "{word} in {warnings}");
    }
    let text = fs::read_to_string(folder.path().join("scene.xml")).expect("scene.xml");
    assert!(text.contains("distortion"), "the file must mention it too");
}

#[test]
fn the_program_exports_and_lists_what_it_wrote() {
    let (_keep, out) = scratch();
    let page = crate::common::program::SMALL;
    let output =
        trace(&["export", "--scene", page, "--format", "mitsuba", "--width", "40", "--out", out.to_str().unwrap()])
            .output()
            .expect("the program");
    let words = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{words}");
    let paths = String::from_utf8(output.stdout).expect("paths");
    assert!(paths.lines().all(|p| Path::new(p).is_file()), "{paths}");
    assert!(paths.trim_end().ends_with("scene.xml"), "{paths}");
    assert!(words.contains("warning: ") && words.contains("Oren–Nayar"), "{words}");
}

#[test]
fn exports_that_cannot_work_end_with_code_2_and_write_nothing() {
    let (_keep, out) = scratch();
    fs::write(&out, "a file").expect("a file");
    let below = out.join("x");
    let page = crate::common::program::SMALL;
    for (arguments, word) in [
        (vec!["export", "--scene", page, "--format", "mitsuba", "--out", below.to_str().unwrap()], "this is a file"),
        (vec!["export", "--scene", page, "--format", "mitsubishi"], "mitsuba"),
        (vec!["export", "--scene", page], "--format"),
        (vec!["export", "--scene", "scenes/fild.ron", "--format", "mitsuba"], "did you mean scenes/field.ron"),
    ] {
        let output = trace(&arguments).output().expect("the program");
        let words = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {words}");
        assert!(words.contains(word), "{word} in {words}");
        assert!(output.stdout.is_empty());
    }
    assert_eq!(fs::read_to_string(&out).expect("the file"), "a file");
}

/// Rationale: users view and benchmark `scene.xml` in Mitsuba; the limits of its own plugins must not change the
/// brightness. Expected: the mean of an image within 1 % of that of `scene-exact.xml`, which uses our BSDFs. Source:
/// Mitsuba, with and without our plugins.
#[test]
fn scenes_with_mitsubas_own_plugins_are_as_bright() {
    let Some(python) = python(PROBE) else { return };
    let pages = ["scenes/01-one-leaf.ron", "scenes/04-weeds.ron"];
    let folders: Vec<tempfile::TempDir> = pages.iter().map(|page| exported(&field(page, 120)).0).collect();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/mitsuba/brightness.py");
    let output =
        Command::new(python).arg(script).arg("0.01").args(folders.iter().map(tempfile::TempDir::path)).output();
    let output = output.expect("python");
    let words = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{words}");
}
