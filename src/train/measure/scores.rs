//! What a confusion matrix says in single numbers.
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
//! Vegetation is every plant against soil, whichever plant it was taken for: the paper's soil–vegetation table.
//!
//! A ratio of nothing is `None` and left out of means: a class that the truth does not hold has no recall, one that was never predicted
//! no precision, one in neither no I/U. So CA is the mean over the classes of the truth, and mean I/U over those of truth or prediction:
//! a class that is predicted where there is none costs.

use super::confusion::Confusion;
use serde::{Deserialize, Serialize};

/// One value for each score: the scores themselves, or what is known about each of them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measures<T> {
    /// GA: share of all pixels that have their class.
    pub global_accuracy: T,
    /// CA: mean recall of the classes.
    pub class_accuracy: T,
    /// Mean I/U of the classes.
    pub mean_iou: T,
    /// Of each class, in the order of their numbers.
    pub classes: Vec<ClassMeasures<T>>,
    /// All plants as one class.
    pub vegetation: ClassMeasures<T>,
}

/// One value for each score of a class.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClassMeasures<T> {
    /// I/U: intersection over union.
    pub iou: T,
    /// P: share of what was taken for it that is it.
    pub precision: T,
    /// R: share of it that was found.
    pub recall: T,
    /// F1: harmonic mean of precision and recall.
    pub f1: T,
}

/// Scores, 0 to 1; `None` where they are of nothing.
pub type Scores = Measures<Option<f64>>;

impl Scores {
    /// Scores of a matrix; `plants` tells for each class whether it is vegetation.
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
    /// Scores of one class of a matrix.
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
    /// The values one after the other: GA, CA, mean I/U, then I/U, P, R, F1 of each class and of vegetation.
    pub fn values(&self) -> impl Iterator<Item = &T> {
        [&self.global_accuracy, &self.class_accuracy, &self.mean_iou]
            .into_iter()
            .chain(self.classes.iter().chain([&self.vegetation]).flat_map(ClassMeasures::values))
    }

    /// From values in the order of [`Self::values`], of this many classes; `None` unless there are as many as that.
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

/// A share; `None` of nothing.
pub fn ratio(part: u64, whole: u64) -> Option<f64> {
    (whole > 0).then(|| part as f64 / whole as f64)
}

/// Mean of what there is; `None` of nothing.
pub fn mean(values: impl Iterator<Item = Option<f64>>) -> Option<f64> {
    let (sum, n) = values.flatten().fold((0.0, 0_u32), |(sum, n), value| (sum + value, n + 1));
    (n > 0).then(|| sum / f64::from(n))
}
