//! Confusion matrix: number of pixels for each pair of true and predicted class.

use furrow_base::{Error, Result};
use furrow_dataset::model::sample::IGNORE;
use serde::{Deserialize, Serialize};

/// Numbers of pixels by true and predicted class. Serialized as one row for each true class, with one number for each predicted class.
///
/// Counts are integers, so merging the matrices of images in any order gives the same result.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(into = "Vec<Vec<u64>>", try_from = "Vec<Vec<u64>>")]
pub struct Confusion {
    classes: usize,
    /// Row by row: `counts[truth * classes + predicted]`.
    counts: Vec<u64>,
}

impl Confusion {
    /// Returns an empty matrix of 1 to 255 classes. Panics for other numbers of classes.
    pub fn new(classes: usize) -> Self {
        assert!((1..=usize::from(IGNORE)).contains(&classes), "{classes} classes");
        Self { classes, counts: vec![0; classes * classes] }
    }

    /// Creates a matrix from its rows, one for each true class. The matrix must be square.
    pub fn from_rows(rows: &[Vec<u64>]) -> Result<Self> {
        let classes = rows.len();
        if !(1..=usize::from(IGNORE)).contains(&classes) || rows.iter().any(|row| row.len() != classes) {
            let lengths: Vec<usize> = rows.iter().map(Vec::len).collect();
            return Err(Error::misuse(format!(
                "a confusion matrix must be square, with 1 to 255 rows; this one has {classes} rows of {lengths:?}"
            )));
        }
        Ok(Self { classes, counts: rows.concat() })
    }

    /// Returns the number of classes.
    pub fn classes(&self) -> usize {
        self.classes
    }

    /// Returns the number of pixels of class `truth` that are predicted as `predicted`.
    pub fn at(&self, truth: usize, predicted: usize) -> u64 {
        self.counts[truth * self.classes + predicted]
    }

    /// Counts the pixels of an image. Classes are numbered from 0; 255 in the truth means no label. After an error the matrix is
    /// unchanged.
    pub fn add(&mut self, truth: &[u8], predicted: &[u8]) -> Result<()> {
        if truth.len() != predicted.len() {
            return Err(Error::misuse(format!(
                "the truth has {} pixels, the prediction {}",
                truth.len(),
                predicted.len()
            )));
        }
        let mut counts = vec![0; self.counts.len()];
        for (at, (&t, &p)) in truth.iter().zip(predicted).enumerate() {
            let (row, column) = (usize::from(t), usize::from(p));
            if t == IGNORE {
                continue;
            }
            if row >= self.classes || column >= self.classes {
                return Err(self.stranger(at, t, p));
            }
            counts[row * self.classes + column] += 1;
        }
        self.counts.iter_mut().zip(counts).for_each(|(sum, n)| *sum += n);
        Ok(())
    }

    fn stranger(&self, at: usize, truth: u8, predicted: u8) -> Error {
        let last = self.classes - 1;
        let (who, what) = if usize::from(truth) > last { ("the truth", truth) } else { ("the prediction", predicted) };
        Error::input(format!(
            "pixel {at} of {who} has the class {what}; classes are 0 to {last}, and 255 in the truth is no label"
        ))
    }

    /// Adds the counts of another matrix. Panics if the numbers of classes differ.
    pub fn merge(&mut self, other: &Self) {
        assert_eq!(self.classes, other.classes, "matrices of different classes");
        self.counts.iter_mut().zip(&other.counts).for_each(|(sum, n)| *sum += n);
    }

    /// Returns the total number of pixels.
    pub fn total(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// Returns the number of pixels of a class in the truth.
    pub fn truth(&self, class: usize) -> u64 {
        (0..self.classes).map(|predicted| self.at(class, predicted)).sum()
    }

    /// Returns the number of pixels that are predicted as a class.
    pub fn predicted(&self, class: usize) -> u64 {
        (0..self.classes).map(|truth| self.at(truth, class)).sum()
    }

    /// Merges classes: `group[class]` is the new class of each class, numbered from 0 without gaps.
    #[must_use]
    pub fn grouped(&self, group: &[usize]) -> Self {
        assert_eq!(group.len(), self.classes, "one group per class");
        let mut out = Self::new(group.iter().max().map_or(1, |most| most + 1));
        for (truth, row) in group.iter().zip(self.counts.chunks_exact(self.classes)) {
            for (predicted, n) in group.iter().zip(row) {
                out.counts[truth * out.classes + predicted] += n;
            }
        }
        out
    }
}

impl From<Confusion> for Vec<Vec<u64>> {
    fn from(matrix: Confusion) -> Self {
        matrix.counts.chunks_exact(matrix.classes).map(<[u64]>::to_vec).collect()
    }
}

impl TryFrom<Vec<Vec<u64>>> for Confusion {
    type Error = Error;

    fn try_from(rows: Vec<Vec<u64>>) -> Result<Self> {
        Self::from_rows(&rows)
    }
}
