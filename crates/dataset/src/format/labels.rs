//! How a dataset's formats name and choose what its images show: classes, and how small or hidden a plant or leaf may be.

use crate::model::classes::{Class, Classes, Map};
use crate::model::labelling::Labelling;
use crate::model::recipe::Recipe;
use crate::model::record::{Leaf, Plant, Record};
use crate::model::sample::Sample;
use crate::read::set::Set;
use furrow_base::{Error, Result};
use serde::Serialize;
use std::borrow::Cow;

/// The labels of one dataset's images.
pub struct Labels<'a> {
    labelling: &'a Labelling,
    classes: Cow<'a, Classes>,
    map: Map,
}

impl<'a> Labels<'a> {
    /// As a recipe asks for them.
    pub fn of(recipe: &'a Recipe) -> Result<Self> {
        let labelling = &recipe.labelling;
        let classes = labelling.classes.as_ref().map_or_else(|| Cow::Owned(Classes::default()), Cow::Borrowed);
        classes.check().map_err(|what| Error::damaged(format!("the classes of this dataset are none: {what}")))?;
        Ok(Self { labelling, map: classes.of(&recipe.species, recipe.models())?, classes })
    }

    /// The classes by number.
    pub fn classes(&self) -> &[Class] {
        self.classes.counted()
    }

    /// The colours of the classes, by number.
    pub fn colors(&self) -> Vec<[u8; 3]> {
        self.classes.colors()
    }

    /// The classes that plants may have, in their order.
    pub fn of_plants(&self) -> Vec<u8> {
        self.classes.of_plants()
    }

    /// The class of each pixel; [`IGNORE`](crate::model::sample::IGNORE) for none.
    pub fn pixels<'s>(&self, sample: &'s Sample) -> Cow<'s, [u8]> {
        if self.labelling.classes.is_none() {
            return Cow::Borrowed(&sample.semantics);
        }
        Cow::Owned(self.map.labels(&sample.semantics, &sample.species, &sample.parts))
    }

    /// The class of a plant; `None` where it is ignored.
    pub fn class(&self, plant: &Plant) -> Option<u8> {
        self.map.of_plant(plant.class as u8, plant.kind)
    }

    /// The plants that formats list, each with its class.
    pub fn plants<'r>(&self, record: &'r Record) -> impl Iterator<Item = (&'r Plant, u8)> {
        record.seen().filter(|plant| self.labelling.lists(&plant.seen)).filter_map(|p| Some((p, self.class(p)?)))
    }

    /// The leaves of a plant that formats list, whether they list the plant or not.
    pub fn leaves<'r>(&self, plant: &'r Plant) -> impl Iterator<Item = &'r Leaf> {
        plant.leaves.iter().filter(|leaf| self.labelling.lists(&leaf.seen))
    }
}

/// How much of what images show stands in no list of a format.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    /// Plants of a class that is ignored, or of none.
    pub ignored_plants: u64,
    /// Other plants that are too small or too hidden.
    pub plants: u64,
    /// Leaves of the plants that are not ignored, which are too small or too hidden.
    pub leaves: u64,
}

impl LeftOut {
    /// Of a whole dataset; `None` where its labelling is the usual, which leaves nothing out.
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
                all.leaves += leaves.filter(|leaf| !labels.labelling.lists(&leaf.seen)).count() as u64;
            }
        }
        Ok(Some(all))
    }
}
