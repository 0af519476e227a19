//! Report page of a run or an evaluation: numbers, curves and images in one self-contained HTML file.

use super::thumbnail::{CONFUSED, INVENTED, MISSED, Thumbnail};
use crate::measure::report::ImageScores;
use crate::measure::{Confusion, Interval, Report};
use furrow_base::Result;
use furrow_base::math::{ToFloat, ToInt};
use furrow_dataset::model::sample::IGNORE;
use furrow_output::ImageData;
use furrow_report::chart::{Chart, Effect, forest};
use furrow_report::{
    self, Number, Table, count, data_url, keyed, legend, number, numbers, pairs, percent, section, swatch, whole,
};
use maud::{Markup, html};

const STYLE: &str = include_str!("page.css");
/// JPEG quality of the images, 0 to 100.
const QUALITY: u8 = 85;

/// Contents of a page; sections without contents are left out.
#[derive(Clone, Copy, Debug, Default)]
pub struct Page<'a> {
    /// Kind of page: `Training`, `Evaluation` or `Experiment`.
    pub kind: &'a str,
    /// Name of the run or dataset.
    pub title: &'a str,
    /// Introductory sentence.
    pub lead: &'a str,
    /// Settings, as names and values.
    pub facts: &'a [(String, String)],
    /// Table of the effects of changes of the training set; shown at full width.
    pub effects: Option<&'a Table>,
    /// Forest plots of the same effects, above the table.
    pub plots: &'a [Plot],
    /// Evaluation on a set of images.
    pub report: Option<&'a Report>,
    /// Training curves.
    pub charts: &'a [Chart],
    /// Images with their predictions.
    pub thumbnails: &'a [Thumbnail],
    /// Heads of the prediction columns; `prediction` for columns beyond the last.
    pub predictors: &'a [String],
    /// Colour of each class.
    pub palette: &'a [[u8; 3]],
    /// Names of the classes.
    pub classes: &'a [String],
    /// Further tables.
    pub tables: &'a [Table],
}

/// Forest plot of the effects of changes on one score.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    /// Title: network and score.
    pub title: String,
    /// Changes of I/U, percentage points.
    pub effects: Vec<Effect>,
}

