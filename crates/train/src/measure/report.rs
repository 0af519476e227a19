//! Evaluation report: scores and tables.

use super::bootstrap::Interval;
use super::boundary::Boundary;
use super::confusion::Confusion;
use super::instances::Instances;
use super::scores::{Measures, Scores};
use super::size::SizeBin;
use furrow_report::{Cell, Table};
use serde::{Deserialize, Serialize};

/// Scores over a set of images. Ratios are from 0 to 1; lists over classes are in the order of `classes`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Names of the classes.
    pub classes: Vec<String>,
    /// Number of pixels with a label.
    pub pixels: u64,
    /// Number of pixels without a label.
    pub ignored: u64,
    /// Confusion matrix.
    pub confusion: Confusion,
    /// Scores over all pixels of all images.
    pub scores: Scores,
    /// 95 % bootstrap intervals of the scores over images.
    pub intervals: Measures<Option<Interval>>,
    /// Boundary scores.
    pub boundary: BoundaryScores,
    /// Scores by plant size, for each class that is a plant.
    pub sizes: Vec<ClassSizes>,
    /// Separated plants, if the truth has plant numbers and the prediction separates plants.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub instances: Option<Instances>,
    /// Duration of predictions, if known.
    pub seconds: Option<Seconds>,
    /// Scores of each image, sorted by name.
    pub images: Vec<ImageScores>,
}

/// Boundary scores of all classes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BoundaryScores {
    /// Largest distance of matched boundary pixels, as a fraction of the image's diagonal.
    pub tolerance: f64,
    /// Mean F-score of the classes.
    pub mean_f_score: Option<f64>,
    /// Scores of each class.
    pub classes: Vec<ClassBoundary>,
}

/// Boundary scores of a class.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClassBoundary {
    /// F-score of the boundary.
    pub f_score: Option<f64>,
    /// Matched fraction of the predicted boundary.
    pub precision: Option<f64>,
    /// Matched fraction of the true boundary.
    pub recall: Option<f64>,
    /// Numbers of boundary pixels.
    pub pixels: Boundary,
}

/// Scores of the plants of a class by size.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClassSizes {
    /// Name of the class.
    pub class: String,
    /// Size bins from small to large, without empty ones.
    pub bins: Vec<SizeBin>,
}

/// Duration of a prediction, seconds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Seconds {
    /// Number of images with a known duration.
    pub images: u64,
    /// Mean.
    pub mean: f64,
    /// Median, which the slow first image does not affect.
    pub median: f64,
}

/// Scores of one image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ImageScores {
    /// Name.
    pub name: String,
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Number of pixels without a label.
    pub ignored: u64,
    /// I/U of each class.
    pub ious: Vec<Option<f64>>,
    /// Mean I/U of the classes that occur in truth or prediction.
    pub mean_iou: Option<f64>,
    /// I/U of all plants as one class.
    pub vegetation_iou: Option<f64>,
    /// Duration of the prediction, seconds, if known.
    pub seconds: Option<f64>,
}

/// Decimals of a percentage.
const PERCENT: usize = 1;

impl Report {
    /// Returns all tables except that of single images; ratios are in percent.
    pub fn tables(&self) -> Vec<Table> {
        let mut all = vec![self.summary(), self.class_table(), self.confusion_table(), self.boundary_table()];
        all.push(self.size_table());
        all.extend(self.instance_table());
        all
    }

    /// Returns the panoptic quality of separated plants, its two factors, and the numbers of plants.
    pub fn instance_table(&self) -> Option<Table> {
        let found = self.instances?;
        let columns = ["panoptic quality (%)", "segmentation", "recognition", "true plants", "predicted", "pairs"];
        let mut table = Table::new("Separated plants", columns);
        let shares = [found.panoptic_quality(), found.segmentation_quality(), found.recognition_quality()];
        let counts = [found.truth, found.predicted, found.pairs].map(Cell::Count);
        table.push(shares.map(|value| Cell::percent(value, PERCENT)).into_iter().chain(counts));
        Some(table)
    }

    /// Returns GA, CA, mean I/U and the scores of vegetation, each with its interval, as in Tables I and II of Di Cicco et al. 2017.
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

    /// Returns I/U, P, R and F1 of each class, and the interval of its I/U.
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

    /// Returns the confusion matrix in pixels.
    pub fn confusion_table(&self) -> Table {
        let columns = ["truth \\ predicted".to_owned()].into_iter().chain(self.classes.iter().cloned());
        let mut table = Table::new("Confusion (pixels)", columns);
        for (truth, name) in self.classes.iter().enumerate() {
            let counts = (0..self.classes.len()).map(|predicted| Cell::Count(self.confusion.at(truth, predicted)));
            table.push([Cell::text(name)].into_iter().chain(counts));
        }
        table
    }

    /// Returns the boundary scores of each class.
    pub fn boundary_table(&self) -> Table {
        let title = format!("Boundaries (%, tolerance {} % of the diagonal)", 100.0 * self.boundary.tolerance);
        let mut table = Table::new(title, ["class", "F", "P", "R"]);
        for (name, b) in self.classes.iter().zip(&self.boundary.classes) {
            let cells = [b.f_score, b.precision, b.recall].map(|value| Cell::percent(value, PERCENT));
            table.push([Cell::text(name)].into_iter().chain(cells));
        }
        table
    }

    /// Returns the scores of plants by size.
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

    /// Returns the I/U of each image.
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
