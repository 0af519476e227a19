//! Labels of a dataset's formats: their classes, and limits on the size and visibility of plants and leaves.

use crate::model::classes::{Class, Classes, Map};
use crate::model::labelling::Labelling;
use crate::model::recipe::Recipe;
use crate::model::record::{Leaf, Plant, Record};
use crate::model::sample::Sample;
use crate::read::set::Set;
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use furrow_field::record::SpeciesRecord;
use serde::Serialize;
use std::borrow::Cow;

/// Labels of one dataset's images.
pub struct Labels<'a> {
    labelling: &'a Labelling,
    classes: Cow<'a, Classes>,
    map: Map,
    species: &'a [SpeciesRecord],
}

impl<'a> Labels<'a> {
    /// Returns the labels that a recipe asks for.
    pub fn of(recipe: &'a Recipe) -> Result<Self> {
        let labelling = &recipe.labelling;
        let classes = labelling.classes.as_ref().map_or_else(|| Cow::Owned(Classes::default()), Cow::Borrowed);
        classes.check().map_err(|what| Error::damaged(format!("the classes of this dataset are invalid: {what}")))?;
        Ok(Self { labelling, map: classes.of(&recipe.species, recipe.models())?, classes, species: &recipe.species })
    }

    /// Returns the classes by number.
    pub fn classes(&self) -> &[Class] {
        self.classes.counted()
    }

    /// Returns the colours of the classes, by number.
    pub fn colors(&self) -> Vec<[u8; 3]> {
        self.classes.colors()
    }

    /// Returns the classes that plants can have, in order.
    pub fn of_plants(&self) -> Vec<u8> {
        self.classes.of_plants(self.species)
    }

    /// Returns the class of each pixel; [`IGNORE`](crate::model::sample::IGNORE) for none.
    pub fn pixels<'s>(&self, sample: &'s Sample) -> Cow<'s, [u8]> {
        if self.labelling.classes.is_none() {
            return Cow::Borrowed(&sample.semantics);
        }
        Cow::Owned(self.map.labels(&sample.semantics, &sample.species, &sample.parts))
    }

    /// Returns the class of a plant; `None` if it is ignored or belongs to no class.
    pub fn class(&self, plant: &Plant) -> Option<u8> {
        self.map.of_plant(plant.class as u8, plant.kind)
    }

    /// Returns the plants that formats list, each with its class.
    pub fn plants<'r>(&self, record: &'r Record) -> impl Iterator<Item = (&'r Plant, u8)> {
        record.seen().filter(|plant| self.labelling.lists(&plant.seen)).filter_map(|p| Some((p, self.class(p)?)))
    }

    /// Returns the plants that formats of whole plants list, each with its class: those of [`Self::plants`], and fully
    /// hidden ones unless small or occluded plants are left out.
    pub fn whole_plants<'r>(&self, record: &'r Record) -> impl Iterator<Item = (&'r Plant, u8)> {
        let hidden = self.labelling.min_pixels.is_none() && self.labelling.min_visible.is_none();
        let listed = move |plant: &&Plant| self.labelling.lists(&plant.seen) || (hidden && plant.seen.pixels == 0);
        record.plants.iter().filter(listed).filter_map(|p| Some((p, self.class(p)?)))
    }

    /// Returns the leaves of a plant that formats list, whether they list the plant or not.
    pub fn leaves<'r>(&self, plant: &'r Plant) -> impl Iterator<Item = &'r Leaf> {
        plant.leaves.iter().filter(|leaf| self.labelling.lists(&leaf.seen))
    }
}

/// Numbers of visible plants and leaves that no format lists.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    /// Plants of the class `ignore`, or of no class.
    pub ignored_plants: u64,
    /// Other plants that are too small or too occluded.
    pub plants: u64,
    /// Leaves that are too small or too occluded, on plants that are not ignored.
    pub leaves: u64,
}

impl LeftOut {
    /// Counts the plants and leaves of a whole dataset; `None` for the default labelling, which omits nothing.
    pub fn of(set: &Set) -> Result<Option<Self>> {
        if set.recipe.labelling.is_usual() {
            return Ok(None);
        }
        let labels = Labels::of(&set.recipe)?;
        let mut all = Self::default();
        for record in set.all() {
            for plant in record?.seen() {
                if labels.class(plant).is_none() {
                    all.ignored_plants += 1;
                    continue;
                }
                all.plants += u64::from(!labels.labelling.lists(&plant.seen));
                let leaves = plant.leaves.iter().filter(|leaf| leaf.seen.pixels > 0);
                all.leaves += leaves.filter(|leaf| !labels.labelling.lists(&leaf.seen)).count().to_u64();
            }
        }
        Ok(Some(all))
    }
}
