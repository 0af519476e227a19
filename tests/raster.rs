//! The raster engine: labels, lighting, effects and output files.
//!
//! Rationale: two engines can only be compared if all else is equal: the same labels, incident light, lens and sensor.
//!
//! Expected: labels equal those of ray casting in 99.9 % of the pixels of every scene, and all differences are at label
//! edges. A matt plane reflects ρ E cos θ / π under a sun and ρ E / π under a uniform environment; a leaf transmits T E
//! / π of the light on its other side, with a wrapped cosine. Switching off an effect changes the image and no label;
//! equal input gives equal bits.
//!
//! Source: closed forms; the label pass, which `labels.rs` tests against double precision.

use crate::common::program::{self, FILES, SMALL, names, scratch, trace};
use crate::common::scenes::square;
use furrow_base::geometry::{Intersect, Ray, Window};
use furrow_base::math::{Spectrum, Vec2, Vec3, vec2, vec3};
use furrow_field::assemble::{self, Options};
use furrow_optics::bsdf::{Bsdf, Leaf, OrenNayar};
use furrow_optics::light::{Constant, Light, Sun};
use furrow_optics::sensor::{Camera, Distortion, Pose};
use furrow_render::accel::EmbreeAccel;
use furrow_render::film::Filter;
use furrow_render::material::Material;
use furrow_render::raster::{LabelledImage, Rasterizer};
use furrow_render::render::{LabelMap, label};
use furrow_render::scene::tag::{Class, Tag};
use furrow_render::scene::{Part, Scene};
use furrow_render::settings::{Engine, Technique, Techniques};
use std::f32::consts::PI;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use std::sync::{Arc, OnceLock};

/// The rasterizer, shared by all tests.
fn card() -> &'static Rasterizer {
    static CARD: OnceLock<Rasterizer> = OnceLock::new();
    CARD.get_or_init(|| Rasterizer::new().expect("a Vulkan driver: apt-get install mesa-vulkan-drivers libvulkan1"))
}

fn draw(scene: &Scene, without: &[Technique]) -> LabelledImage {
    card().draw(scene, &Techniques::without(without)).expect("an image")
}

fn rays(scene: &Scene, geometry: &EmbreeAccel) -> LabelMap {
    label(geometry, &scene.parts, &scene.camera, Window::full(scene.camera.width(), scene.camera.height()))
}

/// Returns whether rays within 0.05 pixels of the pixel's centre hit this tag, so that an edge passes there.
fn near(scene: &Scene, geometry: &EmbreeAccel, tag: Tag, x: u32, y: u32) -> bool {
    let centre = vec2(x as f32 + 0.5, y as f32 + 0.5);
    let around = (0..64).map(|k| {
        let turn = k as f32 * 2.4;
        Vec2::from_angle(turn) * (0.05 * (k as f32 / 63.0).sqrt())
    });
    around.map(|off| scene.camera.ray(centre + off, [0.5; 2])).any(|(origin, direction)| {
        let seen = geometry.closest(&Ray::new(origin, direction));
        seen.map_or(Tag::default(), |hit| scene.parts[hit.part as usize].tag) == tag
    })
}

/// Checks labels, depths and normals of a field of a shipped scene file, as [`crate::estimate`] builds them. Returns `false` if
/// the field exceeds the GPU's limits.
pub(crate) fn labels_are_those_of_the_rays(name: &str, scene: &Scene) -> bool {
    let geometry = EmbreeAccel::build(&scene.surfaces(), 2).expect("an accelerator");
    // These effects change no label: `each_effect_changes_the_picture_and_no_label`.
    let plain = Techniques::without(&[Technique::Shadows, Technique::Ssao, Technique::Msaa]);
    let found = match card().draw(scene, &plain) {
        Ok(drawn) => drawn.labels,
        // Plants that share meshes are rendered as copies, which may exceed the GPU's limits.
        Err(error) if error.to_string().contains("can hold") => return false,
        Err(error) => panic!("{name}: {error}"),
    };
    let expected = rays(scene, &geometry);
    let (width, count) = (expected.window.width() as usize, expected.tags.len());
    let differ: Vec<usize> = (0..count).filter(|i| expected.tags[*i] != found.tags[*i]).collect();
    assert!(differ.len() * 1000 <= count, "{name}: {} of {count} pixels differ", differ.len());
    for i in differ {
        let (x, y) = ((i % width) as u32, (i / width) as u32);
        assert!(near(scene, &geometry, found.tags[i], x, y), "{name}: no edge passes through pixel ({x}, {y})");
    }
    // Depth and normals are those of the surface, except in pixels where another triangle of it is nearer.
    let same = (0..count).filter(|i| expected.parts[*i] == found.parts[*i]).collect::<Vec<_>>();
    let far = same.iter().filter(|i| {
        let (a, b) = (expected.depth[**i], found.depth[**i]);
        a.is_finite() != b.is_finite() || (a - b).abs() > 2e-4 * a.max(1.0)
    });
    assert!(far.count() * 1000 <= count, "{name}: depths differ");
    let turned = same.iter().filter(|i| (expected.normals[**i] - found.normals[**i]).length() > 0.02);
    assert!(turned.count() * 200 <= count, "{name}: normals differ");
    true
}

