//! How well the outline of a class agrees with the true one: boundary F-score.
//!
//! Of a map, the boundary of a class is its pixels with a side neighbour of another class. A boundary pixel is matched where the other
//! map has a boundary pixel of the class no farther than a tolerance, 0.75 % of the image's diagonal. Precision is the matched share of
//! the prediction's boundary, recall of the truth's, F = 2PR / (P + R). Source: Csurka, Larlus & Perronnin 2013, "What is a good
//! evaluation measure for semantic segmentation?", §3; Perazzi et al. 2016 match in the same way.
//!
//! They take the mean of F over images. Here boundary pixels are summed over images before P and R are taken: every stretch of outline
//! has the same weight, and an image with little of a class, or none, does not shout.
//!
//! An image's edge is no boundary. Where the truth has no label neither map has one: such pixels bound nothing.

use super::scores::ratio;
use crate::dataset::sample::IGNORE;
use serde::{Deserialize, Serialize};

/// Share of the image's diagonal that a boundary pixel may be off.
pub const TOLERANCE: f64 = 0.0075;

/// Boundary pixels of one class.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Boundary {
    /// Of the truth, and those that the prediction matches.
    pub truth: u64,
    /// Of the truth, matched.
    pub truth_matched: u64,
    /// Of the prediction.
    pub predicted: u64,
    /// Of the prediction, matched.
    pub predicted_matched: u64,
}

impl Boundary {
    /// Boundaries of each class in one image. Both maps hold `width * height` classes below `classes`, the truth also 255.
    pub fn of(classes: usize, width: usize, height: usize, truth: &[u8], predicted: &[u8]) -> Vec<Self> {
        let tolerance = TOLERANCE * (width as f64).hypot(height as f64);
        (0..classes as u8)
            .map(|class| {
                let outlines = [truth, predicted].map(|map| outline(width, height, map, truth, class));
                let [true_matched, predicted_matched] =
                    [(0, 1), (1, 0)].map(|(of, by)| matched(width, height, &outlines[of], &outlines[by], tolerance));
                Self {
                    truth: outlines[0].len() as u64,
                    truth_matched: true_matched,
                    predicted: outlines[1].len() as u64,
                    predicted_matched,
                }
            })
            .collect()
    }

    /// Adds the boundary of another image.
    pub fn merge(&mut self, other: &Self) {
        self.truth += other.truth;
        self.truth_matched += other.truth_matched;
        self.predicted += other.predicted;
        self.predicted_matched += other.predicted_matched;
    }

    /// Share of the prediction's boundary that is where it should be.
    pub fn precision(&self) -> Option<f64> {
        ratio(self.predicted_matched, self.predicted)
    }

    /// Share of the true boundary that was drawn.
    pub fn recall(&self) -> Option<f64> {
        ratio(self.truth_matched, self.truth)
    }

    /// The F-score: 0 where one of the maps has no boundary of the class, `None` where neither has.
    pub fn f_score(&self) -> Option<f64> {
        match (self.precision(), self.recall()) {
            (None, None) => None,
            (Some(p), Some(r)) if p + r > 0.0 => Some(2.0 * p * r / (p + r)),
            _ => Some(0.0),
        }
    }
}

/// Boundary pixels of a class, in the order of the map.
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

/// How many pixels of an outline have one of another no farther than the tolerance (pixels, centre to centre).
///
/// Exact: with each pixel's distance to the other outline along its column known, only the columns within reach are asked.
fn matched(width: usize, height: usize, outline: &[usize], other: &[usize], tolerance: f64) -> u64 {
    if outline.is_empty() || other.is_empty() {
        return 0;
    }
    let columns = column_distances(width, height, other);
    let (reach, square) = (tolerance.floor() as usize, tolerance * tolerance);
    let near = |at: usize| {
        let (x, y) = (at % width, at / width);
        (x.saturating_sub(reach)..=(x + reach).min(width - 1)).any(|column| {
            let (dx, dy) = (x.abs_diff(column) as f64, f64::from(columns[y * width + column]));
            dx * dx + dy * dy <= square
        })
    };
    outline.iter().filter(|at| near(**at)).count() as u64
}

/// Distance of each pixel to the next marked one of its column, in pixels; `u32::MAX` in a column without.
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
