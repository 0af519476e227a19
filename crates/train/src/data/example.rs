//! One labelled image at the network's size.

use super::bands::{self, Band};
use super::margin;
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use furrow_dataset::Set;
use furrow_dataset::model::classes::Map;
use furrow_dataset::model::sample::IGNORE;
use furrow_dataset::read::native;
use furrow_dataset::read::native::Image;
use serde::{Deserialize, Serialize};

/// Input of a network: bands and size.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shape {
    /// Bands, in order.
    pub bands: Vec<Band>,
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
}

impl Shape {
    /// Returns the number of pixels of an image.
    pub fn pixels(&self) -> usize {
        self.width.to_usize() * self.height.to_usize()
    }
}

/// Image with labels, resized to a network's size. Images of another aspect ratio are stretched, as in Di Cicco et al. 2017: bands
/// are antialiased, and labels are those at the pixels' centres.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Example {
    /// Name in its dataset.
    pub name: String,
    /// One plane of `height × width` 8-bit values for each band.
    pub planes: Vec<Vec<u8>>,
    /// Class of each pixel, [`IGNORE`] for no label.
    pub labels: Vec<u8>,
    /// Plant number of each pixel, 0 for no plant; empty unless requested.
    pub plants: Vec<u32>,
    /// Species of each pixel, as one more than its index in [`Wanted::species`]' numbering; 0 for none. Empty unless requested, and for
    /// images of other programs.
    pub species: Vec<u8>,
}

/// Label maps to read besides the classes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Wanted {
    /// Plant numbers.
    pub plants: bool,
    /// Number of each species of the dataset in [`Example::species`]; empty if they are not wanted.
    pub species: Vec<u8>,
}

impl Example {
    /// Reads an image of a dataset at a network's size. Its label masks are dilated by `margin` pixels of the image, see [`margin`].
    pub fn read(set: &Set, number: u64, map: &Map, margin: f32, shape: &Shape, wanted: &Wanted) -> Result<Self> {
        let (size, whole) = Self::read_whole(set, number, map, margin, &shape.bands, wanted)?;
        Ok(whole.resized(size, (shape.width, shape.height)))
    }

    /// Reads an image at its own size, and returns it with its width and height, pixels.
    pub fn read_whole(
        set: &Set,
        number: u64,
        map: &Map,
        margin: f32,
        of: &[Band],
        wanted: &Wanted,
    ) -> Result<((u32, u32), Self)> {
        let name = Set::name(number);
        let image = Image::of(set, &name);
        if !image.has("record.json")? {
            return Err(Error::input("this image is not there yet")
                .in_file(set.folder.join(native::folder(&name)))
                .help("`trace dataset verify` lists missing images; run the command that created the dataset again"));
        }
        let (w, h, planes) = bands::read(&image, of)?;
        let same = |file: &str, found: (u32, u32)| {
            let what = || format!("it has {} × {} pixels, the image {w} × {h}", found.0, found.1);
            if found == (w, h) { Ok(()) } else { Err(Error::damaged(what()).in_file(image.place(file))) }
        };
        let file = "semantics.png";
        let (lw, lh, semantics) = image.indexed(file)?;
        same(file, (lw, lh))?;
        let mut species = Vec::new();
        if map.needs_species() || !wanted.species.is_empty() {
            let (lw, lh, numbers) = image.species((w, h), None)?;
            same("species.png", (lw, lh))?;
            species = numbers;
        }
        let mut parts = Vec::new();
        if map.needs_parts() {
            let file = "parts.png";
            let (lw, lh, numbers) = image.indexed(file)?;
            same(file, (lw, lh))?;
            parts = numbers;
        }
        let mut plants = Vec::new();
        if wanted.plants {
            let (lw, lh, numbers) = image.plants((w, h), None)?;
            same("plants.png", (lw, lh))?;
            plants = numbers;
        }
        let mut labels = map.labels(&semantics, &species, &parts);
        if wanted.species.is_empty() {
            species.clear();
        }
        let number = |own: &u8| usize::from(*own).checked_sub(1).and_then(|own| wanted.species.get(own)).copied();
        for own in &mut species {
            *own = number(own).unwrap_or(0);
        }
        if margin != 0.0 {
            labels = margin::moved(&labels, (w, h), margin);
            species = margin::moved(&species, (w, h), margin);
        }
        Ok(((w, h), Self { name, planes, labels, plants, species }))
    }

    /// Returns the example resized to another size.
    fn resized(self, (w, h): (u32, u32), to: (u32, u32)) -> Self {
        Self {
            planes: self.planes.iter().map(|plane| furrow_output::resize_gray(w, h, plane, to)).collect(),
            labels: nearest((w, h), &self.labels, to),
            plants: if self.plants.is_empty() { Vec::new() } else { nearest((w, h), &self.plants, to) },
            species: if self.species.is_empty() { Vec::new() } else { nearest((w, h), &self.species, to) },
            name: self.name,
        }
    }

    /// Returns its size in memory, bytes.
    pub fn bytes(&self) -> u64 {
        let planes: usize = self.planes.iter().map(Vec::len).sum();
        (planes + self.labels.len() + 4 * self.plants.len() + self.species.len()).to_u64()
    }

    /// Counts the pixels of each of `classes` classes.
    pub fn counts(&self, classes: usize) -> Vec<u64> {
        let mut counts = vec![0; classes];
        for label in self.labels.iter().filter(|l| **l != IGNORE) {
            counts[usize::from(*label)] += 1;
        }
        counts
    }
}

/// Resizes a map to another size: each pixel takes the value at its centre.
pub(crate) fn nearest<T: Copy>(from: (u32, u32), values: &[T], to: (u32, u32)) -> Vec<T> {
    if from == to {
        return values.to_vec();
    }
    let at = |i: u32, from: u32, to: u32| ((2 * u64::from(i) + 1) * u64::from(from) / (2 * u64::from(to))).to_usize();
    let columns: Vec<usize> = (0..to.0).map(|x| at(x, from.0, to.0)).collect();
    (0..to.1)
        .flat_map(|y| {
            let row = at(y, from.1, to.1) * from.0.to_usize();
            columns.iter().map(move |x| values[row + x])
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_keep_what_lies_at_the_centres() {
        let values: Vec<u8> = (0..36).collect();
        assert_eq!(nearest((6, 6), &values, (2, 2)), [7, 10, 25, 28]);
        assert_eq!(nearest((2, 1), &[1u8, 2], (4, 2)), [1, 1, 2, 2, 1, 1, 2, 2]);
        assert_eq!(nearest((6, 6), &values, (6, 6)), values);
    }
}
