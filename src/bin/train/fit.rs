//! `train fit`.

use crate::machine::MachineArgs;
use crate::report;
use furrow::cli::signal::Signals;
use furrow::train::classes::Classes;
use furrow::train::data::{Augment, Band, Selection, Shape};
use furrow::train::engine::{Precision, device};
use furrow::train::fit::balance::Balance;
use furrow::train::fit::checkpoint::Look;
use furrow::train::fit::plan::{Exposure, Method, Objective};
use furrow::train::fit::schedule::Schedule;
use furrow::train::fit::{Plan, Watch};
use furrow::train::net::Network;
use furrow::train::run::{self, Identity, Results};
use furrow::train::session;
use furrow::{Error, Result, cli};
use indicatif::{ProgressBar, ProgressStyle};
use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// What is trained, on what.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Set to learn from; its training images unless it says DIR@PICK. May be given several times.
    #[arg(long = "set", value_name = "DIR[@PICK][*N]", required = true, value_parser = Selection::parse)]
    sets: Vec<Selection>,
    /// Set to watch the training by; the validation images of the sets that name no pick unless given.
    #[arg(long, value_name = "DIR[@PICK]", value_parser = Selection::parse)]
    val: Vec<Selection>,
    /// Folder of the run; with several seeds, of one run each.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    learn: LearnArgs,
    /// Seed, or several with commas between.
    #[arg(long, value_name = "N[,N]", default_value = "1", value_delimiter = ',')]
    seed: Vec<u64>,
    /// Run whose weights it begins with, to adapt them to other images.
    #[arg(long, value_name = "RUN")]
    init: Option<PathBuf>,
    /// Most time, such as 30m or 8h; the learning rate then falls with the clock, so that no two runs are the same.
    #[arg(long, value_name = "DURATION", value_parser = humantime::parse_duration)]
    time: Option<Duration>,
    #[command(flatten)]
    machine: MachineArgs,
    /// Print nothing but errors and the paths of the files.
    #[arg(long)]
    quiet: bool,
}

/// How it learns.
#[derive(clap::Args)]
pub(crate) struct LearnArgs {
    /// The network: basic-segnet, segnet or unet.
    #[arg(long, value_name = "NAME", default_value = "basic-segnet", value_parser = Network::named)]
    network: Network,
    /// What it tells apart: classes with a semicolon between, each with its labels: `soil; beet=crop; other=weed`.
    #[arg(long, value_name = "CLASSES", default_value = "soil; crop; weed", value_parser = Classes::parse)]
    classes: Classes,
    /// What it sees: rgb, rgbn, or bands with commas between.
    #[arg(long, value_name = "BANDS", default_value = "rgb", value_parser = bands)]
    bands: Bands,
    /// The size that images are brought to.
    #[arg(long, value_name = "WxH", default_value = "480x360", value_parser = size)]
    size: (u32, u32),
    /// The part of each image that a step learns from, at another place each time; all of it unless given. Small windows make
    /// steps cheap and keep small plants as large as they are.
    #[arg(long, value_name = "WxH", value_parser = size)]
    window: Option<(u32, u32)>,
    /// Share of the windows that are laid about a pixel of a rare class, the rarer the more; small plants are in hardly any
    /// window else. Of no effect without --window.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, value_parser = part)]
    rare: f64,
    /// Most steps.
    #[arg(long, value_name = "N", default_value_t = 2000, value_parser = clap::value_parser!(u64).range(1..=100_000_000))]
    steps: u64,
    /// Images a step.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u16).range(1..=1024))]
    batch: u16,
    /// How it steps: sgd or adam.
    #[arg(long, value_name = "NAME", default_value = "adam", value_parser = Method::parse)]
    optimiser: Method,
    /// First learning rate; 0.001 with adam, 0.05 with sgd unless given.
    #[arg(long, value_name = "RATE", value_parser = positive)]
    rate: Option<f64>,
    /// Weight decay.
    #[arg(long, value_name = "SHARE", default_value_t = 5e-4, value_parser = share)]
    decay: f64,
    /// The learning rate over time: poly, cosine or constant.
    #[arg(long, value_name = "NAME", default_value = "poly", value_parser = Schedule::parse)]
    schedule: Schedule,
    /// What is made small: the cross-entropy, or with dice that and what classes lack of a full overlap, which serves rare ones.
    #[arg(long, value_name = "NAME", default_value = "dice", value_parser = Objective::parse)]
    loss: Objective,
    /// What makes up for rare classes: median (frequency), its root, fading (the root, which falls to none until half of the
    /// steps are done), or none.
    #[arg(long, value_name = "NAME", default_value = "none", value_parser = Balance::parse)]
    balance: Balance,
    /// Images to learn from on which, in the end, it is set how readily each class is answered, for the best overlap: losses that serve
    /// small plants make a network draw them too wide. 0 for none.
    #[arg(long, value_name = "N", default_value_t = 0)]
    calibrate: u64,
    /// What is varied: all, none, or some of flip, rotate, scale, crop, colour, blur, noise.
    #[arg(long, value_name = "NAMES", default_value = "all", value_parser = Augment::parse)]
    augment: Augment,
    /// What is taken out of each image: band (exposure and white balance), image (exposure), fixed (nothing).
    #[arg(long, value_name = "NAME", default_value = "band", value_parser = Exposure::parse)]
    normalise: Exposure,
    /// Steps between two looks at the validation images, each with a checkpoint.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..))]
    watch_every: u64,
    /// Looks without a better result after which it ends early.
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..))]
    patience: u64,
}

