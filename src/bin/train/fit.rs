//! `train fit`.

use crate::machine::MachineArgs;
use crate::report;
use furrow_base::{Error, Result};
use furrow_cli::cli;
use furrow_cli::cli::signal::Signals;
use furrow_train::data::{Band, Selection};
use furrow_train::fit::checkpoint::ValidationPass;
use furrow_train::fit::{Adaptation, Callbacks, Plan, Settings};
use furrow_train::net::Network;
use furrow_train::run::{self, Identity, Results};
use furrow_train::session;
use furrow_train::torch::{Precision, device};
use indicatif::{ProgressBar, ProgressStyle};
use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Arguments of `train fit`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Training set: the training images of a dataset, or those that DIR@PICK selects; *N oversamples them N times. May be given
    /// several times.
    #[arg(long = "set", value_name = "DIR[@PICK][*N]", required = true, value_parser = Selection::parse)]
    sets: Vec<Selection>,
    /// Validation set; by default the validation images of the datasets given without a PICK.
    #[arg(long, value_name = "DIR[@PICK]", value_parser = Selection::parse)]
    val: Vec<Selection>,
    /// Folder of the run; with several seeds, one subfolder per run.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Network architecture.
    #[arg(long, value_name = "NAME", help = network_help(), default_value = Plan::default().network.name(), value_parser = Network::named)]
    network: Network,
    #[command(flatten)]
    settings: Settings,
    /// Seed, or a comma-separated list of seeds for one run each.
    #[arg(long, value_name = "N[,N]", default_values_t = [Plan::default().seed], value_delimiter = ',')]
    seed: Vec<u64>,
    /// Run whose weights initialize the network, to fine-tune them on other images.
    #[arg(long, value_name = "RUN")]
    init: Option<PathBuf>,
    /// Time limit, such as 30m or 8h. The learning rate then follows the clock, so that runs are not reproducible.
    #[arg(long, value_name = "DURATION", value_parser = cli::time)]
    time: Option<Duration>,
    #[command(flatten)]
    machine: MachineArgs,
    /// Print nothing but errors and the paths of the files.
    #[arg(long)]
    quiet: bool,
}

fn network_help() -> String {
    let names: Vec<&str> = Network::ALL.iter().map(|network| network.name()).collect();
    format!("Network architecture: {}", names.join(", "))
}

impl Args {
    fn plan(&self, seed: u64, folder: &Path) -> Result<Plan> {
        let val = match self.val.as_slice() {
            [] => self.sets.iter().filter(|s| s.pick.is_none()).cloned().collect(),
            val => val.to_vec(),
        };
        let precision = Precision::named(&self.machine.precision, device::find(&self.machine.machine().device)?);
        // A resumed run keeps its number of threads, on which the last bits depend.
        let before = folder.join(run::PLAN);
        let before: Option<Identity> = before.exists().then(|| run::read_json(&before)).transpose()?;
        let threads =
            self.machine.threads_asked().or(before.map(|b| b.plan.threads)).unwrap_or_else(|| self.machine.threads());
        let mut plan = Plan {
            network: self.network,
            train: self.sets.clone(),
            val,
            seed,
            precision: precision.map_err(Error::input)?.name().into(),
            threads,
            seconds: self.time.map(|t| t.as_secs()),
            ..Plan::default()
        };
        self.settings.apply(&mut plan).map_err(|invalid| invalid.of_flag())?;
        Ok(plan)
    }
}

/// Trains one run for each seed.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    cli::check_folder(&args.out)?;
    let mut paths = Vec::new();
    for seed in &args.seed {
        let folder = if args.seed.len() == 1 { args.out.clone() } else { args.out.join(format!("seed-{seed}")) };
        let plan = args.plan(*seed, &folder)?;
        let results = fit(&plan, args.init.as_deref(), &args.machine, &folder, args.quiet, signals)?;
        paths.extend(written(&folder, args.quiet, &results)?);
    }
    Ok(paths)
}

/// Prints the results of a training and writes its page. Returns the paths of the files of the run.
pub(crate) fn written(folder: &Path, quiet: bool, results: &Results) -> Result<Vec<PathBuf>> {
    if !quiet {
        furrow_cli::message!("{}: {}", folder.display(), in_words(results));
    }
    let mut paths = [run::WEIGHTS, run::MODEL].map(|file| folder.join(file)).to_vec();
    paths.extend(write_page(folder)?);
    Ok(paths)
}

/// Trains one plan and shows its progress.
pub(crate) fn fit(
    plan: &Plan,
    begin: Option<&Path>,
    machine: &MachineArgs,
    folder: &Path,
    quiet: bool,
    signals: &Signals,
) -> Result<Results> {
    shown(plan.hyper.steps, quiet, signals, |callbacks| {
        session::fit(plan, begin, &machine.machine(), folder, callbacks)
    })
}

