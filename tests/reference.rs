//! Compares every pixel with a stored reference.
//!
//! Rationale: closed forms only cover simple scenes, and means hide errors that cancel; a reference detects any changed
//! pixel.
//!
//! Expected: for each tracing mode, the z-test of each pixel and band against the stored mean and error, at α = 0.01
//! with Šidák's correction, accepts at least 99.75 %; for squares of six pixels and for the whole image it accepts all.
//! Errors are detected: an image three percent brighter, and one without the sky. Source: Mitsuba 3's render tests
//! (method and fraction); Šidák 1967.
//!
//! `tests/ref/*.exr` hold the mean of each band (f32) and its standard error (f16). After an intended change of pixels,
//! inspect `target/test-failures/reference-*/`, then update them:
//! `FURROW_BLESS=1 cargo test --release --features system-tests --test system reference::`.

use crate::common::layers::{read_layers, write_layers};
use crate::common::pictures;
use crate::common::scenes::{camera, scene, shoot_with, sphere, square};
use crate::common::stats::{p_value, sidak};
use furrow_base::math::{Frame, Mat3, Spectrum, Vec3, vec3};
use furrow_base::sampling::Points;
use furrow_field::assemble::{self, Options};
use furrow_optics::bsdf::{Bsdf, Leaf, OrenNayar};
use furrow_optics::light::{Lamp, Light, Outline};
use furrow_output::{ImageData, write_png};
use furrow_render::film::Film;
use furrow_render::integrator::{PathTracer, Technique};
use furrow_render::scene::Scene;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const SIZE: (u32, u32) = (48, 36);
/// Side of the squares that are tested as a whole, in pixels.
const SQUARE: u32 = 6;
/// False-alarm probability of all tests in this file, for independent samples; Sobol points have smaller errors than
/// reported.
const ALPHA: f64 = 1e-4;
/// Upper bound on the calls of [`fault`] that expect no fault.
const CALLS: usize = 20;
/// Samples per pixel of a reference, and of the image tested against it.
const REFERENCE_SPP: u32 = 8192;
const SPP: u32 = 256;

fn page(path: &str) -> Scene {
    let options = Options { width: Some(SIZE.0), height: Some(SIZE.1), ..Options::default() };
    assemble::field(Path::new(path), &options).unwrap_or_else(|e| panic!("{e}")).scene
}

/// Builds a closed box with a lamp, a ball and a leaf, in which light bounces many times.
fn closed_box() -> Scene {
    let wall = |rotation: Mat3, at: Vec3, color: Spectrum| {
        let mut mesh = square(Vec3::ZERO, 2.0);
        mesh.transform(rotation, at);
        (mesh, Bsdf::OrenNayar(OrenNayar::new(color, 0.0)))
    };
    let (gray, red, green) =
        (Spectrum::splat(0.6), Spectrum::new(0.6, 0.1, 0.1, 0.7), Spectrum::new(0.1, 0.5, 0.1, 0.7));
    let half = std::f32::consts::FRAC_PI_2;
    let mut leaf = square(Vec3::ZERO, 0.7);
    leaf.transform(Mat3::from_rotation_x(0.7), vec3(-0.4, 0.2, 0.0));
    let parts = vec![
        wall(Mat3::IDENTITY, vec3(0.0, 0.0, -1.0), gray),
        wall(Mat3::from_rotation_x(2.0 * half), vec3(0.0, 0.0, 1.0), gray),
        wall(Mat3::from_rotation_y(half), vec3(-1.0, 0.0, 0.0), red),
        wall(Mat3::from_rotation_y(-half), vec3(1.0, 0.0, 0.0), green),
        wall(Mat3::from_rotation_x(-half), vec3(0.0, -1.0, 0.0), gray),
        wall(Mat3::from_rotation_x(half), vec3(0.0, 1.0, 0.0), gray),
        (sphere(vec3(0.4, 0.3, -0.6), 0.4, 24), Bsdf::OrenNayar(OrenNayar::new(Spectrum::splat(0.8), 0.5))),
        (leaf, Bsdf::Leaf(Leaf::bare(Spectrum::new(0.1, 0.2, 0.05, 0.45), Spectrum::new(0.1, 0.2, 0.05, 0.45)))),
    ];
    let lamp = Lamp::new(Outline::Disc(0.4), vec3(0.0, 0.0, 0.95), Frame::about(-Vec3::Z), Spectrum::splat(3.0));
    scene(parts, vec![Light::Lamp(lamp)], camera(SIZE, vec3(0.0, -0.95, 0.0), vec3(0.0, 0.0, -0.1), 80.0))
}

