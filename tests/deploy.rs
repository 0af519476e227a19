//! Trained models in other programs, and predictions for images without labels.
//!
//! Rationale: robots run an exported file instead of this program; users have photographs of all sizes in many folders,
//! and prediction must not overwrite their files.
//!
//! Expected: ONNX Runtime and TorchScript agree with our values to 1e-4 of the largest value, for one and two images,
//! at even and odd sizes, with every input normalisation; masks equal the network's predictions; invalid requests are
//! refused with a message and exit code 2, and write nothing. Source: `tests/train/check_onnx.py`, the programs named
//! in `tests/requirements.txt`.

use crate::common::dataset::{fail, path, succeed};
use crate::common::program::{SMALL, names, trace};
use crate::common::python::{ask, python, torch};
use crate::common::training::{self, SET, learn, learnt, normalised, pictures, random, stirred};
use furrow_output::ImageData;
use furrow_train::deploy::input_images::Prediction;
use furrow_train::deploy::{onnx, torchscript};
use furrow_train::fit::hyper::NormalizationMode;
use furrow_train::net::Network;
use furrow_train::refine::{Refine, Seen};
use furrow_train::run::{self, TrainedModel};
use furrow_train::torch::tch::{CModule, Device, Kind, Tensor};
use furrow_train::torch::{Model, Placement, Precision, device};
use furrow_train::weights::{self, Array};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;

/// Trains Basic SegNet on these bands; the run is kept until the next test run.
fn trained(name: &str, bands: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    if folder.exists() {
        std::fs::remove_dir_all(&folder).unwrap();
    }
    learn(Network::BasicSegnet, bands, NormalizationMode::Image, &SET, &folder);
    folder
}

static RGB: LazyLock<PathBuf> = LazyLock::new(|| trained("deploy-rgb", "rgb"));
static RGBN: LazyLock<PathBuf> = LazyLock::new(|| trained("deploy-rgbn", "rgbn"));

/// Returns the command `train` with these arguments, and for `predict` with one thread and single precision.
fn train(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_train"));
    command.current_dir(env!("CARGO_MANIFEST_DIR")).args(arguments);
    if arguments[0] == "predict" {
        command.args(["--precision", "f32", "--threads", "1"]);
    }
    command
}

fn model(learnt: &TrainedModel) -> Model {
    device::set_threads(1);
    let place = Placement { device: Device::Cpu, precision: Precision::Single };
    let card = &learnt.card;
    Model::with(card.network, card.input.bands.len(), card.classes.len(), &learnt.values, place).unwrap()
}

/// Numbers of images and their sizes: the network's own size, almost the smallest size that it accepts, odd sizes, and
/// a larger one.
fn cases(network: Network) -> Vec<(usize, (u32, u32))> {
    let least = network.least_side().max(16);
    let (own, small) = ([(1, training::SIZE), (2, training::SIZE)], (least + 3, least + 1));
    // NumPy computes the largest networks slowly.
    let rest = if matches!(network, Network::Segnet | Network::VitUnet) {
        vec![(4, small)]
    } else {
        vec![(16, small), (2, (81, 66))]
    };
    [own.to_vec(), rest].concat()
}

/// Writes 8-bit images and the network's outputs for them.
fn record(learnt: &TrainedModel, file: &Path) {
    let bands = learnt.card.input.bands.len();
    let model = model(learnt);
    let mut arrays = Vec::new();
    for (k, (images, size)) in cases(learnt.card.network).into_iter().enumerate() {
        let pixels = pictures(images, size, bands, k as u64);
        let scores = model.scores(&normalised(learnt, &pixels, size), size).unwrap();
        let (w, h) = (size.0 as usize, size.1 as usize);
        let values = pixels.iter().map(|v| f32::from(*v)).collect();
        arrays.push(Array { name: format!("images_{k}"), shape: vec![images, h, w, bands], values });
        arrays.push(Array {
            name: format!("scores_{k}"),
            shape: vec![images, learnt.card.classes.len(), h, w],
            values: scores,
        });
    }
    weights::write(file, &arrays, "").unwrap();
}

/// Networks of every kind, with every normalisation.
const KINDS: [(Network, &str, NormalizationMode); 6] = [
    (Network::BasicSegnet, "rgbn", NormalizationMode::Band),
    (Network::BasicSegnet, "rgb", NormalizationMode::Image),
    (Network::Segnet, "rgb", NormalizationMode::Image),
    (Network::Unet, "rgbn", NormalizationMode::Fixed),
    (Network::LiteUnet, "rgb", NormalizationMode::Image),
    (Network::VitUnet, "rgb", NormalizationMode::Fixed),
];

