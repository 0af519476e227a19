//! `train make`: a network for a named crop in one command, resumed after a kill; its use on photographs, and the guard against a
//! network that finds almost none of its crop.
//!
//! Rationale: a user without knowledge of training gets one command, and a network that is given the crop must neither be overruled by
//! refinement nor fail silently on another crop. Expected: a killed command ends with the same images and weights; every refusal has
//! exit code 2; almost no crop gives a warning, a record of it, and the predictions of the network for any field. Source: the output of
//! `train make --help` and `train predict --help`.

use crate::common::dataset::{fail, path, same, succeed, tree};
use crate::common::program::{names, small_text};
use crate::common::training::pictures;
use furrow_output::{ImageData, write_png};
use furrow_train::data::{Resize, Shape};
use furrow_train::deploy::input_images::Prediction;
use furrow_train::net::{Network, Parameter, parameters};
use furrow_train::refine::Refine;
use furrow_train::run::{self, ModelCard, TrainedModel};
use furrow_train::weights::{self, Array};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Returns `train` with these arguments, on one thread in single precision.
fn train(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_train"));
    command.current_dir(env!("CARGO_MANIFEST_DIR")).args(arguments).stdin(Stdio::null());
    command.args(["--threads", "1", "--precision", "f32"]);
    command
}

/// Returns the command that makes a network in seconds: three small images of the small scene file, which is put in place of the one
/// that the command would write, and four steps.
fn make(crop: &str, out: &Path, more: &[&str]) -> Command {
    let scene = out.join("scene.ron");
    if !scene.exists() {
        std::fs::create_dir_all(out).expect("a folder");
        // A crop among the weeds, as a scene file of this command has it.
        let text = small_text().replace("tests/ref/species/chenopodium.ron", "scenes/species/rape.ron");
        std::fs::write(scene, text).expect("a scene file");
    }
    let mut command = train(&["make", "--crop", crop, "--out", path(out), "--weeds", "poa", "--images", "3"]);
    command.args(["--steps", "4", "--network", "tiny-unet", "--size", "64x48"]).args(more);
    command
}

/// Writes an image of waves and noise to a folder.
fn photograph(folder: &Path) -> PathBuf {
    let pixels = pictures(1, (64, 48), 3, 4);
    let rgb: Vec<[u8; 3]> = pixels.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
    write_png(&folder.join("photos/p.png"), 64, 48, &ImageData::Rgb(&rgb), "").expect("a photograph");
    folder.join("photos")
}

/// Returns the images, the scene file and the weights of a network.
fn parts(net: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = tree(&net.join("data"));
    for file in ["scene.ron", "make.json", run::WEIGHTS, run::MODEL] {
        files.insert(format!("net/{file}"), std::fs::read(net.join(file)).expect(file));
    }
    files
}

#[test]
fn one_command_makes_a_network_and_a_killed_one_ends_with_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let whole = &folder.path().join("whole");
    let told = succeed(make("maize", whole, &[]));
    let told = String::from_utf8_lossy(&told.stderr).into_owned();
    for words in ["3 images of 64 × 48 pixels", "4 training steps", "core minutes", "4 steps in"] {
        assert!(told.contains(words), "{words}: {told}");
    }
    assert!(!told.contains("is labelled weed"), "{told}");
    for file in ["scene.ron", "report.html", "eval/rendered/report.html"] {
        assert!(whole.join(file).is_file(), "{file}");
    }
    let card = TrainedModel::open(whole).unwrap().card;
    assert_eq!((card.crops, card.refine.name()), (vec!["maize".to_owned()], "colour,smooth".into()));
    let out = folder.path().join("net");
    let mut child = make("ZEAMX", &out, &["--quiet"]).stderr(Stdio::null()).stdout(Stdio::null()).spawn().unwrap();
    let begun = Instant::now();
    while !out.join("data/images/000000").exists() && begun.elapsed() < Duration::from_secs(120) {
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    assert!(!child.wait().unwrap().success(), "it was finished before it was killed");
    succeed(make("maize", &out, &["--quiet"]));
    same(&parts(&out), &parts(whole));
    // Photographs may be given later; what is done is not done again. These weights find crop everywhere.
    untrained([0.0, 50.0, -50.0], "colour", &out);
    let photos = photograph(folder.path());
    let told = succeed(make("maize", &out, &["--photos", path(&photos)]));
    let told = String::from_utf8_lossy(&told.stderr).into_owned();
    assert!(!told.contains("estimating") && !told.contains("rendering"), "{told}");
    let page = std::fs::read_to_string(out.join("predictions/predictions.html")).unwrap();
    assert!(page.contains("Predictions of a network for maize.") && page.contains("network for maize"));
    assert_eq!(names(&out.join("predictions")), ["p.overlay.png", "p.png", "prediction.json", "predictions.html"]);
    let told = fail(make("maize", &out, &["--quick"]), 2);
    assert!(told.contains("started with other options: train make --crop maize --weeds poa --images 3"), "{told}");
}

