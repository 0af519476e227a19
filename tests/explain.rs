//! Method: run `trace explain` and the generation of reference pages like a user. Expected: the pages in
//! `docs/reference` equal the current output of the programs, and every command that an error suggests gives an answer.
//!
//! `cargo run -- reference` and `cargo run --features train --bin train -- reference` regenerate the pages.

use furrow_field::assemble::{Options, Source};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn trace(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_trace")).args(arguments).output().unwrap()
}

fn message(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn pages_are_fresh(program: &str) {
    let folder = tempfile::tempdir().unwrap();
    let output = Command::new(program).args(["reference", "--out"]).arg(folder.path()).output().unwrap();
    let written = message(&output);
    assert!(written.lines().count() >= 2, "{written}");
    for path in written.lines().map(Path::new) {
        let name = path.file_name().unwrap();
        let there = fs::read_to_string(Path::new("docs/reference").join(name)).unwrap_or_default();
        assert!(there == fs::read_to_string(path).unwrap(), "docs/reference/{} is outdated", name.display());
    }
}

#[test]
fn the_generated_pages_are_fresh() {
    pages_are_fresh(env!("CARGO_BIN_EXE_trace"));
    #[cfg(feature = "train")]
    pages_are_fresh(env!("CARGO_BIN_EXE_train"));
}

#[test]
fn a_field_is_explained_with_unit_range_default_and_example() {
    let words = message(&trace(&["explain", "soil.clods.over_5mm_per_m2"]));
    for part in ["longer than 5 mm", "between 0 and 1000000", "m⁻²", "Uniform(8000, 14000)", "number or distribution"]
    {
        assert!(words.contains(part), "{part}: {words}");
    }
    let words = message(&trace(&["explain", "camera.JaiAd130"]));
    assert!(words.contains("height_m") && words.contains("default 0.85"), "{words}");
    // A name without its path, and a name that occurs in several places.
    assert_eq!(message(&trace(&["explain", "moisture"])), message(&trace(&["explain", "soil.moisture"])));
    let words = message(&trace(&["explain", "azimuth_deg"]));
    assert!(words.contains("crops.rows.azimuth_deg") && words.contains("species.plant.azimuth_deg"), "{words}");
    assert!(message(&trace(&["explain", "species.plant.stages.layers.blade_mm"])).contains("mm"));
}

#[test]
fn the_tree_names_everything_once() {
    let words = message(&trace(&["explain"]));
    for name in ["camera", "clods", "over_5mm_per_m2", "Daylight", "spacing_m"] {
        assert!(words.lines().any(|line| line.trim_start().starts_with(name)), "{name}: {words}");
    }
    assert!(words.contains("trace explain species"), "{words}");
}

#[test]
fn what_is_not_there_is_refused_with_the_nearest() {
    let output = trace(&["explain", "soil.clouds"]);
    let words = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2));
    assert!(words.contains("there is no `soil.clouds`") && words.contains("did you mean `soil.clods`"), "{words}");
    for path in ["camera.Fone.height_m", "soil.moisture.mean.nothing"] {
        let words = String::from_utf8(trace(&["explain", path]).stderr).unwrap();
        assert!(words.contains(&format!("there is no `{path}`")), "{words}");
    }
    assert_eq!(trace(&["explain", "xyzzy"]).status.code(), Some(2));
    // A word that is no path lists what contains it.
    for word in ["corn", "sun angle"] {
        let found = message(&trace(&["explain", word]));
        assert_eq!(found.split_once('\n').unwrap().1, message(&trace(&["explain", "--search", word])));
    }
    let output = String::from_utf8(trace(&["explain", "oat"]).stderr).unwrap();
    assert!(output.contains("there is no `oat`") && output.contains("`trace species` lists the species"), "{output}");
    let words = message(&trace(&["explain", "distribution"]));
    assert!(words.contains("LogNormal") && words.contains("median"), "{words}");
}

