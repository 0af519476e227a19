//! Selection of the Embree library by the build script.
//!
//! Rationale: Debian 12 has version 3, later systems have version 4, and Python's wheel has a library with another
//! name. Expected: `EMBREE_DIR` takes precedence, with the library in it or in its `lib` folders, then version 4, then
//! 3; if none is found, the error states what to install. Source: the file names in those packages.

#[path = "../build/search.rs"]
#[allow(dead_code, clippy::print_stdout, reason = "the script's own call is Cargo's")]
mod search;

use search::find;
use std::fs;
use std::path::{Path, PathBuf};

/// Creates a folder with empty files.
fn folder(root: &Path, files: &[&str]) -> PathBuf {
    for file in files {
        let path = root.join(file);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(path, "").expect("a file");
    }
    root.to_path_buf()
}

#[test]
fn the_build_takes_embree_dir_then_version_4_then_3() {
    let keep = tempfile::tempdir().expect("a folder");
    let at = |name: &str, files: &[&str]| folder(&keep.path().join(name), files);
    let debian12 = at("12", &["libembree3.so", "libembree3.so.3", "libtbb.so"]);
    let debian13 = at("13", &["libembree4.so", "libembree4.so.4"]);
    let found = |own: Option<&Path>, system: &[PathBuf]| {
        let found = find(own, system).expect("Embree");
        (found.version, found.file.strip_prefix(keep.path()).expect("below").display().to_string())
    };
    let system = [debian12.clone(), debian13.clone()];
    assert_eq!(found(None, &system), ("4", "13/libembree4.so".into()));
    assert_eq!(found(None, &system[..1]), ("3", "12/libembree3.so".into()));
    for (files, version, file) in [
        (&["lib/libembree3.so", "lib/libembree30.so"][..], "3", "lib/libembree3.so"),
        (&["lib64/libembree4.so.4"], "4", "lib64/libembree4.so.4"),
        (&["libembree4-4aef3270.so.4", "libtbb-dcf63f8c.so.12"], "4", "libembree4-4aef3270.so.4"),
        (&["lib/libembree3.so", "libembree4.so"], "4", "libembree4.so"),
    ] {
        let own = at(&format!("own-{}", file.replace('/', "-")), files);
        let name = own.file_name().expect("a name").to_string_lossy().into_owned();
        assert_eq!(found(Some(&own), &system), (version, format!("{name}/{file}")));
    }
}

#[test]
fn without_embree_the_build_says_what_to_install() {
    let keep = tempfile::tempdir().expect("a folder");
    let other = folder(&keep.path().join("lib"), &["libembree.a", "libembree2.so", "libembree5.so"]);
    let words = find(None, std::slice::from_ref(&other)).expect_err("no Embree");
    assert!(words.contains("apt-get install libembree-dev") && words.contains("EMBREE_DIR"), "{words}");
    // If EMBREE_DIR has no Embree, the system's library is not used instead.
    let system = folder(&keep.path().join("system"), &["libembree4.so"]);
    let words = find(Some(&other), &[system]).expect_err("no Embree there");
    assert!(words.contains(&other.display().to_string()), "{words}");
}
