//! The Python package: built as a wheel, installed into a separate environment, used from an empty folder.
//!
//! Rationale: most people who train networks install the program through pip. Expected: the wheel contains the program,
//! Embree, and all shipped data; the module's arrays equal the files; PyTorch accepts them. Source: Pillow, numpy and
//! torch themselves. The wheel contains the program built for the tests, so nothing is compiled for it. Without maturin
//! the tests are skipped with a note, or fail with `FURROW_REQUIRE_PEERS=1`.

use crate::common::program::{SMALL, names, scratch, trace};
use crate::common::python::{python, torch_with};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::LazyLock;

/// Python code that succeeds if the wheel can be built and run.
const PROBE: &str = "import maturin, numpy, PIL";

/// A dataset of two images, one for training and one for validation.
static DATASET: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("python-dataset");
    let _ = std::fs::remove_dir_all(&folder);
    let rest = ["--count", "2", "--spp", "1", "--split", "1,1,0", "--quiet", "--out"];
    let output = trace(&[&["dataset", "--scene", SMALL], &rest[..]].concat()).arg(&folder).output().expect("trace");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    folder
});

/// Source folder of the module, for environments without the wheel.
fn source() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("python")
}

/// Runs a command that must succeed; returns its stdout.
fn done(command: &mut Command) -> String {
    let Output { status, stdout, stderr } = command.output().unwrap_or_else(|e| panic!("{command:?}: {e}"));
    assert!(status.success(), "{command:?}: {}{}", String::from_utf8_lossy(&stdout), String::from_utf8_lossy(&stderr));
    String::from_utf8(stdout).expect("text")
}

/// Returns the wheel with the program built for the tests: `tests/python/stand-in` has a `cargo` that compiles nothing. `None` where
/// the Python packages that build it are missing.
static WHEEL: LazyLock<Option<PathBuf>> = LazyLock::new(|| {
    let python = python(PROBE)?;
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("python-wheels");
    let _ = std::fs::remove_dir_all(&folder);
    let cargo = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/stand-in/cargo");
    let tools = python.parent().expect("a folder").display().to_string();
    let path = std::env::var("PATH").unwrap_or_default();
    let mut build = Command::new(source().join("build_wheel.sh"));
    build.args(["--profile", "dev"]).env("WHEELS", &folder).env("PATH", format!("{tools}:{path}"));
    build.env("CARGO", cargo).env("REAL_CARGO", env!("CARGO")).env("BUILT_TRACE", env!("CARGO_BIN_EXE_trace"));
    done(&mut build);
    let built = names(&folder);
    assert!(built.len() == 1 && built[0].contains("-py3-none-manylinux_2_"), "{built:?}");
    Some(folder.join(&built[0]))
});

/// Creates an environment with the wheel; numpy and Pillow are taken from `python`'s environment, so nothing is
/// downloaded.
fn environment(python: &Path, wheel: &Path, folder: &Path) -> PathBuf {
    done(Command::new(python).args(["-m", "venv"]).arg(folder));
    let own = folder.join("bin/python");
    done(Command::new(&own).args(["-m", "pip", "install", "-q", "--no-index", "--no-deps"]).arg(wheel));
    let place = "import sysconfig; print(sysconfig.get_path('platlib'))";
    let place_of = |python: &Path| PathBuf::from(done(Command::new(python).args(["-c", place])).trim());
    std::fs::write(place_of(&own).join("peers.pth"), place_of(python).display().to_string()).expect("a file");
    folder.to_path_buf()
}

#[test]
fn an_installed_wheel_needs_nothing_else() {
    let Some(python) = python(PROBE) else { return };
    let Some(wheel) = &*WHEEL else { return };
    let (_keep, folder) = scratch();
    let venv = environment(&python, wheel, &folder.join("venv"));
    let empty = folder.join("empty");
    std::fs::create_dir(&empty).expect("a folder");
    let run = |arguments: &[&str]| {
        let mut command = Command::new(venv.join("bin/trace"));
        for variable in ["FURROW_DATA", "FURROW_TRACE", "LD_LIBRARY_PATH", "PYTHONPATH"] {
            command.env_remove(variable);
        }
        command.current_dir(&empty).args(arguments);
        command
    };
    // Data and libraries come from the wheel, not from the repository or the system.
    let soils = done(&mut run(&["soils"]));
    let albedo = soils.lines().find(|line| line.contains("dirt.png")).expect("a soil");
    assert!(albedo.contains(venv.to_str().expect("a path")), "{soils}");
    let place = ["-c", "import furrow; print(furrow.__path__[0])"];
    let site = done(Command::new(venv.join("bin/python")).args(place).env_remove("PYTHONPATH"));
    let site = Path::new(site.trim()).parent().expect("a folder");
    let libraries = done(Command::new("ldd").arg(site.join("furrow.scripts/trace")));
    let about = |name: &String| name.ends_with(".dist-info");
    let about = site.join(names(site).into_iter().find(about).expect("metadata")).join("sboms/furrow.cyclonedx.json");
    let parts = std::fs::read_to_string(about).expect("a list of all crates in the wheel");
    assert!(parts.contains("\"CycloneDX\"") && parts.contains("\"furrow-embree\""));
    for library in ["libembree", "libtbb"] {
        assert!(libraries.lines().any(|l| l.contains(library) && l.contains("furrow.libs")), "{libraries}");
    }

    let paths = done(&mut run(&["--scene", "field", "--width", "64", "--spp", "1", "--quiet"]));
    assert!(paths.lines().all(|path| path.starts_with("out/field/") && empty.join(path).is_file()), "{paths}");
    done(&mut run(&["init", "my-field"]));
    done(&mut run(&["--scene", "my-field/field.ron", "--width", "64", "--spp", "1", "--quiet"]));
    std::fs::remove_dir_all(empty.join("out")).expect("a folder");

    let mut check = Command::new(venv.join("bin/python"));
    check.arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/check_module.py"));
    check.arg(&*DATASET).arg(&empty).env_remove("FURROW_TRACE").env("PATH", "/usr/bin:/bin");
    done(&mut check);
}