#[test]
fn exported_networks_compute_what_ours_do() {
    let onnx_python = python("import onnx, onnxruntime, safetensors, numpy");
    let torch_python = torch();
    let folder = tempfile::tempdir().unwrap();
    let mut exported = Vec::new();
    for (kind, (network, bands, exposure)) in KINDS.into_iter().enumerate() {
        let folder = folder.path().join(kind.to_string());
        // With random weights, this network's fifty ReLU6 layers amplify rounding differences, because runtimes fold
        // batch norms into convolutions.
        let learnt = if network == Network::LiteUnet {
            learnt(network, bands, exposure)
        } else {
            random(network, bands, exposure, 13)
        };
        let out = folder.join("out");
        learnt.write(&out).unwrap();
        let io = out.join("io.safetensors");
        record(&learnt, &io);

        onnx::write(&learnt, &out.join("network.onnx")).unwrap();
        let bytes = std::fs::read(out.join("network.onnx")).unwrap();
        onnx::write(&learnt, &out.join("network.onnx")).unwrap();
        assert!(bytes == std::fs::read(out.join("network.onnx")).unwrap(), "{} twice", network.name());
        let file = out.join("network.pt");
        torchscript::write(&learnt, training::SIZE, &file).unwrap();
        let bytes = std::fs::read(&file).unwrap();
        torchscript::write(&learnt, training::SIZE, &file).unwrap();
        assert!(bytes == std::fs::read(&file).unwrap(), "{} twice", network.name());
        let module = CModule::load_on_device(&file, Device::Cpu).unwrap();
        let bands = learnt.card.input.bands.len() as i64;
        for images in [1, 2] {
            let pixels = pictures(images, training::SIZE, bands as usize, 21);
            let (w, h) = training::SIZE;
            let lying = Tensor::from_slice(&pixels).view([images as i64, i64::from(h), i64::from(w), bands]);
            let scores = module.forward_ts(&[lying]).unwrap().to_kind(Kind::Float).contiguous().view(-1);
            let ours = model(&learnt).scores(&normalised(&learnt, &pixels, training::SIZE), training::SIZE).unwrap();
            let scores = Vec::<f32>::try_from(scores).unwrap();
            assert!(scores.len() == ours.len() && scores.iter().all(|v| v.is_finite()), "{}", network.name());
            let largest = ours.iter().fold(1f32, |m, v| m.max(v.abs()));
            let apart = ours.iter().zip(&scores).fold(0f32, |m, (a, b)| m.max((a - b).abs())) / largest;
            eprintln!("{} TorchScript, {images} pictures: difference {apart:.1e}", network.name());
            assert!(apart < 1e-4, "{} {images}: {apart}", network.name());
        }
        exported.push(path(&out).to_owned());
    }
    // One process for all networks: the packages alone take seconds to import.
    let exported: Vec<&str> = exported.iter().map(String::as_str).collect();
    if let Some(python) = &onnx_python {
        ask(python, "train/check_onnx.py", &exported);
    }
    if let Some(python) = &torch_python {
        ask(python, "train/check_torchscript.py", &exported);
    }
}

#[test]
fn export_writes_to_the_given_path() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("new/robot.onnx");
    let done = succeed(train(&["export", path(&RGB), "--out", path(&out)]));
    assert_eq!(String::from_utf8(done.stdout).unwrap(), format!("{}\n", out.display()));
    assert!(std::fs::metadata(&out).unwrap().len() > 1_000_000);

    let out = folder.path().join("robot.pt");
    let done =
        succeed(train(&["export", path(&RGB), "--format", "torchscript", "--size", "40x33", "--out", path(&out)]));
    assert_eq!(String::from_utf8(done.stdout).unwrap(), format!("{0}\n{0}.json\n", out.display()));
    let facts: serde_json::Value =
        serde_json::from_slice(&std::fs::read(folder.path().join("robot.pt.json")).unwrap()).unwrap();
    assert_eq!((facts["width"].as_u64(), facts["height"].as_u64()), (Some(40), Some(33)));
    assert_eq!(facts["bands"], serde_json::json!(["red", "green", "blue"]));
    let module = CModule::load(&out).unwrap();
    let scores = module.forward_ts(&[Tensor::zeros([3, 33, 40, 3], (Kind::Uint8, Device::Cpu))]).unwrap();
    assert_eq!(scores.size(), [3, 3, 33, 40]);

    let before = names(folder.path());
    assert_eq!(before, ["new", "robot.pt", "robot.pt.json"]);
    for (arguments, words) in [
        (vec!["--size", "40x40"], "--size applies to TorchScript exports only"),
        (vec!["--out", path(folder.path())], "this is a folder"),
        (vec!["--format", "torchscript", "--size", "4000x10"], "sides from 32 to 8192"),
        (vec!["--format", "coreml"], "invalid value 'coreml'"),
    ] {
        let mut all = vec!["export", path(&RGB)];
        all.extend(arguments);
        let message = fail(train(&all), 2);
        assert!(message.contains(words), "{message}");
    }
    assert_eq!(before, names(folder.path()));
}