/// A list of bands; clap takes a `Vec` for a repeated option.
#[derive(Clone, Debug)]
struct Bands(Vec<Band>);

fn bands(text: &str) -> Result<Bands, String> {
    Band::list(text).map(Bands)
}

/// Reads `480x360`.
pub(crate) fn size(text: &str) -> Result<(u32, u32), String> {
    let sides = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    sides
        .filter(|(w, h)| (32..=8192).contains(w) && (32..=8192).contains(h))
        .ok_or_else(|| "write it as 480x360; sides from 32 to 8192".into())
}

fn positive(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|r: &f64| *r > 0.0 && *r < 100.0)
        .ok_or_else(|| "write a number above 0 such as 0.001".into())
}

fn share(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|r: &f64| (0.0..1.0).contains(r)).ok_or_else(|| "write a share from 0 to below 1".into())
}

fn part(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|r: &f64| (0.0..=1.0).contains(r)).ok_or_else(|| "write a share from 0 to 1".into())
}

impl Args {
    fn plan(&self, seed: u64, folder: &Path) -> Result<Plan> {
        let learn = &self.learn;
        let val = match self.val.as_slice() {
            [] => self.sets.iter().filter(|s| s.pick.is_none()).cloned().collect(),
            val => val.to_vec(),
        };
        let precision = Precision::named(&self.machine.precision, device::find(&self.machine.machine().device)?);
        // Whoever goes on with a run goes on with its threads: they decide the last bits.
        let before = folder.join(run::PLAN);
        let before: Option<Identity> = before.exists().then(|| run::read_json(&before)).transpose()?;
        let threads =
            self.machine.threads_asked().or(before.map(|b| b.plan.threads)).unwrap_or_else(|| self.machine.threads());
        let (width, height) = learn.size;
        if learn.window.is_some_and(|(w, h)| w > width || h > height) {
            return Err(Error::misuse(format!(
                "--window is larger than the images, which are brought to {width}x{height}"
            ))
            .help("a larger --size, or a smaller window"));
        }
        Ok(Plan {
            network: learn.network,
            classes: learn.classes.clone(),
            shape: Shape { bands: learn.bands.0.clone(), width, height },
            train: self.sets.clone(),
            val,
            seed,
            steps: learn.steps,
            batch: learn.batch.into(),
            window: learn.window,
            rare: learn.rare,
            method: learn.optimiser,
            rate: learn.rate.unwrap_or(learn.optimiser.usual_rate()),
            decay: learn.decay,
            schedule: learn.schedule,
            loss: learn.loss,
            balance: learn.balance,
            calibrate: learn.calibrate,
            augment: learn.augment,
            exposure: learn.normalise,
            watch_every: learn.watch_every,
            patience: learn.patience,
            precision: precision.map_err(Error::input)?.name().into(),
            threads,
            begin_with: None,
            seconds: self.time.map(|t| t.as_secs()),
        })
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
        if !args.quiet {
            eprintln!("{}: {}", folder.display(), told(&results));
        }
        paths.extend([folder.join(run::WEIGHTS), folder.join(run::MODEL)]);
        paths.extend(write_page(&folder)?);
    }
    Ok(paths)
}

