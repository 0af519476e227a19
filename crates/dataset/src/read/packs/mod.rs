//! Images in archives instead of a folder an image: a million small files are more than many file systems bear.
//!
//! A pack holds so many images of one split, in the order of their numbers, as a tar archive whose files are named as the package `webdataset`
//! groups them and as [`stream`](crate::deliver::stream) writes them:
//!
//! ```text
//! packs/train-000000.tar     the images
//! seals/train-000000.json    its checksum, where each file lies in it, and the checksums of each image; written last
//! ```
//!
//! Images are made in folders of their own, as ever, and put into their pack when all of it are there: so kills, shards and faults are those
//! of any dataset, and an archive is written once. Which image is in which pack follows from its number, splits and the size of packs.
//! A pack of which a byte was changed, or that is to hold more images or other files, is taken apart first (`store::settle`). So is one whose
//! record is lost and whose archive the manifest knows (`adopt`).

pub mod record;

use crate::model::recipe::Recipe;
use crate::model::split::Split;

/// Most images of a pack: the record of one is read into memory.
pub const MOST: u64 = 100_000;

/// Which pack of a dataset.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Id {
    /// The split of its images.
    pub split: Split,
    /// How many packs of that split are before it.
    pub number: u64,
}

impl Id {
    /// Its name, such as `train-000000`.
    pub fn name(self) -> String {
        format!("{}-{:06}", self.split.name(), self.number)
    }

    /// Its archive, below the dataset's folder.
    pub fn path(self) -> String {
        format!("packs/{}.tar", self.name())
    }

    /// Its record, below the dataset's folder.
    pub fn seal(self) -> String {
        format!("seals/{}.json", self.name())
    }
}

/// Which images of a dataset are in which pack.
#[derive(Clone, Copy)]
pub struct Packing<'a> {
    recipe: &'a Recipe,
    /// Fields of a pack: all images of a field are in one.
    fields: u64,
}

impl<'a> Packing<'a> {
    /// Of a dataset; `None` where its images lie in folders.
    pub fn of(recipe: &'a Recipe) -> Option<Self> {
        Some(Self { recipe, fields: (recipe.pack? / recipe.captures()).max(1) })
    }

    /// Fields of a split in a row, how many are before them, and how many fields have all splits once.
    fn pattern(self, split: Split) -> [u64; 3] {
        let shares = self.recipe.split.0.map(u64::from);
        let place = split as usize;
        [shares[place], shares[..place].iter().sum(), shares.iter().sum::<u64>().max(1)]
    }

    /// The pack of an image.
    pub fn id(self, index: u64) -> Id {
        let (field, _) = self.recipe.field_of(index);
        let split = self.recipe.split.of(field);
        let [share, before, all] = self.pattern(split);
        Id { split, number: (field / all * share + field % all - before) / self.fields }
    }

    /// Packs of a split.
    fn count(self, split: Split) -> u64 {
        let [share, before, all] = self.pattern(split);
        let fields = self.recipe.count.div_ceil(self.recipe.captures());
        (fields / all * share + (fields % all).saturating_sub(before).min(share)).div_ceil(self.fields)
    }

    /// All packs, in the order of splits and numbers.
    pub fn all(self) -> impl Iterator<Item = Id> + use<'a> {
        Split::ALL.into_iter().flat_map(move |split| (0..self.count(split)).map(move |number| Id { split, number }))
    }

    /// The place of a pack among all.
    pub fn place(self, id: Id) -> u64 {
        Split::ALL.into_iter().take_while(|split| *split != id.split).map(|split| self.count(split)).sum::<u64>()
            + id.number
    }

    /// The images of a pack, in order.
    pub fn images(self, id: Id) -> Vec<u64> {
        let [share, before, all] = self.pattern(id.split);
        let (captures, count) = (self.recipe.captures(), self.recipe.count);
        let field = |rank: u64| rank / share.max(1) * all + before + rank % share.max(1);
        let fields = (id.number * self.fields..(id.number + 1) * self.fields).map(field);
        fields.flat_map(|field| field * captures..(field + 1) * captures).take_while(|index| *index < count).collect()
    }
}

impl Recipe {
    /// What the shards of a run share out, by number: fields on a day, or packs where images lie in such.
    pub fn unit_of(&self, index: u64) -> u64 {
        match Packing::of(self) {
            Some(packing) => packing.place(packing.id(index)),
            None => self.growing_of(index),
        }
    }

    /// How many of them there are.
    pub fn units(&self) -> u64 {
        let unpacked = || self.count.checked_sub(1).map_or(0, |last| self.growing_of(last) + 1);
        Packing::of(self).map_or_else(unpacked, |packing| packing.all().count() as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::split::Shares;

    /// Expected: every image is in one pack, the one that lists it, of its split; packs are full but for the last of a split.
    #[test]
    fn every_image_is_in_one_pack() {
        for (count, shares, pack) in [(100, [8, 1, 1], 7), (33, [1, 0, 0], 10), (7, [2, 3, 1], 100), (50, [0, 1, 2], 4)]
        {
            let recipe = Recipe { count, split: Shares(shares), pack: Some(pack), ..Recipe::of_species(Vec::new()) };
            let packing = Packing::of(&recipe).unwrap();
            let mut seen = Vec::new();
            for (place, id) in packing.all().enumerate() {
                assert_eq!(packing.place(id), place as u64);
                let images = packing.images(id);
                let last = packing.count(id.split) == id.number + 1;
                assert!(!images.is_empty() && (last || images.len() as u64 == pack), "{id:?}: {images:?}");
                assert!(images.iter().all(|k| packing.id(*k) == id && recipe.split_of(*k) == id.split));
                seen.extend(images);
            }
            seen.sort_unstable();
            assert_eq!(seen, (0..count).collect::<Vec<_>>());
        }
    }
}
