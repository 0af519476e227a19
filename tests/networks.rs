//! Networks: an independent program computes the same outputs from the same weights.
//!
//! Rationale: a network with a wrong stride, skip connection or normalisation statistic still learns, only worse, and
//! is not the published one. Expected: the published numbers of parameters, and outputs equal to 1e-4 of the largest,
//! for trained weights and for random ones with non-initial statistics, on images of odd size. Source:
//! `tests/train/reference.py`, written from the papers, in NumPy (double precision; all but the largest networks) and, if
//! a Python has it, in PyTorch.

use crate::common::python::{ask, python, torch};
use crate::common::training::{self, SET, learnt, normalised, pictures, random};
use furrow_train::data::Band;
use furrow_train::fit::hyper::NormalizationMode;
use furrow_train::fit::{Hyperparameters, Plan};
use furrow_train::net::{Network, Pretrained, is_encoder};
use furrow_train::run::TrainedModel;
use furrow_train::torch::tch::{self, Device, Tensor};
use furrow_train::torch::{Model, Pass, Placement, Precision, device};
use furrow_train::weights::{self, Array};
use std::path::Path;

const SINGLE: Placement = Placement { device: Device::Cpu, precision: Precision::Single };

/// Builds a network with the weights of a trained model.
fn model(learnt: &TrainedModel, place: Placement) -> Model {
    device::set_threads(1);
    let card = &learnt.card;
    Model::with(card.network, card.input.bands.len(), card.classes.len(), &learnt.values, place).unwrap()
}

/// Converts images × height × width × bands to images × bands × height × width.
fn by_band(pixels: &[f32], bands: usize, area: usize) -> Vec<f32> {
    let image = |image: &[f32]| (0..bands * area).map(|i| image[i % area * bands + i / area]).collect::<Vec<_>>();
    pixels.chunks_exact(bands * area).flat_map(image).collect()
}

/// Writes weights, model card and the network's outputs for some images.
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
    let folder = tempfile::tempdir().unwrap();
    let mut recorded = Vec::new();
    for network in Network::ALL {
        // Other bands change only the first layer; the networks of thirty million parameters are tested with one set. Trained
        // weights of these are compared below, and those of Basic SegNet stand for SegNet, which has the same operations.
        let large = matches!(network, Network::Segnet | Network::VitUnet);
        for bands in if large { &["rgb"][..] } else { &["rgb", "rgbn"] } {
            let mut kinds = vec![("stirred", random(*network, bands, NormalizationMode::Image, 3))];
            if !large && *bands == "rgb" {
                kinds.push(("trained", learnt(*network, bands, NormalizationMode::Image)));
            }
            for (name, model) in kinds {
                let folder = folder.path().join(format!("{}-{bands}", network.name())).join(name);
                record(&model, &folder);
                recorded.push((large, folder.to_str().unwrap().to_owned()));
            }
        }
    }
    for (engine, python) in [("numpy", python("import numpy, safetensors")), ("torch", torch())] {
        if let Some(python) = python {
            // NumPy computes the largest networks slowly; its results for SegNet are compared in `deploy`.
            let asked = recorded.iter().filter(|(is_large, _)| engine == "torch" || !is_large);
            // One process for all networks: PyTorch alone takes seconds to import.
            let arguments: Vec<&str> =
                ["--engine", engine].into_iter().chain(asked.map(|(_, folder)| folder.as_str())).collect();
            ask(&python, "train/reference.py", &arguments);
        }
    }
}

/// Rationale: an encoder that reads its published weights in another order, or pads differently from its original
/// training, still learns. Expected: with ImageNet weights, the program computes the same as the package that they come
/// from, given the same decoder after few training steps. With `freeze`, the encoder and its running statistics equal
/// the file to the last bit, while the decoder changes. Source: PyPI's efficientnet-lite-pytorch 0.1.0 in PyTorch.
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
    // Adam changes each weight by about its learning rate per step, so the ratio of the learning rates is visible.
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

/// Rationale: transposed position embeddings, or a class token without its own embedding, destroy the value of
/// pretrained transformer weights. Expected: with a file under timm's names, the program computes the same as timm with
/// that file. Source: PyPI's timm 0.9.16, `vit_small_patch14_dinov2`, in PyTorch, with random weights; users must
/// supply those of DINOv2 themselves.
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

/// Largest and mean distance of two sets of values, relative to the standard deviation of the second.
fn apart(a: &[f32], b: &[f32]) -> (f64, f64) {
    let spread = Tensor::from_slice(b).std(false).double_value(&[]);
    let distances: Vec<f64> = a.iter().zip(b).map(|(a, b)| f64::from((a - b).abs())).collect();
    let mean = distances.iter().sum::<f64>() / distances.len() as f64;
    (distances.iter().fold(0.0, |m: f64, d| m.max(*d)) / spread, mean / spread)
}

/// Networks with random weights, each with four images at the training size. SegNet has the operations of Basic SegNet.
fn examples() -> Vec<(Network, TrainedModel, Vec<f32>)> {
    let example = |network: &Network| {
        let learnt = random(*network, "rgb", NormalizationMode::Image, 7);
        let pixels = normalised(&learnt, &pictures(4, training::SIZE, 3, 11), training::SIZE);
        (*network, learnt, pixels)
    };
    Network::ALL.iter().filter(|network| **network != Network::Segnet).map(example).collect()
}

#[test]
fn an_answer_depends_neither_on_precision_nor_batch_nor_layout() {
    for (network, learnt, pixels) in examples() {
        let single = model(&learnt, SINGLE);
        let scores = single.scores(&pixels, training::SIZE).unwrap();
        // One image at a time: kernels for other batch sizes may sum in another order.
        let each: Vec<f32> = pixels
            .chunks_exact(pixels.len() / 4)
            .flat_map(|picture| single.scores(picture, training::SIZE).unwrap())
            .collect();
        let batch = apart(&each, &scores);
        // Planar memory layout (NCHW) instead of channels last.
        let plain = single.images(&pixels, training::SIZE).contiguous();
        let plain = tch::no_grad(|| single.forward(&plain, Pass::Inference)).contiguous().view(-1);
        let layout = apart(&Vec::<f32>::try_from(plain).unwrap(), &scores);
        // Eight bits of mantissa: a rounding of 2⁻⁹ after each of up to 26 layers; maxima that become equal are
        // unpooled to another position.
        let half = model(&learnt, Placement { device: Device::Cpu, precision: Precision::Bf16 });
        let half = half.scores(&pixels, training::SIZE).unwrap();
        let half = apart(&half, &scores);
        eprintln!("{}: batch {batch:?}, layout {layout:?}, bf16 {half:?}", network.name());
        if matches!(network, Network::Unet | Network::LiteUnet | Network::VitUnet) {
            // `lite-unet` has twice the convolutions, so twice the roundings.
            let rounding = if network == Network::Unet { 0.05 } else { 0.1 };
            assert!(batch.0 < 1e-4 && layout.0 < 1e-4 && half.1 < rounding, "{batch:?} {layout:?} {half:?}");
        } else {
            // A maximum at another position changes nearby values by more than rounding does.
            assert!(batch.1 < 1e-3 && layout.1 < 1e-3 && half.1 < 0.25, "{batch:?} {layout:?} {half:?}");
        }
    }
}
