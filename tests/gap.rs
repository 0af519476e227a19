//! `trace compare --real … --synthetic …`: the distances between image sets reflect known differences, and invalid
//! input is reported.
//!
//! Rationale: scenes are tuned by these distances. Expected: zero between a set and itself; a known shift gives its
//! size; sets drawn from the same distribution are as far apart as halves of one set; the same files with any number of
//! threads; one clear error with exit code 2 and no output if folders contain no sets. Source: closed forms for the
//! images generated here.

use crate::common::program::{small_text, trace};
use furrow_base::sampling::{Purpose, Stream};
use furrow_cli::reference::{answer, scene, species};
use furrow_compare::Region;
use furrow_compare::gap::advice::{self, ChangeDirection, Step};
use furrow_compare::gap::{Distance, FILES, Feature, Gap, Options};
use furrow_output::{ImageData as Png, read_gray, read_rgb, write_png};
use serde_json::{Value, json};
use std::path::Path;
use std::process::Output;

const SIZE: (u32, u32) = (96, 64);

/// Writes a set in a common folder layout: brown ground with random green squares, with labels and near infrared.
fn set(folder: &Path, seed: u64, pictures: u64, lift: i32) {
    let (width, height) = SIZE;
    for name in ["images", "labels", "nir"] {
        std::fs::create_dir_all(folder.join(name)).unwrap();
    }
    for k in 0..pictures {
        let mut stream = Stream::of(seed, k, Purpose::Test, 0);
        let (light, green) = (stream.range(0.8, 1.2), stream.range(90.0, 140.0));
        let squares: Vec<(u32, u32, u32, u8)> = (0..2 + stream.index(4))
            .map(|_| {
                let side = 4 + stream.index(12) as u32;
                let class = if stream.chance(0.6) { 1 } else { 2 };
                (stream.index(80) as u32, stream.index(48) as u32, side, class)
            })
            .collect();
        let label = |x: u32, y: u32| {
            let inside = |(l, t, s, _): &&(u32, u32, u32, u8)| (*l..l + s).contains(&x) && (*t..t + s).contains(&y);
            squares.iter().find(inside).map_or(0, |square| square.3)
        };
        let labels: Vec<u8> = (0..width * height).map(|p| label(p % width, p / width)).collect();
        let mut code = |mean: f64| ((light * mean + 6.0 * stream.normal()) as i32 + lift).clamp(0, 255) as u8;
        let mut pixel = |label: u8| if label == 0 { [100.0, 80.0, 60.0] } else { [60.0, green, 40.0] }.map(&mut code);
        let rgb: Vec<[u8; 3]> = labels.iter().map(|label| pixel(*label)).collect();
        let nir: Vec<u8> = labels.iter().map(|label| if *label == 0 { 110 } else { 200 }).collect();
        let write = |part: &str, picture: &Png<'_>| {
            write_png(&folder.join(format!("{part}/{k:03}.png")), width, height, picture, "").unwrap();
        };
        write("images", &Png::Rgb(&rgb));
        write("nir", &Png::Gray(&nir));
        write("labels", &Png::Gray(&labels));
    }
}

fn compared(real: &Path, synthetic: &Path) -> Gap {
    Gap::of(real, synthetic, &Options { shown: 0, ..Options::default() }, &|_| (), &|| ()).unwrap()
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    trace(&["compare", "--out", "out"]).current_dir(folder).args(arguments).output().unwrap()
}

#[test]
fn a_set_is_no_distance_from_itself() {
    let folder = tempfile::tempdir().unwrap();
    set(folder.path(), 1, 4, 0);
    let gap = compared(folder.path(), folder.path());
    let measured: Vec<Feature> = gap.distances.iter().map(|d| d.feature).collect();
    assert_eq!(measured, Feature::all(), "labels and near infrared allow every feature to be measured");
    for Distance { feature, distance, halves } in &gap.distances {
        assert_eq!(*distance, 0.0, "{feature:?}");
        assert!(halves.is_some());
    }
    assert!(gap.advice().is_empty());
    // The images alone do not contain the size of a pixel on the ground.
    assert!(gap.warnings.len() == 1 && gap.warnings[0].contains("--pixel-mm"), "{:?}", gap.warnings);
}