/// Expected: half the bytes, each weight rounded to half precision, the same classes except for ties, and a folder that
/// every command accepts as a run.
#[test]
fn half_precision_is_a_run_of_half_the_size() {
    let folder = tempfile::tempdir().unwrap();
    let (half, photos) = (folder.path().join("half"), folder.path().join("photos"));
    succeed(train(&["export", path(&RGB), "--format", "half", "--out", path(&half)]));
    assert_eq!(names(&half), ["model.json", "weights.safetensors"]);
    let message = fail(train(&["export", path(&RGB), "--format", "half", "--out", path(&half)]), 2);
    assert!(message.contains("there is a trained model in this folder already"), "{message}");
    let bytes = |run: &Path| std::fs::metadata(run.join(run::WEIGHTS)).unwrap().len() as f64;
    assert!((0.49..0.52).contains(&(bytes(&half) / bytes(&RGB))), "{} of {} bytes", bytes(&half), bytes(&RGB));
    let weights = |run: &Path| -> BTreeMap<String, Tensor> {
        Tensor::read_safetensors(run.join(run::WEIGHTS)).unwrap().into_iter().collect()
    };
    let (whole, halved) = (weights(&RGB), weights(&half));
    assert!(whole.keys().eq(halved.keys()));
    for (name, tensor) in whole.iter().filter(|(_, tensor)| tensor.kind() == Kind::Float) {
        // Half a unit in the last place of eleven significant bits; below 6·10⁻⁵, half-precision numbers are evenly
        // spaced.
        let apart = (tensor - halved[name].to_kind(Kind::Float)).abs() - tensor.abs() * 2f64.powi(-11);
        assert!(apart.max().double_value(&[]) <= 2f64.powi(-25) * 1.001, "{name}");
    }
    photographs(&photos);
    let answers = [&*RGB, &half].map(|run| {
        let out = folder.path().join(run.file_name().unwrap()).join("answers");
        succeed(train(&["predict", path(run), path(&photos), "--out", path(&out)]));
        furrow_output::read_indexed(&out.join("large.png")).unwrap().2
    });
    let differ = answers[0].iter().zip(&answers[1]).filter(|(a, b)| a != b).count();
    // After few training steps the network is undecided in many pixels: up to one in ten may change class.
    assert!(differ * 10 <= answers[0].len(), "{differ} of {} pixels differ", answers[0].len());
}

/// Rationale: users with photographs but no network should get predictions on the first evening. Expected: the shipped
/// networks are listed; addressed by name from any folder, one finds the plants of a field it was not trained on;
/// nothing is written beside it.
#[test]
fn a_network_that_ships_finds_plants() {
    let listed = succeed(train(&["zoo"]));
    let listed = String::from_utf8(listed.stdout).unwrap();
    assert!(
        listed.lines().any(|line| line.starts_with("any-field  lite-unet  red,green,blue  soil,crop,weed")),
        "{listed}"
    );

    let folder = tempfile::tempdir().unwrap();
    let field = folder.path().join("field");
    let mut render = Command::new(env!("CARGO_BIN_EXE_trace"));
    render.args([
        "--scene",
        "scenes/field.ron",
        "--index",
        "3",
        "--width",
        "480",
        "--spp",
        "8",
        "--quiet",
        "--out",
        path(&field),
    ]);
    render.current_dir(env!("CARGO_MANIFEST_DIR"));
    succeed(render);
    let out = folder.path().join("answers");
    let photo = field.join("rgb.png");
    let mut predict = train(&["predict", "any-field", path(&photo), "--out", path(&out)]);
    succeed({
        predict.current_dir(folder.path());
        predict
    });
    let (_, _, truth) = furrow_output::read_indexed(&field.join("semantics.png")).unwrap();
    let (_, _, answer) = furrow_output::read_indexed(&out.join("rgb.png")).unwrap();
    let count = |test: fn(u8, u8) -> bool| truth.iter().zip(&answer).filter(|(a, b)| test(**a, **b)).count() as f64;
    let overlap = count(|a, b| a > 0 && b > 0) / count(|a, b| a > 0 || b > 0);
    assert!(overlap > 0.6, "{overlap}");

    // A folder of that name without a network, such as one for reports, does not hide the shipped network.
    std::fs::create_dir(folder.path().join("any-field")).unwrap();
    let mut export = train(&["export", "any-field", "--out", path(&folder.path().join("network.onnx"))]);
    export.current_dir(folder.path());
    succeed(export);
    let message = fail(train(&["export", "any-field"]), 2);
    assert!(message.contains("`any-field` ships with the program, and its folder is not for output"), "{message}");
}

