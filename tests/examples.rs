//! The programs in `examples/` run, and the library's image equals the program's byte for byte.
//!
//! Rationale: users of the library start by copying an example. Expected: each runs at a small size and writes the
//! promised files. Cargo builds the examples with the tests; with the test program alone, run `cargo build --examples`
//! first.

use crate::common::program::{SMALL, names, scratch, trace};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Returns the command of a built example.
fn example(name: &str) -> Command {
    let tests = std::env::current_exe().expect("this test");
    let program: PathBuf = tests.ancestors().nth(2).expect("target/debug").join("examples").join(name);
    assert!(program.is_file(), "{}: run `cargo build --examples` with the same features first", program.display());
    Command::new(program)
}

/// Runs an example in its own folder, which contains links to the repository's scene files, textures and tests.
fn run(name: &str, arguments: &[&str]) -> (tempfile::TempDir, PathBuf) {
    let (keep, folder) = scratch();
    fs::create_dir_all(&folder).expect("a folder");
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for shared in ["scenes", "textures", "tests"] {
        std::os::unix::fs::symlink(root.join(shared), folder.join(shared)).expect("a link");
    }
    let output = example(name).args(arguments).current_dir(&folder).output().expect("the example");
    let words = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{name}: {words}");
    let paths = String::from_utf8(output.stdout).expect("paths");
    assert!(paths.lines().count() > 0, "{name} prints no path");
    for path in paths.lines() {
        assert!(folder.join(path).is_file(), "{name}: {path}");
    }
    (keep, folder)
}

#[test]
fn the_example_of_an_image_writes_the_bytes_of_the_program() {
    let (_keep, folder) = run("render", &[SMALL, "2", "40"]);
    let (_other, out) = scratch();
    let program =
        trace(&["--scene", SMALL, "--spp", "2", "--width", "40", "--quiet", "--out", out.to_str().expect("text")])
            .output()
            .expect("the program");
    assert!(program.status.success());
    let ours = folder.join("out/example");
    assert_eq!(names(&ours), names(&out));
    for name in names(&out) {
        assert!(fs::read(ours.join(&name)).expect("a file") == fs::read(out.join(&name)).expect("a file"), "{name}");
    }
}

#[test]
fn the_example_of_a_dataset_makes_a_whole_one() {
    let (_keep, folder) = run("dataset", &[SMALL, "2", "1", "40"]);
    let dataset = folder.join("out/example-dataset");
    let output = trace(&["dataset", "verify", dataset.to_str().expect("text")]).output().expect("the program");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[cfg(feature = "train")]
#[test]
fn the_example_of_a_training_leaves_a_trained_model() {
    let (_keep, folder) = run("dataset", &[SMALL, "10", "1", "40"]);
    let dataset = folder.join("out/example-dataset");
    let (_other, run_folder) = run("train", &[dataset.to_str().expect("text"), "run", "2"]);
    let card = fs::read_to_string(run_folder.join("run/model.json")).expect("a model card");
    assert!(card.contains("basic-segnet"), "{card}");
}
