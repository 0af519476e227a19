//! One page of a run or an evaluation: numbers, curves and pictures, in one file that asks for nothing.

use super::curve::Chart;
use super::shot::{CONFUSED, INVENTED, MISSED, Shot};
use crate::Result;
use crate::dataset::sample::IGNORE;
use crate::html::{count, document, escape, inside, keyed, number, pairs, percent, section, whole};
use crate::output::{self, Picture};
use crate::train::measure::{Cell, Confusion, Interval, Report, Table};
use std::fmt::Write;

const STYLE: &str = include_str!("page.css");
/// Quality of the JPEGs.
const QUALITY: u8 = 85;

/// What a page shows; what is empty is left out.
#[derive(Clone, Copy, Debug, Default)]
pub struct Page<'a> {
    /// What it is of: `Training`, `Evaluation`.
    pub kind: &'a str,
    /// Which one.
    pub title: &'a str,
    /// A sentence on it.
    pub lead: &'a str,
    /// What is what: names and values.
    pub facts: &'a [(String, String)],
    /// The table that all is about; wide.
    pub answer: Option<&'a Table>,
    /// How well a set of images was answered.
    pub report: Option<&'a Report>,
    /// Curves over training.
    pub charts: &'a [Chart],
    /// Images to look at.
    pub shots: &'a [Shot],
    /// Heads of the columns of predictions; `prediction` where there are fewer.
    pub predictors: &'a [String],
    /// Colour of each class.
    pub palette: &'a [[u8; 3]],
    /// Names of the classes.
    pub classes: &'a [String],
    /// More numbers.
    pub tables: &'a [Table],
}

impl Page<'_> {
    /// The page.
    pub fn html(&self) -> Result<String> {
        let mut body = String::new();
        if let Some(report) = self.report {
            body.push_str(&figures(report));
            body.push_str(&section("Scores", &scores(report)));
            body.push_str(&section("Who was taken for whom", &matrix(&report.confusion, &report.classes)));
        }
        if let Some(answer) = self.answer {
            let table = table_html(answer);
            body.push_str(&section("What changes do", &format!("<div class=\"wide\">{table}</div>")));
        }
        body.push_str(&section("Curves", &self.curves()));
        body.push_str(&section("Images", &self.images()?));
        if let Some(report) = self.report {
            let more = [report.boundary_table(), report.size_table()];
            body.push_str(&section("Outlines and sizes", &(tables(&more) + SIZES + &each_image(report))));
        }
        body.push_str(&section("Tables", &tables(self.tables)));
        let facts: Vec<(&str, String)> = self.facts.iter().map(|(k, v)| (k.as_str(), escape(v))).collect();
        body.push_str(&section("What it is", &if facts.is_empty() { String::new() } else { pairs(&facts) }));
        let footer = format!("Written by Furrow {}", env!("CARGO_PKG_VERSION"));
        Ok(document(self.kind, self.title, &escape(self.lead), STYLE, &body, &footer))
    }

    fn curves(&self) -> String {
        let plot = |chart: &Chart| format!("<figure class=\"plot\">{}</figure>\n", chart.inline());
        let plots: String = self.charts.iter().map(plot).collect();
        if plots.is_empty() { plots } else { format!("<div class=\"plots\">{plots}</div>") }
    }

    fn images(&self) -> Result<String> {
        if self.shots.is_empty() {
            return Ok(String::new());
        }
        let mut out = self.legend();
        let columns = self.shots.iter().map(|shot| shot.predictions.len()).max().unwrap_or(0);
        let known = self.shots.iter().any(|shot| !shot.truth.is_empty());
        let mut heads = vec!["image".to_owned()];
        heads.extend(known.then(|| "truth".to_owned()));
        for k in 0..columns {
            heads.push(self.predictors.get(k).cloned().unwrap_or_else(|| "prediction".into()));
            heads.extend(known.then(|| "errors".to_owned()));
        }
        let head = |words: &String| format!("<span>{}</span>", escape(words));
        let _ = writeln!(out, "<div class=\"heads\">{}</div>", heads.iter().map(head).collect::<String>());
        for shot in self.shots {
            out.push_str(&self.row(shot)?);
        }
        Ok(out)
    }

    /// What colours mean.
    fn legend(&self) -> String {
        let item = |[r, g, b]: [u8; 3], words: &str| {
            format!(
                "<span><i class=\"swatch\" style=\"background:#{r:02x}{g:02x}{b:02x}\"></i>{}</span>",
                escape(words)
            )
        };
        let classes = self.palette.iter().zip(self.classes).map(|(color, name)| item(*color, name));
        let errors = [(MISSED, "a plant missed"), (INVENTED, "a plant where none is"), (CONFUSED, "one for another")];
        let known = self.shots.iter().any(|shot| !shot.truth.is_empty());
        let errors = errors.into_iter().filter(|_| known).map(|(color, words)| item(color, words));
        format!("<p class=\"legend\">{}</p>", classes.chain(errors).collect::<String>())
    }

    fn row(&self, shot: &Shot) -> Result<String> {
        let (w, h) = (shot.width, shot.height);
        let picture = |source: &str, what: &str| {
            format!(
                "<img src=\"{source}\" width=\"{w}\" height=\"{h}\" alt=\"{} of {}\">",
                escape(what),
                escape(&shot.name)
            )
        };
        // The colour of every number, so that a map may be written as it is.
        let mut palette = vec![[128; 3]; usize::from(IGNORE) + 1];
        palette[..self.palette.len()].copy_from_slice(self.palette);
        let labels = |map: &[u8]| -> Result<String> {
            let png = output::encode_png(w, h, &Picture::Indexed(map, &palette), "")?;
            Ok(inside("png", &png))
        };
        let mut cells = picture(&inside("jpeg", &output::encode_jpeg(w, h, &shot.rgb, QUALITY)?), "image");
        if !shot.truth.is_empty() {
            cells.push_str(&picture(&labels(&shot.truth)?, "truth"));
        }
        for (k, map) in shot.predictions.iter().enumerate() {
            cells.push_str(&picture(&labels(map)?, "prediction"));
            if !shot.truth.is_empty() {
                let errors = output::encode_png(w, h, &Picture::Rgb(&shot.errors(k)), "")?;
                cells.push_str(&picture(&inside("png", &errors), "errors"));
            }
        }
        Ok(format!(
            "<figure class=\"row\"><figcaption><b>{}</b>{}</figcaption><div>{cells}</div></figure>\n",
            escape(&shot.name),
            self.words(shot)
        ))
    }

    /// I/U of the image, where the report knows it.
    fn words(&self, shot: &Shot) -> String {
        let image = self.report.and_then(|report| report.images.iter().find(|image| image.name == shot.name));
        let Some(image) = image else { return String::new() };
        let classes = self.classes.iter().zip(&image.ious).map(|(name, iou)| (name.as_str(), *iou));
        let all = [("mean I/U", image.mean_iou)].into_iter().chain(classes);
        let words: Vec<String> = all.map(|(name, iou)| format!("{} {}", escape(name), share(iou))).collect();
        words.join(", ")
    }
}