/// Writes three images of different formats and sizes, made from the waves of [`pictures`].
fn photographs(folder: &Path) -> BTreeMap<&'static str, (u32, u32)> {
    let sizes = [("large", (150, 101)), ("small", (33, 70)), ("same", training::SIZE)];
    for (k, (name, (w, h))) in sizes.into_iter().enumerate() {
        let pixels = pictures(1, (w, h), 3, k as u64);
        let rgb = pixels.as_chunks::<3>().0;
        if name == "large" {
            std::fs::create_dir_all(folder).unwrap();
            std::fs::write(folder.join("large.JPG"), furrow_output::encode_jpeg(w, h, rgb, 90).unwrap()).unwrap();
        } else {
            furrow_output::write_png(&folder.join(format!("{name}.png")), w, h, &ImageData::Rgb(rgb), "").unwrap();
        }
        let nir = pictures(1, (w, h), 1, 50 + k as u64);
        furrow_output::write_png(&folder.join(format!("{name}.nir.png")), w, h, &ImageData::Gray(&nir), "").unwrap();
    }
    std::fs::write(folder.join("notes.txt"), "no picture").unwrap();
    sizes.into()
}

#[test]
fn photographs_of_any_size_get_masks_of_their_size() {
    let folder = tempfile::tempdir().unwrap();
    let photos = folder.path().join("photos");
    let sizes = photographs(&photos);
    let out = folder.path().join("answers");
    let arguments = ["predict", path(&RGB), path(&photos), "--out", path(&out), "--batch", "2"];
    let done = succeed(train(&arguments));
    let files = ["large", "same", "small"].iter().flat_map(|n| [format!("{n}.png"), format!("{n}.overlay.png")]);
    let files: Vec<String> = files.chain(["prediction.json".into()]).collect();
    let stated: Vec<String> = files.iter().map(|f| out.join(f).display().to_string()).collect();
    assert_eq!(String::from_utf8(done.stdout).unwrap().lines().collect::<Vec<_>>(), stated);
    let mut sorted = files.clone();
    sorted.sort();
    assert_eq!(names(&out), sorted);

    let learnt = TrainedModel::open(&RGB).unwrap();
    for (name, size) in &sizes {
        let (w, h, map) = furrow_output::read_map(&out.join(format!("{name}.png"))).unwrap();
        let furrow_output::Map::Indexed(classes, palette) = map else { panic!("{name}: not an indexed image") };
        assert_eq!(((w, h), classes.len()), (*size, (size.0 * size.1) as usize));
        assert!(classes.iter().all(|c| *c < 3));
        assert_eq!(palette, learnt.card.classes.colors());
        let (w, h, over) = furrow_output::read_rgb(&out.join(format!("{name}.overlay.png"))).unwrap();
        assert_eq!((w, h), *size);
        // The overlay leaves soil pixels unchanged and colours plants.
        if *name != "large" {
            let (_, _, rgb) = furrow_output::read_rgb(&photos.join(format!("{name}.png"))).unwrap();
            for ((class, a), b) in classes.iter().zip(&rgb).zip(&over) {
                assert!(*class != 0 || a == b);
            }
        }
    }
    // At the network's own size, the mask equals its prediction pixel by pixel.
    let (_, _, rgb) = furrow_output::read_rgb(&photos.join("same.png")).unwrap();
    let pixels = normalised(&learnt, rgb.as_flattened(), training::SIZE);
    let answer = model(&learnt).predict(&pixels, training::SIZE).unwrap();
    let (_, _, mask) = furrow_output::read_indexed(&out.join("same.png")).unwrap();
    let differ = mask.iter().zip(&answer).filter(|(a, b)| a != b).count();
    assert!(differ * 1000 <= mask.len(), "{differ} of {} pixels differ", mask.len());

    // Repeating the command gives the same bytes.
    let read = || files.iter().map(|f| std::fs::read(out.join(f)).unwrap()).collect::<Vec<_>>();
    let before = read();
    succeed(train(&arguments));
    assert!(before == read());
}

