//! `train table`.

use crate::fit;
use crate::machine::MachineArgs;
use crate::report;
use furrow::cli::signal::Signals;
use furrow::dataset::classes::Classes;
use furrow::dataset::generate::Shard;
use furrow::output::write_atomically;
use furrow::ron_file::RonFile;
use furrow::train::baseline::files;
use furrow::train::data::{Band, Pick, Selection};
use furrow::train::figure::sheet;
use furrow::train::fit::Plan;
use furrow::train::measure::Report;
use furrow::train::session::{self, Machine};
use furrow::train::table::{self, Bound, Callbacks, Experiment, Only, Order, Predictor, Real, State};
use furrow::train::torch::{Precision, device};
use furrow::{Error, Result, cli};
use indicatif::HumanDuration;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// Runs an experiment as far as it is missing, and writes its tables.
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(crate) struct Args {
    /// The experiment file.
    page: PathBuf,
    /// Folder of its sets, runs and tables; `out/` and the file's name, with that of the scale, unless given.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Where a real dataset of the experiment lies: a dataset, or a folder with images/ and labels/. May be given several times.
    #[arg(long, value_name = "NAME=DIR", value_parser = Real::parse)]
    real: Vec<Real>,
    /// Leave out what needs this set. May be given several times.
    #[arg(long, value_name = "NAME")]
    without: Vec<String>,
    /// A scale of the experiment file, which makes the same experiment larger or smaller.
    #[arg(long, value_name = "NAME")]
    scale: Option<String>,
    /// Only the rows whose number leaves k when divided by N.
    #[arg(long, value_name = "k/N", default_value = "0/1", value_parser = Shard::parse)]
    row: Shard,
    /// Only a part of the work.
    #[arg(long, value_enum)]
    only: Option<Part>,
    /// Print the sets and rows and how far they are, and do nothing. What is wrong with weights or missing of real sets is told.
    #[arg(long)]
    dry_run: bool,
    /// Most time of a training, such as 30m; its end is then where the clock says, and the tables are not the same twice.
    #[arg(long, value_name = "DURATION", value_parser = cli::time)]
    time: Option<Duration>,
    /// Nothing: this program makes the sets itself. Kept for one version.
    #[arg(long, value_name = "PATH", hide = true)]
    trace: Option<PathBuf>,
    #[command(flatten)]
    machine: MachineArgs,
    /// Print nothing but errors, warnings and the paths of the tables.
    #[arg(long)]
    quiet: bool,
}

const AFTER: &str = "\
Stopped or killed, the same command goes on and ends with the same tables. On several machines that share a folder, the sets first:
  train table PAGE --out DIR --real NAME=DIR --only sets
  sbatch --array=0-7 --wrap 'train table PAGE --out DIR --real NAME=DIR --row $SLURM_ARRAY_TASK_ID/8'
  train table PAGE --out DIR --only tables";

/// A part of the work.
#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Part {
    /// Render and import the datasets.
    Sets,
    /// Write the tables of what is there.
    Tables,
}