impl Page<'_> {
    /// Returns the page as HTML.
    pub fn html(&self) -> Result<String> {
        let images = self.images()?;
        let facts: Vec<(&str, Markup)> = self.facts.iter().map(|(k, v)| (k.as_str(), html! { (v) })).collect();
        let body = html! {
            @if let Some(report) = self.report {
                (figures(report))
                (section("Scores", scores(report)))
                (section("Confusion matrix", matrix(&report.confusion, &report.classes)))
            }
            @if let Some(effects) = self.effects {
                (section("Effect of each change", html! { (self.forests()) div.wide { (effects.html()) } }))
            }
            @if !self.charts.is_empty() {
                (section("Curves", html! { div.plots { @for chart in self.charts { (chart.plot()) } } }))
            }
            (section("Images", images))
            @if let Some(report) = self.report {
                (section("Boundaries and sizes", html! {
                    (tables(&[report.boundary_table(), report.size_table()]))
                    p { (SIZES) }
                    (each_image(report))
                }))
            }
            (section("Tables", tables(self.tables)))
            @if !facts.is_empty() { (section("Settings", pairs(&facts))) }
        };
        let lead = html! { (self.lead) };
        let page = furrow_report::Page { kind: self.kind, title: self.title, lead, style: STYLE, body, script: "" };
        Ok(page.html(env!("CARGO_PKG_VERSION")))
    }

    /// Returns the forest plots.
    fn forests(&self) -> Markup {
        let one = |plot: &Plot| forest(&plot.title, FOREST, &plot.effects);
        html! { div.plots { @for plot in self.plots { (one(plot)) } } }
    }

    fn images(&self) -> Result<Markup> {
        if self.thumbnails.is_empty() {
            return Ok(html! {});
        }
        let columns = self.thumbnails.iter().map(|thumbnail| thumbnail.predictions.len()).max().unwrap_or(0);
        let known = self.thumbnails.iter().any(|thumbnail| !thumbnail.truth.is_empty());
        let mut heads = vec!["image"];
        heads.extend(known.then_some("truth"));
        for k in 0..columns {
            heads.push(self.predictors.get(k).map_or("prediction", String::as_str));
            heads.extend(known.then_some("errors"));
        }
        let mut thumbnails: Vec<&Thumbnail> = self.thumbnails.iter().collect();
        // The worst first; images without a score come last, in their order.
        thumbnails.sort_by(|a, b| self.score(a).unwrap_or(f64::MAX).total_cmp(&self.score(b).unwrap_or(f64::MAX)));
        let rows: Vec<Markup> = thumbnails.into_iter().map(|thumbnail| self.row(thumbnail)).collect::<Result<_>>()?;
        Ok(html! {
            (self.colors(known))
            p.reading {
                @if self.report.is_some() { "The images with the lowest mean I/U, and others spread over the set, the worst first. " }
                "Click an image, or press the space bar on it, to enlarge or restore it."
            }
            div.heads { @for head in heads { span { (head) } } }
            @for row in &rows { (row) }
        })
    }

    /// Returns the legend of the class colours and, if the ground truth is known, of the error colours.
    fn colors(&self, known: bool) -> Markup {
        let classes = self.palette.iter().zip(self.classes).map(|(color, name)| (*color, name.as_str()));
        let errors = [
            (MISSED, "plant taken for soil (false negative)"),
            (INVENTED, "soil taken for a plant (false positive)"),
            (CONFUSED, "plant of another class"),
        ];
        let errors = errors.into_iter().filter(|_| known);
        legend(classes.chain(errors).map(|(color, words)| (swatch(color), html! { (words) })))
    }

    fn row(&self, thumbnail: &Thumbnail) -> Result<Markup> {
        let (w, h) = (thumbnail.width, thumbnail.height);
        // One colour for each of the 256 label values, so that label maps can be encoded unchanged.
        let mut palette = vec![[128; 3]; usize::from(IGNORE) + 1];
        palette[..self.palette.len()].copy_from_slice(self.palette);
        let png = |picture: &ImageData<'_>| -> Result<String> {
            Ok(data_url("png", &furrow_output::encode_png(w, h, picture, "")?))
        };
        let mut cells = vec![("image", data_url("jpeg", &furrow_output::encode_jpeg(w, h, &thumbnail.rgb, QUALITY)?))];
        if !thumbnail.truth.is_empty() {
            cells.push(("truth", png(&ImageData::Indexed(&thumbnail.truth, &palette))?));
        }
        for (k, map) in thumbnail.predictions.iter().enumerate() {
            cells.push(("prediction", png(&ImageData::Indexed(map, &palette))?));
            if !thumbnail.truth.is_empty() {
                cells.push(("errors", png(&ImageData::Rgb(&thumbnail.errors(k)))?));
            }
        }
        Ok(html! {
            figure.row {
                figcaption { b { (thumbnail.name) } (self.words(thumbnail)) }
                div {
                    @for (what, source) in &cells {
                        label {
                            input type="checkbox" aria-label={ "enlarge " (what) " of " (thumbnail.name) };
                            img src=(source) width=(w) height=(h) alt={ (what) " of " (thumbnail.name) };
                        }
                    }
                }
            }
        })
    }

    /// Returns the report's scores of an image, if it has any.
    fn known(&self, thumbnail: &Thumbnail) -> Option<&ImageScores> {
        self.report?.images.iter().find(|image| image.name == thumbnail.name)
    }

    fn score(&self, thumbnail: &Thumbnail) -> Option<f64> {
        self.known(thumbnail)?.mean_iou
    }

    /// Returns the caption with the I/U of an image; empty if the report has no scores of it.
    fn words(&self, thumbnail: &Thumbnail) -> String {
        let Some(image) = self.known(thumbnail) else { return String::new() };
        let classes = self.classes.iter().zip(&image.ious).map(|(name, iou)| (name.as_str(), *iou));
        let all = [("mean I/U", image.mean_iou)].into_iter().chain(classes);
        let words: Vec<String> = all.map(|(name, iou)| format!("{name} {}", share(iou))).collect();
        words.join(", ")
    }
}

const SIZES: &str = "A plant's size is its number of pixels; the diameter doubles from bin to bin. A plant is detected if at least half of its \
                     pixels have the right class. Soil taken for a plant counts with the plant that it touches, or else by its own \
                     size.";

/// Axis label of a forest plot.
const FOREST: &str =
    "change of I/U, percentage points; bars are the standard deviation over seeds, and those that reach 0 are pale";

fn share(value: Option<f64>) -> String {
    value.map_or_else(|| "–".into(), percent)
}