/// The L* of gray is 116 f(Y) − 16; increasing it by ten is a Wasserstein distance of 10 in one of three channels, and
/// no distance in structure.
#[test]
fn a_shift_in_lightness_is_its_distance() {
    let folder = tempfile::tempdir().unwrap();
    let code = |l: f64| {
        let y = ((l + 16.0) / 116.0).powi(3);
        (255.0 * (1.055 * y.powf(1.0 / 2.4) - 0.055)).round() as u8
    };
    for (name, lift) in [("a", 0.0), ("b", 10.0)] {
        std::fs::create_dir(folder.path().join(name)).unwrap();
        for k in 0..3 {
            let l = |p: u32| 30.0 + f64::from((p * 7 + k * 13) % 400) / 10.0 + lift;
            let rgb: Vec<[u8; 3]> = (0..64 * 64).map(|p| [code(l(p)); 3]).collect();
            write_png(&folder.path().join(format!("{name}/{k}.png")), 64, 64, &Png::Rgb(&rgb), "").unwrap();
        }
    }
    let gap = compared(&folder.path().join("a"), &folder.path().join("b"));
    let color = gap.distance(Feature::Color(Region::All)).unwrap();
    assert!((3.0 * color.distance - 10.0).abs() < 0.15, "{}", color.distance);
    assert!(gap.distance(Feature::Color(Region::Crop)).is_none() && gap.distance(Feature::Ndvi(Region::All)).is_none());
    assert!(color.is_large());
}

/// Two sets of the same kind and size: halves of one set are smaller, so slightly further apart.
#[test]
fn sets_of_one_kind_are_as_near_as_halves() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b, far] = ["a", "b", "far"].map(|name| folder.path().join(name));
    set(&a, 1, 24, 0);
    set(&b, 2, 24, 0);
    set(&far, 3, 24, 40);
    let near = compared(&a, &b);
    let mut ratios: Vec<f64> = near.distances.iter().filter_map(Distance::ratio).collect();
    ratios.sort_by(f64::total_cmp);
    let median = ratios[ratios.len() / 2];
    assert!((0.4..1.4).contains(&median), "{ratios:?}");
    assert!(ratios[ratios.len() - 1] < 4.0, "{ratios:?}");
    let far = compared(&a, &far);
    for feature in [Feature::Exposure, Feature::Color(Region::Soil), Feature::Color(Region::Crop)] {
        assert!(far.distance(feature).unwrap().is_large(), "{feature:?}");
    }
    assert!(!far.distance(Feature::Cover(Region::Vegetation)).unwrap().is_large());
}

#[test]
fn files_say_the_same_whatever_the_threads() {
    let folder = tempfile::tempdir().unwrap();
    set(&folder.path().join("real"), 1, 5, 0);
    set(&folder.path().join("made"), 2, 3, 20);
    let read = |threads: &str| {
        let output = run(folder.path(), &["--real", "real", "--synthetic", "made", "--threads", threads]);
        let words = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{words}");
        assert!(words.contains("| exposure [stops]") && words.contains("of two halves of the real set"), "{words}");
        FILES.map(|name| std::fs::read_to_string(folder.path().join("out").join(name)).unwrap())
    };
    let (one, two) = (read("1"), read("2"));
    assert_eq!(one, two);
    let [json, csv, page] = one;
    let json: Value = serde_json::from_str(&json).unwrap();
    let distances = json["distances"].as_array().unwrap();
    assert_eq!((json["real"]["images"].as_u64(), json["synthetic"]["labelled"].as_u64()), (Some(5), Some(3)));
    assert_eq!((distances.len(), csv.lines().count()), (Feature::all().len(), Feature::all().len() + 1));
    for (row, line) in distances.iter().zip(csv.lines().skip(1)) {
        let cells: Vec<&str> = line.split(',').collect();
        assert_eq!(row["key"].as_str(), Some(cells[0]));
        assert_eq!(row["distance"].as_f64(), cells[2].parse().ok(), "{line}");
    }
    // The page loads nothing from the network; it contains crops of the images, and curves.
    assert!(
        !page.contains("http")
            && page.matches("<img").count() == 2 * 8 - 2
            && page.contains("data-curve=\"synthetic\"")
    );
}

