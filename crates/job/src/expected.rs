//! Estimates how many plants the images of a scene file show, and how much the number varies from field to field. For each field it is
//! the mean over random placements, for the camera and the densities drawn. Actual numbers vary more, above all if plants form patches.

use super::SceneFile;
use furrow_base::math::{RoundTo, ToFloat};
use furrow_report::number;

/// Maximum number of fields that are sampled.
const ASKED: u64 = 64;
/// Ratio of the high to the low number of plants above which a warning is given.
const WIDE: f64 = 3.0;
/// Smallest number of fields with percentiles; fewer have their range.
const MANY: usize = 20;

/// Distribution over fields of the expected number of plants in view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExpectedPlants {
    /// Median.
    pub median: f64,
    /// 5th percentile; the smallest number of fewer than 20 fields.
    pub low: f64,
    /// 95th percentile; the largest number of fewer than 20 fields.
    pub high: f64,
    /// Number of fields.
    pub fields: usize,
}

impl ExpectedPlants {
    /// Computes the distribution of these numbers of plants; `None` if there are none.
    fn of(mut plants: Vec<f64>) -> Option<Self> {
        plants.sort_by(f64::total_cmp);
        let fields = plants.len();
        let last = fields.checked_sub(1)?.to_f64();
        let at = |share: f64| plants[(share * last).round_to::<usize>()];
        let median = 0.5 * (plants[(fields - 1) / 2] + plants[fields / 2]);
        let tail = if fields < MANY { 0.0 } else { 0.05 };
        Some(Self { median, low: at(tail), high: at(1.0 - tail), fields })
    }

    /// Returns the ratio of `high` to `low`, with both at least 1.
    pub fn spread(&self) -> f64 {
        self.high.max(1.0) / self.low.max(1.0)
    }

    /// Returns the distribution as a sentence.
    pub fn words(&self) -> String {
        let Self { median, low, high, fields } = *self;
        let about = format!("expected plants in view of an image: {}", number(median));
        let range = format!("{} to {}", number(low), number(high));
        match fields {
            1 => about,
            2..MANY => format!("{about} (median of {fields} fields with {range})"),
            _ => format!("{about} (median; 90 % of the fields: {range})"),
        }
    }

    /// Returns the warning if there is one, otherwise the sentence.
    pub fn message(&self) -> String {
        self.warning().map_or_else(
            || format!("{}; images vary by chance as well", self.words()),
            |words| format!("warning: {words}"),
        )
    }

    /// Returns a warning if the number varies strongly from image to image.
    pub fn warning(&self) -> Option<String> {
        (self.spread() > WIDE).then(|| {
            format!(
                "{}, a factor of {}: narrow height_m of the camera, per_m2 of the weeds or the rows if this is not intended",
                self.words(),
                number(self.spread())
            )
        })
    }
}

impl SceneFile {
    /// Estimates the plants in view of the first `count` fields (at most 64) from their densities, without building them. Fields with
    /// errors are left out; they are reported when their images are rendered. Returns `None` if no field is left, and if a field has
    /// several images.
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
    fn a_wide_spread_of_plant_numbers_is_reported() {
        let even = ExpectedPlants::of((0..100).map(|k| 10.0 + 0.1 * f64::from(k)).collect()).unwrap();
        assert_eq!((even.low, even.median, even.high), (10.5, 14.95, 19.4));
        assert_eq!(even.warning(), None);
        let wide = ExpectedPlants::of((0..100).map(f64::from).collect()).unwrap();
        assert!(wide.warning().unwrap().starts_with(
            "expected plants in view of an image: 49.5 (median; 90 % of the fields: 5 to 94), a factor of 18.8"
        ));
        let few = ExpectedPlants::of(vec![19.5, 11.1]).unwrap();
        assert_eq!(few.words(), "expected plants in view of an image: 15.3 (median of 2 fields with 11.1 to 19.5)");
        assert_eq!(ExpectedPlants::of(vec![7.0]).unwrap().words(), "expected plants in view of an image: 7");
        // Fields with less than one plant count as one, so the ratio stays finite.
        assert_eq!(ExpectedPlants::of(vec![0.0, 0.2, 0.1, 2.0]).unwrap().spread(), 2.0);
        assert_eq!(ExpectedPlants::of(Vec::new()), None);
    }
}
