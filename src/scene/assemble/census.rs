//! How many plants each part of a scene file has brought, and which part to name where they are too many.

use crate::geometry::Cost;
use crate::ron_file::{RonFile, Step};
use crate::scene::estimate::gib;
use crate::scene::tag::MOST_PLANTS;
use crate::{Error, Result};
use std::ops::Range;

/// The most places for plants of one population that are looked at where those beside the view are left out: a second's work.
const MOST_PLACES: f64 = 4e6;
/// Plants that are looked at whatever the memory: before they grow they take some ten megabytes.
const FEW: u64 = 65_535;

/// Where in a scene file plants come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Population {
    /// `crops`, the item of this index.
    Crop(usize),
    /// `weeds`, the item of this index.
    Weed(usize),
    /// `plants`, all items.
    Placed,
}

/// A population and the places of its plants among all.
pub(super) type Members = (Population, Range<usize>);

impl Population {
    /// The way to what decides how many there are, and what makes them fewer.
    pub(super) fn place(self) -> (Vec<Step<'static>>, &'static str) {
        match self {
            Self::Crop(k) => (
                vec![Step::Field("crops"), Step::Item(k), Step::Field("rows")],
                "widen the distances or lower the jitter here",
            ),
            Self::Weed(k) => (vec![Step::Field("weeds"), Step::Item(k), Step::Field("spread")], "lower per_m2 here"),
            Self::Placed => (vec![Step::Field("plants")], "place fewer plants"),
        }
    }
}

/// Counts plants population by population.
pub(super) struct Census<'a> {
    page: &'a RonFile,
    /// Bytes that the field may take.
    memory: u64,
    /// The most plants, by their numbers or by the memory.
    most: usize,
    /// The most places that are looked at for one population.
    most_places: f64,
    /// Populations in order, each with the number of plants before it.
    begun: Vec<(Population, usize)>,
}

impl<'a> Census<'a> {
    /// For plants that labels must be able to number, and that take less than so many bytes; with `culled`, most places stand beside the view.
    pub(super) fn new(page: &'a RonFile, culled: bool, memory: u64) -> Self {
        // A plant is a part at least.
        let fit = (memory as f64 / Cost::of(0.0, 1.0).bytes) as u64;
        let most = fit.clamp(FEW, u64::from(MOST_PLANTS)) as usize;
        let most_places = if culled { MOST_PLACES } else { 2.0 * most as f64 };
        Self { page, memory, most, most_places, begun: Vec::new() }
    }

    /// Begins the next population, with so many plants before it and about so many places for its own. Refuses what labels cannot
    /// number, and what no memory holds, before it takes the memory.
    pub(super) fn open(&mut self, population: Population, places: f64, before: usize) -> Result<()> {
        self.close(before)?;
        self.begun.push((population, before));
        // An expected number may be missed; one far beyond the limit may not.
        if places <= self.most_places {
            return Ok(());
        }
        Err(self.refusal(population, places.ceil() + before as f64))
    }

    /// The plants of each population, of so many in all.
    pub(super) fn populations(&self, plants: usize) -> Vec<Members> {
        let ends = self.begun.iter().skip(1).map(|(_, before)| *before).chain([plants]);
        self.begun.iter().zip(ends).map(|((population, before), end)| (*population, *before..end)).collect()
    }

    /// Checks the plants of all populations so far; the largest population is named where they are too many. Cheap enough to be asked plant by plant.
    pub(super) fn close(&self, plants: usize) -> Result<()> {
        if plants <= self.most {
            return Ok(());
        }
        // The first of several that are equally large.
        let largest = self
            .populations(plants)
            .into_iter()
            .reduce(|most, next| if next.1.len() > most.1.len() { next } else { most });
        Err(self.refusal(largest.map_or(Population::Placed, |(population, _)| population), plants as f64))
    }

    fn refusal(&self, population: Population, plants: f64) -> Error {
        let (path, advice) = population.place();
        let about = format!("about {plants:.3e} plants or places for them");
        let (words, more) = if plants > f64::from(MOST_PLANTS) {
            (format!("{about}: labels can number {MOST_PLANTS}"), "")
        } else if plants > self.most as f64 {
            let words = format!("{about}: they would take more memory than the limit, {}", gib(self.memory as f64));
            (words, "; --memory sets the limit, in GiB")
        } else {
            (format!("{about}, most of them beside the view: {MOST_PLACES} can be looked at"), "")
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

    /// A census of a crop and two kinds of weeds, with so many plants before the second weed and in all.
    fn close(page: &RonFile, memory: u64, (before, all): (usize, usize)) -> Result<()> {
        let mut census = Census::new(page, false, memory);
        census.open(Population::Crop(0), 10.0, 0)?;
        census.open(Population::Weed(0), 10.0, 10)?;
        census.open(Population::Weed(1), 10.0, before)?;
        census.close(all)
    }

    /// Expected: more than 65,535 plants are numbered, as many as 24 bits number; of more, the largest population is named.
    #[test]
    fn labels_number_24_bits() {
        let page = page();
        assert!(close(&page, u64::MAX, (20, 100_000)).is_ok());
        assert!(close(&page, u64::MAX, (20, MANY)).is_ok());
        for (before, place) in [(20, "per_m2: 9"), (MANY, "per_m2: 5")] {
            let error = close(&page, u64::MAX, (before, MANY + 1)).unwrap_err();
            let words = error.to_string();
            assert!(words.contains("about 1.678e7 plants or places for them: labels can number 16777215"), "{words}");
            assert!(words.contains(place) && error.exit_code() == 2, "{words}");
        }
        let places = Census::new(&page, false, u64::MAX).open(Population::Crop(0), 3.0 * MANY as f64, 0).unwrap_err();
        assert!(places.to_string().contains("labels can number 16777215"), "{places}");
    }

    /// Rationale: places are listed before anything is known of their plants. Expected: no more of them than the least that plants take leaves room
    /// for, 2.5 kB each; up to 65,535 the estimate decides, which knows what they take.
    #[test]
    fn memory_bounds_what_is_listed() {
        let page = page();
        assert!(close(&page, 1, (20, 65_535)).is_ok());
        assert!(close(&page, 1 << 30, (20, 400_000)).is_ok());
        let error = close(&page, 1 << 30, (20, 500_000)).unwrap_err().to_string();
        assert!(error.contains("more memory than the limit, 1.0 GiB") && error.contains("--memory"), "{error}");
        let error = Census::new(&page, true, u64::MAX).open(Population::Weed(0), 5e6, 0).unwrap_err().to_string();
        assert!(error.contains("most of them beside the view: 4000000 can be looked at"), "{error}");
    }
}