/// Record of a rendered image with the given ground size of a pixel and sampling error.
fn record(pixel_mm: f64, error: f64) -> String {
    let camera = json!({
        "width_px": 192, "height_px": 128, "fx_px": 1000.0 / pixel_mm, "fy_px": 1000.0 / pixel_mm, "cx_px": 96.0, "cy_px": 64.0,
        "k1": 0.0, "k2": 0.0, "p1": 0.0, "p2": 0.0, "k3": 0.0, "position_m": [0.0, 0.0, 1.0],
        "world_to_camera": [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]], "aperture": null,
    });
    json!({ "conditions": { "camera": camera }, "sampling": { "spp": 16.0, "relative_error": error } }).to_string()
}

/// Expected: images with twice the resolution over the same ground, downscaled to that of the others, are the same
/// images, with no distance; without downscaling, the plant sizes differ strongly. Noise from few samples, compared
/// with that of the real set, is reported with a sufficient number of samples.
#[test]
fn sets_are_resampled_to_one_pixel_size_and_sampling_noise_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let (real, made) = (folder.path().join("real"), folder.path().join("made"));
    set(&real, 1, 4, 0);
    let (width, height) = SIZE;
    for k in 0..4_u64 {
        let out = made.join(format!("images/{k:06}"));
        std::fs::create_dir_all(&out).unwrap();
        let (_, _, rgb) = read_rgb(&real.join(format!("images/{k:03}.png"))).unwrap();
        let (_, _, labels) = read_gray(&real.join(format!("labels/{k:03}.png"))).unwrap();
        let places = || (0..4 * width * height).map(|p| (p / (2 * width) / 2 * width + p % (2 * width) / 2) as usize);
        let rgb: Vec<[u8; 3]> = places().map(|at| rgb[at]).collect();
        let labels: Vec<u8> = places().map(|at| labels[at]).collect();
        write_png(&out.join("rgb.png"), 2 * width, 2 * height, &Png::Rgb(&rgb), "").unwrap();
        write_png(&out.join("semantics.png"), 2 * width, 2 * height, &Png::Gray(&labels), "").unwrap();
        std::fs::write(out.join("record.json"), record(0.25, 0.3)).unwrap();
    }
    let with = |pixel_mm| Gap::of(&real, &made, &Options { shown: 0, pixel_mm }, &|_| (), &|| ()).unwrap();
    let known = with(Some(0.5));
    assert_eq!(known.pixels.factors(), [1.0, 2.0]);
    for Distance { feature, distance, .. } in &known.distances {
        assert!(*distance < 1e-9, "{feature:?}: {distance}");
    }
    assert!(known.advice().iter().all(|advice| advice.step == Step::PixelSize && !advice.turns.is_empty()));
    let warns = |gap: &Gap, words: &str| gap.warnings.iter().any(|warning| warning.contains(words));
    assert!(warns(&known, "samples per pixel") && warns(&known, "--spp "), "{:?}", known.warnings);
    assert!(!warns(&known, "--pixel-mm"));
    let blind = with(None);
    assert!(warns(&blind, "--pixel-mm"), "{:?}", blind.warnings);
    // Four times the area is 0.6 decades.
    let size = blind.distance(Feature::BlobSize(Region::Crop)).unwrap().distance;
    assert!((size - 4.0_f64.log10()).abs() < 0.06, "{size}");
    for k in 0..4 {
        std::fs::write(made.join(format!("images/{k:06}/record.json")), record(0.25, 0.001)).unwrap();
    }
    assert!(!warns(&with(Some(0.5)), "samples per pixel"));
}