/// Runs `work`, which trains for at most `steps` steps, and shows its progress.
pub(crate) fn shown(
    steps: u64,
    quiet: bool,
    signals: &Signals,
    work: impl FnOnce(&Callbacks<'_>) -> Result<Results>,
) -> Result<Results> {
    let bar = if quiet { ProgressBar::hidden() } else { ProgressBar::new(steps) };
    let style = ProgressStyle::with_template("{bar:30} step {pos} of {len}, {msg}, {eta} left");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    let smooth = Cell::new(None);
    let step = |done: u64, loss: Option<f64>| {
        if let Some(loss) = loss {
            let mean = smooth.get().map_or(loss, |mean: f64| mean + 0.05 * (loss - mean));
            smooth.set(Some(mean));
            bar.set_message(format!("loss {mean:.4}"));
        }
        if bar.position() == 0 && done > 1 {
            // A resumed run: estimate the remaining time from the steps of this process only.
            bar.set_position(done);
            bar.reset_eta();
        }
        bar.set_position(done);
    };
    let validation = |pass: &ValidationPass, best: bool| {
        let iou: Vec<String> = pass.iou.iter().map(|v| v.map_or("–".into(), |v| format!("{:.1}", 100.0 * v))).collect();
        let loss = smooth.get().unwrap_or_default();
        let best = if best { ", the best so far" } else { "" };
        let line = format!(
            "step {} of {}: loss {loss:.4}, validation mean I/U {:.1} ({}){best}",
            pass.step,
            steps,
            100.0 * pass.miou,
            iou.join(", ")
        );
        if !quiet {
            bar.suspend(|| furrow_cli::message!("{line}"));
        }
    };
    let warn = |words: &str| {
        if !quiet {
            bar.suspend(|| furrow_cli::message!("warning: {words}"));
        }
    };
    let callbacks = Callbacks { step: &step, validation: &validation, warn: &warn, stop: signals.catch() };
    let results = work(&callbacks);
    bar.finish_and_clear();
    results
}

/// Describes the result of a training run: steps, reason for ending, speed and best validation pass.
pub(crate) fn in_words(results: &Results) -> String {
    let why = match results.ended.as_str() {
        "patience" => ", stopped early without a better validation pass,",
        "time" => ", stopped at the time limit,",
        _ => "",
    };
    let best = match (results.best_step, results.history.best()) {
        (Some(step), Some(pass)) => format!("; best at step {step}: validation mean I/U {:.1}", 100.0 * pass.miou),
        _ => "; no validation set, the last weights are kept".into(),
    };
    format!(
        "{} steps{why} in {:.0} s, {:.2} images a second{best}",
        results.steps, results.seconds, results.images_per_second
    )
}

/// Writes the report of a finished training run from the files in its folder.
pub(crate) fn write_page(folder: &Path) -> Result<Vec<PathBuf>> {
    let Identity { plan, .. } = run::read_json(&folder.join(run::PLAN))?;
    let results: Results = run::read_json(&folder.join(run::RESULT))?;
    report::write_training(folder, &results, plan.hyper.loss.in_words(), &plan.classes.names(), &facts(&plan, &results))
}

/// Returns the settings and the result that the report lists, as names and values.
fn facts(plan: &Plan, results: &Results) -> Vec<(String, String)> {
    let sets = |selections: &[Selection]| selections.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
    let bands: Vec<&str> = plan.shape.bands.iter().map(Band::name).collect();
    let fact = |name: &str, value: String| (name.to_owned(), value);
    let mut facts = vec![
        fact("network", plan.network.about().into()),
        fact("training set", sets(&plan.train)),
        fact("validation set", sets(&plan.val)),
        fact("input", format!("{} at {} × {} pixels", bands.join(", "), plan.shape.width, plan.shape.height)),
        fact("steps", format!("{} of {}", results.steps, plan.batch_in_words())),
        fact("loss", format!("{}, class weights {}", plan.hyper.loss.name(), plan.hyper.class_weights.name())),
        fact("input normalization", plan.hyper.normalization.name().into()),
        fact("data augmentation", plan.hyper.augment.to_string()),
        fact("seed", plan.seed.to_string()),
        fact("result", in_words(results)),
    ];
    if !plan.hyper.augment_scale.is_relative() {
        facts.push(fact("scale of the augmentation", format!("{}, mm a pixel", plan.hyper.augment_scale.name())));
    }
    if let Some(Adaptation { photos, keep, .. }) = plan.adaptation {
        let words = format!(
            "{photos} photographs without labels; the most confident {keep} of each class's pixels are used as labels"
        );
        facts.insert(2, fact("self-training", words));
    }
    facts
}