/// Expected: for a folder of two runs, the prediction is the class with the highest mean probability; an unfinished run
/// and a run with other bands are reported by their folders. Source: softmax and mean, computed here from the logits of
/// each run.
#[test]
fn runs_of_one_folder_answer_together() {
    let folder = tempfile::tempdir().unwrap();
    let (runs, photos, out) = (folder.path().join("runs"), folder.path().join("photos"), folder.path().join("answers"));
    let first = TrainedModel::open(&RGB).unwrap();
    let both = [first.clone(), stirred(&first, 5)];
    for (k, trained) in both.iter().enumerate() {
        trained.write(&runs.join(format!("seed-{}", k + 1))).unwrap();
    }
    let size = training::SIZE;
    let bytes = pictures(1, size, 3, 4);
    std::fs::create_dir_all(&photos).unwrap();
    let rgb: Vec<[u8; 3]> = bytes.as_chunks().0.to_vec();
    furrow_output::write_png(&photos.join("a.png"), size.0, size.1, &ImageData::Rgb(&rgb), "").unwrap();
    let arguments = ["predict", path(&runs), path(&photos), "--out", path(&out)];
    succeed(train(&arguments));

    let n = bytes.len() / 3;
    let mut mean = vec![0.0_f32; 3 * n];
    for trained in &both {
        let logits = model(trained).scores(&normalised(trained, &bytes, size), size).unwrap();
        for at in 0..n {
            let sum: f32 = (0..3).map(|c| logits[c * n + at].exp()).sum();
            (0..3).for_each(|c| mean[c * n + at] += logits[c * n + at].exp() / sum / 2.0);
        }
    }
    let highest = |at: usize| (0..3).max_by(|a, b| mean[a * n + at].total_cmp(&mean[b * n + at])).unwrap() as u8;
    let (_, _, mask) = furrow_output::read_indexed(&out.join("a.png")).unwrap();
    let differ = (0..n).filter(|at| mask[*at] != highest(*at)).count();
    assert!(differ * 1000 <= n, "{differ} of {n} pixels differ");
    let alone: Vec<u8> = model(&first).predict(&normalised(&first, &bytes, size), size).unwrap();
    assert!(mask != alone, "the second run does not affect the prediction");

    TrainedModel::open(&RGBN).unwrap().write(&runs.join("seed-3")).unwrap();
    let words = fail(train(&arguments), 2);
    assert!(words.contains("seed-3") && words.contains("does not match"), "{words}");
    std::fs::remove_file(runs.join("seed-3").join(run::MODEL)).unwrap();
    std::fs::copy(RGB.join(run::PLAN), runs.join("seed-3").join(run::PLAN)).unwrap();
    let words = fail(train(&arguments), 2);
    assert!(words.contains("seed-3") && words.contains("not complete"), "{words}");
}

/// Rationale: users who store a dataset in packs should not have to unpack all of it to predict some images. Expected:
/// a dataset in packs and one in folders, with a near-infrared band, give the same masks, overlays and file names; an
/// image that is not in any pack yet is reported.
#[test]
fn images_in_packs_are_predicted_as_those_in_folders_are() {
    let folder = tempfile::tempdir().unwrap();
    let answers = ["folders", "packs"].map(|kind| {
        let (set, out) = (folder.path().join(kind), folder.path().join(format!("{kind}-answers")));
        let mut make = trace(&["dataset", "--scene", SMALL, "--width", "48", "--spp", "1", "--count", "5"]);
        make.args(["--split", "3,1,1", "--quiet", "--out"]).arg(&set);
        if kind == "packs" {
            make.args(["--pack", "2"]);
        }
        succeed(make);
        assert_eq!(set.join("images/000001").is_dir(), kind == "folders");
        succeed(train(&["predict", path(&RGBN), &format!("{}@1..4", path(&set)), "--out", path(&out)]));
        names(&out)
            .into_iter()
            .filter(|name| name != "prediction.json")
            .map(|name| (name.clone(), std::fs::read(out.join(name)).unwrap()))
            .collect::<Vec<_>>()
    });
    assert_eq!(answers[0].len(), 6);
    assert!(answers[0] == answers[1], "packs and folders give different predictions");
    let packs = folder.path().join("packs");
    for pack in ["packs", "seals"] {
        std::fs::remove_dir_all(packs.join(pack)).unwrap();
    }
    let out = folder.path().join("none");
    let words = fail(train(&["predict", path(&RGBN), path(&packs), "--out", path(&out)]), 2);
    assert!(words.contains("not there yet"), "{words}");
}

