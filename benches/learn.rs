//! Training images per second of each network: `cargo bench --features train --bench learn -- --set DIR`.
//!
//! A whole training step is measured: reading and augmenting images, forward and backward pass, optimiser. The table reports the
//! median over the steps, which excludes the first ones, where kernels are set up and the images decoded. `benches/learn.py` runs
//! the same networks in PyTorch, alternating with this program.

#![allow(clippy::print_stdout, reason = "the table is the result")]
#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    reason = "the numbers of a benchmark are small"
)]

use furrow_train::data::{Selection, Shape};
use furrow_train::fit::{Callbacks, Hyperparameters, Plan};
use furrow_train::net::Network;
use furrow_train::session::{self, Machine};
use furrow_train::torch::tch::Device;
use furrow_train::torch::{Model, Placement, Precision};
use std::cell::RefCell;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

struct Asked {
    set: PathBuf,
    size: (u32, u32),
    batch: usize,
    steps: u64,
    precision: String,
    networks: Vec<Network>,
}

/// Parses the command line; ignores `--bench`, which `cargo bench` adds.
fn asked() -> Asked {
    let words: Vec<String> = std::env::args().skip(1).filter(|w| w != "--bench").collect();
    let of = |name: &str| words.iter().position(|w| w == name).and_then(|i| words.get(i + 1)).cloned();
    let number = |name: &str, usual: u64| of(name).map_or(usual, |n| n.parse().expect("a number"));
    let networks = of("--network").map_or(Network::ALL.to_vec(), |n| vec![Network::named(&n).expect("a network")]);
    Asked {
        set: of("--set").expect("--set DIR: a folder that `trace dataset` made").into(),
        size: (number("--width", 480) as u32, number("--height", 360) as u32),
        batch: number("--batch", 4) as usize,
        steps: number("--steps", 9),
        precision: of("--precision").unwrap_or_else(|| "auto".into()),
        networks,
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn main() {
    // The `train` program does the same.
    furrow_train::memory::keep();
    let asked = asked();
    let precision = Precision::named(&asked.precision, Device::Cpu).expect("a precision");
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let (width, height) = asked.size;
    println!("| network | size | precision | images a second, training | seconds an image, prediction |");
    println!("|---|---|---|---|---|");
    for network in &asked.networks {
        let folder = tempfile::tempdir().expect("a folder");
        let plan = Plan {
            network: *network,
            shape: Shape { width, height, ..Plan::default().shape },
            train: vec![Selection::parse(&format!("{}@0..{}", asked.set.display(), asked.batch)).expect("a set")],
            hyper: Hyperparameters {
                steps: asked.steps,
                batch: asked.batch,
                validate_every: u64::MAX,
                ..Hyperparameters::default()
            },
            precision: precision.name().into(),
            threads,
            ..Plan::default()
        };
        let machine = Machine { device: "cpu".into(), loaders: 1, memory: 4 << 30 };
        let times = RefCell::new(vec![Instant::now()]);
        let step = |_, _| times.borrow_mut().push(Instant::now());
        let stop = AtomicBool::new(false);
        let callbacks = Callbacks { step: &step, validation: &|_, _| (), warn: &|_| (), stop: &stop };
        session::fit(&plan, None, &machine, folder.path(), &callbacks).expect("a training");
        let times = times.into_inner();
        let learning = asked.batch as f64 / median(times.windows(2).map(|t| (t[1] - t[0]).as_secs_f64()).collect());
        let model = Model::new(*network, 3, 3, 1, Placement { device: Device::Cpu, precision });
        let pixels = vec![0.5; 3 * width as usize * height as usize];
        let answer = || {
            let begun = Instant::now();
            model.predict(&pixels, asked.size).expect("an answer");
            begun.elapsed().as_secs_f64()
        };
        let answering = median((0..7).map(|_| answer()).collect());
        let name = network.name();
        println!("| {name} | {width} × {height} | {} | {learning:.2} | {answering:.3} |", precision.name());
    }
}
