//! Class weights: the weight of a pixel of each class in the loss.

use crate::data::Store;
use furrow_base::Result;
use furrow_base::math::ToFloat;
use serde::{Deserialize, Serialize};

/// Class weights of the loss.
///
/// In JSON, over which checksums are computed, the names are `median`, `root`, `fading` and `none`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ClassWeights {
    /// Median-frequency weights: the median of the class frequencies divided by the frequency of the class. The frequency is the
    /// class's fraction of the pixels of images that contain it. Source: Eigen & Fergus 2015, as used by Badrinarayanan et al. 2017.
    Median,
    /// Square root of the median-frequency weights: a compromise between recall of rare classes and false positives.
    #[serde(rename = "root")]
    Sqrt,
    /// The square root at the start, annealed to 1 over the first half of the steps. Classes of few pixels need weights early: once a
    /// network never predicts a class, the gradient of the Dice loss cannot restore it. Later, weights would only widen outlines.
    #[serde(rename = "fading")]
    Annealed,
    /// All weights are 1.
    None,
}

impl ClassWeights {
    /// Parses `median`, `sqrt`, `annealed` or `none`.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text {
            "median" => Ok(Self::Median),
            "sqrt" => Ok(Self::Sqrt),
            "annealed" => Ok(Self::Annealed),
            "none" => Ok(Self::None),
            _ => Err(format!("there are no class weights `{text}`: write median, sqrt, annealed or none")),
        }
    }

    /// Returns the name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Median => "median",
            Self::Sqrt => "sqrt",
            Self::Annealed => "annealed",
            Self::None => "none",
        }
    }

    /// Returns the weights of classes with these rarities at the completed fraction `done` of a training, 0 to 1. A class that no
    /// image contains has the weight 0.
    pub fn weights(self, rarities: &[Option<f64>], done: f64) -> Vec<f32> {
        let power = match self {
            Self::Median => 1.0,
            Self::Sqrt => 0.5,
            Self::Annealed => (0.5 - done).max(0.0),
            Self::None => 0.0,
        };
        rarities.iter().map(|rarity| rarity.map_or(0.0, |r| r.powf(power).to_f32())).collect()
    }
}

/// Returns the rarity of each class over the images of a store: the median of the class frequencies divided by the frequency of the
/// class; `None` if no image contains the class.
pub fn rarities(store: &Store, classes: usize) -> Result<Vec<Option<f64>>> {
    let mut images = Vec::new();
    for place in 0..store.len() {
        images.push(store.get(place)?.counts(classes));
    }
    Ok(rarities_of(&images, classes))
}

/// Returns the rarities from the number of pixels of each class in each image.
fn rarities_of(images: &[Vec<u64>], classes: usize) -> Vec<Option<f64>> {
    let frequency = |class: usize| {
        let holding = images.iter().filter(|counts| counts[class] > 0);
        let (own, all) = holding.fold((0, 0), |(own, all), c| (own + c[class], all + c.iter().sum::<u64>()));
        (own > 0).then(|| own.to_f64() / all.to_f64())
    };
    let frequencies: Vec<Option<f64>> = (0..classes).map(frequency).collect();
    let mut there: Vec<f64> = frequencies.iter().copied().flatten().collect();
    there.sort_by(f64::total_cmp);
    let middle = there.len() / 2;
    let median = match there.len() {
        0 => 0.0,
        n if n % 2 == 1 => there[middle],
        _ => f64::midpoint(there[middle - 1], there[middle]),
    };
    frequencies.into_iter().map(|f| f.map(|f| median / f)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn median_frequency_is_that_of_the_images_that_hold_the_class() {
        // Class 2 is only in the first image: 10 of 100 pixels there. Class 1: 30 of 200. Class 0: 160 of 200.
        let images = vec![vec![70, 20, 10], vec![90, 10, 0]];
        let rarities = rarities_of(&images, 3);
        let weights = ClassWeights::Median.weights(&rarities, 0.7);
        let expected = [0.15 / 0.8, 1.0, 1.5];
        assert!(weights.iter().zip(expected).all(|(w, e)| (w - e).abs() < 1e-6), "{weights:?}");
        let roots = ClassWeights::Sqrt.weights(&rarities, 0.7);
        assert!(roots.iter().zip(expected).all(|(w, e)| (w * w - e).abs() < 1e-6));
        assert_eq!(ClassWeights::Median.weights(&rarities_of(&[vec![50, 50, 0]], 3), 0.0), [1.0, 1.0, 0.0]);
        assert_eq!(ClassWeights::None.weights(&rarities, 0.0), [1.0; 3]);
        assert_eq!(ClassWeights::None.weights(&rarities_of(&[vec![50, 50, 0]], 3), 0.0), [1.0, 1.0, 0.0]);
    }

    #[test]
    fn weights_are_annealed_from_the_square_root_to_1_within_half_of_the_steps() {
        let rarities = [Some(0.04), Some(1.0), None, Some(81.0)];
        let annealed = |done| ClassWeights::Annealed.weights(&rarities, done);
        assert_eq!(annealed(0.0), ClassWeights::Sqrt.weights(&rarities, 0.0));
        assert!((annealed(0.25)[3] - 3.0).abs() < 1e-5 && (annealed(0.25)[0] - 0.04f32.sqrt().sqrt()).abs() < 1e-5);
        assert_eq!(annealed(0.5), [1.0, 1.0, 0.0, 1.0]);
        assert_eq!(annealed(1.0), annealed(0.5));
    }
}