#[test]
fn images_of_a_set_are_asked_about_by_name_and_bands_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("answers");
    let some = format!("{}@2..4", path(&SET));
    succeed(train(&["predict", path(&RGBN), &some, "--out", path(&out)]));
    let answers = ["000002.overlay.png", "000002.png", "000003.overlay.png", "000003.png", "prediction.json"];
    assert_eq!(names(&out), answers);
    // The evaluation for Di Cicco's dataset receives the same image and must predict the same map.
    let learnt = TrainedModel::open(&RGBN).unwrap();
    let image = SET.join("images/000002");
    let (w, h, rgb) = furrow_output::read_rgb(&image.join("rgb.png")).unwrap();
    let (_, _, nir) = furrow_output::read_gray(&image.join("nir.png")).unwrap();
    assert_eq!((w, h), training::SIZE);
    let four: Vec<u8> = rgb.iter().zip(&nir).flat_map(|(p, n)| [p[0], p[1], p[2], *n]).collect();
    let answer = model(&learnt).predict(&normalised(&learnt, &four, (w, h)), (w, h)).unwrap();
    let mask = |out: &Path, name: &str| furrow_output::read_indexed(&out.join(name)).unwrap().2;
    let differ = mask(&out, "000002.png").iter().zip(&answer).filter(|(a, b)| a != b).count();
    assert!(differ * 1000 <= answer.len(), "{differ}");

    // Refinement: the program applies the library's refinement to the network's probabilities, refuses to write beside
    // unrefined predictions, and cannot use colours without a red band.
    let refined = folder.path().join("refined");
    let ask =
        |refine: &str, out: &Path| train(&["predict", path(&RGBN), &some, "--out", path(out), "--refine", refine]);
    succeed(ask("colour,plants", &refined));
    let network = model(&learnt);
    let pixels = normalised(&learnt, &four, (w, h));
    let mut probabilities = network.probabilities(&pixels, (w, h), (w, h)).unwrap();
    let seen = Seen {
        pixels: &pixels,
        size: (w, h),
        bands: &learnt.card.input.bands,
        finest: None,
        features: None,
        vectors: None,
        points: &[],
    };
    Refine::parse("colour,plants").unwrap().apply(&seen, &mut probabilities, None);
    let n = (w * h) as usize;
    let class = |at: usize| {
        (1..3).fold(0, |best, c| if probabilities[c * n + at] > probabilities[best * n + at] { c } else { best })
    };
    let expected: Vec<u8> = (0..n).map(|at| class(at) as u8).collect();
    let differ = mask(&refined, "000002.png").iter().zip(&expected).filter(|(a, b)| a != b).count();
    assert!(differ * 1000 <= n && expected != answer, "{differ}");
    assert!(fail(ask("none", &refined), 2).contains("with another --refine"));
    assert!(fail(ask("color", &refined), 2).contains("there is no refinement `color`"));

    // The near-infrared band may be beside the photograph under another name, or in another folder: the prediction is
    // the same.
    for (k, photo, band, more) in
        [(0, "a.png", "a.nir.png", false), (1, "rgb_7.png", "nir_7.png", false), (2, "a.png", "elsewhere/a.png", true)]
    {
        let photos = folder.path().join(format!("photos{k}"));
        std::fs::create_dir_all(photos.join("elsewhere")).unwrap();
        std::fs::copy(image.join("rgb.png"), photos.join(photo)).unwrap();
        std::fs::copy(image.join("nir.png"), photos.join(band)).unwrap();
        let answers = folder.path().join(format!("answers{k}"));
        let named = format!("nir={}", photos.join("elsewhere").display());
        let mut arguments = vec!["predict", path(&RGBN), path(&photos), "--out", path(&answers), "--quiet"];
        if more {
            arguments.extend(["--band", &named]);
        }
        succeed(train(&arguments));
        assert_eq!(mask(&answers, photo), mask(&out, "000002.png"), "{band}");
        assert_eq!(names(&answers).len(), 3, "{band} must not be predicted as an image");
    }
}