const SIZES: &str = "<p>A plant's size is its pixels; each bin is twice as large across as the one before. Detected are plants of which at \
                     least half of the pixels have the right class; what was taken for a plant and is none counts where the plant is that it \
                     frays, or by its own size.</p>";

fn share(value: Option<f64>) -> String {
    value.map_or_else(|| "–".into(), percent)
}

/// The numbers at the top.
fn figures(report: &Report) -> String {
    let s = &report.scores;
    let mut all = vec![("mean I/U".to_owned(), "mean_iou", s.mean_iou)];
    let plants = report.classes.iter().zip(&s.classes).skip(1);
    all.extend(plants.map(|(name, class)| (format!("{name} I/U"), "class_iou", class.iou)));
    all.push(("vegetation I/U".into(), "vegetation_iou", s.vegetation.iou));
    let figure = |words: &str, shown: &str| format!("<div><b>{shown}</b><span>{}</span></div>", escape(words));
    let mut out: String = all
        .iter()
        .map(|(words, key, value)| {
            let held = value.map_or_else(|| "null".to_owned(), |v| v.to_string());
            figure(words, &keyed(key, held, &share(*value)))
        })
        .collect();
    let images = report.images.len() as u64;
    out.push_str(&figure(if images == 1 { "image" } else { "images" }, &keyed("images", images, &whole(images))));
    if let Some(seconds) = &report.seconds {
        let ms = 1000.0 * seconds.median;
        out.push_str(&figure("an image, median", &keyed("seconds", seconds.median, &format!("{} ms", number(ms)))));
    }
    format!("<div class=\"figures\">{out}</div>\n")
}

