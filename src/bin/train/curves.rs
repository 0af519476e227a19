//! `train report`: plots losses and validation scores of several runs together, on one page.

use furrow_base::math::ToFloat;
use furrow_base::{Error, Result};
use furrow_cli::cli;
use furrow_output::write_files;
use furrow_report::Table;
use furrow_report::chart::{Chart, Curve};
use furrow_report::{Cell, number};
use furrow_train::figure::Page;
use furrow_train::fit::checkpoint::History;
use furrow_train::fit::log;
use furrow_train::run::{self, Identity, Results};
use std::path::{Path, PathBuf};

/// File name of the page.
const FILE: &str = "losses.html";

/// Arguments of `train report`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folders of runs; runs that are not done are plotted from their logs.
    #[arg(required = true, value_name = "RUN")]
    runs: Vec<PathBuf>,
    /// Folder for losses.html.
    #[arg(long, value_name = "DIR", default_value = "out/losses")]
    out: PathBuf,
}

/// A training run, finished or not.
struct Run {
    name: String,
    /// Name of its loss, if it has a plan file.
    loss: Option<&'static str>,
    history: History,
    /// Final results; `None` if it is not done.
    results: Option<Results>,
}

impl Run {
    fn read(folder: &Path) -> Result<Self> {
        let results = run::results(folder)?;
        let history = match &results {
            Some(results) => Some(results.history.clone()),
            None => log::read(folder)?,
        };
        let history = history.ok_or_else(|| {
            Error::input("there is no training run in this folder")
                .in_file(folder)
                .help("give run folders of `train fit`, or folders in runs/ of `train table`")
        })?;
        let plan = folder.join(run::PLAN);
        let loss = plan.exists().then(|| run::read_json::<Identity>(&plan)).transpose()?;
        let loss = loss.map(|identity| identity.plan.hyper.loss.in_words());
        Ok(Self { name: folder.display().to_string(), loss, history, results })
    }
}

/// Reads the runs and writes the page; returns its path.
pub(crate) fn run(args: &Args) -> Result<Vec<PathBuf>> {
    cli::check_folder(&args.out)?;
    let runs = args.runs.iter().map(|folder| Run::read(folder)).collect::<Result<Vec<_>>>()?;
    let charts = charts(&runs);
    let page = Page {
        kind: "Training",
        title: "Losses of several runs",
        lead: "Each line is a run. Losses of runs with different loss functions or class weights are not comparable; validation scores are.",
        charts: &charts,
        tables: &[table(&runs)],
        ..Page::default()
    };
    write_files(&args.out, &[(FILE, page.html()?.into_bytes())])
}

/// Returns the charts of training loss, validation loss, learning rate and mean I/U; charts without data are left out.
fn charts(runs: &[Run]) -> Vec<Chart> {
    let chart = |title: &str, upwards: &str, logarithmic, points: &dyn Fn(&History) -> Vec<(f64, f64)>| Chart {
        title: title.into(),
        across: "steps".into(),
        upwards: upwards.into(),
        curves: runs
            .iter()
            .map(|run| Curve { name: run.name.clone(), points: points(&run.history) })
            .filter(|curve| !curve.points.is_empty())
            .collect(),
        logarithmic,
    };
    let losses = |of: &History| of.losses.iter().map(|l| (l.step.to_f64(), l.loss)).collect();
    let rates = |of: &History| of.losses.iter().map(|l| (l.step.to_f64(), l.rate)).collect();
    let validation =
        |of: &History| of.validation.iter().filter_map(|pass| Some((pass.step.to_f64(), pass.loss?))).collect();
    let scores = |of: &History| of.validation.iter().map(|pass| (pass.step.to_f64(), 100.0 * pass.miou)).collect();
    // The axis is named after the loss if all runs have the same one.
    let one = runs.first().and_then(|first| first.loss).filter(|loss| runs.iter().all(|run| run.loss == Some(loss)));
    let loss = one.unwrap_or("loss");
    let all = [
        chart("Training loss", loss, true, &losses),
        chart("Validation loss", loss, true, &validation),
        chart("Learning rate", "rate", true, &rates),
        chart("Validation set", "mean I/U, %", false, &scores),
    ];
    all.into_iter().filter(|chart| !chart.curves.is_empty()).collect()
}

/// Returns a table of the state and results of each run.
fn table(runs: &[Run]) -> Table {
    let mut table =
        Table::new("Runs", ["run", "state", "steps", "best step", "best mean I/U, %", "last loss", "minutes"]);
    for Run { name, history, results, .. } in runs {
        let best = history.best();
        table.push([
            Cell::text(name),
            Cell::text(if results.is_some() { "done" } else { "not done" }),
            Cell::Count(results.as_ref().map_or_else(|| history.last(), |results| results.steps)),
            Cell::number(best.map(|pass| pass.step.to_f64()), 0),
            Cell::percent(best.map(|pass| pass.miou), 1),
            Cell::Shown(history.losses.last().map_or_else(|| "–".into(), |last| number(last.loss))),
            Cell::number(results.as_ref().map(|results| results.seconds / 60.0), 1),
        ]);
    }
    table
}
