//! Scores from a confusion matrix.
//!
//! With T_p, F_p, F_n the true positives, false positives and false negatives of a class (Di Cicco et al. 2017, §IV and eq. 1, 2):
//!
//! ```text
//! GA  = Σ T_p / all pixels                      global accuracy
//! CA  = mean over classes of T_p / (T_p + F_n)  per-class average accuracy
//! I/U = T_p / (T_p + F_p + F_n)                 and its mean over classes
//! P   = T_p / (T_p + F_p)      R = T_p / (T_p + F_n)      F1 = 2 T_p / (2 T_p + F_p + F_n)
//! ```
//!
//! Vegetation is the union of all plant classes against soil, as in the paper's soil–vegetation table.
//!
//! A ratio with the denominator 0 is `None` and is left out of means: a class that is not in the truth has no recall, a class that is
//! never predicted has no precision, and a class in neither has no I/U. So CA is the mean over the classes of the truth, and mean I/U
//! that over the classes of truth or prediction: predicting a class that does not occur lowers it.

use super::confusion::Confusion;
use furrow_base::math::ToFloat;
use serde::{Deserialize, Serialize};

/// One value for each score: the score itself, or information about it such as a confidence interval.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measures<T> {
    /// GA: fraction of all pixels that are predicted correctly.
    pub global_accuracy: T,
    /// CA: mean recall of the classes.
    pub class_accuracy: T,
    /// Mean I/U of the classes.
    pub mean_iou: T,
    /// Values of each class, in the order of their numbers.
    pub classes: Vec<ClassMeasures<T>>,
    /// All plants as one class.
    pub vegetation: ClassMeasures<T>,
}

/// One value for each score of a class.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClassMeasures<T> {
    /// I/U: intersection over union.
    pub iou: T,
    /// P: fraction of the pixels predicted as the class that belong to it.
    pub precision: T,
    /// R: fraction of the pixels of the class that are predicted as it.
    pub recall: T,
    /// F1: harmonic mean of precision and recall.
    pub f1: T,
}

/// Scores, 0 to 1; `None` if the denominator is 0.
pub type Scores = Measures<Option<f64>>;

impl Scores {
    /// Computes the scores of a matrix; `plants` is `true` for each class that is vegetation.
    pub fn of(matrix: &Confusion, plants: &[bool]) -> Self {
        let n = matrix.classes();
        let classes: Vec<ClassMeasures<Option<f64>>> = (0..n).map(|class| ClassMeasures::of(matrix, class)).collect();
        let right: u64 = (0..n).map(|class| matrix.at(class, class)).sum();
        let group: Vec<usize> = plants.iter().map(|plant| usize::from(*plant)).collect();
        let vegetation = if plants.contains(&true) {
            ClassMeasures::of(&matrix.grouped(&group), 1)
        } else {
            ClassMeasures { iou: None, precision: None, recall: None, f1: None }
        };
        Self {
            global_accuracy: ratio(right, matrix.total()),
            class_accuracy: mean(classes.iter().map(|c| c.recall)),
            mean_iou: mean(classes.iter().map(|c| c.iou)),
            classes,
            vegetation,
        }
    }
}

impl ClassMeasures<Option<f64>> {
    /// Computes the scores of one class of a matrix.
    pub fn of(matrix: &Confusion, class: usize) -> Self {
        let (hit, truth, predicted) = (matrix.at(class, class), matrix.truth(class), matrix.predicted(class));
        Self {
            iou: ratio(hit, truth + predicted - hit),
            precision: ratio(hit, predicted),
            recall: ratio(hit, truth),
            f1: ratio(2 * hit, truth + predicted),
        }
    }
}

impl<T> Measures<T> {
    /// Iterates over all values: GA, CA, mean I/U, then I/U, P, R and F1 of each class and of vegetation.
    pub fn values(&self) -> impl Iterator<Item = &T> {
        [&self.global_accuracy, &self.class_accuracy, &self.mean_iou]
            .into_iter()
            .chain(self.classes.iter().chain([&self.vegetation]).flat_map(ClassMeasures::values))
    }

    /// Creates measures of this number of classes from values in the order of [`Self::values`]. Returns `None` if the number of values
    /// is wrong.
    pub fn from_values(classes: usize, values: impl IntoIterator<Item = T>) -> Option<Self> {
        let mut values = values.into_iter();
        let out = Self {
            global_accuracy: values.next()?,
            class_accuracy: values.next()?,
            mean_iou: values.next()?,
            classes: (0..classes).map(|_| ClassMeasures::from_values(&mut values)).collect::<Option<_>>()?,
            vegetation: ClassMeasures::from_values(&mut values)?,
        };
        values.next().is_none().then_some(out)
    }
}

impl<T> ClassMeasures<T> {
    fn values(&self) -> [&T; 4] {
        [&self.iou, &self.precision, &self.recall, &self.f1]
    }

    fn from_values(values: &mut impl Iterator<Item = T>) -> Option<Self> {
        Some(Self { iou: values.next()?, precision: values.next()?, recall: values.next()?, f1: values.next()? })
    }
}

/// Returns `part / whole`, or `None` if `whole` is 0.
pub fn ratio(part: u64, whole: u64) -> Option<f64> {
    (whole > 0).then(|| part.to_f64() / whole.to_f64())
}

/// Returns the mean of the values that are not `None`, or `None` if there are none.
pub fn mean(values: impl Iterator<Item = Option<f64>>) -> Option<f64> {
    let (sum, n) = values.flatten().fold((0.0, 0_u32), |(sum, n), value| (sum + value, n + 1));
    (n > 0).then(|| sum / f64::from(n))
}
