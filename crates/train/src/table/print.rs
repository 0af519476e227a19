//! Tables of an experiment, with the results so far.

use super::against;
use super::evaluation;
use super::experiment::Experiment;
use super::rows::{self, Learner, Row};
use super::seen::{PERCENT, Seen, mean, median, scale, see, spread};
use super::sets::BoundExperiment;
use crate::figure;
use crate::measure::Report;
use crate::run::{self, Results};
use furrow_base::Result;
use furrow_base::math::{ToFloat, ToInt};
use furrow_dataset::model::classes::Classes;
use furrow_output::{write_atomically, write_together};
use furrow_report::{Cell, Table};
use std::path::{Path, PathBuf};

/// Name of the table of individual runs.
pub const RUNS: &str = "runs";

/// Name of the table of times, the only one that differs between identical experiments.
pub const TIMES: &str = "times";

/// Name of the table of changes against the reference training set.
const AGAINST: &str = "against";

/// Tables by file name.
#[derive(Clone, Debug, PartialEq)]
pub struct Tables(pub Vec<(&'static str, Table)>);

impl Tables {
    /// Writes every table as Markdown, CSV and JSON, all files or none; returns the paths.
    pub fn write(&self, out: &Path) -> Result<Vec<PathBuf>> {
        write_together(out, |files| {
            for (name, table) in &self.0 {
                for (ending, text) in [("md", table.markdown()), ("csv", table.csv()), ("json", table.json())] {
                    files.add(&out.join(format!("{name}.{ending}")), text.as_bytes())?;
                }
            }
            Ok(())
        })
    }
}

/// Line of a table: all seeds of one network or baseline on one training set.
struct Line<'a> {
    name: &'static str,
    train: &'a str,
    seen: Vec<&'a Seen>,
}

/// Builds the tables of the results so far; returns them with warnings about evaluations that are left out.
pub fn tables(bound: &BoundExperiment, out: &Path) -> Result<(Tables, Vec<String>)> {
    let experiment = &bound.experiment;
    let mut notes = Vec::new();
    let seen = rows::rows(experiment)
        .into_iter()
        .map(|row| see(experiment, row, out, &mut notes))
        .collect::<Result<Vec<_>>>()?;
    let lines = lines(experiment, &seen);
    let mut all = vec![
        ("table-1", segmentation(experiment, &lines)),
        ("table-2", vegetation(experiment, &lines)),
        ("table-3", classes(experiment, &lines)),
        (RUNS, runs(experiment, &seen)),
        (TIMES, times(experiment, &seen)),
    ];
    if let Some(table) = against::table(bound, &seen, out)? {
        all.insert(0, (AGAINST, table));
    }
    Ok((Tables(all), notes))
}

/// Returns the lines of the tables: networks, then baselines, each with all training sets, in the order of the experiment file.
fn lines<'a>(experiment: &'a Experiment, seen: &'a [Seen]) -> Vec<Line<'a>> {
    let networks = experiment.networks.iter().map(|n| n.name());
    let names = networks.chain(experiment.baselines.iter().map(|b| b.name()));
    let line = |name: &'static str| {
        experiment.train.iter().enumerate().map(move |(i, train)| Line {
            name,
            train: &train.name,
            seen: seen.iter().filter(|s| s.row.learner.name() == name && s.row.train == i).collect(),
        })
    };
    names.flat_map(line).collect()
}

impl Line<'_> {
    /// Returns a score of all seeds that have an evaluation on a test set.
    fn values(&self, test: usize, of: impl Fn(&Report) -> Option<f64>) -> Vec<f64> {
        self.seen.iter().filter_map(|s| of(s.reports[test].as_ref()?)).collect()
    }

    /// Returns the number of evaluated runs: the minimum over the test sets.
    fn done(&self, tests: usize) -> u64 {
        let evaluated = |test: usize| self.seen.iter().filter(|s| s.reports[test].is_some()).count().to_u64();
        (0..tests).map(evaluated).min().unwrap_or(0)
    }

    fn begin(&self) -> [Cell; 2] {
        [Cell::text(self.name), Cell::text(self.train)]
    }
}