/// Words that users of the documentation typed, each with the line that it must find; those of species come first.
#[test]
fn words_of_users_find_what_they_mean() {
    for (word, line) in [
        ("row spacing", "crops.rows.spacing_m"),
        ("Reihenabstand", "crops.rows.spacing_m"),
        ("sun angle", "lights.Daylight.sun.Angles.elevation_deg"),
        ("field of view", "camera.Pinhole.intrinsics.FieldOfView"),
        ("camera height", "camera.JaiAd130.height_m"),
        ("height", "camera.JaiAd130.height_m"),
        ("wet soil", "soil.moisture"),
        ("wet", "soil.moisture"),
        ("image width", "camera.Pinhole.size"),
        ("missing plants", "crops.rows.emergence"),
        ("weed density", "models.spread.per_m2"),
        ("depth of field", "camera.Pinhole.aperture"),
        ("residue", "soil.litter"),
        ("cloudy", "lights.Overcast"),
    ] {
        let found = message(&trace(&["explain", word]));
        assert!(found.lines().any(|l| l.split("  ").any(|part| part.trim() == line)), "{word}: {found}");
    }
    for (word, species) in [
        ("potatoes", "potato"),
        ("Bohnen", "bean"),
        ("judia", "bean"),
        ("Moehre", "carrot"),
        ("Gansefuss", "chenopodium"),
        ("pomme-de-terre", "potato"),
        ("Zuckerrube", "sugar_beet"),
        ("ble", "wheat"),
        ("Raps", "rape"),
    ] {
        let found = message(&trace(&["explain", word]));
        assert!(
            found.lines().nth(1).is_some_and(|l| l.starts_with(&format!("species: {species:?}"))),
            "{word}: {found}"
        );
        assert!(furrow_field::shipped::species(word).is_ok_and(|file| file.is_some()), "{word}");
    }
}

#[test]
fn every_command_that_an_error_names_answers() {
    let references =
        [furrow_cli::reference::scene(), furrow_cli::reference::species(), furrow_cli::reference::texture()];
    let mut asked = 0;
    for entry in fs::read_dir("tests/bad").unwrap() {
        let path = entry.unwrap().path();
        let Some(text) = path.extension().filter(|e| *e == "txt").map(|_| fs::read_to_string(&path).unwrap()) else {
            continue;
        };
        for command in text.lines().filter_map(|line| line.strip_prefix(" see:  trace explain")) {
            let answer = furrow_cli::reference::answer(command.trim(), &references, "trace");
            assert!(answer.is_ok(), "{}: {command}: {}", path.display(), answer.err().unwrap());
            asked += 1;
        }
    }
    assert!(asked > 30, "{asked} errors name a command");
}

/// Method: typical mistakes of users who have not read the documentation. Expected: all missing fields are reported at
/// once, with the correct form of what is wrong.
#[test]
fn messages_show_what_to_write() {
    let folder = tempfile::tempdir().unwrap();
    let answer_to = |text: &str| {
        let file = folder.path().join("field.ron");
        fs::write(&file, text).unwrap();
        let output = trace(&["--scene", file.to_str().unwrap()]);
        assert_eq!(output.status.code(), Some(2));
        String::from_utf8(output.stderr).unwrap()
    };
    let words = answer_to("Field(camera: JaiAd130(), soil: (layers: [(share: 1)]))");
    assert!(words.contains("fields `albedo`, `size_m`, `height_mm` of layer are missing"), "{words}");
    assert!(words.contains("see:  trace explain soil.layers"), "{words}");
    let words = answer_to("Field(camera: JaiAd130(height_m: Normal(0.8, 0.02)))");
    assert!(words.contains("write Normal(mean: 0.8, sd: 0.02)"), "{words}");
    let words = answer_to("Field(camera: JaiAd130(), crops: [(species: \"maize\", growth: 18, rows: ())])");
    assert!(words.contains("write AgeDays(18) or Bbch(18)"), "{words}");
    let words = answer_to("Field(camera: Phone, soil: ())");
    assert!(words.contains("Phone has no brackets") && words.contains("write Phone()"), "{words}");
    // The suggested path ends at its last valid part.
    let words = answer_to("Field(camera: JaiAd130(), soyl: (clods: (max_mm 3)))");
    let see = words.lines().find_map(|line| line.strip_prefix(" see:  ")).unwrap_or_else(|| panic!("{words}"));
    assert_eq!(see, "trace explain", "{words}");
    let words = answer_to("Field(camera: JaiAd130(height_m: [0.8, 0.9]))");
    assert!(words.contains("write Uniform(0.8, 0.9)"), "{words}");
}

