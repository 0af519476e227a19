//! Small training runs and synthetic images.

use super::dataset::{path, succeed};
use super::program::{SMALL, trace};
use furrow_base::sampling::{Purpose, Stream};
use furrow_dataset::model::classes::Classes;
use furrow_train::data::{Band, Pick, Selection, Shape};
use furrow_train::fit::hyper::NormalizationMode;
use furrow_train::fit::{Callbacks, Hyperparameters, Plan, log};
use furrow_train::net::{Network, Parameter, Role, parameters};
use furrow_train::run::TrainedModel;
use furrow_train::session::{self, Machine};
use furrow_train::weights;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, LazyLock, Mutex, OnceLock};

/// Input size, in pixels, at which small networks are trained.
pub const SIZE: (u32, u32) = (64, 48);

/// A CPU with one data-loading thread.
pub fn machine() -> Machine {
    Machine { device: "cpu".into(), loaders: 1, memory: 1 << 28 }
}

/// Eight images of the small scene, shared by all tests that only read them.
pub static SET: LazyLock<PathBuf> = LazyLock::new(|| set("training-set"));

/// Renders eight images of the small scene into a folder that is kept until the next run.
pub fn set(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    if folder.exists() {
        std::fs::remove_dir_all(&folder).expect("an old folder");
    }
    let out = path(&folder);
    succeed(trace(&[
        "dataset", "--scene", SMALL, "--out", out, "--count", "8", "--width", "64", "--spp", "2", "--quiet",
    ]));
    folder
}

/// Trains a network for six steps on a dataset.
pub fn learn(network: Network, bands: &str, normalization: NormalizationMode, set: &Path, out: &Path) -> TrainedModel {
    let shape = Shape { bands: Band::list(bands).expect("bands"), width: SIZE.0, height: SIZE.1 };
    let plan = Plan { network, shape, ..Plan::default() };
    learn_with(set, out, plan, Hyperparameters { normalization, ..Hyperparameters::default() })
}

/// A network trained on [`SET`] as by [`learn`], once for all tests that ask for the same one.
pub fn learnt(network: Network, bands: &'static str, normalization: NormalizationMode) -> TrainedModel {
    type Learnt = Arc<OnceLock<TrainedModel>>;
    static ALL: LazyLock<Mutex<HashMap<String, Learnt>>> = LazyLock::new(Mutex::default);
    let key = format!("{} {bands} {normalization:?}", network.name());
    let one = ALL.lock().expect("no test panics here").entry(key).or_default().clone();
    let train = || {
        let folder = tempfile::tempdir().expect("a folder");
        learn(network, bands, normalization, &SET, &folder.path().join("run"))
    };
    one.get_or_init(train).clone()
}

/// Trains a plan on a dataset for six steps with batches of two images.
pub fn learn_with(set: &Path, out: &Path, plan: Plan, hyper: Hyperparameters) -> TrainedModel {
    let selection = Selection { pick: Some(Pick::All), ..Selection::of(set) };
    let shape = Shape { width: SIZE.0, height: SIZE.1, ..plan.shape };
    let hyper = Hyperparameters { steps: 6, batch: 2, ..hyper };
    let plan = Plan { shape, classes: Classes::default(), train: vec![selection], hyper, ..plan };
    let callbacks =
        Callbacks { step: &|_, _| (), validation: &|_, _| (), warn: &|_| (), stop: &AtomicBool::new(false) };
    session::fit(&plan, None, &machine(), out, &callbacks).expect("a training");
    TrainedModel::open(out).expect("a trained model")
}

/// Returns a network with random weights as by [`stirred`], which needs no training of it: the rest of its card is that of a small
/// network, trained on [`SET`] for these bands.
pub fn random(network: Network, bands: &'static str, normalization: NormalizationMode, seed: u64) -> TrainedModel {
    let mut small = learnt(Network::TinyUnet, bands, normalization);
    let card = &mut small.card;
    let all = parameters(network, card.input.bands.len(), card.classes.len());
    card.parameters = all.iter().filter(|p| p.role.is_trainable()).map(Parameter::len).sum();
    card.network = network;
    stirred(&small, seed)
}

/// Returns the same network with random weights: initial weights, but biases, gains, shifts and statistics away from
/// their usual initial values.
pub fn stirred(learnt: &TrainedModel, seed: u64) -> TrainedModel {
    let card = &learnt.card;
    let list = parameters(card.network, card.input.bands.len(), card.classes.len());
    let values: Vec<weights::Array> = list
        .iter()
        .enumerate()
        .map(|(place, p)| {
            let mut stream = Stream::of(seed, place as u64, Purpose::Training, 9);
            let values = match p.role {
                Role::Weight => p.begin(seed, place),
                Role::Bias | Role::Shift | Role::Mean => (0..p.len()).map(|_| 0.2 * stream.normal() as f32).collect(),
                Role::Gain | Role::Variance => (0..p.len()).map(|_| stream.range32(0.6, 1.6)).collect(),
            };
            weights::Array { name: p.name.clone(), shape: p.shape.clone(), values }
        })
        .collect();
    let mut card = card.clone();
    card.weights_sha256 = weights::hash(&values);
    TrainedModel { card, values }
}

/// Synthetic 8-bit images, laid out images × height × width × bands: waves and noise, all different.
pub fn pictures(images: usize, (width, height): (u32, u32), bands: usize, seed: u64) -> Vec<u8> {
    let mut pixels = Vec::new();
    for image in 0..images {
        let mut stream = Stream::of(seed, image as u64, Purpose::Training, 8);
        let waves: Vec<[f32; 4]> = (0..bands)
            .map(|_| {
                [
                    stream.range32(0.1, 0.5),
                    stream.range32(0.1, 0.5),
                    stream.range32(0.0, 6.0),
                    stream.range32(60.0, 160.0),
                ]
            })
            .collect();
        for y in 0..height {
            for x in 0..width {
                for [fx, fy, phase, level] in &waves {
                    let wave = (fx * x as f32 + fy * y as f32 + phase).sin();
                    pixels.push((level + 40.0 * wave + 12.0 * stream.normal() as f32).clamp(0.0, 255.0) as u8);
                }
            }
        }
    }
    pixels
}

/// Network input for such images: scaled to 0–1 and normalised, in the same layout.
pub fn normalised(learnt: &TrainedModel, pictures: &[u8], (width, height): (u32, u32)) -> Vec<f32> {
    let bands = learnt.card.input.bands.len();
    let mut pixels: Vec<f32> = pictures.iter().map(|v| f32::from(*v) / 255.0).collect();
    for image in pixels.chunks_exact_mut(width as usize * height as usize * bands) {
        learnt.card.normalization.apply(image, bands);
    }
    pixels
}

/// Waits until the log of a training holds `steps` rows below its header, or until the training ends.
pub fn wait_for_steps(run: &Path, steps: usize, child: &mut std::process::Child) {
    let rows = || std::fs::read_to_string(run.join(log::CSV)).map_or(0, |log| log.lines().count());
    while rows() <= steps && child.try_wait().expect("the state of a training").is_none() {
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
}