/// Column head of a score, and the function that reads it from a report.
type Score = (&'static str, fn(&Report) -> Option<f64>);

/// Builds a table of means over seeds, with a column per score and test set.
fn means(title: String, experiment: &Experiment, lines: &[Line<'_>], scores: &[Score]) -> Table {
    let heads = experiment.test.iter().flat_map(|t| scores.iter().map(move |(head, _)| format!("{} {head}", t.name)));
    let columns = ["network", "trained on"].map(str::to_owned).into_iter().chain(heads).chain(["runs".to_owned()]);
    let mut table = Table::new(title, columns);
    for line in lines {
        let cells = (0..experiment.test.len()).flat_map(|test| {
            scores.iter().map(move |(_, score)| Cell::percent(mean(&line.values(test, score)), PERCENT))
        });
        table.push(line.begin().into_iter().chain(cells).chain([Cell::Count(line.done(experiment.test.len()))]));
    }
    table
}

/// Builds Table I: global accuracy (GA), class accuracy (CA) and mean I/U.
fn segmentation(experiment: &Experiment, lines: &[Line<'_>]) -> Table {
    let scores: [Score; 3] =
        [("GA", |r| r.scores.global_accuracy), ("CA", |r| r.scores.class_accuracy), ("I/U", |r| r.scores.mean_iou)];
    means(format!("Image segmentation ({})", scale(experiment)), experiment, lines, &scores)
}

/// Builds Table II: precision and recall of vegetation.
fn vegetation(experiment: &Experiment, lines: &[Line<'_>]) -> Table {
    let scores: [Score; 2] = [("P", |r| r.scores.vegetation.precision), ("R", |r| r.scores.vegetation.recall)];
    means(format!("Vegetation detection ({})", scale(experiment)), experiment, lines, &scores)
}

/// Builds the table of I/U of every class but the first, and of vegetation: means and standard deviations over seeds.
fn classes(experiment: &Experiment, lines: &[Line<'_>]) -> Table {
    let names = experiment.plan.classes.names();
    let iou = |report: &Report, class: Option<usize>| match class {
        Some(class) => report.scores.classes.get(class)?.iou,
        None => report.scores.vegetation.iou,
    };
    let kinds: Vec<(&str, Option<usize>)> =
        names.iter().enumerate().skip(1).map(|(i, n)| (n.as_str(), Some(i))).collect();
    let kinds = [kinds, vec![("vegetation", None)]].concat();
    let heads = experiment.test.iter().flat_map(|t| {
        kinds.iter().flat_map(move |(name, _)| [format!("{} {name}", t.name), format!("{} {name} ±", t.name)])
    });
    let columns = ["network", "trained on"].map(str::to_owned).into_iter().chain(heads).chain(["runs".to_owned()]);
    let mut table =
        Table::new(format!("I/U of plants, mean and standard deviation over seeds ({})", scale(experiment)), columns);
    for line in lines {
        let mut cells = line.begin().to_vec();
        for test in 0..experiment.test.len() {
            for (_, class) in &kinds {
                let values = line.values(test, |r| iou(r, *class));
                cells.extend([Cell::percent(mean(&values), PERCENT), Cell::percent(spread(&values), PERCENT)]);
            }
        }
        cells.push(Cell::Count(line.done(experiment.test.len())));
        table.push(cells);
    }
    table
}

/// Writes the report page `results.html` with all tables but times; returns its path.
pub(super) fn page(bound: &BoundExperiment, tables: &Tables, out: &Path) -> Result<PathBuf> {
    let experiment = &bound.experiment;
    let plan = &experiment.plan;
    let fact = |name: &str, value: String| (name.to_owned(), value);
    let names = |all: Vec<&str>| all.join(", ");
    let facts = [
        fact("networks", names(experiment.networks.iter().map(|n| n.about()).collect())),
        fact("seeds", experiment.seeds.iter().map(u64::to_string).collect::<Vec<_>>().join(", ")),
        fact("images", format!("{} × {} pixels", plan.shape.width, plan.shape.height)),
        fact("steps", format!("at most {} of {}", plan.hyper.steps, plan.batch_in_words())),
        fact("classes", plan.classes.names().join(", ")),
        fact("scale", experiment.scale.clone().unwrap_or_else(|| "as in the file".into())),
        fact("sets", names(experiment.sets.iter().map(|(name, _)| name.as_str()).collect())),
    ];
    let effects = tables.0.iter().find(|(name, _)| *name == AGAINST).map(|(_, table)| table);
    let plots = effects.map(against::plots).unwrap_or_default();
    let shown: Vec<Table> =
        tables.0.iter().filter(|(name, _)| ![TIMES, AGAINST].contains(name)).map(|(_, t)| t.clone()).collect();
    let (title, lead) = match &experiment.against {
        Some(_) => ("Effect of each change on a trained network", against::LEAD),
        None => (
            "Trained on rendered and real images, evaluated on real ones",
            "Means over seeds; a network that scores below the ExG baselines has learned nothing about shape.",
        ),
    };
    let thumbnails = against::thumbnails(bound)?;
    let predictors: [String; 1] = ["labels".into()];
    let page = figure::Page {
        kind: "Experiment",
        title,
        lead,
        facts: &facts,
        effects,
        plots: &plots,
        tables: &shown,
        thumbnails: &thumbnails,
        predictors: &predictors,
        palette: &Classes::default().colors(),
        classes: &Classes::default().names(),
        ..figure::Page::default()
    };
    let path = out.join("results.html");
    write_atomically(&path, page.html()?.as_bytes())?;
    Ok(path)
}

/// Returns a table of all rows with their numbers and progress.
pub fn listing(bound: &BoundExperiment, out: &Path) -> Result<Table> {
    let experiment = &bound.experiment;
    let mut table = Table::new("Rows", ["row", "network", "trained on", "seed", "training", "tests evaluated"]);
    for (i, row) in rows::rows(experiment).into_iter().enumerate() {
        let folder = row.folder(experiment, out);
        let s = see(experiment, row, out, &mut Vec::new())?;
        let state = match (evaluation::who(&folder)?.is_some(), folder.join(run::PLAN).exists()) {
            (true, _) => "done",
            (false, true) => "begun",
            (false, false) => "missing",
        };
        let evaluated = s.reports.iter().flatten().count();
        table.push([
            Cell::Count(i.to_u64()),
            Cell::text(row.learner.name()),
            Cell::text(&experiment.train[row.train].name),
            seed(&row),
            Cell::text(state),
            Cell::text(format!("{evaluated} of {}", s.reports.len())),
        ]);
    }
    Ok(table)
}

fn seed(row: &Row) -> Cell {
    match row.learner {
        Learner::Network(_, seed) => Cell::Count(seed),
        Learner::Baseline(_) => Cell::number(None, 0),
    }
}

/// Builds the table of every run on every test set.
fn runs(experiment: &Experiment, seen: &[Seen]) -> Table {
    let names = experiment.plan.classes.names();
    let fixed =
        ["network", "trained on", "seed", "steps", "best step", "tested on", "GA", "CA", "I/U"].map(str::to_owned);
    let classes = names.iter().map(|n| format!("{n} I/U"));
    let last = ["vegetation I/U", "vegetation P", "vegetation R"].map(str::to_owned);
    let mut table = Table::new(format!("Runs ({})", scale(experiment)), fixed.into_iter().chain(classes).chain(last));
    for s in seen {
        let steps = |v: Option<u64>| Cell::number(v.map(ToFloat::to_f64), 0);
        for (test, report) in experiment.test.iter().zip(&s.reports) {
            let begin = [
                Cell::text(s.row.learner.name()),
                Cell::text(&experiment.train[s.row.train].name),
                seed(&s.row),
                steps(s.results.as_ref().map(|r| r.steps)),
                steps(s.results.as_ref().and_then(|r| r.best_step)),
                Cell::text(&test.name),
            ];
            let score = |of: &dyn Fn(&Report) -> Option<f64>| Cell::percent(report.as_ref().and_then(of), PERCENT);
            let means = [
                score(&|r| r.scores.global_accuracy),
                score(&|r| r.scores.class_accuracy),
                score(&|r| r.scores.mean_iou),
            ];
            let classes = (0..names.len()).map(|k| score(&|r| r.scores.classes.get(k)?.iou));
            let vegetation = [
                score(&|r| r.scores.vegetation.iou),
                score(&|r| r.scores.vegetation.precision),
                score(&|r| r.scores.vegetation.recall),
            ];
            table.push(begin.into_iter().chain(means).chain(classes).chain(vegetation));
        }
    }
    table
}

/// Builds Table III: prediction time per image (median over the images of a test set, then over runs), and the mean speed and duration of
/// training.
fn times(experiment: &Experiment, seen: &[Seen]) -> Table {
    let tests = experiment.test.iter().map(|t| format!("{}: seconds an image", t.name));
    let columns = ["network".to_owned()].into_iter().chain(tests);
    let columns = columns.chain(["training images a second", "minutes of a training"].map(str::to_owned));
    let plan = &experiment.plan;
    let title = format!("Times ({} × {})", plan.shape.width, plan.shape.height);
    let mut table = Table::new(title, columns);
    let networks = experiment.networks.iter().map(|n| n.name());
    for name in networks.chain(experiment.baselines.iter().map(|b| b.name())) {
        let of: Vec<&Seen> = seen.iter().filter(|s| s.row.learner.name() == name).collect();
        let results: Vec<&Results> = of.iter().filter_map(|s| s.results.as_ref()).collect();
        let predictions = (0..experiment.test.len()).map(|test| {
            let all: Vec<f64> = of.iter().filter_map(|s| s.seconds[test]).collect();
            Cell::number(median(all), 3)
        });
        let rate = mean(&results.iter().map(|r| r.images_per_second).collect::<Vec<_>>());
        let minutes = mean(&results.iter().map(|r| r.seconds / 60.0).collect::<Vec<_>>());
        table.push(
            [Cell::text(name)].into_iter().chain(predictions).chain([Cell::number(rate, 2), Cell::number(minutes, 1)]),
        );
    }
    table
}
