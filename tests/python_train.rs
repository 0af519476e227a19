//! The Python package `furrow-train`: the program `train` with the libtorch of the package torch.
//!
//! Rationale: people who have torch should not download libtorch twice. Expected: a wheel installed beside a package
//! torch, here one with links to the libtorch of this build, lists the networks and predicts a photograph; without torch
//! or with another version it says what to install; all versions agree. Source: pip, auditwheel and hatchling. The wheel
//! contains the program built for the tests.

use crate::common::program::{names, scratch};
use crate::common::python::python;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Python code that succeeds if the wheel can be built.
const PROBE: &str = "import auditwheel, build, hatchling";

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn text(path: &str) -> String {
    fs::read_to_string(root().join(path)).expect("a file")
}

/// Expected: the packages have the version of the program, and torch that of the libtorch which the program is built with.
#[test]
fn versions_agree() {
    let own = env!("CARGO_PKG_VERSION");
    let libtorch = text(".libtorch/get.sh");
    let libtorch = libtorch.lines().find_map(|line| line.strip_prefix("version=")).expect("a version").trim();
    let train = text("python/train/pyproject.toml");
    assert!(train.contains(&format!("\nversion = \"{own}\"\n")), "{own}");
    assert!(train.contains(&format!("\"furrow=={own}\", \"torch=={libtorch}\"")), "{own}, {libtorch}");
    assert!(text("pyproject.toml").contains(&format!("train = [\"furrow-train=={own}\"]")), "{own}");
}

/// Runs a command and returns its exit code and its stderr.
fn ran(command: &mut Command) -> (Option<i32>, String) {
    let Output { status, stdout, stderr } = command.output().unwrap_or_else(|e| panic!("{command:?}: {e}"));
    (status.code(), String::from_utf8_lossy(&stdout).into_owned() + &String::from_utf8_lossy(&stderr))
}

fn done(command: &mut Command) -> String {
    let (code, words) = ran(command);
    assert_eq!(code, Some(0), "{command:?}: {words}");
    words
}

/// Builds the wheel with the program built for the tests, and installs it with a package torch.
fn installed(python: &Path, folder: &Path) -> (PathBuf, PathBuf) {
    let wheels = folder.join("wheels");
    let tools = python.parent().expect("a folder").display().to_string();
    let mut build = Command::new(root().join("python/train/build_wheel.sh"));
    build.arg(env!("CARGO_BIN_EXE_train")).env("WHEELS", &wheels);
    // The tools, and the package hatchling, are those of the environment.
    let path = format!("{tools}:{}", std::env::var("PATH").unwrap_or_default());
    done(build.env("PATH", path).env("FURROW_BUILD", "--no-isolation"));
    let built = names(&wheels);
    assert!(built.len() == 1 && built[0].starts_with("furrow_train-"), "{built:?}");
    let venv = folder.join("venv");
    done(Command::new(python).args(["-m", "venv"]).arg(&venv));
    let own = venv.join("bin/python");
    let install = ["-m", "pip", "install", "-q", "--no-index", "--no-deps"];
    done(Command::new(&own).args(install).arg(wheels.join(&built[0])));
    let site = done(Command::new(&own).args(["-c", "import sysconfig; print(sysconfig.get_path('platlib'))"]));
    let site = PathBuf::from(site.trim());
    fs::create_dir_all(site.join("torch/lib")).expect("a folder");
    fs::write(site.join("torch/__init__.py"), "raise ImportError('this takes seconds')").expect("a file");
    for library in names(&root().join(".libtorch/lib")) {
        let to = site.join("torch/lib").join(&library);
        std::os::unix::fs::symlink(root().join(".libtorch/lib").join(&library), to).expect("a link");
    }
    (venv.join("bin/train"), site)
}

#[test]
fn a_wheel_takes_libtorch_of_the_package_torch() {
    let Some(python) = python(PROBE) else { return };
    let (_keep, folder) = scratch();
    let (program, site) = installed(&python, &folder);
    let train = |arguments: &[&str]| {
        let mut command = Command::new(&program);
        for variable in ["FURROW_DATA", "LD_LIBRARY_PATH", "PYTHONPATH", "LIBTORCH"] {
            command.env_remove(variable);
        }
        command.current_dir(&folder).args(arguments);
        command
    };
    let listed = done(&mut train(&["zoo"]));
    assert!(listed.starts_with("any-field  lite-unet"), "{listed}");
    fs::copy(root().join("scenes/gallery/field.jpg"), folder.join("field.jpg")).expect("a picture");
    done(&mut train(&[
        "predict",
        "any-field",
        "field.jpg",
        "--resize",
        "64",
        "--refine",
        "none",
        "--quiet",
        "--out",
        "p",
    ]));
    assert_eq!(names(&folder.join("p")), ["field.overlay.png", "field.png", "prediction.json"]);
    // The version is known from the package's metadata.
    let about = |version: &str| {
        let folder = site.join("torch-1.dist-info");
        fs::create_dir_all(&folder).expect("a folder");
        fs::write(folder.join("METADATA"), format!("Metadata-Version: 2.1\nName: torch\nVersion: {version}\n"))
            .expect("a file");
    };
    about("2.11.0+cpu");
    done(&mut train(&["zoo"]));
    about("2.10.0");
    let (code, words) = ran(&mut train(&["zoo"]));
    assert!(code == Some(1) && words.contains("torch is 2.10.0, but train needs 2.11.0"), "{words}");
    fs::remove_dir_all(site.join("torch")).expect("a folder");
    let (code, words) = ran(&mut train(&["zoo"]));
    assert!(code == Some(1) && words.contains("libtorch was not found: pip install torch==2.11.0"), "{words}");
}