/// Builds a plane of one material, a metre below the camera.
fn plane(bsdf: Bsdf, lights: Vec<Light>, distortion: Distortion) -> Scene {
    let pose = Pose::nadir(vec3(0.0, 0.0, 1.0), 0.0, 0.0, 0.0);
    let camera = Camera::new((64, 48), [80.0; 2], [32.0, 24.0], distortion, pose).expect("a camera");
    let tag = Tag { class: Class::Crop, plant: 1, leaf: 0 };
    Scene {
        parts: vec![Part { mesh: Arc::new(square(Vec3::ZERO, 4.0)), mask: None, material: 0, tag, instance: None }],
        materials: vec![Material::Plain(bsdf)],
        lights,
        haze: None,
        camera,
        filter: Filter::Box.footprint(),
    }
}

fn expect(scene: &Scene, expected: Spectrum, what: &str) {
    for (i, pixel) in draw(scene, &[]).film.pixels.iter().enumerate() {
        let error = (pixel.mean.0 - expected.0).abs() / expected.0;
        assert!(error.max_element() < 5e-3, "{what}: pixel {i} is {:?}, not {expected:?}", pixel.mean);
    }
}

#[test]
fn a_matt_plane_returns_what_the_cosine_law_says() {
    let albedo = Spectrum::new(0.3, 0.2, 0.1, 0.5);
    let bsdf = Bsdf::OrenNayar(OrenNayar::new(albedo, 0.0));
    let irradiance = Spectrum::new(1.0, 2.0, 3.0, 4.0);
    let slant = vec3(0.6, 0.0, 0.8);
    let bent = Distortion { k1: -0.2, ..Distortion::default() };
    for lens in [Distortion::default(), bent] {
        let sun = plane(bsdf, vec![Light::Sun(Sun::uniform(slant, irradiance))], lens);
        expect(&sun, albedo * irradiance * (0.8 / PI), "sun");
        let around = plane(bsdf, vec![Light::Constant(Constant::new(irradiance))], lens);
        expect(&around, albedo * irradiance, "surrounding");
    }
}

#[test]
fn light_from_behind_comes_through_a_leaf() {
    let (returned, passed) = (Spectrum::splat(0.1), Spectrum::new(0.1, 0.2, 0.05, 0.4));
    let bsdf = Bsdf::Leaf(Leaf::bare(returned, passed));
    let irradiance = Spectrum::ONE;
    let below = plane(bsdf, vec![Light::Sun(Sun::uniform(-Vec3::Z, irradiance))], Distortion::default());
    // Wrapped by ½, light from directly behind has the factor (1 + ½) / (1 + ½)².
    expect(&below, passed * (1.5 / 2.25 / PI), "from below");
    let dark = draw(&below, &[Technique::Foliage]).film;
    assert!(dark.pixels.iter().all(|p| p.mean.max() == 0.0), "without the effect no light is transmitted");
}

#[test]
fn a_lamp_falls_off_with_the_square_of_the_distance() {
    let albedo = Spectrum::splat(0.5);
    let small = furrow_optics::light::Lamp::new(
        furrow_optics::light::Outline::Disc(0.005),
        vec3(0.0, 0.0, 0.8),
        furrow_base::math::Frame::about(-Vec3::Z),
        Spectrum::splat(1000.0),
    );
    let scene = plane(Bsdf::OrenNayar(OrenNayar::new(albedo, 0.0)), vec![Light::Lamp(small)], Distortion::default());
    let film = draw(&scene, &[]).film;
    for (x, y) in [(32, 24), (0, 0), (60, 40)] {
        let (_, direction) = scene.camera.centre_ray(x, y);
        let at = scene.camera.pose().position - direction / direction.z;
        let to = vec3(0.0, 0.0, 0.8) - at;
        let cosine = to.z / to.length();
        let expected = 0.5 / PI * 1000.0 * (PI * 0.005 * 0.005) * cosine * cosine / to.length_squared();
        let found = film.at(x, y).mean.to_array()[1];
        assert!((found / expected - 1.0).abs() < 0.01, "({x}, {y}): {found} for {expected}");
    }
}

