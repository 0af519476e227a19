//! Networks: what ours compute is what an independent program computes from the same weights.
//!
//! Rationale: a network with a stride, a skip or a statistic in the wrong place still learns, only worse, and is not the one of its paper.
//! Expected: the published numbers of parameters, and values equal to 1e-4 of the largest, for trained weights and for random ones with
//! statistics that are not the initial ones, on pictures of odd size. Source: `tests/train/reference.py`, written from the papers, in
//! NumPy (double precision) and, where a Python has it, in PyTorch.

use crate::common::python::{ask, python, torch};
use crate::common::training::{self, learn, normalised, pictures, stirred};
use furrow::train::data::Band;
use furrow::train::fit::hyper::NormalizationMode;
use furrow::train::fit::{Hyperparameters, Plan};
use furrow::train::net::{Network, Pretrained, is_encoder};
use furrow::train::run::TrainedModel;
use furrow::train::torch::{Model, Pass, Precision, Where, device};
use furrow::train::weights::{self, Array};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use tch::{Device, Tensor};

static SET: LazyLock<PathBuf> = LazyLock::new(|| training::set("networks-set"));

const SINGLE: Where = Where { device: Device::Cpu, precision: Precision::Single };

/// A network with what was learnt.
fn model(learnt: &TrainedModel, place: Where) -> Model {
    device::set_threads(1);
    let card = &learnt.card;
    Model::with(card.network, card.input.bands.len(), card.classes.len(), &learnt.values, place).unwrap()
}

/// Images × height × width × bands as images × bands × height × width.
fn by_band(pixels: &[f32], bands: usize, area: usize) -> Vec<f32> {
    let image = |image: &[f32]| (0..bands * area).map(|i| image[i % area * bands + i / area]).collect::<Vec<_>>();
    pixels.chunks_exact(bands * area).flat_map(image).collect()
}

/// Writes weights, card and what the network makes of some pictures.
fn record(learnt: &TrainedModel, folder: &Path) {
    let (images, size) = (6, (47, 35));
    let bands = learnt.card.input.bands.len();
    let pixels = normalised(learnt, &pictures(images, size, bands, 5), size);
    let scores = model(learnt, SINGLE).scores(&pixels, size).unwrap();
    learnt.write(folder).unwrap();
    let array = |name: &str, channels: usize, values: Vec<f32>| Array {
        name: name.into(),
        shape: vec![images, channels, size.1 as usize, size.0 as usize],
        values,
    };
    let area = (size.0 * size.1) as usize;
    let images = array("images", bands, by_band(&pixels, bands, area));
    let scores = array("scores", learnt.card.classes.len(), scores);
    weights::write(&folder.join("io.safetensors"), &[images, scores], "").unwrap();
}

#[test]
fn networks_compute_what_an_independent_program_does() {
    let engines = [("numpy", python("import numpy, safetensors")), ("torch", torch())];
    for network in Network::ALL {
        for bands in ["rgb", "rgbn"] {
            let folder = tempfile::tempdir().unwrap();
            let trained = learn(*network, bands, NormalizationMode::Image, &SET, &folder.path().join("trained"));
            // As it was learnt, in one of both: another band is another first layer alone.
            let learnt = [("stirred", &stirred(&trained, 3)), ("trained", &trained)];
            for (name, learnt) in learnt.into_iter().take(if bands == "rgb" { 2 } else { 1 }) {
                let folder = folder.path().join(name);
                record(learnt, &folder);
                for (engine, python) in &engines {
                    if let Some(python) = python {
                        ask(python, "train/reference.py", &["--engine", engine, folder.to_str().unwrap()]);
                    }
                }
            }
        }
    }
}

/// Rationale: an encoder that reads its published weights in another order, or pads otherwise than they were trained with, still learns.
/// Expected: with ImageNet weights the program computes what the package computes from which they come, where the decoder is what it was
/// after so few steps; and with `freeze` the encoder is the file's to the last bit, its running statistics too, while the decoder moves.
/// Source: PyPI's efficientnet-lite-pytorch 0.1.0 in PyTorch.
#[test]
fn an_encoder_that_begins_with_imagenet_computes_what_its_package_does() {
    let folder = tempfile::tempdir().unwrap();
    let begun = training::learn_with(
        &SET,
        &folder.path().join("frozen"),
        Plan { network: Network::LiteUnet, ..Plan::default() },
        Hyperparameters { pretrained: Pretrained::Imagenet, freeze: 6, ..Hyperparameters::default() },
    );
    let published = Pretrained::Imagenet.begin(Network::LiteUnet, &Band::RGB, 3, 1).unwrap();
    for array in &published {
        let learnt = begun.values.iter().find(|a| a.name == array.name).unwrap();
        assert_eq!(learnt.values == array.values, is_encoder(&array.name), "{}", array.name);
    }
    let rate = Hyperparameters { pretrained: Pretrained::Imagenet, encoder_rate: 0.1, ..Hyperparameters::default() };
    let plan = Plan { network: Network::LiteUnet, ..Plan::default() };
    let moved = training::learn_with(&SET, &folder.path().join("moved"), plan, rate);
    // Adam moves each weight by about its rate a step: so many that the share of the rate shows.
    let step = |name: &str| {
        let of = |arrays: &[Array]| arrays.iter().find(|a| a.name == name).unwrap().values.clone();
        let (a, b) = (of(&moved.values), of(&published));
        a.iter().zip(&b).map(|(a, b)| f64::from((a - b).abs())).sum::<f64>() / a.len() as f64
    };
    let share = step("enc3_1.expand.conv.weight") / step("dec1_1.conv.weight");
    assert!((0.05..0.2).contains(&share), "{share}");
    let compared = folder.path().join("compared");
    record(&begun, &compared);
    if let Some(python) = torch() {
        ask(&python, "train/reference.py", &["--engine", "torch", compared.to_str().unwrap()]);
    }
}

