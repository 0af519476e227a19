//! How many plants the images of a scene file show, and how much that differs from field to field: the mean over where chance may place them,
//! by the camera and the densities that a field draws. What chance places, above all in patches, differs more.

use super::SceneFile;
use crate::report::number;

/// Most fields that are asked.
const ASKED: u64 = 64;
/// Plants in the fullest fields over those in the emptiest, above which somebody may not have meant it.
const WIDE: f64 = 3.0;

/// Plants that are to be expected in view, over fields.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExpectedPlants {
    /// In the middle field.
    pub median: f64,
    /// Nineteen fields of twenty have more.
    pub low: f64,
    /// Nineteen fields of twenty have fewer.
    pub high: f64,
}

impl ExpectedPlants {
    /// Of some numbers of plants; `None` of none.
    fn of(mut plants: Vec<f64>) -> Option<Self> {
        plants.sort_by(f64::total_cmp);
        let last = plants.len().checked_sub(1)? as f64;
        let at = |share: f64| plants[(share * last).round() as usize];
        Some(Self { median: at(0.5), low: at(0.05), high: at(0.95) })
    }

    /// High over low, a plant being the least that counts.
    pub fn spread(&self) -> f64 {
        self.high.max(1.0) / self.low.max(1.0)
    }

    /// A sentence.
    pub fn words(&self) -> String {
        let Self { median, low, high } = *self;
        format!(
            "about {} plants an image, {} to {} by the views and densities of nine fields in ten",
            number(median),
            number(low),
            number(high)
        )
    }

    /// The warning where there is one, else the sentence.
    pub fn told(&self) -> String {
        self.warning().map_or_else(|| self.words(), |words| format!("warning: {words}"))
    }

    /// A warning where images differ much.
    pub fn warning(&self) -> Option<String> {
        (self.spread() > WIDE).then(|| {
            format!(
                "{}, {} times as many: narrow height_m of the camera, per_m2 of the weeds or the rows if that is not meant",
                self.words(),
                number(self.spread())
            )
        })
    }
}

impl SceneFile {
    /// Plants in view over the first of so many fields, from their densities; nothing is grown. Fields that cannot be are left out: each is
    /// told when its image is made. `None` of no fields, and where each is seen by several images.
    #[doc(hidden)]
    pub fn plants_in_view(&self, count: u64) -> Option<ExpectedPlants> {
        if self.captures() > 1 {
            return None;
        }
        ExpectedPlants::of((0..count.min(ASKED)).filter_map(|index| self.expected_plants(index).ok()).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_that_differ_much_are_told() {
        let even = ExpectedPlants::of((0..100).map(|k| 10.0 + 0.1 * f64::from(k)).collect()).unwrap();
        assert_eq!((even.low, even.median, even.high), (10.5, 15.0, 19.4));
        assert_eq!(even.warning(), None);
        let wide = ExpectedPlants::of((0..100).map(f64::from).collect()).unwrap();
        assert!(wide.warning().unwrap().starts_with(
            "about 50 plants an image, 5 to 94 by the views and densities of nine fields in ten, 18.8 times"
        ));
        // Fields of less than a plant are not infinitely far from others.
        assert_eq!(ExpectedPlants::of(vec![0.0, 0.2, 0.1, 2.0]).unwrap().spread(), 2.0);
        assert_eq!(ExpectedPlants::of(Vec::new()), None);
    }
}
