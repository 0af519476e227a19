//! Shipped scene files, species and soils, found by name from any folder, and the folder that `trace init` creates.
//!
//! Rationale: users of an installed program have no clone of the repository whose paths they could name. Expected:
//! names resolve to the shipped files, the user's own files take precedence, and a dataset made from names contains all
//! the files it needs. Source: the names in the species files.

use crate::common::program::{names, scratch};
use std::path::Path;
use std::process::{Command, Output};

/// Runs `trace` in a folder, with FURROW_DATA set to `data`.
fn run(folder: &Path, data: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_trace"));
    command.current_dir(folder).env("FURROW_DATA", data).args(arguments).output().expect("the program")
}

fn repository() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Checks that a run succeeded; returns its stdout.
fn done(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout.clone()).expect("text")
}

/// Checks that a run exited with code 2; returns its stderr.
fn refused(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(2), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stderr.clone()).expect("text")
}

/// A scene file that names a species and a soil by name only.
const BY_NAME: &str = r#"Field(
    camera: Pinhole(size: (48, 36), intrinsics: FieldOfView(horizontal_deg: 30), pose: Nadir(height_m: 0.5)),
    lights: [Constant(radiance: (1, 1, 1, 1))],
    soil: (layers: [(albedo: "dirt.png", height: "dirt.height.png", size_m: 0.5, height_mm: (-4, 8))]),
    plants: [(species: "thistle", growth: Bbch(14))],
)"#;

#[test]
fn scene_files_are_found_by_name_from_an_empty_folder() {
    let (_keep, folder) = scratch();
    std::fs::create_dir(&folder).unwrap();
    let arguments = ["--scene", "02-one-plant", "--width", "32", "--spp", "1", "--quiet"];
    let paths = done(&run(&folder, repository(), &arguments));
    assert!(paths.lines().count() == 7 && paths.lines().all(|path| path.starts_with("out/02-one-plant/")), "{paths}");
    // A file of that name in the folder takes precedence.
    std::fs::write(folder.join("02-one-plant.ron"), "Field(").unwrap();
    assert!(refused(&run(&folder, repository(), &arguments)).contains("02-one-plant.ron:1:"));
    let near = refused(&run(&folder, repository(), &["--scene", "fild"]));
    assert!(near.contains("did you mean field, which ships"), "{near}");
    let lacking = refused(&run(&folder, &folder, &["--scene", "field"]));
    assert!(lacking.contains("FURROW_DATA names a folder without"), "{lacking}");
    let nowhere = refused(&run(&folder, &folder, &["species"]));
    assert!(nowhere.contains("FURROW_DATA"), "{nowhere}");
}

/// Expected: a species and a soil named by name give the same field as by path; the dataset contains copies and names
/// them by path, so that a machine with only the program renders the same bytes.
#[test]
fn a_dataset_holds_what_its_scene_file_names() {
    holds(BY_NAME);
}

/// The same for soil layers that the scene file omits.
#[test]
fn a_dataset_holds_the_soil_that_its_scene_file_leaves_out() {
    let start = BY_NAME.find("layers:").unwrap();
    let end = start + BY_NAME[start..].find(']').unwrap() + 1;
    holds(&[&BY_NAME[..start], BY_NAME[end..].trim_start_matches(',')].concat());
}

/// The same for a user's species based on a shipped one (`like`), whose leaves are in a table.
#[test]
fn a_dataset_holds_what_a_species_is_like() {
    let (_keep, folder) = scratch();
    std::fs::create_dir(&folder).unwrap();
    let own = r#"Species(name: "sinapis", eppo: "OWNSP", role: Weed, like: "sinapis.ron")"#;
    std::fs::write(folder.join("own.ron"), own).unwrap();
    std::fs::write(folder.join("mine.ron"), BY_NAME.replace("thistle", "own.ron")).unwrap();
    let scene = ["--scene", "mine.ron", "--spp", "1", "--quiet"];
    done(&run(&folder, repository(), &[&["dataset"], &scene[..], &["--count", "1", "--out", "data"]].concat()));
    let held = |path: &str| std::fs::read_to_string(folder.join("data/scene").join(path)).unwrap_or_default();
    assert_eq!(held("own.ron"), own.replace("sinapis.ron", "external/scenes/species/sinapis.ron"));
    for file in ["species/sinapis.ron", "species/rape.ron", "species/sinapis.csv"] {
        assert!(!held(&format!("external/scenes/{file}")).is_empty(), "{file}");
    }
    done(&run(&folder, Path::new("/nowhere"), &["dataset", "verify", "data", "--rerender", "1"]));
}