#[test]
fn unknown_crops_are_refused_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("net");
    for (crop, more, words) in [
        ("maise", "", "did you mean `maize` (ZEAMX)"),
        ("thistle", "", "`thistle` is a weed: creeping thistle (CIRAR)"),
        ("maize", "maize", "`maize` is both a crop and a weed"),
    ] {
        let mut command = train(&["make", "--crop", crop, "--out", path(&out)]);
        command.args(["--weeds", if more.is_empty() { "all" } else { more }]);
        let told = fail(command, 2);
        assert!(told.contains(words), "{told}");
    }
    assert!(!out.exists());
}

fn predict(network: &Path, photos: &Path, out: &Path, more: &[&str]) -> Command {
    let mut command = train(&["predict", path(network), path(photos), "--out", path(out), "--quiet"]);
    command.args(more);
    command
}

fn described(out: &Path) -> Prediction {
    run::read_json(&out.join("prediction.json")).unwrap()
}

#[test]
fn a_network_that_knows_the_crop_is_refined_by_colour_alone() {
    let folder = tempfile::tempdir().unwrap();
    let (net, photos) = (&folder.path().join("net"), photograph(folder.path()));
    untrained([0.0, 50.0, -50.0], "colour", net);
    let out = |name: &str| folder.path().join(name);
    succeed(predict(net, &photos, &out("usual"), &["--crop", "Zea mays"]));
    let usual = described(&out("usual"));
    assert_eq!((usual.refine.name().as_str(), usual.crops), ("colour", vec!["maize".to_owned()]));
    succeed(predict(net, &photos, &out("asked"), &["--refine", "plants"]));
    assert_eq!(described(&out("asked")).refine.name(), "plants");
    let told = fail(predict(net, &photos, &out("other"), &["--crop", "BEAVX"]), 2);
    assert!(told.contains("trained for maize, not for sugar beet") && !out("other").exists(), "{told}");
    let told = succeed(predict(Path::new("any-field"), &photos, &out("any"), &["--crop", "maize", "--resize", "64"]));
    let told = String::from_utf8_lossy(&told.stderr).into_owned();
    assert!(told.contains("warning: this network does not know which crop is sown"), "{told}");
    assert!(described(&out("any")).crops.is_empty());
}

/// Writes a small network for maize with random weights, these biases of soil, crop and weed, and this refinement.
fn untrained(biases: [f32; 3], refine: &str, out: &Path) {
    let any = TrainedModel::open(Path::new("any-field")).unwrap().card;
    let (network, input) = (Network::TinyUnet, Shape { width: 64, height: 48, ..any.input.clone() });
    let list = parameters(network, 3, 3);
    let array = |(place, p): (usize, &Parameter)| Array {
        name: p.name.clone(),
        shape: p.shape.clone(),
        values: if p.name == "head.conv.bias" { biases.to_vec() } else { p.begin(1, place) },
    };
    let values: Vec<Array> = list.iter().enumerate().map(array).collect();
    let card = ModelCard {
        network,
        input,
        parameters: list.iter().filter(|p| p.role.is_trainable()).map(Parameter::len).sum(),
        resize: Resize::Stretch,
        refine: Refine::parse(refine).unwrap(),
        crops: vec!["maize".into()],
        weights_sha256: weights::hash(&values),
        ..any
    };
    TrainedModel { card, values }.write(out).unwrap();
}

/// Expected: a network that finds only weeds is reported, and the network for any field answers beside with its own refinement; one
/// that finds only crop or only soil is not. A small network takes the place of that for any field.
#[cfg(unix)]
#[test]
fn almost_no_crop_is_reported_and_answered_beside() {
    let folder = tempfile::tempdir().unwrap();
    let photos = photograph(folder.path());
    let at = |name: &str| folder.path().join(name);
    for shared in ["scenes", "textures"] {
        std::os::unix::fs::symlink(Path::new(env!("CARGO_MANIFEST_DIR")).join(shared), at(shared)).unwrap();
    }
    untrained([0.0, 1.0, 2.0], "colour,plants,rows", &at("networks/any-field"));
    for (name, biases) in [("weedy", [0.0, -50.0, 50.0]), ("crops", [0.0, 50.0, -50.0]), ("bare", [50.0, 0.0, 0.0])] {
        untrained(biases, "colour", &at(name));
        let out = at(&format!("{name}-out"));
        let mut command = predict(&at(name), &photos, &out, &[]);
        command.env("FURROW_DATA", folder.path());
        let told = succeed(command);
        let told = String::from_utf8_lossy(&told.stderr).into_owned();
        let implausible = described(&out).implausible;
        if name != "weedy" {
            assert!(implausible.is_none() && told.is_empty() && !out.join("any-field").exists(), "{name}: {told}");
            continue;
        }
        assert!(told.contains("warning: 0.0 % of the plants' pixels are maize"), "{told}");
        let found = implausible.unwrap();
        assert_eq!((found.crop_of_vegetation, found.beside.as_str()), (0.0, "any-field"));
        assert!(found.vegetation > 0.9, "{found:?}");
        let beside = described(&out.join("any-field"));
        assert_eq!(beside.refine.name(), "colour,plants,rows");
        let files = ["p.overlay.png", "p.png", "prediction.json"];
        assert_eq!(names(&out.join("any-field")), files);
    }
}
