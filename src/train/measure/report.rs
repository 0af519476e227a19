//! An evaluation report: scores and tables.

use super::bootstrap::Interval;
use super::boundary::Boundary;
use super::confusion::Confusion;
use super::scores::{Measures, Scores};
use super::size::SizeBin;
use crate::report::{Cell, Table};
use serde::{Deserialize, Serialize};

/// Scores over a set of images. Shares are 0 to 1; lists of classes are in the order of `classes`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Names of the classes.
    pub classes: Vec<String>,
    /// Pixels with a label, and without.
    pub pixels: u64,
    /// Pixels without a label.
    pub ignored: u64,
    /// Confusion matrix.
    pub confusion: Confusion,
    /// Of all pixels of all images.
    pub scores: Scores,
    /// 95 % intervals of the scores over images.
    pub intervals: Measures<Option<Interval>>,
    /// Agreement of outlines.
    pub boundary: BoundaryScores,
    /// Plants by size, of each class that is a plant.
    pub sizes: Vec<ClassSizes>,
    /// How long a prediction took, where that is known.
    pub seconds: Option<Seconds>,
    /// Each image, by name.
    pub images: Vec<ImageScores>,
}

/// Agreement of outlines.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BoundaryScores {
    /// How far a boundary pixel may be off: a share of the image's diagonal.
    pub tolerance: f64,
    /// Mean F-score of the classes.
    pub mean_f_score: Option<f64>,
    /// Of each class.
    pub classes: Vec<ClassBoundary>,
}

/// Agreement of the outline of a class.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClassBoundary {
    /// F-score of the outline.
    pub f_score: Option<f64>,
    /// Share of the predicted outline that is where it should be.
    pub precision: Option<f64>,
    /// Share of the true outline that was drawn.
    pub recall: Option<f64>,
    /// What they are shares of.
    pub pixels: Boundary,
}

/// Plants of a class by size.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClassSizes {
    /// Name of the class.
    pub class: String,
    /// Small to large; sizes that no image has are left out.
    pub bins: Vec<SizeBin>,
}

/// Seconds that a prediction took.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Seconds {
    /// Images that it is known of.
    pub images: u64,
    /// Mean.
    pub mean: f64,
    /// Median: the first image, which warms up, does not move it.
    pub median: f64,
}

/// One image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ImageScores {
    /// Its name.
    pub name: String,
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Pixels without a label.
    pub ignored: u64,
    /// I/U of each class.
    pub ious: Vec<Option<f64>>,
    /// Mean I/U of the classes that are there.
    pub mean_iou: Option<f64>,
    /// I/U of all plants as one class.
    pub vegetation_iou: Option<f64>,
    /// How long the prediction took.
    pub seconds: Option<f64>,
}

/// Decimals of a percentage.
const PERCENT: usize = 1;

impl Report {
    /// All of it but single images, as tables for people and programs; shares in percent.
    pub fn tables(&self) -> Vec<Table> {
        let mut all = vec![self.summary(), self.class_table(), self.confusion_table(), self.boundary_table()];
        all.push(self.size_table());
        all
    }

    /// GA, CA, mean I/U and the vegetation's scores, each with its interval: the paper's Tables I and II.
    pub fn summary(&self) -> Table {
        let mut table = Table::new("Scores (%)", ["score", "value", "from", "to"]);
        let (s, i) = (&self.scores, &self.intervals);
        let (v, vi) = (&s.vegetation, &i.vegetation);
        let rows = [
            ("GA", s.global_accuracy, i.global_accuracy),
            ("CA", s.class_accuracy, i.class_accuracy),
            ("mean I/U", s.mean_iou, i.mean_iou),
            ("vegetation I/U", v.iou, vi.iou),
            ("vegetation P", v.precision, vi.precision),
            ("vegetation R", v.recall, vi.recall),
            ("vegetation F1", v.f1, vi.f1),
        ];
        for (name, value, interval) in rows {
            table.push([
                Cell::text(name),
                Cell::percent(value, PERCENT),
                Cell::percent(interval.map(|i| i.low), PERCENT),
                Cell::percent(interval.map(|i| i.high), PERCENT),
            ]);
        }
        table
    }

    /// I/U, P, R, F1 of each class, and the interval of its I/U.
    pub fn class_table(&self) -> Table {
        let mut table = Table::new("Classes (%)", ["class", "I/U", "I/U from", "I/U to", "P", "R", "F1", "pixels"]);
        for (k, (name, s)) in self.classes.iter().zip(&self.scores.classes).enumerate() {
            let interval = self.intervals.classes[k].iou;
            let percents = [s.iou, interval.map(|i| i.low), interval.map(|i| i.high), s.precision, s.recall, s.f1];
            let cells = percents.map(|value| Cell::percent(value, PERCENT));
            table.push([Cell::text(name)].into_iter().chain(cells).chain([Cell::Count(self.confusion.truth(k))]));
        }
        table
    }

    /// The confusion matrix in pixels.
    pub fn confusion_table(&self) -> Table {
        let columns = ["truth \\ predicted".to_owned()].into_iter().chain(self.classes.iter().cloned());
        let mut table = Table::new("Confusion (pixels)", columns);
        for (truth, name) in self.classes.iter().enumerate() {
            let counts = (0..self.classes.len()).map(|predicted| Cell::Count(self.confusion.at(truth, predicted)));
            table.push([Cell::text(name)].into_iter().chain(counts));
        }
        table
    }

    /// Agreement of outlines.
    pub fn boundary_table(&self) -> Table {
        let title = format!("Boundaries (%, tolerance {} % of the diagonal)", 100.0 * self.boundary.tolerance);
        let mut table = Table::new(title, ["class", "F", "P", "R"]);
        for (name, b) in self.classes.iter().zip(&self.boundary.classes) {
            let cells = [b.f_score, b.precision, b.recall].map(|value| Cell::percent(value, PERCENT));
            table.push([Cell::text(name)].into_iter().chain(cells));
        }
        table
    }

    /// Plants by size.
    pub fn size_table(&self) -> Table {
        let columns = ["class", "pixels from", "to", "plants", "detected", "recall (%)", "I/U (%)"];
        let mut table = Table::new("Plants by size", columns);
        for ClassSizes { class, bins } in &self.sizes {
            for b in bins {
                let counts = [b.from_pixels, b.to_pixels, b.plants, b.detected].map(Cell::Count);
                let shares = [b.recall, b.iou].map(|value| Cell::percent(value, PERCENT));
                table.push([Cell::text(class)].into_iter().chain(counts).chain(shares));
            }
        }
        table
    }

    /// I/U of each image.
    pub fn image_table(&self) -> Table {
        let classes = self.classes.iter().map(|name| format!("{name} I/U"));
        let columns = ["image".to_owned(), "mean I/U".into(), "vegetation I/U".into()];
        let mut table = Table::new("Images (%)", columns.into_iter().chain(classes));
        for image in &self.images {
            let means = [image.mean_iou, image.vegetation_iou];
            let cells = means.iter().chain(&image.ious).map(|value| Cell::percent(*value, PERCENT));
            table.push([Cell::text(&image.name)].into_iter().chain(cells));
        }
        table
    }
}