fn holds(text: &str) {
    let (_keep, folder) = scratch();
    std::fs::create_dir(&folder).unwrap();
    std::fs::write(folder.join("mine.ron"), text).unwrap();
    let scene = ["--scene", "mine.ron", "--spp", "1", "--quiet"];
    let labels = |out: &str| std::fs::read(folder.join(out).join("semantics.png")).unwrap();
    done(&run(&folder, repository(), &[&scene[..], &["--out", "by-name"]].concat()));
    let plan = [&["dataset"], &scene[..], &["--count", "2", "--out", "data"]].concat();
    done(&run(&folder, repository(), &plan));
    let text = std::fs::read_to_string(folder.join("data/scene/mine.ron")).unwrap();
    assert!(text.contains(r#"species: "external/scenes/species/cirsium.ron""#), "{text}");
    assert!(text.contains(r#"albedo: "external/textures/soil/dirt.png""#), "{text}");
    let verified = run(&folder, Path::new("/nowhere"), &["dataset", "verify", "data", "--rerender", "2"]);
    done(&verified);
    // The copy is an ordinary scene file.
    let copy = ["--scene", "data/scene/mine.ron", "--spp", "1", "--quiet", "--out", "by-path"];
    done(&run(&folder, Path::new("/nowhere"), &copy));
    let pixels = |out: &str| furrow_output::read_indexed(&folder.join(out).join("semantics.png")).unwrap();
    assert_eq!(pixels("by-name"), pixels("by-path"));
    assert!(!labels("by-name").is_empty());
    // Running the same command again continues the dataset.
    done(&run(&folder, repository(), &plan));
}

#[test]
fn a_name_that_no_species_has_is_shown_where_it_stands() {
    let (_keep, folder) = scratch();
    std::fs::create_dir(&folder).unwrap();
    for (name, words) in [
        ("thistel", "did you mean `thistle`?"),
        ("grass", "barnyard grass or annual meadow-grass"),
        ("thistle.ron", "there is no file `thistle.ron`"),
    ] {
        std::fs::write(folder.join("mine.ron"), BY_NAME.replace("thistle", name)).unwrap();
        let message = refused(&run(&folder, repository(), &["--scene", "mine.ron"]));
        assert!(message.contains("mine.ron:5:") && message.contains(words), "{message}");
    }
    // A file of the user takes precedence.
    std::fs::write(folder.join("cirsium"), "Species(").unwrap();
    std::fs::write(folder.join("mine.ron"), BY_NAME.replace("thistle", "cirsium")).unwrap();
    let message = refused(&run(&folder, repository(), &["--scene", "mine.ron"]));
    assert!(message.contains("cirsium:1:"), "{message}");
}

#[test]
fn a_folder_of_ones_own_renders_at_once() {
    let (_keep, folder) = scratch();
    std::fs::create_dir(&folder).unwrap();
    let paths = done(&run(&folder, repository(), &["init", "my-field"]));
    assert!(paths.lines().all(|path| folder.join(path).is_file()) && paths.contains("my-field/field.ron"), "{paths}");
    // No other files are needed.
    let own = folder.join("my-field");
    let render = ["--scene", "field.ron", "--width", "32", "--spp", "1", "--quiet"];
    done(&run(&own, Path::new("/nowhere"), &render));
    assert_eq!(names(&own.join("out/field")).len(), 7);
    let readme = std::fs::read_to_string(own.join("README.md")).unwrap();
    assert!(readme.lines().count() <= 25, "{}", readme.lines().count());
    let again = refused(&run(&folder, repository(), &["init", "my-field"]));
    assert!(again.contains("not empty"), "{again}");
    std::fs::create_dir(folder.join("empty")).unwrap();
    done(&run(&folder, repository(), &["init", "empty"]));
}

#[test]
fn lists_have_a_line_for_everything_that_ships() {
    let (_keep, folder) = scratch();
    std::fs::create_dir(&folder).unwrap();
    let list = |what: &str| done(&run(&folder, repository(), &[what]));
    let species = list("species");
    assert_eq!(
        species.lines().count(),
        names(&repository().join("scenes/species")).iter().filter(|name| name.strip_suffix(".ron").is_some()).count()
    );
    let thistle = species.lines().find(|line| line.starts_with("cirsium ")).expect("the thistle");
    let words: Vec<&str> = thistle.split("  ").map(str::trim).filter(|word| !word.is_empty()).collect();
    assert_eq!(words[..6], ["cirsium", "Cirsium arvense", "creeping thistle", "CIRAR", "weed", "BBCH 10 to 19"]);
    let others: Vec<&str> = words[6].split(", ").collect();
    assert!(others.contains(&"Ackerkratzdistel"), "{others:?}");
    let beet = species.lines().find(|line| line.starts_with("sugar_beet ")).expect("the beet");
    assert!(["BBCH 9 to 65", "Zuckerrübe", "BEAVA"].iter().all(|word| beet.contains(word)), "{beet}");
    let cameras = list("cameras");
    for words in [
        "JaiAd130",
        "1296 × 966 pixels",
        "18.4° × 13.8°",
        "4.86 × 3.62 mm",
        "Phone",
        "rolling shutter of 20 ms",
        "Pinhole",
    ] {
        assert!(cameras.contains(words), "no {words} in\n{cameras}");
    }
    let soils = list("soils");
    for words in ["Loess", "R 0.220, G 0.144, B 0.088, NIR 0.273", "albedo: \"dirt.png\"", "crust", "stony"] {
        assert!(soils.contains(words), "no {words} in\n{soils}");
    }
}