/// Expected: the conda package of the wheel has the program, Embree, the data and the module where conda's installers put them, and
/// they work there.
#[test]
fn the_conda_package_works_in_its_own_folders() {
    let Some(python) = python("import rattler_build, zstandard, numpy, PIL") else { return };
    let Some(wheel) = &*WHEEL else { return };
    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).expect("a folder");
    let mut check = Command::new(python);
    check.arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/check_conda.py"));
    check.arg(source().join("conda")).arg(wheel).arg(folder).env("PYTHONDONTWRITEBYTECODE", "1");
    done(&mut check);
}

/// Runs a script of `tests/python` on a folder with the package of this clone.
fn passes(python: &Path, script: &str, folder: &Path) {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python").join(script);
    let quiet = [("PYTHONDONTWRITEBYTECODE", "1"), ("OMP_NUM_THREADS", "1")];
    done(Command::new(python).arg(script).arg(folder).env("PYTHONPATH", source()).envs(quiet));
}

#[test]
fn pytorch_loads_batches_of_a_dataset() {
    let Some(python) = torch_with("PIL") else { return };
    passes(&python, "check_loader.py", &DATASET);
}

/// Expected: tensors and targets equal the files, and a detector of torchvision takes them.
#[test]
fn pytorch_trains_on_targets_of_a_dataset() {
    let Some(python) = torch_with("PIL, torchvision") else { return };
    passes(&python, "check_torch.py", &DATASET);
}

/// Expected: CVAT's reader and Label Studio's decoder find the predicted classes of every pixel.
#[test]
fn predictions_are_read_as_annotations() {
    let Some(python) = python("import datumaro, numpy, PIL") else { return };
    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).expect("a folder");
    passes(&python, "check_annotate.py", &folder);
}

/// Expected: the page lists the images of its folder, whatever their names, and replaces no other page.
#[test]
fn plants_are_marked_on_a_page() {
    let Some(python) = python("import numpy, PIL") else { return };
    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).expect("a folder");
    passes(&python, "check_points.py", &folder);
}

/// Runs a script of `tests/python` that starts the program on a scene with one plant.
fn passes_with_program(python: &Path, script: &str) {
    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).expect("a folder");
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut run = Command::new(python);
    run.arg(root.join("tests/python").join(script)).arg(env!("CARGO_BIN_EXE_trace"));
    run.arg(root.join("tests/ref/plant.ron")).arg(folder);
    done(run.env("PYTHONPATH", source()).env("PYTHONDONTWRITEBYTECODE", "1"));
}

/// Expected: workers of Dask render the same files as one process, and a lost shard is submitted again.
#[test]
fn executors_of_python_render_a_dataset() {
    let Some(python) = python("import distributed, numpy, PIL") else { return };
    passes_with_program(&python, "check_distribute.py");
}

/// Expected: a bucket of a server that checks signatures contains the dataset; mistakes are named, and the next run goes on.
#[test]
fn a_dataset_is_pushed_to_a_bucket() {
    let Some(python) = python("import boto3, flask_cors, moto.server") else { return };
    passes_with_program(&python, "check_bucket.py");
}

/// Rationale: a notebook that stops in its third cell is worse than none. Expected: all code cells run, with small images:
/// plots where Matplotlib is installed, the training, whose loss falls, where PyTorch is.
#[test]
fn the_notebook_runs_from_the_first_cell_to_the_last() {
    let (_keep, folder) = scratch();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for (python, part) in [(python("import matplotlib, numpy, PIL"), "plots"), (torch_with("PIL"), "torch")] {
        let Some(python) = python else { continue };
        let mut run = Command::new(python);
        run.arg(root.join("tests/python/check_notebook.py")).arg(root.join("docs/guide/notebook.ipynb")).arg(part);
        run.env("PYTHONPATH", source()).env("FURROW_TRACE", env!("CARGO_BIN_EXE_trace"));
        run.env("MPLCONFIGDIR", &folder).env("TMPDIR", env!("CARGO_TARGET_TMPDIR")).env("PYTHONDONTWRITEBYTECODE", "1");
        done(&mut run);
    }
}

/// Expected: a misspelt keyword is an error of type checkers, and the right one is not.
#[test]
fn a_misspelt_keyword_is_an_error_of_types() {
    let Some(python) = python("import mypy, numpy, PIL") else { return };
    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).expect("a folder");
    let file = folder.join("misspelt.py");
    for (keyword, code) in [("width", 0), ("wdith", 1)] {
        std::fs::write(&file, format!("import furrow\nfurrow.load('field').render({keyword}=3)\n")).expect("a file");
        let mut check = Command::new(&python);
        check.args(["-m", "mypy", "--cache-dir", env!("CARGO_TARGET_TMPDIR")]).arg(&file).env("MYPYPATH", source());
        let output = check.output().expect("mypy");
        let words = String::from_utf8_lossy(&output.stdout);
        assert_eq!(output.status.code(), Some(code), "{words}");
        assert_eq!(words.contains("did you mean \"width\"?"), code == 1, "{words}");
    }
}

#[test]
fn the_types_of_the_module_are_right() {
    let Some(python) = python("import mypy, numpy, PIL") else { return };
    let mut check = Command::new(python);
    check.args(["-m", "mypy", "--strict", "--cache-dir", env!("CARGO_TARGET_TMPDIR")]).arg(source().join("furrow"));
    done(check.arg(source().join("train/furrow_train")));
}
