//! Packs: archives of many images instead of a folder for each image, since many file systems cannot handle millions of
//! small files.
//!
//! A pack contains a fixed number of images of one split, in the order of their numbers. It is a tar archive with the
//! file names that the package `webdataset` groups by image and that [`stream`](crate::deliver::stream) writes:
//!
//! ```text
//! packs/train-000000.tar     the images
//! seals/train-000000.json    checksum of the archive, position of each file in it, checksum record of each image; written last
//! ```
//!
//! Images are made in folders of their own, as usual, and moved into their pack when all of its images are complete. So
//! kills, shards and failures have the same effects as in any dataset, and an archive is written once. The pack of an
//! image follows from the number of the image, the splits and the pack size.
//!
//! A pack is unpacked first (`store::settle`) if a byte of it was changed, or if it needs more images or other files.
//! It is also unpacked if its record is lost and the manifest lists its archive (`adopt`).

pub mod record;

use crate::model::recipe::Recipe;
use crate::model::split::Split;
use furrow_base::math::ToInt;

/// Maximum number of images in a pack; the record of a pack is read into memory.
pub const MOST: u64 = 100_000;

/// Identifier of a pack in a dataset.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Id {
    /// Split of its images.
    pub split: Split,
    /// Number of the pack among those of its split, from 0.
    pub number: u64,
}

impl Id {
    /// Returns the name, such as `train-000000`.
    pub fn name(self) -> String {
        format!("{}-{:06}", self.split.name(), self.number)
    }

    /// Returns the path of the archive, relative to the dataset's folder.
    pub fn path(self) -> String {
        format!("packs/{}.tar", self.name())
    }

    /// Returns the path of the record, relative to the dataset's folder.
    pub fn seal(self) -> String {
        format!("seals/{}.json", self.name())
    }
}

/// Assignment of a dataset's images to packs.
#[derive(Clone, Copy)]
pub struct Packing<'a> {
    recipe: &'a Recipe,
    /// Number of fields in a pack; all images of a field are in the same pack.
    fields: u64,
}

impl<'a> Packing<'a> {
    /// Returns the packing of a dataset; `None` if its images are in folders.
    pub fn of(recipe: &'a Recipe) -> Option<Self> {
        Some(Self { recipe, fields: (recipe.pack? / recipe.captures()).max(1) })
    }

    /// Describes the repeating pattern of splits over the fields. Returns the number of fields of `split` in one
    /// period, the number of fields before them, and the length of the period.
    fn pattern(self, split: Split) -> [u64; 3] {
        let shares = self.recipe.split.0.map(u64::from);
        let place = split as usize;
        [shares[place], shares[..place].iter().sum(), shares.iter().sum::<u64>().max(1)]
    }

    /// Returns the pack of an image.
    pub fn id(self, index: u64) -> Id {
        let (field, _) = self.recipe.field_of(index);
        let split = self.recipe.split.of(field);
        let [share, before, all] = self.pattern(split);
        Id { split, number: (field / all * share + field % all - before) / self.fields }
    }

    /// Returns the number of packs of a split.
    fn count(self, split: Split) -> u64 {
        let [share, before, all] = self.pattern(split);
        let fields = self.recipe.count.div_ceil(self.recipe.captures());
        (fields / all * share + (fields % all).saturating_sub(before).min(share)).div_ceil(self.fields)
    }

    /// Returns all packs, in the order of splits and numbers.
    pub fn all(self) -> impl Iterator<Item = Id> + use<'a> {
        Split::ALL.into_iter().flat_map(move |split| (0..self.count(split)).map(move |number| Id { split, number }))
    }

    /// Returns the index of a pack among all packs.
    pub fn place(self, id: Id) -> u64 {
        Split::ALL.into_iter().take_while(|split| *split != id.split).map(|split| self.count(split)).sum::<u64>()
            + id.number
    }

    /// Returns the images of a pack, in order.
    pub fn images(self, id: Id) -> Vec<u64> {
        let [share, before, all] = self.pattern(id.split);
        let (captures, count) = (self.recipe.captures(), self.recipe.count);
        let field = |rank: u64| rank / share.max(1) * all + before + rank % share.max(1);
        let fields = (id.number * self.fields..(id.number + 1) * self.fields).map(field);
        fields.flat_map(|field| field * captures..(field + 1) * captures).take_while(|index| *index < count).collect()
    }
}

impl Recipe {
    /// Returns the number of the work unit of an image. Units are distributed to the shards of a run: a field on one
    /// day, or a pack if images are packed.
    pub fn unit_of(&self, index: u64) -> u64 {
        match Packing::of(self) {
            Some(packing) => packing.place(packing.id(index)),
            None => self.growing_of(index),
        }
    }

    /// Returns the number of work units.
    pub fn units(&self) -> u64 {
        let unpacked = || self.count.checked_sub(1).map_or(0, |last| self.growing_of(last) + 1);
        Packing::of(self).map_or_else(unpacked, |packing| packing.all().count().to_u64())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::split::Shares;

    /// Expected: every image is in exactly one pack, which lists it and has its split; packs are full except the last
    /// one of a split.
    #[test]
    fn every_image_is_in_one_pack() {
        for (count, shares, pack) in [(100, [8, 1, 1], 7), (33, [1, 0, 0], 10), (7, [2, 3, 1], 100), (50, [0, 1, 2], 4)]
        {
            let recipe = Recipe { count, split: Shares(shares), pack: Some(pack), ..Recipe::of_species(Vec::new()) };
            let packing = Packing::of(&recipe).unwrap();
            let mut seen = Vec::new();
            for (place, id) in packing.all().enumerate() {
                assert_eq!(packing.place(id), place.to_u64());
                let images = packing.images(id);
                let last = packing.count(id.split) == id.number + 1;
                assert!(!images.is_empty() && (last || images.len().to_u64() == pack), "{id:?}: {images:?}");
                assert!(images.iter().all(|k| packing.id(*k) == id && recipe.split_of(*k) == id.split));
                seen.extend(images);
            }
            seen.sort_unstable();
            assert_eq!(seen, (0..count).collect::<Vec<_>>());
        }
    }
}
