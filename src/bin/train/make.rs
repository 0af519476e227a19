//! `train make`.

use crate::machine::MachineArgs;
use crate::predict::Job;
use crate::{eval, fit, report};
use furrow_base::math::{ToFloat, ToInt};
use furrow_base::{Error, Result};
use furrow_cli::cli;
use furrow_cli::cli::signal::Signals;
use furrow_dataset::make::cost_estimate::estimate_cost;
use furrow_dataset::make::generate::{Callbacks, Work};
use furrow_dataset::make_watched;
use furrow_dataset::model::recipe;
use furrow_job::Threads;
use furrow_output::write_atomically;
use furrow_report::{count, number};
use furrow_train::crop::{Recipe, Species, scene};
use furrow_train::deploy::input_images::{self, InputImage, PREDICTION, Prediction, files};
use furrow_train::ensemble::Ensemble;
use furrow_train::fit::Plan;
use furrow_train::fit::settings::parse_size;
use furrow_train::net::Network;
use furrow_train::run::{self, Identity};
use furrow_train::session;
use furrow_train::torch::{Precision, device};
use furrow_train::zoo::ANY_FIELD;
use indicatif::{ProgressBar, ProgressStyle};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// File with the command that began a folder.
const MADE: &str = "make.json";
/// Scene file of the network's fields.
const SCENE: &str = "scene.ron";
/// Folder of the rendered images.
const DATA: &str = "data";
/// Folder of the evaluation on rendered images that were held out.
const HELD_OUT: &str = "eval/rendered";
/// Folder of the predictions for photographs.
const PREDICTIONS: &str = "predictions";
/// Batch size of predictions: images at several sizes go through the network one by one.
const BATCH: usize = 4;

/// Arguments of `train make`.
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(crate) struct Args {
    /// Crop that the network is for, by any name of a species (`trace species` lists them) or as a species file, FILE.ron. May be given
    /// several times: each field has one of these crops.
    #[arg(long = "crop", value_name = "NAME", required = true)]
    crops: Vec<String>,
    /// Weeds: all (every weed, and relatives of the crop), or a comma-separated list of species, which may be crops.
    #[arg(long, value_name = "all|NAMES", default_value = ALL)]
    weeds: String,
    /// Photographs without labels to predict with the network: PNG or JPEG files or a folder of them. May be given several times.
    #[arg(long, value_name = "DIR")]
    photos: Vec<PathBuf>,
    /// Folder of the network, its scene file, images and reports.
    #[arg(long, value_name = "NET")]
    out: PathBuf,
    /// Less than ten minutes on two cores instead of less than an hour, by the estimate: 40 images at 4 samples per pixel and 300 steps
    /// instead of 400, 8 and 600.
    #[arg(long)]
    quick: bool,
    /// Number of rendered images; a tenth of them is held out for the evaluation.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(3..=100_000))]
    images: Option<u64>,
    /// Number of training steps.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    steps: Option<u64>,
    /// Write the scene file, print the estimated cost, and do nothing else.
    #[arg(long, conflicts_with = "quiet")]
    dry_run: bool,
    /// Network architecture, to try the command out.
    #[arg(long, value_name = "NAME", hide = true, value_parser = Network::named)]
    network: Option<Network>,
    /// Width and height of the images, to try the command out.
    #[arg(long, value_name = "WxH", hide = true, value_parser = parse_size)]
    size: Option<(u32, u32)>,
    #[command(flatten)]
    machine: MachineArgs,
    /// Print nothing but errors, warnings about the photographs, and the paths of the files.
    #[arg(long)]
    quiet: bool,
}

/// Value of `--weeds` for every weed.
const ALL: &str = "all";

const AFTER: &str = "\
Steps: NET/scene.ron (the scene file, to read and edit), NET/data (rendered images), NET (the network), NET/eval/rendered (scores on rendered
images that were held out, which say nothing about photographs), NET/predictions (class masks, overlays and predictions.html).
A step that is done is skipped: the same command continues after a stop or kill and ends with the same network.";

/// Contents of `make.json`.
#[derive(Serialize, Deserialize)]
struct Made {
    /// Version of the program.
    furrow: String,
    /// The options that decide about the network, as a command.
    command: String,
}

