//! Counts the plants of each population of a scene file, and names the largest population in the error about too many plants.

use crate::estimate::gib;
use furrow_base::geometry::Cost;
use furrow_base::math::{RoundTo, ToFloat, ToInt};
use furrow_base::ron_file::{RonFile, Step};
use furrow_base::{Error, Result};
use furrow_render::scene::tag::MOST_PLANTS;
use std::ops::Range;

/// Maximum number of candidate positions of one population if positions outside the view are culled: about a second of work.
const MOST_PLACES: f64 = 4e6;
/// Number of plants that is always allowed, whatever the memory limit: before they are grown, they take about ten megabytes.
const FEW: u64 = 65_535;

/// The entry of a scene file that plants come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Population {
    /// The item of `crops` with this index.
    Crop(usize),
    /// The item of `weeds` with this index.
    Weed(usize),
    /// All items of `plants`.
    Placed,
    /// The item of `models` with this index, which is sown by its field `rows` or `spread`.
    Model(usize, &'static str),
}

/// A population and the index range of its plants among all plants.
pub(super) type Members = (Population, Range<usize>);

impl Population {
    /// Returns the path of the setting that controls the number of plants, and advice on how to get fewer.
    pub(super) fn place(self) -> (Vec<Step<'static>>, &'static str) {
        let (list, k, field) = match self {
            Self::Crop(k) => ("crops", k, "rows"),
            Self::Weed(k) => ("weeds", k, "spread"),
            Self::Model(k, field) => ("models", k, field),
            Self::Placed => return (vec![Step::Field("plants")], "place fewer plants"),
        };
        let fewer = if field == "rows" { "widen the distances or lower the jitter here" } else { "lower per_m2 here" };
        (vec![Step::Field(list), Step::Item(k), Step::Field(field)], fewer)
    }
}

/// Counter of plants, population by population.
pub(super) struct Census<'a> {
    page: &'a RonFile,
    /// Memory limit of the field, bytes.
    memory: u64,
    /// Maximum number of plants, limited by label numbers and by memory.
    most: usize,
    /// Maximum number of candidate positions of one population.
    most_places: f64,
    /// Populations in order, each with the number of plants that precede it.
    begun: Vec<(Population, usize)>,
}

impl<'a> Census<'a> {
    /// Creates a census for a field that may take `memory` bytes. `culled` states that positions outside the view are left out.
    pub(super) fn new(page: &'a RonFile, culled: bool, memory: u64) -> Self {
        // A plant takes at least the memory of one part.
        let fit = (memory.to_f64() / Cost::of(0.0, 1.0).bytes).trunc_to::<u64>();
        let most = fit.clamp(FEW, u64::from(MOST_PLANTS)).to_usize();
        let most_places = if culled { MOST_PLACES } else { 2.0 * most.to_f64() };
        Self { page, memory, most, most_places, begun: Vec::new() }
    }

    /// Starts the next population, which has about `places` candidate positions and follows `before` plants. Returns an error before any
    /// memory is allocated if label maps cannot number the plants or if they would not fit into memory.
    pub(super) fn open(&mut self, population: Population, places: f64, before: usize) -> Result<()> {
        self.close(before)?;
        self.begun.push((population, before));
        // `places` is an expected value, but the limit leaves enough room for its deviation.
        if places <= self.most_places {
            return Ok(());
        }
        Err(self.refusal(population, places.ceil() + before.to_f64()))
    }

    /// Returns the index range of each population, given the total number of plants.
    pub(super) fn populations(&self, plants: usize) -> Vec<Members> {
        let ends = self.begun.iter().skip(1).map(|(_, before)| *before).chain([plants]);
        self.begun.iter().zip(ends).map(|((population, before), end)| (*population, *before..end)).collect()
    }

    /// Checks the number of plants so far. The error about too many plants points at the largest population. Cheap enough to be called
    /// for every plant.
    pub(super) fn close(&self, plants: usize) -> Result<()> {
        if plants <= self.most {
            return Ok(());
        }
        // Of several equally large populations, take the first.
        let largest = self
            .populations(plants)
            .into_iter()
            .reduce(|most, next| if next.1.len() > most.1.len() { next } else { most });
        Err(self.refusal(largest.map_or(Population::Placed, |(population, _)| population), plants.to_f64()))
    }

    fn refusal(&self, population: Population, plants: f64) -> Error {
        let (path, advice) = population.place();
        let about = format!("about {plants:.0} plants or planting positions");
        let (words, more) = if plants > f64::from(MOST_PLANTS) {
            (format!("{about}: label maps can number at most {MOST_PLANTS}"), "")
        } else if plants > self.most.to_f64() {
            let words = format!("{about}: they would need more memory than the limit, {}", gib(self.memory.to_f64()));
            (words, "; --memory sets the limit, in GiB")
        } else {
            (format!("{about}, most of them outside the view: at most {MOST_PLACES} can be checked"), "")
        };
        let error = Error::input(words).help(format!("{advice}, or lower the camera{more}"));
        self.page.blame(&path, error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MANY: usize = MOST_PLANTS as usize;

    fn page() -> RonFile {
        RonFile::of("Field(crops: [(rows: ())], weeds: [(spread: (per_m2: 5)), (spread: (per_m2: 9))], plants: [()])")
    }

    /// Runs a census of a crop and two weeds, with `before` plants before the second weed and `all` plants in total.
    fn close(page: &RonFile, memory: u64, (before, all): (usize, usize)) -> Result<()> {
        let mut census = Census::new(page, false, memory);
        census.open(Population::Crop(0), 10.0, 0)?;
        census.open(Population::Weed(0), 10.0, 10)?;
        census.open(Population::Weed(1), 10.0, before)?;
        census.close(all)
    }

    /// Expected: up to 2²⁴ − 1 plants are accepted; for more, the error names the largest population.
    #[test]
    fn labels_number_24_bits() {
        let page = page();
        assert!(close(&page, u64::MAX, (20, 100_000)).is_ok());
        assert!(close(&page, u64::MAX, (20, MANY)).is_ok());
        for (before, place) in [(20, "per_m2: 9"), (MANY, "per_m2: 5")] {
            let error = close(&page, u64::MAX, (before, MANY + 1)).unwrap_err();
            let words = error.to_string();
            assert!(
                words.contains("about 16777216 plants or planting positions: label maps can number at most 16777215"),
                "{words}"
            );
            assert!(words.contains(place) && error.exit_code() == 2, "{words}");
        }
        let places = Census::new(&page, false, u64::MAX).open(Population::Crop(0), 3.0 * MANY.to_f64(), 0).unwrap_err();
        assert!(places.to_string().contains("label maps can number at most 16777215"), "{places}");
    }

    /// Rationale: positions are listed before the size of their plants is known. Expected: no more positions than fit into memory at the
    /// minimum of 2.5 kB per plant; up to 65,535, the later estimate decides, which knows the plants' sizes.
    #[test]
    fn memory_bounds_what_is_listed() {
        let page = page();
        assert!(close(&page, 1, (20, 65_535)).is_ok());
        assert!(close(&page, 1 << 30, (20, 400_000)).is_ok());
        let error = close(&page, 1 << 30, (20, 500_000)).unwrap_err().to_string();
        assert!(error.contains("more memory than the limit, 1.0 GiB") && error.contains("--memory"), "{error}");
        let error = Census::new(&page, true, u64::MAX).open(Population::Weed(0), 5e6, 0).unwrap_err().to_string();
        assert!(error.contains("most of them outside the view: at most 4000000 can be checked"), "{error}");
    }
}
