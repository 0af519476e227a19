//! `--set PATH=VALUE`: values of a scene file replaced on the command line.
//!
//! Rationale: trying a value must not need an edited copy of the scene file, and its image must be reproducible.
//! Expected: the bytes of a scene file that has the value; errors that point into the argument. Source: an edited copy.

use crate::common::dataset::{fail, path, succeed};
use crate::common::program::{SMALL, scratch, small_text, trace};
use std::fs;

/// Values, and the text of the small scene file with them.
fn edited() -> ([&'static str; 8], String, String) {
    let text = small_text();
    let beet = concat!("species: \"", env!("CARGO_MANIFEST_DIR"), "/tests/ref/species/sugar_beet.ron\"");
    let new = text
        .replace("height_m: 0.45", "height_m: 0.6")
        .replacen(beet, "species: \"maize\"", 1)
        .replace("clods: (", "clods: (max_mm: 20, ");
    let set = ["camera.pose.height_m=0.6", "crops[0].species=maize", "soil.clods.max_mm=20", "seed=3"];
    let values = ["--set", set[0], "--set", set[1], "--set", set[2], "--set", set[3]];
    (values, text, new)
}

#[test]
fn a_stream_with_values_equals_that_of_the_edited_file() {
    let (_keep, folder) = scratch();
    fs::create_dir_all(&folder).expect("a folder");
    let (values, text, new) = edited();
    assert_eq!(new.matches("maize").count() + new.matches("max_mm").count(), 2, "{new}");
    let stream = |text: &str, values: &[&str]| {
        let scene = folder.join("scene.ron");
        fs::write(&scene, text).expect("a file");
        let arguments = ["stream", "--scene", path(&scene), "--count", "2", "--spp", "1", "--quiet"];
        succeed(trace(&[&arguments[..], values].concat())).stdout
    };
    let with = stream(&text, &values);
    assert!(with == stream(&new, &[]), "the images differ from those of the edited file");
    assert!(with != stream(&text, &[]), "the values have no effect");
}

/// Expected: the files of an image contain each value, so that the image can be rendered again.
#[test]
fn an_image_records_the_values() {
    let (_keep, folder) = scratch();
    let (values, ..) = edited();
    let arguments = ["--scene", SMALL, "--spp", "1", "--width", "32", "--quiet", "--out", path(&folder)];
    succeed(trace(&[&arguments[..], &values].concat()));
    for file in ["rgb.png", "semantics.png", "radiance.exr"] {
        let bytes = fs::read(folder.join(file)).expect("a file");
        let text = String::from_utf8_lossy(&bytes);
        assert!(text.contains("\nset: crops[0].species=maize\nset: soil.clods.max_mm=20"), "{file}");
    }
}

/// Expected: errors of reading, of building and of named files are shown in the argument, with exit code 2.
#[test]
fn errors_point_into_the_argument() {
    let (_keep, out) = scratch();
    let out = path(&out);
    for (verb, value, words) in [
        (&["--scene"][..], "camera.pose.hight_m=1", "--set:1:13: unknown field `hight_m` in Nadir"),
        (
            &["scan", "--lidar", "Vlp16", "--scene"],
            "crops[0].species=maizee",
            "--set:1:18: no built-in species is called `maizee`",
        ),
        (
            &["export", "--format", "gltf", "--scene"],
            "lights[0].sun.elevation_deg=Normal(mean:-3,sd:1)",
            "--set:1:41: ",
        ),
        (&["dataset", "plan", "--count", "1", "--scene"], "weeds[3].spread=()", "--set:1:6: there is no item [3]"),
        (&["--scene"], "camera.pose.pitch_deg=1O", "--set:1:23: "),
    ] {
        let message = fail(trace(&[verb, &[SMALL, "--out", out, "--set", value]].concat()), 2);
        assert!(message.contains(words) && message.contains(&format!("   1 | {value}\n")), "{value}: {message}");
    }
    let message = fail(trace(&["--scene", SMALL, "--set", "seed"]), 2);
    assert!(message.contains("write PATH=VALUE"), "{message}");
}