/// Makes the network; returns the paths of the files that describe it and of the predictions.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    let make = Make::new(args, signals)?;
    cli::check_folder(&args.out)?;
    let plan = make.plan()?;
    plan.hyper.pretrained.begin(plan.network, &plan.shape.bands, plan.classes.len(), plan.seed)?;
    if !args.photos.is_empty() {
        // Missing photographs are reported before an hour of work.
        input_images::find(&args.photos, &plan.shape, &[])?;
    }
    make.claim()?;
    // A quiet run would not print it.
    if args.dry_run || !args.quiet && !make.data.join(recipe::FILE).exists() {
        make.estimate()?;
        signals.release()?;
    }
    if args.dry_run {
        return Ok(vec![make.scene]);
    }
    make.render()?;
    signals.release()?;
    let names: Vec<String> = make.crops.iter().map(|crop| crop.desc.name.clone()).collect();
    let results = fit::shown(plan.hyper.steps, args.quiet, signals, |callbacks| {
        session::fit_crops(&plan, &names, make.recipe.begin(), &args.machine.machine(), &args.out, callbacks)
    })?;
    signals.release()?;
    make.tell(&format!("{}: {}", args.out.display(), fit::in_words(&results)));
    let mut paths = [run::WEIGHTS, run::MODEL].map(|file| args.out.join(file)).to_vec();
    paths.extend(fit::write_page(&args.out)?);
    let trained = Ensemble::open(&args.out)?;
    paths.extend(make.evaluate(&trained)?);
    signals.release()?;
    paths.extend(make.predict(&trained)?);
    Ok(paths)
}

/// The work of one command.
struct Make<'a> {
    args: &'a Args,
    signals: &'a Signals,
    crops: Vec<Species>,
    weeds: Option<Vec<Species>>,
    recipe: Recipe,
    scene: PathBuf,
    data: PathBuf,
}

impl<'a> Make<'a> {
    fn new(args: &'a Args, signals: &'a Signals) -> Result<Self> {
        let mut crops: Vec<Species> = args.crops.iter().map(|name| Species::crop(name)).collect::<Result<_>>()?;
        crops.sort_by(|a, b| a.written.cmp(&b.written));
        crops.dedup_by(|a, b| a.file == b.file);
        let listed = (args.weeds != ALL).then(|| args.weeds.split(',').map(str::trim).filter(|name| !name.is_empty()));
        let mut weeds = listed.map(|names| names.map(Species::find).collect::<Result<Vec<_>>>()).transpose()?;
        if let Some(weeds) = &mut weeds {
            weeds.sort_by(|a, b| a.written.cmp(&b.written));
            weeds.dedup_by(|a, b| a.file == b.file);
            if let Some(both) = weeds.iter().find(|weed| crops.iter().any(|crop| crop.file == weed.file)) {
                return Err(Error::misuse(format!("`{}` is both a crop and a weed", both.desc.name))
                    .help("leave it out of --weeds or of --crop"));
            }
        }
        let usual = if args.quick { Recipe::QUICK } else { Recipe::USUAL };
        let recipe = Recipe {
            images: args.images.unwrap_or(usual.images),
            steps: args.steps.unwrap_or(usual.steps),
            size: args.size.unwrap_or(usual.size),
            network: args.network.unwrap_or(usual.network),
            ..usual
        };
        Ok(Self { args, signals, crops, weeds, recipe, scene: args.out.join(SCENE), data: args.out.join(DATA) })
    }

    fn tell(&self, words: &str) {
        if !self.args.quiet {
            furrow_cli::message!("{words}");
        }
    }

    /// Returns the options that decide about the network, as a command.
    fn command(&self) -> String {
        let quoted = |name: &str| if name.contains(' ') { format!("'{name}'") } else { name.to_owned() };
        let mut words = vec!["train make".to_owned()];
        words.extend(self.crops.iter().map(|crop| format!("--crop {}", quoted(&crop.written))));
        if let Some(weeds) = &self.weeds {
            let names: Vec<&str> = weeds.iter().map(|weed| weed.written.as_str()).collect();
            words.push(format!("--weeds {}", quoted(&names.join(","))));
        }
        let Args { quick, images, steps, network, size, .. } = self.args;
        words.extend(quick.then(|| "--quick".to_owned()));
        words.extend(images.map(|n| format!("--images {n}")));
        words.extend(steps.map(|n| format!("--steps {n}")));
        words.extend(network.map(|network| format!("--network {}", network.name())));
        words.extend(size.map(|(width, height)| format!("--size {width}x{height}")));
        words.join(" ")
    }

    /// Returns the plan of the training. A run that was started before keeps its number of threads and its precision, on which the last
    /// bits depend.
    fn plan(&self) -> Result<Plan> {
        let machine = &self.args.machine;
        let before = self.args.out.join(run::PLAN);
        let before: Option<Identity> = before.exists().then(|| run::read_json(&before)).transpose()?;
        let found = Precision::named(&machine.precision, device::find(&machine.machine().device)?);
        let found = found.map_err(Error::input)?.name().to_owned();
        let (precision, threads) = match before {
            Some(Identity { plan, .. }) => (plan.precision, machine.threads_asked().unwrap_or(plan.threads)),
            None => (found, machine.threads()),
        };
        self.recipe.plan(&self.data, &precision, threads)
    }

