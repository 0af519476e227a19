//! What a field will take is told before it grows, and what is too much is refused.
//!
//! Rationale: a scene file that asks for a thousand times too many clods must not take all of a machine's memory before it fails, and the
//! estimate that says so must not refuse what is ordinary. Expected: for each shipped scene file, and for dense ones, the estimate is at
//! least half of the triangles that grow and at most three times as many: plants beside the view are grown, and dropped. Source: the fields.

use crate::common::program::{scratch, small_text, trace};
use furrow::render;
use furrow::scene::assemble::{self, Options, Source};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Estimated triangles over those that grew: plants that share meshes have them once.
fn ratio(path: &Path, options: &Options) -> f64 {
    let pool = render::pool(0).expect("a pool");
    pool.install(|| {
        let expected = Source::open(path).unwrap_or_else(|e| panic!("{e}")).estimate(options).expect("an estimate");
        let field = assemble::field(path, options).unwrap_or_else(|e| panic!("{e}"));
        let meshes: BTreeMap<_, _> =
            field.scene.parts.iter().map(|part| (Arc::as_ptr(&part.mesh), part.mesh.triangles.len())).collect();
        expected.total().triangles / meshes.values().sum::<usize>() as f64
    })
}

fn near(ratio: f64, name: &str) {
    assert!((0.5..3.0).contains(&ratio), "{name}: {ratio}");
}

/// The small scene file with its soil replaced, in a folder that stays as long as the first value.
fn with_soil(soil: &str) -> (tempfile::TempDir, PathBuf) {
    let (keep, _) = scratch();
    let text = small_text();
    let (from, to) = (text.find("soil: (").expect("soil"), text.find("\n    crops").expect("crops"));
    let path = keep.path().join("page.ron");
    let here = std::env::current_dir().expect("a folder");
    let text = format!("{}{soil},{}", &text[..from], &text[to..]);
    let text = text.replace("\"scenes/", &format!("\"{}/scenes/", here.display()));
    std::fs::write(&path, text).expect("a file");
    (keep, path)
}

#[test]
fn the_scene_files_that_ship_grow_as_estimated() {
    let options = Options { width: Some(96), ..Options::default() };
    let scenes = std::fs::read_dir("scenes").expect("scenes").map(|e| e.expect("an entry").path());
    let scenes: Vec<PathBuf> = scenes.filter(|path| path.extension().is_some_and(|e| e == "ron")).collect();
    assert!(scenes.len() >= 15);
    for path in scenes {
        near(ratio(&path, &options), &path.display().to_string());
    }
}

/// Each as dense as a test can afford: what is estimated for a thousand times more is counted by the same rule.
#[test]
fn dense_ground_grows_as_estimated() {
    for soil in [
        "soil: (clods: (over_5mm_per_m2: 60000))",
        "soil: (clods: (over_5mm_per_m2: 3000, min_mm: 1.2))",
        "soil: (clods: (over_5mm_per_m2: 0), stones: [(cover: 0.3, median_mm: 3, min_mm: 1)])",
        "soil: (clods: (over_5mm_per_m2: 0), stones: [(cover: 0.2, median_mm: 40, max_mm: 100)])",
        "soil: (clods: (over_5mm_per_m2: 0), litter: (straw_cover: 0.9))",
        "soil: (clods: (over_5mm_per_m2: 0), litter: (sticks_per_m2: 8000, stubs: 12))",
        "soil: (clods: (over_5mm_per_m2: 0), litter: (bits_per_m2: 60000))",
    ] {
        let (_keep, path) = with_soil(soil);
        near(ratio(&path, &Options::default()), soil);
    }
}

