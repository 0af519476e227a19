//! The selected images: decoded once, and kept as far as memory goes.

use super::example::{Example, Shape};
use super::ground::PIXEL_MM;
use super::select::{Pick, Selection};
use crate::dataset::Set;
use crate::dataset::classes::{Classes, Map};
use crate::{Error, Result};
use std::borrow::Cow;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

/// Images, about, whose records are read for the size of their pixels.
const ASKED: usize = 256;

/// Images of one or several sets, by place.
pub struct Store {
    /// With their outlines' margins.
    sets: Vec<(Set, Map, f32)>,
    /// Set and number of each image.
    images: Vec<(usize, u64)>,
    shape: Shape,
    with_plants: bool,
    kept: Vec<OnceLock<Example>>,
    /// Which image is the first of the same: repeated images are kept once.
    same: Vec<usize>,
    free: AtomicU64,
}

impl Store {
    /// The images of the selections, in their order; at most `memory` bytes of them are kept decoded.
    pub fn open(
        selections: &[Selection],
        otherwise: Pick,
        seed: u64,
        classes: &Classes,
        shape: &Shape,
        with_plants: bool,
        memory: u64,
    ) -> Result<Self> {
        let (mut sets, mut images) = (Vec::new(), Vec::new());
        for selection in selections {
            let (set, numbers) = selection.open(otherwise, seed)?;
            let map = classes.of(&set.recipe.species, set.recipe.models()).map_err(|e| e.in_file(&set.folder))?;
            set.recipe.check_parts(classes).map_err(|e| e.in_file(&set.folder))?;
            images.extend(numbers.into_iter().map(|n| (sets.len(), n)));
            sets.push((set, map, selection.margin));
        }
        let mut first = std::collections::BTreeMap::new();
        let same = images.iter().enumerate().map(|(i, image)| *first.entry(*image).or_insert(i)).collect();
        let kept = images.iter().map(|_| OnceLock::new()).collect();
        Ok(Self { sets, images, shape: shape.clone(), with_plants, kept, same, free: AtomicU64::new(memory) })
    }

    /// How many images there are, repeated ones counted as often as they stand there.
    pub fn len(&self) -> usize {
        self.images.len()
    }

    /// How many different ones.
    pub fn distinct(&self) -> usize {
        self.same.iter().enumerate().filter(|(place, first)| place == *first).count()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.images.is_empty()
    }

    /// What each image is brought to.
    pub fn shape(&self) -> &Shape {
        &self.shape
    }

    /// The image at a place: from memory, or read.
    pub fn get(&self, place: usize) -> Result<Cow<'_, Example>> {
        let place = self.same[place];
        if let Some(example) = self.kept[place].get() {
            return Ok(Cow::Borrowed(example));
        }
        let (set, number) = self.images[place];
        let (set, map, margin) = &self.sets[set];
        let example = Example::read(set, number, map, *margin, &self.shape, self.with_plants)?;
        Ok(self.keep(place, example))
    }

    /// The image at a place at its own size, which is told: read afresh, and not kept.
    pub fn whole(&self, place: usize) -> Result<((u32, u32), Example)> {
        let (set, number) = self.images[place];
        let (set, map, margin) = &self.sets[set];
        Example::read_whole(set, number, map, *margin, &self.shape.bands, self.with_plants)
    }

    /// Side of a pixel on the ground at the network's size, millimetres: the median of some images whose records tell their cameras.
    pub fn pixel_mm(&self) -> Result<Option<f64>> {
        let mut sizes = Vec::new();
        for place in (0..self.images.len()).step_by(self.images.len().div_ceil(ASKED).max(1)) {
            sizes.extend(self.pixel_mm_of(place)?);
        }
        sizes.sort_by(f64::total_cmp);
        Ok(sizes.get(sizes.len() / 2).copied())
    }

    /// The same of each image, in their order; all records are read.
    ///
    /// # Errors
    /// An image whose record does not tell it, or one outside [`PIXEL_MM`].
    pub fn pixel_sizes_mm(&self) -> Result<Vec<f64>> {
        let mut sizes: Vec<f64> = Vec::with_capacity(self.images.len());
        for (place, first) in self.same.iter().enumerate() {
            if *first < place {
                sizes.push(sizes[*first]);
                continue;
            }
            let told = self.pixel_mm_of(place)?.filter(|mm| PIXEL_MM.contains(mm));
            sizes.push(told.ok_or_else(|| self.untold(place))?);
        }
        Ok(sizes)
    }

    /// Number of the first image whose record is there and does not tell it, or tells one outside [`PIXEL_MM`].
    pub fn first_untold(&self) -> Option<u64> {
        let is_told = |place: usize| self.pixel_mm_of(place).map(|told| told.is_some_and(|mm| PIXEL_MM.contains(&mm)));
        let lacks = |place: &usize| self.same[*place] == *place && matches!(is_told(*place), Ok(false));
        (0..self.images.len()).find(lacks).map(|place| self.images[place].1)
    }

    /// That an image does not tell the size of its pixels.
    fn untold(&self, place: usize) -> Error {
        let (set, number) = self.images[place];
        let name = Set::name(number);
        Error::misuse(format!("--augment-scale: image {name} does not tell the size of its pixels on the ground"))
            .help("imported images do not, nor cameras that do not look down: leave this option out for them")
            .in_file(&self.sets[set].0.folder)
    }

    /// Of the image at a place, where its record tells its camera.
    fn pixel_mm_of(&self, place: usize) -> Result<Option<f64>> {
        let (set, number) = self.images[place];
        let record = self.sets[set].0.record(number)?;
        let across = record.conditions.as_ref().and_then(|conditions| conditions.camera.pixel_m());
        Ok(across.map(|m| 1e3 * m * f64::from(record.width) / f64::from(self.shape.width)))
    }

    /// Keeps an image that was read, where the budget allows it.
    fn keep(&self, place: usize, example: Example) -> Cow<'_, Example> {
        let bytes = example.bytes();
        let take = |free: u64| free.checked_sub(bytes);
        if self.free.fetch_update(Ordering::Relaxed, Ordering::Relaxed, take).is_err() {
            return Cow::Owned(example);
        }
        if self.kept[place].set(example).is_err() {
            // Another thread has kept the same image meanwhile: it takes memory once.
            self.free.fetch_add(bytes, Ordering::Relaxed);
        }
        Cow::Borrowed(self.kept[place].get().expect("an image that was just kept"))
    }

    /// What decides the images of a place: the set's fingerprint and the image's number.
    pub fn fingerprints(&self) -> Result<Vec<(String, Vec<u64>)>> {
        let of = |(i, (set, ..)): (usize, &(Set, Map, f32))| {
            let numbers = self.images.iter().filter(|(s, _)| *s == i).map(|(_, n)| *n).collect();
            Ok((set.recipe.fingerprint()?, numbers))
        };
        self.sets.iter().enumerate().map(of).collect()
    }

    /// What its first set's images are, for people: folders with the number of images of each.
    pub fn told(&self) -> Vec<(String, usize)> {
        let of = |(i, (set, ..)): (usize, &(Set, Map, f32))| {
            (set.folder.display().to_string(), self.images.iter().filter(|(s, _)| *s == i).count())
        };
        self.sets.iter().enumerate().map(of).collect()
    }
}