/// Rationale: positions that lie across where they lie down, or a class token without its own, make a transformer that was trained for
/// weeks one that has to learn again. Expected: with a file under timm's names the program computes what timm does with that very file.
/// Source: PyPI's timm 0.9.16, `vit_small_patch14_dinov2`, in PyTorch, with random weights: those of DINOv2 are the user's to bring.
#[test]
fn a_transformer_that_begins_with_a_published_file_computes_what_timm_does() {
    let Some(python) = torch() else { return };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("dinov2.safetensors");
    ask(&python, "train/reference.py", &["--write-vit", file.to_str().unwrap()]);
    let begun = training::learn_with(
        &SET,
        &folder.path().join("frozen"),
        Plan { network: Network::VitUnet, ..Plan::default() },
        Hyperparameters { pretrained: Pretrained::File(file.clone()), freeze: 6, ..Hyperparameters::default() },
    );
    let compared = folder.path().join("compared");
    record(&begun, &compared);
    let [file, compared] = [&file, &compared].map(|path| path.to_str().unwrap());
    ask(&python, "train/reference.py", &["--engine", "torch", "--encoder", file, compared]);
}

/// How far values are from others: the largest distance, and the mean one, as shares of the others' deviation.
fn apart(a: &[f32], b: &[f32]) -> (f64, f64) {
    let spread = Tensor::from_slice(b).std(false).double_value(&[]);
    let distances: Vec<f64> = a.iter().zip(b).map(|(a, b)| f64::from((a - b).abs())).collect();
    let mean = distances.iter().sum::<f64>() / distances.len() as f64;
    (distances.iter().fold(0.0, |m: f64, d| m.max(*d)) / spread, mean / spread)
}

/// All networks, stirred, with four pictures at the size that they learnt at.
fn examples() -> Vec<(Network, TrainedModel, Vec<f32>)> {
    let example = |network: &Network| {
        let folder = tempfile::tempdir().unwrap();
        let learnt = stirred(&learn(*network, "rgb", NormalizationMode::Image, &SET, folder.path()), 7);
        let pixels = normalised(&learnt, &pictures(4, training::SIZE, 3, 11), training::SIZE);
        (*network, learnt, pixels)
    };
    Network::ALL.iter().map(example).collect()
}

#[test]
fn an_answer_depends_neither_on_precision_nor_batch_nor_layout() {
    for (network, learnt, pixels) in examples() {
        let single = model(&learnt, SINGLE);
        let scores = single.scores(&pixels, training::SIZE).unwrap();
        // One picture at a time: kernels for other batches may sum in another order.
        let each: Vec<f32> = pixels
            .chunks_exact(pixels.len() / 4)
            .flat_map(|picture| single.scores(picture, training::SIZE).unwrap())
            .collect();
        let batch = apart(&each, &scores);
        // Channel by channel in memory, instead of channels beside each other.
        let plain = single.images(&pixels, training::SIZE).contiguous();
        let plain = tch::no_grad(|| single.forward(&plain, Pass::Inference)).contiguous().view(-1);
        let layout = apart(&Vec::<f32>::try_from(plain).unwrap(), &scores);
        // Eight bits of mantissa: a rounding of 2⁻⁹ after each of up to 26 layers, and maxima that come to be equal and go back to
        // another place.
        let half = model(&learnt, Where { device: Device::Cpu, precision: Precision::Bf16 });
        let half = half.scores(&pixels, training::SIZE).unwrap();
        let half = apart(&half, &scores);
        eprintln!("{}: batch {batch:?}, layout {layout:?}, bf16 {half:?}", network.name());
        if matches!(network, Network::Unet | Network::LiteUnet | Network::VitUnet) {
            // `lite-unet` has twice the convolutions, so twice the roundings.
            let rounding = if network == Network::Unet { 0.05 } else { 0.1 };
            assert!(batch.0 < 1e-4 && layout.0 < 1e-4 && half.1 < rounding, "{batch:?} {layout:?} {half:?}");
        } else {
            // One maximum in another place moves values near it by more than rounding does.
            assert!(batch.1 < 1e-3 && layout.1 < 1e-3 && half.1 < 0.25, "{batch:?} {layout:?} {half:?}");
        }
    }
}