#[test]
fn what_cannot_be_answered_is_refused_and_nothing_is_written_over() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let photos = at("photos");
    photographs(&photos);
    let write = |file: &Path, value: u8| {
        furrow_output::write_png(file, 40, 40, &ImageData::Rgb(&[[value, 90, 60]; 1600]), "").unwrap();
    };
    write(&at("more/small.png"), 40);
    write(&at("plain/a.png"), 40);
    std::fs::create_dir_all(at("empty")).unwrap();
    std::fs::write(at("empty/notes.txt"), "").unwrap();
    furrow_output::write_png(&at("gray.png"), 40, 40, &ImageData::Gray(&[7; 1600]), "").unwrap();
    let whole = std::fs::read(photos.join("small.png")).unwrap();
    std::fs::write(at("cut.png"), &whole[..whole.len() / 2]).unwrap();
    std::fs::write(at("words.png"), "no picture at all").unwrap();
    furrow_output::write_png(&at("odd/a.png"), 40, 40, &ImageData::Rgb(&[[9; 3]; 1600]), "").unwrap();
    furrow_output::write_png(&at("odd/a.nir.png"), 20, 40, &ImageData::Gray(&[9; 800]), "").unwrap();

    let refuse = |run: &Path, images: &[&Path], more: &[&str], words: &[&str]| {
        let out = at("refused");
        let mut arguments = vec!["predict", path(run)];
        arguments.extend(images.iter().map(|i| path(i)));
        arguments.extend(["--out", path(&out)]);
        arguments.extend(more);
        let message = fail(train(&arguments), 2);
        for words in words {
            assert!(message.contains(words), "`{words}` is not in: {message}");
        }
        let left = names(&out);
        assert!(left.is_empty(), "{words:?}: {left:?}");
    };
    refuse(&at("none"), &[&photos], &[], &["there is no trained network in this folder", "train fit --out DIR"]);
    refuse(&RGB, &[&at("nothing.png")], &[], &["nothing.png: there is no such image", "DIR@PICK"]);
    refuse(&RGB, &[&at("empty")], &[], &["empty: there is no image in this folder"]);
    refuse(&RGB, &[&at("cut.png")], &[], &["cut.png: the image ends too early"]);
    refuse(&RGB, &[&at("words.png")], &[], &["words.png: this is not an image"]);
    refuse(&RGB, &[&at("gray.png")], &[], &["gray.png: this picture is gray", "red, green and blue"]);
    refuse(&RGB, &[&photos, &at("more")], &[], &["photos/small.png and", "more/small.png would both become small.png"]);
    refuse(&RGB, &[&photos], &["--band", "nir=x"], &["the network does not see the band `nir`", "red, green, blue"]);
    refuse(&RGB, &[&photos], &["--band", "red=x"], &["`red` is read from the image itself"]);
    refuse(&RGBN, &[&at("plain")], &[], &["a.png: the network sees the band `nir`", "a.nir.png", "--band nir=DIR"]);
    refuse(&RGBN, &[&at("odd")], &[], &["a.nir.png: it is 20 × 40 pixels", "is 40 × 40"]);
    let few = PathBuf::from(format!("{}@5..99", path(&SET)));
    refuse(&RGB, &[&few], &[], &["the set has 8 images"]);
    refuse(&RGB, &[&PathBuf::from(format!("{}@most", path(&SET)))], &[], &["`most` picks no images"]);

    // An unreadable image does not prevent predictions for the others.
    let out = at("others");
    let message = fail(train(&["predict", path(&RGB), path(&at("cut.png")), path(&photos), "--out", path(&out)]), 2);
    assert!(
        message.contains("1 of 4 images could not be read; the others have predictions:")
            && message.contains("cut.png: "),
        "{message}"
    );
    assert_eq!(names(&out).len(), 7, "{:?}", names(&out));
    let stated: Prediction = run::read_json(&out.join("prediction.json")).unwrap();
    assert_eq!(stated.pictures.keys().collect::<Vec<_>>(), ["large", "same", "small"]);

    assert!(stated.evidence.is_empty() && stated.appearance.is_none(), "nothing was refined");

    // The changes by refinement are recorded and printed; one image is too little for appearance.
    let refined = at("refined");
    let told = succeed(train(&["predict", "any-field", path(&photos.join("large.JPG")), "--out", path(&refined)]));
    let told = String::from_utf8_lossy(&told.stderr).into_owned();
    assert!(told.contains("refinement: plants ") && told.contains("appearance skipped"), "{told}");
    let described: Prediction = run::read_json(&refined.join("prediction.json")).unwrap();
    assert_eq!((described.appearance, described.evidence.len()), (Some(false), 1));
    let found = &described.evidence["large"];
    assert!((0.0..=1.0).contains(&found.vegetation) && (0.0..=1.0).contains(&found.reclassified), "{found:?}");

    // Masks written beside the photographs would overwrite them.
    let message = fail(train(&["predict", path(&RGB), path(&photos), "--out", path(&photos)]), 2);
    assert!(
        message.contains("small.png: this file is not a prediction")
            || message.contains("same.png: this file is not a prediction"),
        "{message}"
    );
    assert_eq!(std::fs::read(photos.join("small.png")).unwrap(), whole);
    // Predictions for other images of the same name, or by another network, are not overwritten.
    let before = std::fs::read(out.join("small.png")).unwrap();
    let message = fail(train(&["predict", path(&RGB), path(&at("more")), "--out", path(&out)]), 2);
    assert!(
        message.contains("small.png: this is the prediction of") && message.contains("photos/small.png"),
        "{message}"
    );
    let message = fail(train(&["predict", path(&RGBN), path(&photos), "--out", path(&out)]), 2);
    assert!(message.contains("this folder holds predictions of another network"), "{message}");
    assert_eq!(std::fs::read(out.join("small.png")).unwrap(), before);

    // Weights that are damaged, or that do not belong to the model card.
    let broken = at("broken");
    std::fs::create_dir_all(&broken).unwrap();
    for file in ["model.json", "weights.safetensors"] {
        std::fs::copy(RGB.join(file), broken.join(file)).unwrap();
    }
    let mut bytes = std::fs::read(broken.join("weights.safetensors")).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(broken.join("weights.safetensors"), &bytes).unwrap();
    for arguments in [
        ["predict", path(&broken), path(&photos), "--out", path(&at("refused"))].as_slice(),
        &["export", path(&broken)],
    ] {
        let message = fail(train(arguments), 1);
        let words = "weights.safetensors: this is not a weights file of `train`, or it is damaged";
        assert!(message.contains(words), "{message}");
    }
    std::fs::copy(RGBN.join("weights.safetensors"), broken.join("weights.safetensors")).unwrap();
    let message = fail(train(&["predict", path(&broken), path(&photos), "--out", path(&at("refused"))]), 1);
    assert!(message.contains("these are not the weights that model.json in this folder describes"), "{message}");
    assert_eq!(names(&broken), ["model.json", "weights.safetensors"]);
}

