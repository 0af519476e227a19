//! One image at the network's size.

use super::bands::{self, Band};
use super::margin;
use crate::dataset::classes::Map;
use crate::dataset::native::Image;
use crate::dataset::sample::IGNORE;
use crate::dataset::{Set, native};
use crate::output;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};

/// What a network takes in: bands and size.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shape {
    /// Its bands, in order.
    pub bands: Vec<Band>,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
}

impl Shape {
    /// Pixels of an image.
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }
}

/// An image with labels, brought to a network's size. Pictures of another shape are stretched, as Di Cicco et al. 2017 do:
/// bands antialiased, labels as they are at the pixels' centres.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Example {
    /// Its name in its set.
    pub name: String,
    /// One plane of `height × width` 8-bit values for each band.
    pub planes: Vec<Vec<u8>>,
    /// Class of each pixel, [`IGNORE`] for none.
    pub labels: Vec<u8>,
    /// Number of the plant of each pixel, 0 for none; empty unless asked for.
    pub plants: Vec<u32>,
}

impl Example {
    /// Reads an image of a set at a network's size; `margin` pixels of it lie between leaves and their outlines, see [`margin`].
    pub fn read(set: &Set, number: u64, map: &Map, margin: f32, shape: &Shape, with_plants: bool) -> Result<Self> {
        let (size, whole) = Self::read_whole(set, number, map, margin, &shape.bands, with_plants)?;
        Ok(whole.resized(size, (shape.width, shape.height)))
    }

    /// The same at its own size: width and height, pixels.
    pub fn read_whole(
        set: &Set,
        number: u64,
        map: &Map,
        margin: f32,
        of: &[Band],
        with_plants: bool,
    ) -> Result<((u32, u32), Self)> {
        let name = Set::name(number);
        let image = Image::of(set, &name);
        if !image.has("record.json")? {
            return Err(Error::input("this image is not there yet")
                .in_file(set.folder.join(native::folder(&name)))
                .help("`trace dataset verify` tells what the set lacks, the command that began it makes it"));
        }
        let (w, h, planes) = bands::read(&image, of)?;
        let same = |file: &str, found: (u32, u32)| {
            let what = || format!("it is {} × {} pixels, the photograph {w} × {h}", found.0, found.1);
            if found == (w, h) { Ok(()) } else { Err(Error::damaged(what()).in_file(image.place(file))) }
        };
        let file = "semantics.png";
        let (lw, lh, semantics) = image.indexed(file)?;
        same(file, (lw, lh))?;
        let mut species = Vec::new();
        if map.needs_species() {
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
        if with_plants {
            let (lw, lh, numbers) = image.plants((w, h), None)?;
            same("plants.png", (lw, lh))?;
            plants = numbers;
        }
        let mut labels = map.labels(&semantics, &species, &parts);
        if margin != 0.0 {
            labels = margin::moved(&labels, (w, h), margin);
        }
        Ok(((w, h), Self { name, planes, labels, plants }))
    }

    /// The same at another size.
    fn resized(self, (w, h): (u32, u32), to: (u32, u32)) -> Self {
        Self {
            planes: self.planes.iter().map(|plane| output::resize_gray(w, h, plane, to)).collect(),
            labels: nearest((w, h), &self.labels, to),
            plants: if self.plants.is_empty() { Vec::new() } else { nearest((w, h), &self.plants, to) },
            name: self.name,
        }
    }

    /// Bytes that it takes in memory.
    pub fn bytes(&self) -> u64 {
        (self.planes.iter().map(Vec::len).sum::<usize>() + self.labels.len() + 4 * self.plants.len()) as u64
    }

    /// Pixels of each of `classes` classes.
    pub fn counts(&self, classes: usize) -> Vec<u64> {
        let mut counts = vec![0; classes];
        for label in self.labels.iter().filter(|l| **l != IGNORE) {
            counts[usize::from(*label)] += 1;
        }
        counts
    }
}

/// A map at another size: each pixel has what lies at its centre.
pub(crate) fn nearest<T: Copy>(from: (u32, u32), values: &[T], to: (u32, u32)) -> Vec<T> {
    if from == to {
        return values.to_vec();
    }
    let at = |i: u32, from: u32, to: u32| ((2 * u64::from(i) + 1) * u64::from(from) / (2 * u64::from(to))) as usize;
    let columns: Vec<usize> = (0..to.0).map(|x| at(x, from.0, to.0)).collect();
    (0..to.1)
        .flat_map(|y| {
            let row = at(y, from.1, to.1) * from.0 as usize;
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
