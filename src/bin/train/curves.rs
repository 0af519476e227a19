//! `train report`: losses and validation scores of several runs over each other, on one page.

use furrow::output::write_files;
use furrow::report::Table;
use furrow::report::chart::{Chart, Curve};
use furrow::report::{Cell, number};
use furrow::train::figure::Page;
use furrow::train::run::{self, Results};
use furrow::{Error, Result, cli};
use std::path::PathBuf;

/// Name of the page.
const FILE: &str = "losses.html";

/// Which runs.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folders of runs that are done.
    #[arg(required = true, value_name = "RUN")]
    runs: Vec<PathBuf>,
    /// Folder for losses.html.
    #[arg(long, value_name = "DIR", default_value = "out/losses")]
    out: PathBuf,
}

/// Reads the runs and writes the page; returns its path.
pub(crate) fn run(args: &Args) -> Result<Vec<PathBuf>> {
    cli::check_folder(&args.out)?;
    let mut runs = Vec::new();
    for folder in &args.runs {
        let results = run::results(folder)?.ok_or_else(|| {
            Error::input("there is no finished training in this folder")
                .in_file(folder)
                .help("give folders of `train fit`, or those below runs/ of `train table`")
        })?;
        runs.push((folder.display().to_string(), results));
    }
    let charts = charts(&runs);
    let page = Page {
        kind: "Training",
        title: "Losses of several runs",
        lead: "Each line is a run. Losses of trainings with different losses or class weights are not of one scale; validation scores are.",
        charts: &charts,
        tables: &[table(&runs)],
        ..Page::default()
    };
    write_files(&args.out, &[(FILE, page.html()?.into_bytes())])
}

/// Training loss, validation loss and mean I/U; those that no run has are left out.
fn charts(runs: &[(String, Results)]) -> Vec<Chart> {
    let chart = |title: &str, upwards: &str, logarithmic, points: &dyn Fn(&Results) -> Vec<(f64, f64)>| Chart {
        title: title.into(),
        across: "steps".into(),
        upwards: upwards.into(),
        curves: runs
            .iter()
            .map(|(name, results)| Curve { name: name.clone(), points: points(results) })
            .filter(|curve| !curve.points.is_empty())
            .collect(),
        logarithmic,
    };
    let losses = |of: &Results| of.history.losses.iter().map(|l| (l.step as f64, l.loss)).collect();
    let validation =
        |of: &Results| of.history.validation.iter().filter_map(|pass| Some((pass.step as f64, pass.loss?))).collect();
    let scores =
        |of: &Results| of.history.validation.iter().map(|pass| (pass.step as f64, 100.0 * pass.miou)).collect();
    let all = [
        chart("Training loss", "loss", true, &losses),
        chart("Validation loss", "loss", true, &validation),
        chart("Validation set", "mean I/U, %", false, &scores),
    ];
    all.into_iter().filter(|chart| !chart.curves.is_empty()).collect()
}

/// How each run ended.
fn table(runs: &[(String, Results)]) -> Table {
    let mut table = Table::new("Runs", ["run", "steps", "best step", "best mean I/U, %", "last loss", "minutes"]);
    for (name, results) in runs {
        let best = results.history.best();
        table.push([
            Cell::text(name),
            Cell::Count(results.steps),
            Cell::number(results.best_step.map(|step| step as f64), 0),
            Cell::percent(best.map(|pass| pass.miou), 1),
            Cell::Shown(results.history.losses.last().map_or_else(|| "–".into(), |last| number(last.loss))),
            Cell::number(Some(results.seconds / 60.0), 1),
        ]);
    }
    table
}