/// Rationale: statistics learnt from a set of photographs must depend on the set, not on the batch size. Expected: with
/// appearance features, batches of one and of three give the same masks; a single photograph gives the masks of row
/// refinement alone; without rows the option is refused.
#[test]
fn appearance_is_learnt_from_all_pictures_and_from_one_alone_not() {
    let folder = tempfile::tempdir().unwrap();
    let rows = "colour,plants,rows";
    let looks = "colour,plants,rows,appearance";
    let masks = |name: &str, images: &str, refine: &str, batch: &str| -> Vec<Vec<u8>> {
        let out = folder.path().join(name);
        let set = format!("{}@{images}", path(&SET));
        succeed(train(&["predict", path(&RGB), &set, "--out", path(&out), "--refine", refine, "--batch", batch]));
        let of = |name: &&String| !name.contains("overlay") && !name.contains("prediction");
        names(&out).iter().filter(of).map(|name| furrow_output::read_indexed(&out.join(name)).unwrap().2).collect()
    };
    let (one_by_one, together) = (masks("a", "0..3", looks, "1"), masks("b", "0..3", looks, "3"));
    assert!(one_by_one.len() == 3 && one_by_one == together);
    assert!(one_by_one.iter().any(|mask| mask.iter().any(|class| *class > 0)), "the network finds no plants at all");
    assert_eq!(masks("c", "1..2", looks, "1"), masks("d", "1..2", rows, "1"));
    let out = folder.path().join("e");
    let words =
        fail(train(&["predict", path(&RGB), path(&SET), "--out", path(&out), "--refine", "plants,appearance"]), 2);
    assert!(words.contains("appearance needs rows"), "{words}");

    let report = folder.path().join("report");
    succeed(train(&["eval", path(&RGB), "--set", path(&SET), "--refine", looks, "--out", path(&report)]));
    assert!(report.join("report.json").is_file());
}
