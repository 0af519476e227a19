//! USD export: OpenUSD's own client opens it and agrees with the glTF export of the same field.
//!
//! Rationale: two formats written by different code do not have the same mistakes. Expected: the same meshes bit by
//! bit, the same labels (`UsdSemantics`), materials, camera and lights; all validators of OpenUSD find nothing; skins at
//! rest are the meshes within 1e-5 m (`UsdSkel`); sky and sun give the irradiance that the camera is exposed for.
//! Source: usd-core 26.11, named in `tests/requirements.txt`; `tests/usd/check.py` has the estimates.

use crate::common::program::{SMALL, names, scratch, trace};
use crate::common::python::{ask, python};
use std::fs;
use std::path::{Path, PathBuf};

/// Succeeds if the client is installed.
const PROBE: &str = "from pxr import UsdSemantics, UsdSkel, UsdValidation; import numpy, OpenEXR";

/// Exports a scene, 48 pixels wide, and returns the folder.
fn export(scene: &str, format: &str, more: &[&str], into: &Path) -> PathBuf {
    let folder = into.join(format);
    let mut command = trace(&["export", "--scene", scene, "--width", "48", "--quiet", "--format", format, "--out"]);
    let done = command.arg(&folder).args(more).output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    folder
}

/// Exports a scene in both formats, and returns folder and GLB file as arguments of the client's script.
fn both(scene: &str, more: &[&str], into: &Path) -> [String; 2] {
    let usd = export(scene, "usd", more, into);
    let glb = export(scene, "gltf", more, into).join("scene.glb");
    [usd, glb].map(|path| path.to_str().unwrap().to_owned())
}

fn agrees(scene: &str, more: &[&str]) {
    let Some(python) = python(PROBE) else { return };
    let (keep, _) = scratch();
    let [usd, glb] = both(scene, more, keep.path());
    ask(&python, "usd/check.py", &[&usd, &glb]);
}

#[test]
fn openusd_reads_a_field_with_joints() {
    agrees(SMALL, &["--skins"]);
}

/// Four lamps of two outlines, a lens with distortion, and no sky.
#[test]
fn openusd_reads_lamps() {
    agrees("scenes/05-flash-hood.ron", &[]);
}

/// Leaves with holes and marks, under a sky without sun.
#[test]
fn openusd_reads_an_overcast_field() {
    agrees("scenes/06-overcast-cracked.ron", &[]);
}

/// Rationale: a check that accepts everything shows nothing. Expected: each of these changes of one value is found.
#[test]
fn the_client_finds_each_damage() {
    let Some(python) = python(PROBE) else { return };
    let (keep, _) = scratch();
    let [usd, glb] = both(SMALL, &["--skins"], keep.path());
    let damages = [
        ("plants.usda", "labels:class = [\"crop\"]", "labels:class = [\"weed\"]"),
        ("plants.usda", "semantics:labels:leaf = [\"1\"]", "semantics:labels:leaf = [\"2\"]"),
        ("plants.usda", "SemanticsLabelsAPI:leaf", "SemanticsLabelAPI:leaf"),
        ("plants.usda", "point3f[] points = [(", "point3f[] points = [(1"),
        (
            "plants.usda",
            "restTransforms = [( (",
            "restTransforms = [( (0.1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1) ), ( (",
        ),
        ("plants.usda", "material:binding = </field/materials/", "material:binding = </field/material/"),
        ("plants.usda", "\"MaterialBindingAPI\", ", ""),
        ("ground.usda", "primvars:st = [(", "primvars:st = [(1"),
        ("materials.usda", "opacityThreshold = 0.5", "opacityThreshold = 0"),
        ("materials.usda", "@./textures/reflected_0.png@", "@./textures/reflected.png@"),
        ("materials.usda", "float furrow:nirReflectance = 0", "float furrow:nirReflectance = 1"),
        ("materials.usda", "scale = (2,2,2,1)", "scale = (1,1,1,1)"),
        ("scene.usda", "float focalLength = 0", "float focalLength = 1"),
        ("scene.usda", "float exposure = -", "float exposure = "),
        ("scene.usda", "(0, -1, 0, 0)", "(0, 1, 0, 0)"),
        ("scene.usda", "upAxis = \"Z\"", "upAxis = \"Y\""),
    ];
    let damages = damages.iter().flat_map(|(name, from, to)| [*name, *from, *to]);
    let arguments: Vec<&str> = [&*usd, &*glb].into_iter().chain(damages).collect();
    ask(&python, "usd/check.py", &arguments);
}

/// Expected: the same files whatever the number of threads, each in its place; a warning names what is lost.
#[test]
fn equal_runs_write_equal_files() {
    let (keep, _) = scratch();
    let [one, two] =
        ["1", "2"].map(|threads| export(SMALL, "usd", &["--threads", threads], &keep.path().join(threads)));
    assert_eq!(names(&one), ["ground.usda", "materials.usda", "plants.usda", "scene.usda", "textures"]);
    let textures = names(&one.join("textures"));
    assert!(textures.contains(&"sky.exr".to_owned()) && textures == names(&two.join("textures")), "{textures:?}");
    let files = names(&one).into_iter().filter(|name| name != "textures");
    for name in files.chain(textures.iter().map(|name| format!("textures/{name}"))) {
        assert!(fs::read(one.join(&name)).unwrap() == fs::read(two.join(&name)).unwrap(), "{name}");
    }
    let mut command = trace(&["export", "--scene", SMALL, "--width", "32", "--format", "usd", "--out"]);
    let done = command.arg(keep.path().join("3")).output().unwrap();
    let words = String::from_utf8_lossy(&done.stderr);
    assert!(words.contains("no transmission"), "{words}");
    let printed = String::from_utf8_lossy(&done.stdout).into_owned();
    assert!(printed.lines().last().unwrap().ends_with("scene.usda"), "{printed}");
}