/// Returns the key numbers at the top of the page.
fn figures(report: &Report) -> Markup {
    let s = &report.scores;
    let score = |key, words: String, value: Option<f64>| Number {
        key,
        value: value.map_or_else(|| "null".to_owned(), |v| v.to_string()),
        shown: share(value),
        words,
    };
    let mut all = vec![score("mean_iou", "mean I/U".into(), s.mean_iou)];
    let plants = report.classes.iter().zip(&s.classes).skip(1);
    all.extend(plants.map(|(name, class)| score("class_iou", format!("{name} I/U"), class.iou)));
    all.push(score("vegetation_iou", "vegetation I/U".into(), s.vegetation.iou));
    let images = report.images.len().to_u64();
    all.push(Number::count("images", images, if images == 1 { "image" } else { "images" }));
    if let Some(seconds) = &report.seconds {
        let shown = format!("{} ms", number(1000.0 * seconds.median));
        let value = seconds.median.to_string();
        all.push(Number { key: "seconds", value, shown, words: "an image, median".into() });
    }
    numbers(all)
}

/// Returns the scores over all classes and of each class, with their confidence intervals.
fn scores(report: &Report) -> Markup {
    let (s, i) = (&report.scores, &report.intervals);
    let cell = |value: Option<f64>, interval: Option<Interval>| {
        html! {
            td {
                (share(value))
                @if let Some(i) = interval { " " small { (number(100.0 * i.low)) " to " (number(100.0 * i.high)) } }
            }
        }
    };
    let all = [
        ("GA, global accuracy", s.global_accuracy, i.global_accuracy),
        ("CA, mean accuracy of classes", s.class_accuracy, i.class_accuracy),
        ("mean I/U", s.mean_iou, i.mean_iou),
    ];
    let names = report.classes.iter().map(String::as_str).chain(["vegetation"]);
    let rows = s.classes.iter().chain([&s.vegetation]).zip(i.classes.iter().chain([&i.vegetation]));
    html! {
        div.wide { table.numbers.means { tbody { @for (name, value, interval) in all { tr { th { (name) } (cell(value, interval)) } } } } }
        div.wide {
            table.numbers {
                thead { tr { th {} @for head in ["I/U", "P", "R", "F1"] { td { (head) } } } }
                tbody {
                    @for (name, (s, i)) in names.zip(rows) {
                        tr {
                            th { (name) }
                            (cell(s.iou, i.iou)) (cell(s.precision, i.precision)) (cell(s.recall, i.recall)) (cell(s.f1, i.f1))
                        }
                    }
                }
            }
        }
        p {
            "Small numbers: 95 % intervals over resamples of " (count(report.images.len().to_u64(), "image", "images")) "."
            @if report.ignored > 0 { " " (count(report.ignored, "pixel", "pixels")) " without a label are not counted." }
        }
    }
}

/// Returns the confusion matrix; each cell is tinted by its fraction of the true class.
fn matrix(matrix: &Confusion, classes: &[String]) -> Markup {
    let cell = |truth: usize, predicted: usize| {
        let (n, all) = (matrix.at(truth, predicted), matrix.truth(truth));
        let part = n.to_f64() / all.max(1).to_f64();
        let tint = if truth == predicted { "var(--crop)" } else { "var(--weed)" };
        // The square root keeps small fractions visible.
        let style = format!("background:color-mix(in srgb, {tint} {:.1}%, transparent)", 60.0 * part.sqrt());
        let shown = share((all > 0).then_some(part));
        html! { td style=(style) { (keyed(&format!("confusion.{truth}.{predicted}"), n, &shown)) small { (whole(n)) } } }
    };
    html! {
        div.wide {
            table.numbers.matrix {
                thead { tr { th { "truth \\ prediction" } @for name in classes { th { (name) } } } }
                tbody {
                    @for (truth, name) in classes.iter().enumerate() {
                        tr { th { (name) } @for predicted in 0..classes.len() { (cell(truth, predicted)) } }
                    }
                }
            }
        }
        p { "Shares are of the pixels of the true class, its row." }
    }
}

fn each_image(report: &Report) -> Markup {
    let mut report = report.clone();
    report.images.sort_by(|a, b| a.mean_iou.unwrap_or(f64::MAX).total_cmp(&b.mean_iou.unwrap_or(f64::MAX)));
    let table = Table { title: String::new(), ..report.image_table() };
    html! {
        details {
            summary { "Each of " (count(report.images.len().to_u64(), "image", "images")) ", the worst first" }
            div.wide { (table.html()) }
        }
    }
}

/// Returns the tables that have rows, side by side if they fit.
fn tables(all: &[Table]) -> Markup {
    let shown: Vec<&Table> = all.iter().filter(|table| !table.rows.is_empty()).collect();
    html! { @if !shown.is_empty() { div.tables { @for table in shown { div { (table.html()) } } } } }
}
