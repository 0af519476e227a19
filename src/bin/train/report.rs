//! Reports of evaluations and training runs: tables, figure and HTML page.

use furrow_base::Result;
use furrow_base::math::ToFloat;
use furrow_dataset::model::classes::Classes;
use furrow_output::{read_indexed, write_atomically, write_files};
use furrow_report::chart::{Chart, Curve};
use furrow_train::data::Band;
use furrow_train::deploy::input_images::{InputImage, files};
use furrow_train::figure::{Page, Thumbnail, Thumbnails, compose, spread};
use furrow_train::fit::checkpoint::History;
use furrow_train::fit::log;
use furrow_train::measure::Report;
use furrow_train::run;
use std::path::{Path, PathBuf};

/// Number of images with the lowest mean I/U that the figure and the page of an evaluation show.
const WORST: usize = 8;
/// Number of further images shown, evenly spread over the set.
const SPREAD: usize = 4;
/// Maximum width and height of the images shown, pixels.
const LARGEST: u32 = 360;

/// Name of the page of an evaluation.
pub(crate) const EVALUATION: &str = "report.html";
/// Name of the page of predictions.
pub(crate) const PREDICTIONS: &str = "predictions.html";
/// Largest number of images on a page of predictions.
const SHOWN: usize = 24;

/// Returns a collector for the images to show of a set of `images` images: the worst by mean I/U over `classes` classes, and some
/// spread over the set.
pub(crate) fn thumbnails(images: usize, bands: &[Band], classes: usize) -> Thumbnails {
    Thumbnails::new(images, SPREAD, LARGEST, bands).and_worst(WORST, classes)
}

/// Writes `report.json`, `report.md`, `figure.png` and `report.html`; returns their paths.
pub(crate) fn write(
    out: &Path,
    title: &str,
    lead: &str,
    report: &Report,
    thumbnails: &[Thumbnail],
    palette: &[[u8; 3]],
) -> Result<Vec<PathBuf>> {
    let tables: String = report.tables().iter().map(|t| t.markdown() + "\n").collect();
    let tables = format!("{title}: {lead}\n\n{tables}");
    let page = Page {
        kind: "Evaluation",
        title,
        lead,
        report: Some(report),
        thumbnails,
        palette,
        classes: &report.classes,
        ..Page::default()
    };
    let files = [
        (EVALUATION, page.html()?.into_bytes()),
        ("figure.png", compose(thumbnails, palette, true).png()?),
        ("report.json", run::json(report)?),
        ("report.md", tables.into_bytes()),
    ];
    write_files(out, &files)
}

/// Writes the page `predictions.html` with some of the images, evenly spread, and their predictions in `folders`, which are named by the
/// heads of their columns. Returns its path.
pub(crate) fn write_predictions(
    out: &Path,
    (title, lead): (&str, &str),
    pictures: &[InputImage],
    folders: &[(String, PathBuf)],
    classes: &Classes,
) -> Result<PathBuf> {
    let mut thumbnails = Vec::new();
    for picture in spread(pictures.len(), SHOWN).into_iter().map(|k| &pictures[k]) {
        let maps = folders.iter().map(|(_, folder)| folder.join(&files(&picture.name)[0]));
        let maps: Vec<PathBuf> = maps.filter(|map| map.is_file()).collect();
        // Images that could not be read have no prediction.
        if maps.len() < folders.len() {
            continue;
        }
        let image = picture.read()?;
        let maps = maps.iter().map(|map| Ok(read_indexed(map)?.2)).collect::<Result<Vec<_>>>()?;
        let maps: Vec<&[u8]> = maps.iter().map(Vec::as_slice).collect();
        thumbnails.push(Thumbnail::new(&picture.name, (image.width, image.height), &image.rgb, &[], &maps, LARGEST));
    }
    let heads: Vec<String> = folders.iter().map(|(head, _)| head.clone()).collect();
    let (palette, names) = (classes.colors(), classes.names());
    let page = Page {
        kind: "Predictions",
        title,
        lead,
        thumbnails: &thumbnails,
        predictors: &heads,
        palette: &palette,
        classes: &names,
        ..Page::default()
    };
    let path = out.join(PREDICTIONS);
    write_atomically(&path, page.html()?.as_bytes())?;
    Ok(path)
}

/// Returns the charts of a training run: loss (`loss` is its name), learning rate and validation I/U.
pub(crate) fn curves(history: &History, loss: &str, classes: &[String]) -> Vec<Chart> {
    let chart = |title: &str, upwards: &str, curves: Vec<Curve>, logarithmic| Chart {
        title: title.into(),
        across: "steps".into(),
        upwards: upwards.into(),
        curves,
        logarithmic,
    };
    let losses = history.losses.iter().map(|l| (l.step.to_f64(), l.loss)).collect();
    let validation: Vec<(f64, f64)> =
        history.validation.iter().filter_map(|pass| Some((pass.step.to_f64(), pass.loss?))).collect();
    let mut losses = vec![Curve { name: "training".into(), points: losses }];
    if !validation.is_empty() {
        losses.push(Curve { name: "validation".into(), points: validation });
    }
    let mut charts = vec![chart("Loss", loss, losses, true)];
    let rates = history.losses.iter().map(|l| (l.step.to_f64(), l.rate)).collect();
    charts.push(chart("Learning rate", "rate", vec![Curve { name: "decoder".into(), points: rates }], true));
    if !history.validation.is_empty() {
        let of = |name: &str, value: &dyn Fn(usize) -> Option<f64>| Curve {
            name: name.into(),
            points: history
                .validation
                .iter()
                .enumerate()
                .filter_map(|(i, l)| Some((l.step.to_f64(), 100.0 * value(i)?)))
                .collect(),
        };
        let mut all = vec![of("mean", &|i| Some(history.validation[i].miou))];
        all.extend(classes.iter().enumerate().map(|(c, name)| of(name, &|i| history.validation[i].iou[c])));
        charts.push(chart("Validation set", "I/U, %", all, false));
    }
    charts
}

/// Writes `report.html`, `loss.svg` and `log.csv` of a training run; returns their paths.
pub(crate) fn write_training(
    out: &Path,
    results: &run::Results,
    loss: &str,
    classes: &[String],
    facts: &[(String, String)],
) -> Result<Vec<PathBuf>> {
    let charts = curves(&results.history, loss, classes);
    let page = Page {
        kind: "Training",
        title: &out.display().to_string(),
        facts,
        charts: &charts,
        classes,
        ..Page::default()
    };
    let files = [
        ("report.html", page.html()?.into_bytes()),
        ("loss.svg", charts[0].svg().into_bytes()),
        (log::CSV, log::table(&results.history, classes).into_bytes()),
    ];
    write_files(out, &files)
}