#[test]
fn each_effect_changes_the_picture_and_no_label() {
    let field = assemble::field(SMALL.as_ref(), &Options::default()).expect("a field");
    let whole = draw(&field.scene, &[]);
    let again = draw(&field.scene, &[]);
    assert!(whole.film == again.film && whole.labels == again.labels, "equal input must give equal bits");
    for (effect, _) in Technique::ALL.into_iter().filter(|(t, _)| t.engine() == Engine::Raster) {
        let name = effect.name();
        let less = draw(&field.scene, &[effect]);
        assert!(less.labels == whole.labels, "{name}");
        let changed = less.film.pixels.iter().zip(&whole.film.pixels).filter(|(a, b)| a.mean != b.mean).count();
        assert!(changed * 100 > whole.film.pixels.len(), "{name}: {changed} pixels");
    }
}

#[test]
fn it_is_about_as_bright_as_the_path_tracer() {
    let field = assemble::field(SMALL.as_ref(), &Options::default()).expect("a field");
    let (film, _) = program::shoot(&field, 16, 2);
    let mean = |film: &furrow_render::film::Film| {
        film.pixels.iter().map(|p| p.mean.0).sum::<furrow_base::math::Vec4>() / film.pixels.len() as f32
    };
    let ratio = mean(&draw(&field.scene, &[]).film) / mean(&film);
    // There is no interreflection, and the sky is occluded only by surfaces within a leaf's size.
    assert!(ratio.min_element() > 0.75 && ratio.max_element() < 1.25, "{ratio}");
}

#[test]
fn the_program_writes_the_files_of_an_image() {
    let (_keep, out) = scratch();
    program::run(&out, &["--engine", "raster"]);
    assert_eq!(names(&out), FILES);
    let size = |folder: &Path| {
        let decoder = png::Decoder::new(BufReader::new(File::open(folder.join("rgb.png")).expect("an image")));
        let info = decoder.read_info().expect("an image").info().clone();
        (info.width, info.height)
    };
    let (_keep, again) = scratch();
    program::run(&again, &["--engine", "raster"]);
    assert_eq!(std::fs::read(out.join("radiance.exr")).unwrap(), std::fs::read(again.join("radiance.exr")).unwrap());
    let (_keep, part) = scratch();
    program::run(&part, &["--engine", "raster", "--crop", "10,8,20,12"]);
    assert_eq!(size(&part), (20, 12));
    assert!(size(&out).0 > 20);
}

#[test]
fn a_dataset_is_drawn_again_the_same() {
    let (_keep, out) = scratch();
    let folder = out.to_str().expect("a path");
    let made = trace(&["dataset", "--scene", SMALL, "--count", "2", "--engine", "raster", "--out", folder, "--quiet"])
        .output();
    let made = made.expect("the program");
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let recipe = std::fs::read_to_string(out.join("dataset.json")).expect("a recipe");
    assert!(recipe.contains("\"engine\": \"raster\"") && recipe.contains(card().adapter()), "{recipe}");
    let checked = trace(&["dataset", "verify", folder, "--rerender", "2"]).output().expect("the program");
    let message = String::from_utf8_lossy(&checked.stderr);
    assert!(checked.status.success() && message.contains("2 rendered again and the same"), "{message}");
}

#[test]
fn unsupported_features_are_reported() {
    let (_keep, out) = scratch();
    let out = out.to_str().expect("a path");
    for (flags, words) in [
        (&["--engine", "raster", "--denoise"][..], "--denoise has no effect with --engine raster"),
        (&["--engine", "raster", "--time", "5s"], "--time and --target-error have no effect"),
        (&["--engine", "raster", "--without", "mis"], "--without mis has no effect with --engine raster"),
        (&["--engine", "raster", "--max-depth", "3"], "--max-depth and --clamp have no effect with --engine raster"),
        (&["--without", "msaa"], "--without msaa has no effect with --engine trace"),
    ] {
        let output = trace(&["--scene", SMALL, "--out", out]).args(flags).output().expect("the program");
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && message.contains(words), "{flags:?}: {message}");
        assert!(!Path::new(out).exists(), "{flags:?} left files");
    }
}

#[test]
fn without_a_driver_it_names_the_package() {
    let (_keep, out) = scratch();
    let mut command = trace(&["--scene", SMALL, "--engine", "raster", "--out", out.to_str().expect("a path")]);
    let output = command.env("VK_DRIVER_FILES", "/nowhere.json").env("VK_ICD_FILENAMES", "/nowhere.json").output();
    let output = output.expect("the program");
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(2) && message.contains("mesa-vulkan-drivers"), "{message}");
    assert!(!out.exists());
}

/// Rationale: servers have no window system, and a spurious error hides real ones. Expected: nothing on stderr.
#[test]
fn without_a_window_system_nothing_is_said_of_one() {
    let (_keep, out) = scratch();
    let arguments =
        ["--scene", SMALL, "--engine", "raster", "--width", "8", "--quiet", "--out", out.to_str().expect("UTF-8")];
    let output = trace(&arguments).env_remove("XDG_RUNTIME_DIR").output().expect("the program");
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && message.is_empty(), "{message}");
}