/// Expected: the explanations of soil agree with the program's limits and with the tutorial scenes.
#[test]
fn explanations_of_soil_match_the_limits() {
    let answer_to = |path: &str| {
        let words = message(&trace(&["explain", path]));
        words.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    assert_eq!(furrow_grow::soil::MAX_LAYERS, 4);
    assert!(answer_to("soil").contains("One to four layers"), "{}", answer_to("soil"));
    assert!(fs::read_to_string("scenes/11-drone.ron").unwrap().contains("patch_m: 2.5"));
    let patches = answer_to("soil.moisture.patch_m");
    assert!(patches.contains("0.02–0.15") && patches.contains("some metres in images of a field"), "{patches}");
}

/// Method: scene files with values that are valid but probably unintended. Expected: a warning for each, and none for
/// the tutorial scenes.
#[test]
fn implausible_values_are_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    let species = fs::canonicalize("scenes/species/maize.ron").unwrap();
    let warnings = |camera: &str, crop: &str| {
        let file = folder.path().join("field.ron");
        let text = format!("Field(camera: {camera}, lights: [Overcast()], crops: [(species: {species:?}, {crop})])");
        fs::write(&file, text).unwrap();
        let source = Source::open(&file).unwrap();
        let options = Options { width: Some(32), ..Options::default() };
        let (expected_warnings, all) =
            (source.expected_warnings(&options).unwrap(), source.field(&options).unwrap().warnings);
        // All warnings are given before the field is built, except those that depend on the built field.
        let later: Vec<&String> = all.iter().filter(|warning| !expected_warnings.contains(warning)).collect();
        assert!(later.iter().all(|warning| warning.contains("no crop is in")), "{later:?}");
        assert!(expected_warnings.iter().all(|warning| all.contains(warning)), "{expected_warnings:?}");
        all.join("\n")
    };
    let rows = "rows: (spacing_m: 0.75, in_row_m: 0.05)";
    let low = "JaiAd130(height_m: 3)";
    assert_eq!(warnings(low, &format!("growth: Bbch(14), {rows}")), "");
    let words = warnings(low, &format!("growth: Bbch(85), {rows}"));
    assert!(words.contains("its last stage is BBCH 69, so BBCH 85 looks like that"), "{words}");
    let words = warnings(low, "growth: Bbch(14), rows: (spacing_m: 75)");
    assert!(words.contains("rows of") && words.contains("stand 75 m apart"), "{words}");
    let words = warnings(low, "growth: Bbch(14), rows: (spacing_m: 0.75, in_row_m: 16)");
    assert!(words.contains("stands 16 m apart in its rows; in_row_m is in metres"), "{words}");
    let words = warnings(low, "growth: Bbch(11), rows: (spacing_m: 75, offset_m: 30)");
    assert!(words.contains("no crop is in the camera's view"), "{words}");
    let words = warnings("JaiAd130(height_m: 8), detail: Full, sensor: Phone", &format!("growth: Bbch(14), {rows}"));
    assert!(words.contains("the camera is 8.0 m above the ground") && words.contains("sensor: JaiAd130"), "{words}");
}