/// Mean and variance of each band of each pixel.
#[derive(Clone)]
struct Estimate {
    mean: Vec<[f64; 4]>,
    variance: Vec<[f64; 4]>,
}

impl Estimate {
    fn of(film: &Film) -> Self {
        let bands = |s: Spectrum| s.to_array().map(f64::from);
        Self {
            mean: film.pixels.iter().map(|p| bands(p.mean)).collect(),
            variance: film.pixels.iter().map(|p| bands(p.variance)).collect(),
        }
    }

    fn path(name: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/ref/{name}.exr"))
    }

    fn read(name: &str) -> Self {
        let (layers, _) = read_layers(&Self::path(name));
        let pixels = (SIZE.0 * SIZE.1) as usize;
        let bands = |prefix: &str| -> Vec<[f64; 4]> {
            let of = Spectrum::NAMES.map(|band| &layers[&format!("{prefix}{band}")]);
            (0..pixels).map(|i| of.map(|layer| f64::from(layer[i]))).collect()
        };
        let squared = |errors: Vec<[f64; 4]>| errors.into_iter().map(|e| e.map(|e| e * e)).collect();
        Self { mean: bands(""), variance: squared(bands("error.")) }
    }

    fn write(&self, name: &str) {
        let mut layers = BTreeMap::new();
        for (i, band) in Spectrum::NAMES.iter().enumerate() {
            layers.insert((*band).to_owned(), self.mean.iter().map(|m| m[i] as f32).collect());
            layers.insert(format!("error.{band}"), self.variance.iter().map(|v| v[i].sqrt() as f32).collect());
        }
        write_layers(&Self::path(name), SIZE, &layers, |channel| channel.starts_with("error"));
    }

    /// Averages over blocks of `w` × `h` pixels.
    fn over(&self, (w, h): (u32, u32)) -> Self {
        let (columns, rows) = (SIZE.0 / w, SIZE.1 / h);
        let mut all = Self { mean: Vec::new(), variance: Vec::new() };
        for (column, row) in (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row))) {
            let inside: Vec<usize> = (row * h..(row + 1) * h)
                .flat_map(|y| (column * w..(column + 1) * w).map(move |x| (y * SIZE.0 + x) as usize))
                .collect();
            let n = inside.len() as f64;
            let sum = |of: &[[f64; 4]], band: usize| inside.iter().map(|i| of[*i][band]).sum::<f64>();
            all.mean.push([0, 1, 2, 3].map(|band| sum(&self.mean, band) / n));
            all.variance.push([0, 1, 2, 3].map(|band| sum(&self.variance, band) / (n * n)));
        }
        all
    }

    /// p-value, for every pixel and band, of the hypothesis that both have the same mean.
    fn p(&self, other: &Self) -> Vec<[f64; 4]> {
        let p = |i: usize, band: usize| {
            let difference = self.mean[i][band] - other.mean[i][band];
            // Single-precision rounding of the means.
            let rounding = (1e-6 * other.mean[i][band]).powi(2) + 1e-16;
            p_value(difference / (self.variance[i][band] + other.variance[i][band] + rounding).sqrt())
        };
        (0..self.mean.len()).map(|i| [0, 1, 2, 3].map(|band| p(i, band))).collect()
    }
}

/// Describes the evidence against equal means of two estimates; `None` if there is none.
fn fault(got: &Estimate, reference: &Estimate) -> Option<String> {
    for (what, size, share) in
        [("pixels", (1, 1), 0.9975), ("squares", (SQUARE, SQUARE), 1.0), ("whole image", SIZE, 1.0)]
    {
        let (got, reference) = (got.over(size), reference.over(size));
        let p = got.p(&reference);
        let p = p.as_flattened();
        let level = sidak(ALPHA, 3 * CALLS * p.len());
        let accepted = p.iter().filter(|p| **p > level).count() as f64 / p.len() as f64;
        if accepted < share {
            let least = p.iter().copied().fold(1.0, f64::min);
            return Some(format!("{what}: {:.2} % accepted, smallest p {least:.1e}", 100.0 * accepted));
        }
    }
    None
}

