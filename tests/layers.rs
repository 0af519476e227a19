//! Multi-layer EXR with Cryptomattes: independent readers find every object's coverage and every id.
//!
//! Rationale: a matte is correct if compositing programs decode it to the fractions of the rendered samples. Expected:
//! exact equality in single precision for every object and pixel; 32-bit ids up to 4 × 10⁹; equal bytes in every run.
//! Source: cryptomatte-api 1.0.0, OpenEXR 3.5.3 (Python); without them the tests are skipped with a note, or fail with
//! `FURROW_REQUIRE_PEERS=1`.

use crate::common::program::{field, shoot, small_text};
use crate::common::python::python;
use furrow_base::geometry::Window;
use furrow_base::math::Vec3;
use furrow_field::assemble::Options;
use furrow_output::encode_layers;
use furrow_render::film::{Film, Pixel, Tally};
use furrow_render::render::LabelMap;
use furrow_render::scene::tag::{Class, Tag};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

/// Names of the objects in each matte, defined here independently.
fn names(tags: &[Tag]) -> BTreeMap<&'static str, Vec<String>> {
    let of = |f: fn(&Tag) -> String| tags.iter().map(f).collect();
    let plant = |t: &Tag| if t.plant == 0 { "ground".into() } else { format!("plant_{}", t.plant) };
    let leaf = |t: &Tag| match (t.plant, t.leaf) {
        (0, _) => "ground".to_owned(),
        (plant, 0) => format!("plant_{plant}/stem"),
        (plant, leaf) => format!("plant_{plant}/leaf_{leaf}"),
    };
    BTreeMap::from([
        ("CryptoClass", of(|t| t.class.name().into())),
        ("CryptoPlant", of(plant)),
        ("CryptoLeaf", of(leaf)),
    ])
}

/// Coverage of every object in every pixel, and the ids, as a reader should find them.
fn expected(film: &Film, labels: &LabelMap, tags: &[Tag]) -> Value {
    let mut mattes = serde_json::Map::new();
    for (layer, names) in names(tags) {
        let mut objects: BTreeMap<&str, Vec<f32>> = BTreeMap::new();
        for name in &names {
            objects.insert(name, vec![0.0; film.pixels.len()]);
        }
        for (k, pixel) in film.pixels.iter().enumerate() {
            let mut counts: BTreeMap<&str, u32> = BTreeMap::new();
            pixel.tally.iter().for_each(|(part, n)| *counts.entry(&names[part as usize]).or_default() += n);
            for (name, n) in counts {
                objects.get_mut(name).unwrap()[k] = (f64::from(n) / f64::from(pixel.samples)) as f32;
            }
        }
        mattes.insert(layer.into(), json!(objects));
    }
    let ids = |f: &dyn Fn(usize) -> u32| (0..labels.tags.len()).map(f).collect::<Vec<u32>>();
    json!({
        "mattes": mattes,
        "ids": {
            "id.class": ids(&|i| labels.tags[i].class as u32),
            "id.plant": ids(&|i| labels.tags[i].plant),
            "id.leaf": ids(&|i| labels.tags[i].leaf.into()),
            "id.part": ids(&|i| labels.parts[i].wrapping_add(1)),
        },
        "radiance": film.pixels.iter().map(|p| p.mean.to_array()).collect::<Vec<_>>(),
    })
}

/// Lets the readers compare a file with the expected values.
fn ask(name: &str, film: &Film, labels: &LabelMap, tags: &[Tag]) {
    let Some(python) = python("import OpenEXR, cryptomatte_api") else { return };
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("layers").join(name);
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("image.exr"), encode_layers(film, labels, tags, "a comment").unwrap()).unwrap();
    std::fs::write(folder.join("expected.json"), expected(film, labels, tags).to_string()).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/formats/check_layers.py");
    let output = Command::new(python).arg(script).arg(&folder).env("PYTHONDONTWRITEBYTECODE", "1").output().unwrap();
    assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
    eprintln!("{}", String::from_utf8_lossy(&output.stdout));
}

fn tag(class: Class, plant: u32, leaf: u16) -> Tag {
    Tag { class, plant, leaf }
}

/// Builds a row of pixels, given the parts hit by their samples; part 0 is ground, each other part a leaf of its own
/// plant.
fn row(pixels: &[&[(u32, u32)]]) -> (Film, LabelMap, Vec<Tag>) {
    let pixel = |met: &&[(u32, u32)]| {
        let mut tally = Tally::default();
        met.iter().for_each(|(part, n)| (0..*n).for_each(|_| tally.add(*part)));
        Pixel { samples: 64, tally, ..Pixel::default() }
    };
    let window = Window::full(pixels.len() as u32, 1);
    let film = Film { window, pixels: pixels.iter().map(pixel).collect() };
    let mut tags = vec![tag(Class::Soil, 0, 0)];
    tags.extend((1..=12).map(|k| tag(if k % 2 == 0 { Class::Crop } else { Class::Weed }, k, k as u16 % 3)));
    let n = pixels.len();
    // The largest ids that 32 bits hold, including "no part".
    let parts = (0..n).map(|k| if k == 0 { u32::MAX } else { 3_999_999_990 + k as u32 }).collect();
    let tags_seen = (0..n).map(|k| tags[k % tags.len()]).collect();
    let labels = LabelMap { window, parts, tags: tags_seen, depth: vec![1.0; n], normals: vec![Vec3::Z; n] };
    (film, labels, tags)
}

#[test]
fn an_edge_pixel_is_three_quarters_of_one_plant_and_a_quarter_of_the_other() {
    let crowd: Vec<(u32, u32)> = (0..9).map(|part| (part, 7)).collect();
    // 48 of 64 and 16 of 64 samples; no hits; nine objects, more than the six for which every file has room; half of
    // the samples without a hit.
    let (film, labels, tags) = row(&[&[(1, 48), (2, 16)], &[], &crowd, &[(0, 32)], &[(3, 64)]]);
    let found = expected(&film, &labels, &tags);
    assert_eq!(found["mattes"]["CryptoPlant"]["plant_1"][0], 0.75);
    assert_eq!(found["mattes"]["CryptoPlant"]["plant_2"][0], 0.25);
    ask("row", &film, &labels, &tags);
}

#[test]
fn every_object_of_a_field_is_decoded_with_its_coverage() {
    let options = Options { width: Some(96), height: Some(72), ..Options::default() };
    let field = field(&small_text(), &options);
    let (film, labels) = shoot(&field, 8, 2);
    let tags = field.scene.tags();
    let mixed = film.pixels.iter().filter(|p| p.tally.iter().count() > 1).count();
    assert!(mixed > 100, "{mixed} pixels show more than one part: too few edges");
    ask("field", &film, &labels, &tags);
}

#[test]
fn equal_films_are_equal_bytes() {
    let (film, labels, tags) = row(&[&[(1, 48), (2, 16)]]);
    let first = encode_layers(&film, &labels, &tags, "").unwrap();
    for _ in 0..20 {
        assert!(
            encode_layers(&film, &labels, &tags, "").unwrap() == first,
            "the order of the header's attributes varies"
        );
    }
}
