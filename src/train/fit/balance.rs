//! What a pixel of each class weighs in the loss.

use crate::Result;
use crate::train::data::Store;
use serde::{Deserialize, Serialize};

/// How rare classes are made up for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Balance {
    /// By median frequency: the median of the classes' frequencies over that of the class, a frequency being the class's share
    /// of the pixels of the images that hold it. Source: Eigen & Fergus 2015, as used by Badrinarayanan et al. 2017.
    Median,
    /// The root of that: a compromise between rare classes and few false alarms.
    Root,
    /// All pixels weigh the same.
    None,
}

impl Balance {
    /// Reads `median`, `root` or `none`.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text {
            "median" => Ok(Self::Median),
            "root" => Ok(Self::Root),
            "none" => Ok(Self::None),
            _ => Err(format!("classes are not weighed by `{text}`: write median, root or none")),
        }
    }

    /// The weights of the classes; 0 for a class that no image holds.
    pub fn weights(self, store: &Store, classes: usize) -> Result<Vec<f32>> {
        let mut images = Vec::new();
        for place in 0..store.len() {
            images.push(store.get(place)?.counts(classes));
        }
        Ok(self.of(&images, classes))
    }

    /// The same from the pixels of each class in each image.
    pub fn of(self, images: &[Vec<u64>], classes: usize) -> Vec<f32> {
        let frequency = |class: usize| {
            let holding = images.iter().filter(|counts| counts[class] > 0);
            let (own, all) = holding.fold((0, 0), |(own, all), c| (own + c[class], all + c.iter().sum::<u64>()));
            (own > 0).then(|| own as f64 / all as f64)
        };
        let frequencies: Vec<Option<f64>> = (0..classes).map(frequency).collect();
        let mut there: Vec<f64> = frequencies.iter().copied().flatten().collect();
        there.sort_by(f64::total_cmp);
        let middle = there.len() / 2;
        let median = match there.len() {
            0 => return vec![1.0; classes],
            n if n % 2 == 1 => there[middle],
            _ => f64::midpoint(there[middle - 1], there[middle]),
        };
        let weight = |f: Option<f64>| match (self, f) {
            (_, None) => 0.0,
            (Self::Median, Some(f)) => median / f,
            (Self::Root, Some(f)) => (median / f).sqrt(),
            (Self::None, Some(_)) => 1.0,
        };
        frequencies.into_iter().map(|f| weight(f) as f32).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn median_frequency_is_that_of_the_images_that_hold_the_class() {
        // Class 2 is only in the first image: 10 of 100 pixels there. Class 1: 30 of 200. Class 0: 160 of 200.
        let images = vec![vec![70, 20, 10], vec![90, 10, 0]];
        let weights = Balance::Median.of(&images, 3);
        let expected = [0.15 / 0.8, 1.0, 1.5];
        assert!(weights.iter().zip(expected).all(|(w, e)| (w - e).abs() < 1e-6), "{weights:?}");
        let roots = Balance::Root.of(&images, 3);
        assert!(roots.iter().zip(expected).all(|(w, e)| (w * w - e).abs() < 1e-6));
        assert_eq!(Balance::Median.of(&[vec![50, 50, 0]], 3), [1.0, 1.0, 0.0]);
        assert_eq!(Balance::None.of(&images, 3), [1.0; 3]);
    }
}