/// Scores of all and of each class, with their intervals.
fn scores(report: &Report) -> String {
    let (s, i) = (&report.scores, &report.intervals);
    let cell = |value: Option<f64>, interval: Option<Interval>| {
        let around = interval.map_or_else(String::new, |i| {
            format!(" <small>{} to {}</small>", number(100.0 * i.low), number(100.0 * i.high))
        });
        format!("<td>{}{around}</td>", share(value))
    };
    let mut all = String::new();
    for (name, value, interval) in [
        ("GA, global accuracy", s.global_accuracy, i.global_accuracy),
        ("CA, mean accuracy of classes", s.class_accuracy, i.class_accuracy),
        ("mean I/U", s.mean_iou, i.mean_iou),
    ] {
        let _ = write!(all, "<tr><th>{name}</th>{}</tr>", cell(value, interval));
    }
    let mut classes = String::new();
    let names = report.classes.iter().map(String::as_str).chain(["vegetation"]);
    let rows = s.classes.iter().chain([&s.vegetation]).zip(i.classes.iter().chain([&i.vegetation]));
    for (name, (s, i)) in names.zip(rows) {
        let cells = [(s.iou, i.iou), (s.precision, i.precision), (s.recall, i.recall), (s.f1, i.f1)];
        let cells: String = cells.into_iter().map(|(value, interval)| cell(value, interval)).collect();
        let _ = write!(classes, "<tr><th>{}</th>{cells}</tr>", escape(name));
    }
    format!(
        "<div class=\"wide\"><table class=\"numbers means\"><tbody>{all}</tbody></table></div>\
         <div class=\"wide\"><table class=\"numbers\"><thead><tr><th></th><td>I/U</td><td>P</td><td>R</td><td>F1</td></tr></thead>\
         <tbody>{classes}</tbody></table></div>\
         <p>Small numbers are where 95 % of resamples of {} lie. {}</p>",
        count(report.images.len() as u64, "image", "images"),
        if report.ignored > 0 {
            format!("{} without a label count nowhere.", count(report.ignored, "pixel", "pixels"))
        } else {
            String::new()
        }
    )
}

/// The confusion matrix: each cell tinted by its share of the true class.
fn matrix(matrix: &Confusion, classes: &[String]) -> String {
    let head = |name: &String| format!("<th>{}</th>", escape(name));
    let heads: String = classes.iter().map(head).collect();
    let mut rows = String::new();
    for (truth, name) in classes.iter().enumerate() {
        let all = matrix.truth(truth);
        let _ = write!(rows, "<tr><th>{}</th>", escape(name));
        for predicted in 0..classes.len() {
            let n = matrix.at(truth, predicted);
            let part = n as f64 / all.max(1) as f64;
            let tint = if truth == predicted { "var(--crop)" } else { "var(--weed)" };
            let _ = write!(
                rows,
                "<td style=\"background:color-mix(in srgb, {tint} {:.1}%, transparent)\">{}<small>{}</small></td>",
                // What is rare is seen as well.
                60.0 * part.sqrt(),
                keyed(&format!("confusion.{truth}.{predicted}"), n, &share((all > 0).then_some(part))),
                whole(n)
            );
        }
        rows.push_str("</tr>");
    }
    format!(
        "<div class=\"wide\"><table class=\"numbers matrix\"><thead><tr><th>truth, taken for</th>{heads}</tr></thead><tbody>{rows}</tbody></table></div>\
         <p>Shares are of the pixels of the true class, its row.</p>"
    )
}

fn each_image(report: &Report) -> String {
    let table = report.image_table();
    format!(
        "<details><summary>Each of {}</summary><div class=\"wide\">{}</div></details>",
        count(report.images.len() as u64, "image", "images"),
        table_html(&Table { title: String::new(), ..table })
    )
}

/// Tables beside each other as far as there is room.
fn tables(all: &[Table]) -> String {
    let one = |table: &Table| format!("<div>{}</div>\n", table_html(table));
    let all: String = all.iter().filter(|table| !table.rows.is_empty()).map(one).collect();
    if all.is_empty() { all } else { format!("<div class=\"tables\">{all}</div>") }
}

/// A table as HTML: words on the left, numbers on the right.
fn table_html(table: &Table) -> String {
    let words: Vec<bool> = (0..table.columns.len()).map(|k| table.is_words(k)).collect();
    let class = |k: usize| if words[k] { " class=\"words\"" } else { "" };
    let head = |(k, head): (usize, &String)| format!("<td{}>{}</td>", class(k), escape(head));
    let heads: String = table.columns.iter().enumerate().map(head).collect();
    let cell = |(k, cell): (usize, &Cell)| {
        let shown = if let Cell::Count(n) = cell { whole(*n) } else { cell.shown() };
        format!("<td{}>{}</td>", class(k), escape(&shown))
    };
    let row = |row: &Vec<Cell>| format!("<tr>{}</tr>", row.iter().enumerate().map(cell).collect::<String>());
    let rows: String = table.rows.iter().map(row).collect();
    let caption =
        if table.title.is_empty() { String::new() } else { format!("<caption>{}</caption>", escape(&table.title)) };
    format!("<table class=\"numbers\">{caption}<thead><tr>{heads}</tr></thead><tbody>{rows}</tbody></table>")
}