/// Expected: exit code 2, the field that is to blame under a caret, the limit, and what to do; nothing is written, and nothing grown, which
/// would take hours or all memory.
#[test]
fn what_would_take_too_much_is_refused_where_it_stands() {
    for (soil, blamed) in [
        ("soil: (\n clods: (over_5mm_per_m2: 9e11)\n)", "clods"),
        ("soil: (\n clods: (min_mm: 0.001),\n)", "clods"),
        ("soil: (\n crumbs: (min_mm: 0.0001),\n)", "crumbs"),
        ("soil: (\n stones: [(cover: 0.5), (cover: 0.5, median_mm: 0.0001, min_mm: 0.0001)],\n)", "stones"),
        ("soil: (\n litter: (straw_cover: 0.9, straw_width_mm: 0.0001),\n)", "straw_cover"),
        ("soil: (\n litter: (sticks_per_m2: 1e12),\n)", "sticks_per_m2"),
        ("soil: (\n litter: (sticks_per_m2: 10, stubs: 1000000),\n)", "sticks_per_m2"),
        ("soil: (\n litter: (bits_per_m2: 1e12),\n)", "bits_per_m2"),
    ] {
        let (keep, path) = with_soil(soil);
        let out = keep.path().join("out");
        let scene = path.to_str().expect("UTF-8");
        let run = trace(&["--scene", scene, "--out", out.to_str().expect("UTF-8"), "--spp", "1", "--memory", "2"]);
        let said = refused(run);
        let line = soil.lines().position(|line| line.contains(blamed)).expect("a line of it");
        let first = said.lines().next().unwrap_or_default();
        assert!(first.contains("this field would take about"), "{soil}: {said}");
        assert!(said.contains("the limit is") && said.contains(" help: "), "{soil}: {said}");
        assert!(said.lines().any(|l| l.contains(soil.lines().nth(line).expect("a line").trim())), "{soil}: {said}");
        assert!(!out.exists());
    }
}

#[test]
fn the_limit_is_raised_by_a_flag_and_changes_no_byte() {
    let (keep, path) = with_soil("soil: (clods: (over_5mm_per_m2: 0), litter: (bits_per_m2: 60000))");
    let scene = path.to_str().expect("UTF-8");
    let out = |name: &str| keep.path().join(name);
    let run = |memory: &str, name: &str| {
        let out = out(name);
        trace(&[
            "--scene",
            scene,
            "--out",
            out.to_str().expect("UTF-8"),
            "--spp",
            "1",
            "--width",
            "64",
            "--memory",
            memory,
        ])
    };
    let said = refused(run("0.1", "small"));
    assert!(said.contains("the limit is 0.1 GiB") && said.contains("--memory"), "{said}");
    for name in ["8", "9"] {
        assert!(run(name, name).output().expect("the program").status.success());
    }
    for file in ["rgb.png", "radiance.exr", "plants.png"] {
        assert_eq!(std::fs::read(out("8").join(file)).expect(file), std::fs::read(out("9").join(file)).expect(file));
    }
}

/// A field is refused in each verb that grows it.
#[test]
fn every_verb_that_grows_a_field_refuses_it() {
    let (keep, path) = with_soil("soil: (clods: (over_5mm_per_m2: 9e11))");
    let scene = path.to_str().expect("UTF-8");
    let out = keep.path().join("out.png");
    let out = out.to_str().expect("UTF-8");
    for arguments in [
        vec!["preview", scene, "--out", out],
        vec!["dataset", "--scene", scene, "--count", "2", "--out", out],
        vec!["export", "--scene", scene, "--format", "gltf", "--out", out],
        vec!["--scene", scene, "--pixel", "1,1"],
    ] {
        assert!(refused(trace(&arguments)).contains("of memory"), "{arguments:?}");
        assert!(!Path::new(out).exists(), "{arguments:?}");
    }
}

/// Lights, cameras and species files that no field was meant to have.
#[test]
fn what_no_field_was_meant_to_have_is_refused() {
    let camera = |height: &str| {
        format!(
            "Field(camera: Pinhole(size: (8, 8), intrinsics: FieldOfView(horizontal_deg: 0.0001), pose: Nadir(height_m: {height})), soil: ())"
        )
    };
    let lights = |n: usize| {
        let light = "Constant(radiance: (1, 1, 1, 1)), ".repeat(n);
        format!("Field(camera: JaiAd130(), lights: [{light}], plants: [(species: \"maize\", growth: Bbch(12))])")
    };
    let refused = |text: &str| match assemble::field_of(text, &Options { width: Some(8), ..Options::default() }) {
        Ok(_) => panic!("not refused: {text:.100}"),
        Err(error) => error.to_string(),
    };
    assert!(refused(&camera("4000000000")).contains("more than 1000 m"));
    assert!(refused(&lights(257)).contains("257 lights"));
    assert!(assemble::field_of(&lights(256), &Options { width: Some(8), ..Options::default() }).is_ok());
}

/// Runs a command that must be refused; returns what it said.
fn refused(mut command: std::process::Command) -> String {
    let output = command.output().expect("the program");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{command:?}: {said}");
    said
}
