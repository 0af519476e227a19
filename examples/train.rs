//! Trains a network on a dataset and evaluates it on the test set, as `train fit` and `train eval` do. If it is stopped, the same command
//! resumes.
//!
//! ```sh
//! cargo run --release --example dataset                                                # the dataset
//! cargo run --release --features train --example train                                 # Basic SegNet, 400 steps
//! cargo run --release --features train --example train -- DATASET RUN 20 unet          # another dataset, folder, steps, network
//! ```

#![expect(clippy::print_stdout, reason = "scores and paths are the result")]

use furrow::train::{self, Callbacks, Machine, Network, Plan, Selection, Settings, TrainedModel};
use std::path::Path;
use std::sync::atomic::AtomicBool;

fn main() -> furrow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let dataset = arguments.next().unwrap_or_else(|| "out/example-dataset".into());
    let run = arguments.next().unwrap_or_else(|| "out/example-run".into());
    let steps = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(400);
    let network = arguments.next().unwrap_or_else(|| "basic-segnet".into());

    let images = |pick: &str| Selection::parse(&format!("{dataset}@{pick}")).map_err(furrow::Error::misuse);
    let mut plan = Plan {
        network: Network::named(&network).map_err(furrow::Error::misuse)?,
        train: vec![images("train")?],
        val: vec![images("val")?],
        threads: std::thread::available_parallelism().map_or(1, usize::from),
        ..Plan::default()
    };
    let settings = Settings { steps: Some(steps), batch: Some(2), size: Some((240, 180)), ..Settings::default() };
    settings.apply(&mut plan).map_err(|invalid| invalid.of_flag())?;

    let machine = Machine::default();
    let step = |done, loss: Option<f64>| {
        if let Some(loss) = loss.filter(|_| done % 20 == 0) {
            eprintln!("step {done} of {steps}: loss {loss:.4}");
        }
    };
    let results =
        train::fit(&plan, None, &machine, Path::new(&run), &Callbacks { step: &step, ..Callbacks::default() })?;
    eprintln!("{} steps in {:.0} s", results.steps, results.seconds);

    let trained = TrainedModel::open(Path::new(&run))?;
    let stop = AtomicBool::new(false);
    let report =
        train::evaluate(&trained.into(), &images("test")?, "f32", plan.threads, &machine, &stop, &mut |_| Ok(()))?;
    eprintln!("{}", report.summary().markdown());
    for name in ["weights.safetensors", "model.json", "result.json"] {
        println!("{run}/{name}");
    }
    Ok(())
}