/// Writes image, reference and a map of the smallest p-value of each pixel (dark: unlikely); returns their folder.
fn keep(name: &str, got: &Estimate, reference: &Estimate) -> String {
    let folder = pictures::folder(&format!("reference-{name}"));
    let white = reference.mean.iter().flatten().copied().fold(1e-9, f64::max);
    let tone = |v: f64| (255.0 * (v / white).clamp(0.0, 1.0).powf(1.0 / 2.2)) as u8;
    let picture = |of: &Estimate| of.mean.iter().map(|m| [tone(m[0]), tone(m[1]), tone(m[2])]).collect::<Vec<_>>();
    let p_map: Vec<[u8; 3]> = (got.p(reference).iter())
        .map(|p| [(255.0 * p.iter().copied().fold(1.0, f64::min).powf(0.25)) as u8; 3])
        .collect();
    for (file, pixels) in [("image", picture(got)), ("reference", picture(reference)), ("p", p_map)] {
        let path = folder.join(format!("{file}.png"));
        write_png(&path, SIZE.0, SIZE.1, &ImageData::Rgb(&pixels), name).expect("an image");
    }
    folder.display().to_string()
}

/// Returns every tracing mode, with the factor by which it needs more samples for a reliable variance.
fn ways() -> Vec<(&'static str, PathTracer, Points, u32)> {
    let all = Technique::default();
    let with = |technique| PathTracer { technique, ..PathTracer::default() };
    vec![
        ("all", PathTracer::default(), Points::Sobol, 1),
        ("without-qmc", PathTracer::default(), Points::Independent, 1),
        ("without-mis", with(Technique { mis: false, ..all }), Points::Sobol, 1),
        ("without-roulette", with(Technique { roulette: false, ..all }), Points::Sobol, 1),
    ]
}

fn check(name: &str, scene: &Scene, ways: &[(&str, PathTracer, Points, u32)]) {
    if std::env::var_os("FURROW_BLESS").is_some_and(|v| v == "1") {
        let film = shoot_with(scene, &PathTracer::default(), Points::Sobol, REFERENCE_SPP, 1);
        Estimate::of(&film).write(name);
        return;
    }
    let reference = Estimate::read(name);
    for (k, (way, path, points, times)) in ways.iter().enumerate() {
        let got = Estimate::of(&shoot_with(scene, path, *points, SPP * times, 100 + k as u64));
        if let Some(fault) = fault(&got, &reference) {
            let seen = keep(&format!("{name}-{way}"), &got, &reference);
            panic!(
                "{name}, {way}: {fault}; if it should have changed, look at {seen} and renew the references with \
                 FURROW_BLESS=1 cargo test --release --features system-tests --test system reference::"
            );
        }
    }
}

#[test]
fn one_leaf_is_the_reference() {
    check("one-leaf", &page("scenes/01-one-leaf.ron"), &ways());
}

#[test]
fn the_main_scene_is_the_reference() {
    check("field", &page("scenes/field.ron"), &ways());
}

#[test]
fn the_flash_hood_is_the_reference() {
    check("flash-hood", &page("scenes/05-flash-hood.ron"), &ways());
}

#[test]
fn a_closed_box_is_the_reference() {
    let chance = Technique { light_sampling: false, ..Technique::default() };
    let by_chance = PathTracer { technique: chance, ..PathTracer::default() };
    let mut ways = ways();
    ways.push(("without-light-sampling", by_chance, Points::Sobol, 4));
    check("closed-box", &closed_box(), &ways);
}

/// Expected: the test detects an image that is three percent brighter, and one without the light of the sky.
#[test]
fn what_should_be_found_is_found() {
    if std::env::var_os("FURROW_BLESS").is_some_and(|v| v == "1") {
        return;
    }
    let mut scene = page("scenes/field.ron");
    let reference = Estimate::read("field");
    let shoot = |scene: &Scene| Estimate::of(&shoot_with(scene, &PathTracer::default(), Points::Sobol, SPP, 300));
    let right = shoot(&scene);
    assert_eq!(fault(&right, &reference), None);
    let mut bright = right;
    bright.mean.iter_mut().for_each(|m| *m = m.map(|v| 1.03 * v));
    assert!(fault(&bright, &reference).is_some(), "three percent more light must be detected");
    scene.lights.retain(|light| !matches!(light, Light::Sky(_)));
    let dark = fault(&shoot(&scene), &reference).expect("a missing sky must be detected");
    assert!(dark.starts_with("pixels"), "the test of single pixels must detect it: {dark}");
}