/// Trains one plan and shows how it goes.
pub(crate) fn fit(
    plan: &Plan,
    begin: Option<&Path>,
    machine: &MachineArgs,
    folder: &Path,
    quiet: bool,
    signals: &Signals,
) -> Result<Results> {
    let bar = if quiet { ProgressBar::hidden() } else { ProgressBar::new(plan.steps) };
    let style = ProgressStyle::with_template("{bar:30} step {pos} of {len}, {msg}, {eta} left");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    let smooth = Cell::new(None);
    let step = |done: u64, loss: f64| {
        let mean = smooth.get().map_or(loss, |mean: f64| mean + 0.05 * (loss - mean));
        smooth.set(Some(mean));
        bar.set_message(format!("loss {mean:.4}"));
        if bar.position() == 0 && done > 1 {
            // Time left is told from this sitting's steps alone.
            bar.set_position(done);
            bar.reset_eta();
        }
        bar.set_position(done);
    };
    let look = |look: &Look, best: bool| {
        let iou: Vec<String> = look.iou.iter().map(|v| v.map_or("–".into(), |v| format!("{:.1}", 100.0 * v))).collect();
        let loss = smooth.get().unwrap_or_default();
        let best = if best { ", the best so far" } else { "" };
        let line = format!(
            "step {} of {}: loss {loss:.4}, validation mean I/U {:.1} ({}){best}",
            look.step,
            plan.steps,
            100.0 * look.miou,
            iou.join(", ")
        );
        if !quiet {
            bar.suspend(|| eprintln!("{line}"));
        }
    };
    let watch = Watch { step: &step, look: &look, stop: signals.heed() };
    let results = session::fit(plan, begin, &machine.machine(), folder, &watch);
    bar.finish_and_clear();
    results
}

fn told(results: &Results) -> String {
    let why = match results.ended.as_str() {
        "patience" => ", nothing better came for long",
        "time" => ", the time was up",
        _ => "",
    };
    let best = match (results.best_step, results.history.best()) {
        (Some(step), Some(look)) => format!("; best at step {step}: validation mean I/U {:.1}", 100.0 * look.miou),
        _ => "; no validation images, the last weights are kept".into(),
    };
    format!(
        "{} steps{why} in {:.0} s, {:.2} images a second{best}",
        results.steps, results.seconds, results.images_per_second
    )
}

/// Writes what people look at of a training that is done, from what lies in its folder.
pub(crate) fn write_page(folder: &Path) -> Result<Vec<PathBuf>> {
    let Identity { plan, .. } = run::read_json(&folder.join(run::PLAN))?;
    let results: Results = run::read_json(&folder.join(run::RESULT))?;
    report::write_training(folder, &results, &plan.classes.names(), &facts(&plan, &results))
}

/// What the run's page says of the plan.
fn facts(plan: &Plan, results: &Results) -> Vec<(String, String)> {
    let sets = |selections: &[Selection]| selections.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
    let bands: Vec<&str> = plan.shape.bands.iter().map(Band::name).collect();
    let fact = |name: &str, value: String| (name.to_owned(), value);
    vec![
        fact("network", plan.network.about().into()),
        fact("learnt from", sets(&plan.train)),
        fact("watched by", sets(&plan.val)),
        fact("input", format!("{} at {} × {} pixels", bands.join(", "), plan.shape.width, plan.shape.height)),
        fact("steps", format!("{} of {}", results.steps, plan.batch_told())),
        fact("seed", plan.seed.to_string()),
        fact("how it went", told(results)),
    ]
}
