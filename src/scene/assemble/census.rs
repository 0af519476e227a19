//! How many plants each part of a scene file has brought, and which part to name where they are too many.

use super::builder::MOST_PLANTS;
use crate::ron_file::{RonFile, Step};
use crate::{Error, Result};
use std::ops::Range;

/// The most places for plants of one population that are looked at where those beside the view are left out: a second's work.
const MOST_PLACES: f64 = 4e6;

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
    /// The most places that are looked at for one population.
    most_places: f64,
    /// Populations in order, each with the number of plants before it.
    begun: Vec<(Population, usize)>,
}

impl<'a> Census<'a> {
    /// For plants of which labels must be able to number all that stand in places which are looked at; with `culled`, of which most stand beside the view.
    pub(super) fn new(page: &'a RonFile, culled: bool) -> Self {
        let most_places = if culled { MOST_PLACES } else { 2.0 * MOST_PLANTS as f64 };
        Self { page, most_places, begun: Vec::new() }
    }

    /// Begins the next population, with so many plants before it and about so many places for its own. Refuses what labels cannot
    /// number before it takes the memory.
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

    /// Checks the plants of all populations so far; the largest population is named where they are too many.
    pub(super) fn close(&self, plants: usize) -> Result<()> {
        if plants <= MOST_PLANTS {
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
        let words = format!("about {plants:.3e} plants or places for them: labels can number {MOST_PLANTS}");
        let error = Error::input(words).help(format!("{advice}, or lower the camera"));
        self.page.blame(&path, error)
    }
}