/// Rationale: advice that names a non-existent field, or the wrong direction, costs days. Expected: each advised path
/// is one that `trace explain` knows.
#[test]
fn every_field_that_advice_names_exists() {
    let references = [scene(), species()];
    let fields = advice::fields();
    assert!(fields.len() > 30, "{fields:?}");
    for field in &fields {
        let message = answer(field, &references, "trace").unwrap_or_else(|e| panic!("{field}: {e}")).text;
        let name = field.rsplit('.').next().unwrap();
        assert!(message.lines().next().unwrap().ends_with(name), "{field} is explained as {message}");
    }
    assert!(answer("sensor.exposure.Auto.lewel", &references, "trace").is_err());
}

/// Rationale: users follow the advice. Expected: for fields rendered with half the exposure, the first advice is to
/// increase it; for the same fields with higher moisture and equal exposure, the advice is to reduce the moisture and
/// leave the exposure. Source: the changes made here.
#[test]
fn what_was_changed_in_a_scene_file_is_advised_to_be_turned_back() {
    let folder = tempfile::tempdir().unwrap();
    let make = |name: &str, white: f64, moisture: f64| {
        let text = small_text()
            .replace("Field(", &format!("Field(\n    sensor: (exposure: White(level: {white}), noise: (on: false)),"))
            .replace("soil: (", &format!("soil: (moisture: (mean: {moisture}, spread: 0), "));
        let file = folder.path().join(format!("{name}.ron"));
        std::fs::write(&file, text).unwrap();
        let out = folder.path().join(name);
        let arguments =
            ["dataset", "--scene", file.to_str().unwrap(), "--count", "6", "--spp", "8", "--quiet", "--out"];
        let output = trace(&arguments).arg(&out).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        out
    };
    let real = make("real", 0.6, 0.15);
    let advised = |gap: &Gap, field: &str| -> Vec<ChangeDirection> {
        let turns = gap.advice().into_iter().flat_map(|advice| advice.turns);
        turns.filter(|turn| turn.field == field).map(|turn| turn.way).collect()
    };
    let dark = compared(&real, &make("dark", 0.3, 0.15));
    assert_eq!(dark.advice()[0].step, Step::Exposure, "{:?}", dark.advice());
    assert_eq!(advised(&dark, "sensor.exposure.White.level"), [ChangeDirection::Raise]);
    let wet = compared(&real, &make("wet", 0.6, 0.85));
    let ways = advised(&wet, "soil.moisture.mean");
    assert!(!ways.is_empty() && ways[0] == ChangeDirection::Lower, "{:?}", wet.advice());
    assert!(advised(&wet, "sensor.exposure.White.level").is_empty(), "{:?}", wet.advice());
    assert!(wet.pixels.real_mm.is_some() && wet.pixels.real_mm == wet.pixels.synthetic_mm);
}

#[test]
fn folders_that_are_no_set_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    set(&folder.path().join("good"), 1, 2, 0);
    set(&folder.path().join("bad"), 1, 2, 0);
    std::fs::create_dir(folder.path().join("empty")).unwrap();
    write_png(&folder.path().join("bad/labels/001.png"), 8, 8, &Png::Gray(&[0; 64]), "").unwrap();
    for (real, synthetic, words) in [
        ("good", "nothing", "--synthetic nothing: there is no such folder"),
        ("empty", "good", "--real empty: there is no PNG or JPEG in this folder"),
        ("good/images/000.png", "good", "this is not a folder"),
        ("bad", "good", "001.png: it has 8 × 8 pixels, its image 96 × 64"),
    ] {
        let output = run(folder.path(), &["--real", real, "--synthetic", synthetic]);
        let warns = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{warns}");
        assert!(warns.contains(words), "{warns}");
    }
    for arguments in [&["--real", "good"][..], &["good"], &["good", "bad", "--real", "good", "--synthetic", "bad"], &[]]
    {
        assert_eq!(run(folder.path(), arguments).status.code(), Some(2), "{arguments:?}");
    }
    assert!(!folder.path().join("out").exists());
}
