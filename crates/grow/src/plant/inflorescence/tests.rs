//! Flowering plants of the species files: sizes, counts, invariants and refused descriptions.

use super::*;
use crate::plant::{Plant, PlantDesc, Stage, grow as grow_plant, most_triangles};
use furrow_base::geometry::Mesh;
use furrow_base::math::ToFloat;
use furrow_field::species_text::SpeciesFile;
use serde::Deserialize;
use serde::de::IgnoredAny;

/// The fields of a species file that these tests read.
#[derive(Deserialize)]
#[serde(rename = "Species")]
struct Page {
    eppo: String,
    #[serde(default)]
    #[allow(dead_code)]
    materials: IgnoredAny,
    plant: PlantDesc,
}

/// Returns the species files whose plants flower.
fn flowering() -> Vec<Page> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/species");
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().path()).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "ron"));
    files.sort();
    let read = |f: &std::path::PathBuf| {
        let file = SpeciesFile::read(f).unwrap_or_else(|e| panic!("{e}"));
        ron::from_str::<Page>(&file.page().text).unwrap_or_else(|e| panic!("{}: {e}", f.display()))
    };
    files.iter().map(read).filter(|page| !page.plant.flowers.is_empty()).collect()
}

fn stream(seed: u64) -> Stream {
    Stream::of(seed, 0, Purpose::Plant, 3)
}

/// Returns the cells of `tests/ref/species_flowers.csv`, row by row.
fn table() -> Vec<Vec<String>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/ref/species_flowers.csv");
    let text = std::fs::read_to_string(path).unwrap();
    let rows = text.lines().filter(|l| !l.starts_with('#')).skip(1);
    rows.map(|row| row.split(',').map(str::to_owned).collect()).collect()
}

/// Returns the bounding box diagonal of the largest connected piece of this material, mm, and the number of pieces.
fn measured(plant: &Plant, material: &str) -> (f32, usize) {
    let mut all = Mesh::default();
    for organ in plant.organs.iter().filter(|o| o.material == material) {
        all.append(&organ.mesh);
    }
    let pieces = all.pieces();
    let extent = |mesh: &Mesh| mesh.bounds().map_or(0.0, |(lo, hi)| lo.distance(hi));
    (pieces.iter().map(extent).fold(0.0, f32::max) * 1e3, pieces.len())
}

/// Expected: sizes and counts within the ranges of the table, for all seeds. Source: the sources of the table.
#[test]
fn flowers_lie_within_the_table() {
    let pages = flowering();
    for row in table() {
        let [eppo, bbch, material] = [&row[0], &row[1], &row[2]];
        let plant = &pages.iter().find(|p| p.eppo == *eppo).unwrap_or_else(|| panic!("{eppo} does not flower")).plant;
        let range: Vec<f32> = row[3..7].iter().map(|cell| cell.parse().unwrap()).collect();
        for seed in 0..10 {
            let plant = grow_plant(plant, Stage::Bbch(bbch.parse().unwrap()), &stream(seed));
            let (largest, count) = measured(&plant, material);
            let at = format!("{eppo} {bbch} {material} seed {seed}: {largest} mm, {count}");
            assert!((range[0]..=range[1]).contains(&largest), "{at}");
            assert!((range[2]..=range[3]).contains(&count.to_f32()), "{at}");
        }
    }
}

/// Rationale: an estimate that is too low allows scenes that exceed the limits. Expected: no plant has more triangles
/// than the estimate, at the stages and between them.
#[test]
fn the_estimate_of_triangles_holds() {
    for page in flowering() {
        let most = most_triangles(&page.plant);
        let (first, last) = page.plant.days();
        for seed in 0..10 {
            let age = first + (last - first) * (0.5 + 0.05 * (seed + 1).to_f32());
            let plant = grow_plant(&page.plant, Stage::Age(age), &stream(seed));
            let count: usize = plant.organs.iter().map(|o| o.mesh.triangles.len()).sum();
            assert!(count.to_f64() <= most, "{} on day {age}: {count} of {most}", page.eppo);
        }
    }
}