    /// Claims the folder for this network and writes the scene file, or checks that both are there.
    fn claim(&self) -> Result<()> {
        let (path, command) = (self.args.out.join(MADE), self.command());
        if path.exists() {
            let there: Made = run::read_json(&path)?;
            if there.command != command {
                return Err(Error::misuse(format!("this folder was started with other options: {}", there.command))
                    .help("give another --out, or the same options to resume")
                    .in_file(path));
            }
        } else if run::is_run(&self.args.out) || self.data.exists() {
            return Err(Error::misuse("this folder holds a network or a dataset that `train make` did not begin")
                .help("give another --out")
                .in_file(&self.args.out));
        }
        // An edited scene file stays.
        if !self.scene.exists() {
            let text = scene(&self.crops, self.weeds.as_deref(), &command)?;
            write_atomically(&self.scene, text.as_bytes())?;
        }
        run::write_json(&path, &Made { furrow: env!("CARGO_PKG_VERSION").into(), command })
    }

    /// Prints the estimated cost of rendering and training.
    fn estimate(&self) -> Result<()> {
        self.tell("estimating the cost from a few images");
        let (order, threads) = (self.recipe.order(&self.scene), Threads::all()?);
        let (cost, _) = estimate_cost(&self.data, &order, &threads, &|_| (), self.signals.catch())?;
        let training = self.recipe.training_core_s();
        let Recipe { images, spp, steps, size: (width, height), .. } = self.recipe;
        let minutes = |core_s: f64| number(core_s / 60.0);
        self.tell(&format!(
            "{} of {width} × {height} pixels at {}: {} core minutes, {} MB; {}: about {} core minutes; together about {} minutes with {}",
            count(images, "image", "images"),
            count(spp.into(), "sample per pixel", "samples per pixel"),
            minutes(cost.core_s),
            number(cost.bytes.to_f64() / 1e6),
            count(steps, "training step", "training steps"),
            minutes(training),
            minutes((cost.core_s + training) / threads.count().to_f64()),
            count(threads.count().to_u64(), "thread", "threads"),
        ));
        Ok(())
    }

    /// Renders the missing images.
    fn render(&self) -> Result<()> {
        if Recipe::is_rendered(&self.data) {
            return Ok(());
        }
        self.tell(&format!("rendering {}", count(self.recipe.images, "image", "images")));
        let bar = if self.args.quiet { ProgressBar::hidden() } else { ProgressBar::new(self.recipe.images) };
        let style = ProgressStyle::with_template("{bar:30} {pos} of {len} images, {eta} left");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        let stop = self.signals.catch();
        let callbacks = Callbacks {
            begin: &|total| bar.set_length(total.to_u64()),
            warn: &|words| {
                // The scene file lists relatives of the crop as weeds on purpose.
                if !furrow_field::assemble::is_about_role(words) {
                    bar.suspend(|| self.tell(&format!("warning: {words}")));
                }
            },
            done: &|_| bar.inc(1),
            soon: stop,
            now: stop,
        };
        let made = make_watched(&self.data, &self.recipe.order(&self.scene), &Work::default(), &callbacks);
        bar.finish_and_clear();
        made.map(drop)
    }

    /// Evaluates the network on the rendered images that were held out.
    fn evaluate(&self, trained: &Ensemble) -> Result<Vec<PathBuf>> {
        let out = self.args.out.join(HELD_OUT);
        if out.join(report::EVALUATION).is_file() {
            return Ok(vec![out.join(report::EVALUATION)]);
        }
        let set = Recipe::held_out(&self.data);
        eval::evaluate(trained, &self.args.out, &set, &out, &self.args.machine, self.signals)
    }

    /// Predicts the photographs and writes a page of them.
    fn predict(&self, trained: &Ensemble) -> Result<Vec<PathBuf>> {
        if self.args.photos.is_empty() {
            return Ok(Vec::new());
        }
        let out = self.args.out.join(PREDICTIONS);
        let photos = input_images::find(&self.args.photos, &trained.card.input, &[])?;
        let page = out.join(report::PREDICTIONS);
        let is_there = |photo: &InputImage| files(&photo.name).iter().all(|file| out.join(file).is_file());
        if page.is_file() && photos.iter().all(is_there) {
            return Ok(vec![page]);
        }
        let job = Job {
            images: &self.args.photos,
            bands: &[],
            batch: BATCH,
            pixel_mm: None,
            plants: false,
            like: None,
            machine: &self.args.machine,
            quiet: self.args.quiet,
            signals: self.signals,
        };
        let mut paths = job.run(trained, &out)?;
        self.signals.release()?;
        let described: Prediction = run::read_json(&out.join(PREDICTION))?;
        let names = trained.card.crops.join(" and ");
        let mut folders = vec![(format!("network for {names}"), out.clone())];
        let lead = match &described.implausible {
            None => format!("Predictions of a network for {names}."),
            Some(found) => {
                folders.push((format!("network {ANY_FIELD}"), out.join(&found.beside)));
                found.warning(&trained.card)
            }
        };
        let title = format!("{} on photographs", self.args.out.display());
        let classes = &trained.card.classes;
        paths.push(report::write_predictions(&out, (&title, &lead), &photos, &folders, classes)?);
        Ok(paths)
    }
}