/// Does what is missing.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    let page = RonFile::read(&args.page)?;
    for warning in page.renamed(table::RENAMED) {
        furrow::tell!("warning: {warning}");
    }
    let experiment = Experiment::of(&page, args.scale.as_deref())?;
    let out = args.out.clone().unwrap_or_else(|| usual_folder(&args.page, args.scale.as_deref()));
    cli::check_folder(&out)?;
    let bound = Bound::new(experiment, &args.real, &args.without, &out)?;
    for name in &bound.left_out {
        furrow::tell!("warning: `{name}` is left out: --without {}", args.without.join(" --without "));
    }
    if args.only != Some(Part::Tables) {
        table::check_pixel_sizes(&bound, &page)?;
    }
    if args.dry_run {
        for error in [bound.check(), table::check_weights(&bound)].into_iter().filter_map(Result::err) {
            furrow::tell!("warning: {error}");
        }
        furrow::tell!("{}\n", bound.listing()?.markdown().trim_end());
        furrow::tell!("{}", table::listing(&bound, &out)?.markdown().trim_end());
        return Ok(Vec::new());
    }
    if args.trace.is_some() {
        furrow::tell!("warning: --trace says nothing any more: this program renders the sets itself");
    }
    let machine = args.machine.machine();
    // First of all: for a GPU the program replaces itself.
    let precision = Precision::named(&args.machine.precision, device::find(&machine.device)?);
    let precision = precision.map_err(Error::input)?.name();
    let scale = args.scale.as_ref().map(|s| format!("// At the scale \"{s}\".\n")).unwrap_or_default();
    let order = Order {
        bound: &bound,
        out: &out,
        page: &(scale + &page.text),
        shard: args.row,
        only: args.only.map(|part| match part {
            Part::Sets => Only::Sets,
            Part::Tables => Only::Tables,
        }),
        seconds: args.time.map(|t| t.as_secs()),
        threads: args.machine.threads(),
        precision,
    };
    let stop = signals.heed();
    let paths = table::run(
        &order,
        &Callbacks {
            fit: &|plan: &Plan, folder: &Path| fit::fit(plan, None, &args.machine, folder, args.quiet, signals),
            page: &|folder| fit::write_page(folder).map(drop),
            evaluate: &|predictor, on, picture| evaluate(predictor, on, picture, &machine, stop),
            training: &|row: &str, state: &State| {
                if !args.quiet {
                    furrow::tell!("training {} of {}: {row}{}", state.number, state.of, left(state.left));
                }
            },
            tell: &|words| {
                if !args.quiet {
                    furrow::tell!("{words}");
                }
            },
            warn: &|words| furrow::tell!("warning: {words}"),
            stop,
        },
    )?;
    if !args.quiet {
        let (tables, _) = table::tables(&bound, &out)?;
        for (_, table) in tables.0.iter().filter(|(name, _)| *name != table::RUNS && args.only != Some(Part::Sets)) {
            furrow::tell!("\n{}", table.markdown().trim_end());
        }
    }
    Ok(paths)
}

/// Evaluates a network or a baseline; some of the images go to a figure, beside ground truth, prediction and errors.
fn evaluate(
    predictor: &Predictor<'_>,
    on: &Selection,
    picture: &Path,
    machine: &Machine,
    stop: &AtomicBool,
) -> Result<Report> {
    let (_, images) = on.open(Pick::All, 0)?;
    let (report, shots, palette) = match predictor {
        Predictor::Network(trained, precision, threads) => {
            let mut shots = report::shots(images.len(), &trained.card.input.bands, trained.card.classes.len());
            let mut see = |seen: &session::Predicted<'_>| shots.see(seen.example, seen.size, seen.predicted);
            let report =
                session::evaluate(&(*trained).clone().into(), on, precision, *threads, machine, stop, &mut see)?;
            (report, shots, trained.card.classes.colors())
        }
        Predictor::Baseline(baseline, shape) => {
            let mut shots = report::shots(images.len(), &Band::RGB, Classes::default().len());
            let size = (shape.width, shape.height);
            let mut see = |example: &_, predicted: &[u8]| shots.see(example, size, predicted);
            let report = files::evaluate(baseline, on, shape, stop, &mut see)?;
            (report, shots, Classes::default().colors())
        }
    };
    write_atomically(picture, &sheet(&shots.kept(), &palette, true).png()?)?;
    Ok(report)
}

fn left(seconds: Option<f64>) -> String {
    let time = seconds.map(|s| HumanDuration(Duration::from_secs_f64(s.max(0.0))));
    time.map(|t| format!("; {t} of training left")).unwrap_or_default()
}

fn usual_folder(page: &Path, scale: Option<&str>) -> PathBuf {
    let name = page.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    Path::new("out").join(scale.map(|s| format!("{name}-{s}")).unwrap_or(name))
}
