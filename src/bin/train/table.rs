//! `train table`.

use crate::fit;
use crate::machine::MachineArgs;
use crate::report;
use furrow_base::ron_file::RonFile;
use furrow_base::{Error, Result};
use furrow_cli::cli;
use furrow_cli::cli::signal::Signals;
use furrow_dataset::make::generate::Shard;
use furrow_dataset::model::classes::Classes;
use furrow_output::write_atomically;
use furrow_train::baseline::files;
use furrow_train::data::{Band, Pick, Selection};
use furrow_train::figure::compose;
use furrow_train::fit::Plan;
use furrow_train::measure::Report;
use furrow_train::session::{self, Machine};
use furrow_train::table::{
    self, BoundExperiment, Callbacks, Experiment, Predictor, RealSet, State, TableOptions, WorkPart,
};
use furrow_train::torch::{Precision, device};
use indicatif::HumanDuration;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// Arguments of `train table`.
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(crate) struct Args {
    /// Experiment file.
    page: PathBuf,
    /// Folder of its datasets, runs and tables; by default `out/NAME` or `out/NAME-SCALE`, after the file and the scale.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Folder of a real dataset of the experiment: a dataset, or a folder with images/ and labels/. May be given several times.
    #[arg(long, value_name = "NAME=DIR", value_parser = RealSet::parse)]
    real: Vec<RealSet>,
    /// Leave out the training and test sets that need this dataset. May be given several times.
    #[arg(long, value_name = "NAME")]
    without: Vec<String>,
    /// Scale of the experiment, as defined in its file: a larger or smaller variant.
    #[arg(long, value_name = "NAME")]
    scale: Option<String>,
    /// Run only the rows whose number modulo N is k.
    #[arg(long, value_name = "k/N", default_value = "0/1", value_parser = Shard::parse)]
    row: Shard,
    /// Do only one part of the work.
    #[arg(long, value_enum)]
    only: Option<WorkPartArg>,
    /// Print the datasets and rows with their progress, and do nothing else. Invalid weights and missing real datasets are reported.
    #[arg(long)]
    dry_run: bool,
    /// Time limit of each training run, such as 30m. Runs then end by the clock, so that the tables are not reproducible.
    #[arg(long, value_name = "DURATION", value_parser = cli::time)]
    time: Option<Duration>,
    #[command(flatten)]
    machine: MachineArgs,
    /// Print nothing but errors, warnings and the paths of the tables.
    #[arg(long)]
    quiet: bool,
}

const AFTER: &str = "\
If it is stopped or killed, the same command resumes and ends with the same tables. On several machines that share a folder, make the
datasets first:
  train table PAGE --out DIR --real NAME=DIR --only sets
  sbatch --array=0-7 --wrap 'train table PAGE --out DIR --real NAME=DIR --row $SLURM_ARRAY_TASK_ID/8'
  train table PAGE --out DIR --only tables";

/// A part of the work.
#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum WorkPartArg {
    /// Render and import the datasets.
    Sets,
    /// Write the tables of the results so far.
    Tables,
}

/// Runs the missing parts of the experiment; returns the paths of the tables.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    let page = RonFile::read(&args.page)?;
    let experiment = Experiment::of(&page, args.scale.as_deref())?;
    let out = args.out.clone().unwrap_or_else(|| usual_folder(&args.page, args.scale.as_deref()));
    cli::check_folder(&out)?;
    let bound = BoundExperiment::new(experiment, &args.real, &args.without, &out)?;
    for name in &bound.left_out {
        furrow_cli::message!("warning: `{name}` is left out: --without {}", args.without.join(" --without "));
    }
    if args.only != Some(WorkPartArg::Tables) {
        table::check_pixel_sizes(&bound, &page)?;
    }
    if args.dry_run {
        for error in [bound.check(), table::check_weights(&bound)].into_iter().filter_map(Result::err) {
            furrow_cli::message!("warning: {error}");
        }
        furrow_cli::message!("{}\n", bound.listing()?.markdown().trim_end());
        furrow_cli::message!("{}", table::listing(&bound, &out)?.markdown().trim_end());
        return Ok(Vec::new());
    }
    let machine = args.machine.machine();
    // Before any work: `device::find` may replace the process for a GPU.
    let precision = Precision::named(&args.machine.precision, device::find(&machine.device)?);
    let precision = precision.map_err(Error::input)?.name();
    let scale = args.scale.as_ref().map(|s| format!("// At the scale \"{s}\".\n")).unwrap_or_default();
    let order = TableOptions {
        bound: &bound,
        out: &out,
        page: &(scale + &page.text),
        shard: args.row,
        only: args.only.map(|part| match part {
            WorkPartArg::Sets => WorkPart::Sets,
            WorkPartArg::Tables => WorkPart::Tables,
        }),
        seconds: args.time.map(|t| t.as_secs()),
        threads: args.machine.threads(),
        precision,
    };
    let stop = signals.catch();
    let paths = table::run(
        &order,
        &Callbacks {
            fit: &|plan: &Plan, folder: &Path| fit::fit(plan, None, &args.machine, folder, args.quiet, signals),
            page: &|folder| fit::write_page(folder).map(drop),
            evaluate: &|predictor, on, picture| evaluate(predictor, on, picture, &machine, stop),
            training: &|row: &str, state: &State| {
                if !args.quiet {
                    furrow_cli::message!("training {} of {}: {row}{}", state.number, state.of, left(state.left));
                }
            },
            message: &|words| {
                if !args.quiet {
                    furrow_cli::message!("{words}");
                }
            },
            warn: &|words| furrow_cli::message!("warning: {words}"),
            stop,
        },
    )?;
    if !args.quiet {
        let (tables, _) = table::tables(&bound, &out)?;
        for (_, table) in
            tables.0.iter().filter(|(name, _)| *name != table::RUNS && args.only != Some(WorkPartArg::Sets))
        {
            furrow_cli::message!("\n{}", table.markdown().trim_end());
        }
    }
    Ok(paths)
}

/// Evaluates a network or a baseline. Writes a figure of some images with ground truth, prediction and errors to `picture`.
fn evaluate(
    predictor: &Predictor<'_>,
    on: &Selection,
    picture: &Path,
    machine: &Machine,
    stop: &AtomicBool,
) -> Result<Report> {
    let (_, images) = on.open(Pick::All, 0)?;
    let (report, thumbnails, palette) = match predictor {
        Predictor::Network(trained, precision, threads) => {
            let mut thumbnails =
                report::thumbnails(images.len(), &trained.card.input.bands, trained.card.classes.len());
            let mut see = |seen: &session::Predicted<'_>| thumbnails.see(seen.example, seen.size, seen.predicted);
            let report =
                session::evaluate(&(*trained).clone().into(), on, precision, *threads, machine, stop, &mut see)?;
            (report, thumbnails, trained.card.classes.colors())
        }
        Predictor::Baseline(baseline, shape) => {
            let mut thumbnails = report::thumbnails(images.len(), &Band::RGB, Classes::default().len());
            let size = (shape.width, shape.height);
            let mut see = |example: &_, predicted: &[u8]| thumbnails.see(example, size, predicted);
            let report = files::evaluate(baseline, on, shape, stop, &mut see)?;
            (report, thumbnails, Classes::default().colors())
        }
    };
    write_atomically(picture, &compose(&thumbnails.kept(), &palette, true).png()?)?;
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