/// Rationale: labels distinguish organs by these kinds. Expected: flowers, heads, ears, tassels and pods belong to no
/// leaf; every plant at BBCH 65 has some; before the first stage with flowering axes there are none.
#[test]
fn flowers_are_there_when_the_stage_has_them() {
    let blooms = |plant: &Plant| {
        let is = |kind| {
            use OrganKind::{Bud, Ear, Flower, Head, Tassel};
            matches!(kind, Flower | Bud | Head | Ear | Tassel)
        };
        plant.organs.iter().filter(|o| is(o.kind)).inspect(|o| assert_eq!(o.leaf, 0)).count()
    };
    for page in flowering() {
        let first = page.plant.stages.iter().position(|s| !s.inflorescences.is_empty()).unwrap();
        for seed in 0..10 {
            let at = |stage: Stage| grow_plant(&page.plant, stage, &stream(seed));
            assert!(blooms(&at(Stage::Bbch(65))) > 0, "{}: nothing flowers", page.eppo);
            let before = &page.plant.stages[first - 1];
            assert_eq!(blooms(&at(Stage::Bbch(before.bbch))), 0, "{}", page.eppo);
        }
    }
}

/// Rationale: flowers have their own random streams. Expected: the leaves of a plant are the same with and without its
/// flowers.
#[test]
fn flowers_move_no_leaf() {
    for page in flowering() {
        let mut bare = page.plant.clone();
        bare.stages.iter_mut().for_each(|stage| stage.inflorescences.clear());
        let [with, without] = [&page.plant, &bare].map(|p| grow_plant(p, Stage::Bbch(65), &stream(5)));
        assert_eq!(with.organs[..without.organs.len()], without.organs[..], "{}", page.eppo);
        assert!(with.organs.len() > without.organs.len());
    }
}

/// Expected: a terminal flower is at the end of its axis, whose length is that of the file; a second axis starts on the
/// first.
#[test]
fn an_axis_is_as_long_as_written_and_bears_its_flower_at_its_end() {
    let text = r#"(form: Rosette, vigour: 1, lean_deg: 0, kinds: {"leaf": (shape: Sheet(outline: Power(a: 0.5, b: 0.5)))},
        flowers: {"ball": Berry(sepals: 0)}, stages: [(bbch: 65, days: 3, hypocotyl_mm: 5, stem_mm: 2, layers: [
            (kind: "leaf", blade_mm: 5, width_mm: 3, angle_deg: 50)], inflorescences: [
            (name: "scape", at: Tip, length_mm: 200, width_mm: 2, flowers: [(kind: "ball", size_mm: 6)]),
            (at: On(axis: "scape", from: 0.5, to: 0.5), length_mm: 50, width_mm: 1, angle_deg: 90, flowers: [(kind: "ball", size_mm: 4)]),
        ])])"#;
    let desc: PlantDesc = ron::from_str(text).unwrap();
    for seed in 0..10 {
        let plant = grow_plant(&desc, Stage::Bbch(65), &stream(seed));
        let berries = plant.organs.iter().find(|o| o.kind == OrganKind::Berry).unwrap().mesh.pieces();
        let middle = |mesh: &Mesh| mesh.bounds().map(|(lo, hi)| 0.5 * (lo + hi)).unwrap();
        assert_eq!(berries.len(), 2);
        // Hypocotyl 5 mm, crown about 1 mm, a slightly curved scape of 200 mm, half of the berry.
        let (high, low) = (middle(&berries[0]), middle(&berries[1]));
        assert!((0.195..0.2105).contains(&high.z), "{high}");
        assert!((0.09..0.14).contains(&low.z) && low.truncate().distance(high.truncate()) > 0.035, "{low}");
    }
    for (from, to, says) in [
        ("axis: \"scape\"", "axis: \"scale\"", "no flowering axis before this one is called \"scale\""),
        ("kind: \"ball\", size_mm: 6", "kind: \"bell\", size_mm: 6", "no flower is called \"bell\""),
        ("at: Tip", "at: Axils(first: 0, last: 2)", "a whole number from 1"),
        ("at: Tip", "at: Tip, count: 401", "flowering axes"),
    ] {
        let page = text.replacen(from, to, 1);
        assert_ne!(page, text);
        let message = ron::from_str::<PlantDesc>(&page).unwrap_err().to_string();
        assert!(message.contains(says), "{message}");
    }
}
