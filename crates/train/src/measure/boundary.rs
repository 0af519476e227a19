//! Boundary F-score: agreement of the predicted outlines of a class with the true ones.
//!
//! The boundary of a class in a map consists of its pixels that have a neighbour of another class on one of their four sides. A boundary
//! pixel is matched if the other map has a boundary pixel of the class within a tolerance of 0.75 % of the image's diagonal.
//! Precision is the matched fraction of the prediction's boundary, recall that of the truth's, and F = 2PR / (P + R).
//!
//! Source: Csurka, Larlus & Perronnin 2013, "What is a good evaluation measure for semantic segmentation?", §3; Perazzi et al. 2016
//! match in the same way.
//!
//! These papers average F over images. Here boundary pixels are summed over images before P and R are computed: every part of an
//! outline has the same weight, and images with little or nothing of a class do not dominate.
//!
//! The edge of an image is not a boundary. Pixels without a label in the truth are treated as unlabelled in both maps, and their
//! neighbours are not boundary pixels because of them.

use super::scores::ratio;
use furrow_base::math::{RoundTo, ToFloat, ToInt};
use furrow_dataset::model::sample::IGNORE;
use serde::{Deserialize, Serialize};

/// Largest distance of matched boundary pixels, as a fraction of the image's diagonal.
pub const TOLERANCE: f64 = 0.0075;

/// Numbers of boundary pixels of one class.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Boundary {
    /// Boundary pixels of the truth.
    pub truth: u64,
    /// Boundary pixels of the truth that the prediction matches.
    pub truth_matched: u64,
    /// Boundary pixels of the prediction.
    pub predicted: u64,
    /// Boundary pixels of the prediction that the truth matches.
    pub predicted_matched: u64,
}

impl Boundary {
    /// Counts the boundary pixels of each class in one image. Both maps contain `width * height` classes below `classes`; the truth may
    /// also contain 255.
    pub fn of(classes: usize, width: usize, height: usize, truth: &[u8], predicted: &[u8]) -> Vec<Self> {
        let tolerance = TOLERANCE * width.to_f64().hypot(height.to_f64());
        (0..classes.to_u8())
            .map(|class| {
                let outlines = [truth, predicted].map(|map| outline(width, height, map, truth, class));
                let [true_matched, predicted_matched] =
                    [(0, 1), (1, 0)].map(|(of, by)| matched(width, height, &outlines[of], &outlines[by], tolerance));
                Self {
                    truth: outlines[0].len().to_u64(),
                    truth_matched: true_matched,
                    predicted: outlines[1].len().to_u64(),
                    predicted_matched,
                }
            })
            .collect()
    }

    /// Adds the numbers of another image.
    pub fn merge(&mut self, other: &Self) {
        self.truth += other.truth;
        self.truth_matched += other.truth_matched;
        self.predicted += other.predicted;
        self.predicted_matched += other.predicted_matched;
    }

    /// Returns the matched fraction of the prediction's boundary.
    pub fn precision(&self) -> Option<f64> {
        ratio(self.predicted_matched, self.predicted)
    }

    /// Returns the matched fraction of the truth's boundary.
    pub fn recall(&self) -> Option<f64> {
        ratio(self.truth_matched, self.truth)
    }

    /// Returns the F-score: 0 if only one of the maps has a boundary of the class, `None` if neither has.
    pub fn f_score(&self) -> Option<f64> {
        match (self.precision(), self.recall()) {
            (None, None) => None,
            (Some(p), Some(r)) if p + r > 0.0 => Some(2.0 * p * r / (p + r)),
            _ => Some(0.0),
        }
    }
}

/// Returns the indices of the boundary pixels of a class, in the order of the map.
fn outline(width: usize, height: usize, map: &[u8], truth: &[u8], class: u8) -> Vec<usize> {
    let other = |at: usize| truth[at] != IGNORE && map[at] != class;
    let bounds = |at: usize| {
        let (x, y) = (at % width, at / width);
        x > 0 && other(at - 1)
            || x + 1 < width && other(at + 1)
            || y > 0 && other(at - width)
            || y + 1 < height && other(at + width)
    };
    (0..width * height).filter(|at| map[*at] == class && truth[*at] != IGNORE && bounds(*at)).collect()
}

/// Counts the pixels of an outline that have a pixel of the other outline within the tolerance (pixels, centre to centre).
///
/// The result is exact: the distance of each pixel to the other outline along its column is precomputed, so only the columns within the
/// tolerance are searched.
fn matched(width: usize, height: usize, outline: &[usize], other: &[usize], tolerance: f64) -> u64 {
    if outline.is_empty() || other.is_empty() {
        return 0;
    }
    let columns = column_distances(width, height, other);
    let (reach, square) = (tolerance.floor_to::<usize>(), tolerance * tolerance);
    let near = |at: usize| {
        let (x, y) = (at % width, at / width);
        (x.saturating_sub(reach)..=(x + reach).min(width - 1)).any(|column| {
            let (dx, dy) = (x.abs_diff(column).to_f64(), f64::from(columns[y * width + column]));
            dx * dx + dy * dy <= square
        })
    };
    outline.iter().filter(|at| near(**at)).count().to_u64()
}

/// Returns the distance of each pixel to the nearest marked pixel of its column, in pixels; `u32::MAX` if the column has none.
fn column_distances(width: usize, height: usize, marked: &[usize]) -> Vec<u32> {
    let mut out = vec![u32::MAX; width * height];
    for at in marked {
        out[*at] = 0;
    }
    for at in width..width * height {
        out[at] = out[at].min(out[at - width].saturating_add(1));
    }
    for at in (0..width * (height - 1)).rev() {
        out[at] = out[at].min(out[at + width].saturating_add(1));
    }
    out
}
