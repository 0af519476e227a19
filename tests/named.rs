//! A network that takes the crop as an input, from training to export.
//!
//! Rationale: one network serves every crop, and a crop that it is given must reach predictions, scores and exported files; a crop that it
//! is not given must be refused, never ignored. Expected: its predictions depend on the named crop, and any name of the species gives the
//! same; the exported network is the one of predictions; a training continues from an ordinary network; every refusal has exit code 2
//! and says what to do. Source: the output of `train predict --help`, `train fit --help`.

use crate::common::dataset::{fail, path, succeed};
use crate::common::training::{SET, pictures};
use furrow_output::{ImageData, write_png};
use furrow_train::deploy::input_images::Prediction;
use furrow_train::net::film;
use furrow_train::run::{self, TrainedModel};
use furrow_train::weights;
use std::path::Path;
use std::process::Command;

/// Returns the command `train` with these arguments, on one thread.
fn train(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_train"));
    command.current_dir(env!("CARGO_MANIFEST_DIR")).args(arguments);
    if arguments[0] != "export" {
        command.args(["--precision", "f32", "--threads", "1"]);
    }
    command
}

/// Trains a small network for six steps on the set.
fn fit(out: &Path, more: &[&str]) -> Command {
    let set = format!("{}@all", path(&SET));
    let mut command = train(&["fit", "--set", &set, "--out", path(out), "--network", "tiny-unet", "--size", "64x48"]);
    command.args(["--steps", "6", "--batch", "2", "--quiet"]).args(more);
    command
}

/// Writes the network with other weights: all pixels are crop if sugar beet is named, otherwise soil.
fn decide(mut trained: TrainedModel, out: &Path) {
    for array in &mut trained.values {
        match array.name.as_str() {
            // Rows are fat hen and sugar beet.
            film::EMBEDDING => {
                array.values.iter_mut().enumerate().for_each(|(k, v)| *v = f32::from(u8::from(k == film::WIDTH)));
            }
            // The second half of the rows gives β: 1000 for the first channel of the last batch norm.
            name if name == film::map("dec1_1.bn") => {
                let first = array.values.len() / 2;
                array.values.iter_mut().enumerate().for_each(|(k, v)| *v = if k == first { 1000.0 } else { 0.0 });
            }
            name if name.starts_with("film.") => array.values.fill(0.0),
            "head.conv.bias" => array.values = vec![100.0, 0.0, 0.0],
            // Classes × channels × 3 × 3: crop at the centre of the first channel.
            "head.conv.weight" => {
                let (crop, centre) = (array.shape[1] * 9, 4);
                array.values.iter_mut().enumerate().for_each(|(k, v)| *v = f32::from(u8::from(k == crop + centre)));
            }
            _ => {}
        }
    }
    trained.card.weights_sha256 = weights::hash(&trained.values);
    trained.write(out).unwrap();
}

#[test]
fn the_named_crop_decides_and_every_command_takes_it() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let init = at("plain");
    succeed(fit(&init, &[]));
    let refine = ["--refine", "colour,plants,rows"];
    succeed(fit(&at("net"), &[&refine[..], &["--name-crops", "0.9", "--init", path(&init)]].concat()));
    let trained = TrainedModel::open(&at("net")).unwrap();
    decide(trained.clone(), &at("net"));
    assert_eq!(trained.card.species, ["fat hen", "sugar beet"]);
    let pixels = pictures(1, (64, 48), 3, 4);
    let rgb: Vec<[u8; 3]> = pixels.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
    write_png(&at("photos/p.png"), 64, 48, &ImageData::Rgb(&rgb), "").unwrap();
    let predicted = |network: &str, out: &str, crops: &[&str]| {
        let [network, photos, out] = [network, "photos", out].map(at);
        let mut command = train(&["predict", path(&network), path(&photos), "--out", path(&out), "--quiet"]);
        for crop in crops {
            command.args(["--crop", crop]);
        }
        succeed(command);
        let described: Prediction = run::read_json(&out.join("prediction.json")).unwrap();
        // Compares pixels and metadata of the class map.
        (std::fs::read(out.join("p.png")).unwrap(), described)
    };
    let (beet, described) = predicted("net", "beet", &["Beta vulgaris"]);
    assert_eq!((described.crops, described.refine.name()), (vec!["sugar beet".to_owned()], "colour,smooth".into()));
    assert_eq!(predicted("net", "beet-again", &["BEAVX"]).0, beet);
    assert_ne!(predicted("net", "weed", &["fat hen"]).0, beet);
    let (_, both) = predicted("net", "both", &["fat hen", "sugar beet"]);
    assert_eq!(both.crops, ["fat hen", "sugar beet"]);
    let (any, described) = predicted("net", "any", &[]);
    assert_eq!((described.crops.len(), described.refine.name()), (0, "colour,plants,rows".into()));
    assert_eq!(predicted("net", "auto", &["auto"]).0, any);
    // The exported network knows its crop and predicts the same.
    let (net, half) = (at("net"), at("half"));
    succeed(train(&["export", path(&net), "--crop", "beet", "--format", "half", "--out", path(&half)]));
    let exported = TrainedModel::open(&half).unwrap().card;
    assert_eq!((exported.crops, exported.species.len()), (vec!["sugar beet".to_owned()], 0));
    let onnx = |crops: &[&str]| {
        let file = at(&format!("{}.onnx", crops.len()));
        let mut command = train(&["export", path(&net), "--out", path(&file)]);
        command.args(crops);
        succeed(command);
        std::fs::read(file).unwrap()
    };
    assert_ne!(onnx(&["--crop", "sugar beet"]), onnx(&[]));
    let set = format!("{}@0..1", path(&SET));
    succeed(train(&["eval", path(&net), "--set", &set, "--crop", "sugar beet", "--out", path(&at("report"))]));
    // Refusals, and their ways out.
    let other =
        fail(train(&["predict", path(&net), path(&at("photos")), "--out", path(&at("no")), "--crop", "maize"]), 2);
    for words in ["does not know maize", "it knows fat hen, sugar beet", "train make --crop maize --out DIR"] {
        assert!(other.contains(words), "{words}: {other}");
    }
    let mixed = fail(train(&["eval", path(&net), "--set", &set, "--crop", "auto", "--crop", "sugar beet"]), 2);
    assert!(mixed.contains("give --crop auto alone"), "{mixed}");
    let unknown = fail(train(&["eval", path(&net), "--set", &set, "--crop", "maise"]), 2);
    assert!(unknown.contains("did you mean `maize` (ZEAMX)") && unknown.contains("species file"), "{unknown}");
    let plain = fail(train(&["export", path(&init), "--crop", "maize", "--out", path(&at("no"))]), 2);
    assert!(
        plain.contains("does not take the crop as an input") && plain.contains("train make --crop maize"),
        "{plain}"
    );
    let classes = fail(fit(&at("no"), &["--name-crops", "0.5", "--classes", "soil; plant=crop,weed"]), 2);
    assert!(classes.contains("--name-crops: the classes are soil; plant=crop,weed"), "{classes}");
    assert!(!at("no").exists());
    // A card that lists fewer species than the weights have is no answer to a named crop.
    let mut torn = trained;
    torn.card.species.pop();
    torn.card.parameters -= film::WIDTH;
    torn.write(&at("torn")).unwrap();
    let message = TrainedModel::open(&at("torn")).unwrap_err().to_string();
    assert!(message.contains("of a network for 2 species, model.json lists 1"), "{message}");
}
