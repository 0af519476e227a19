//! The selected images of datasets, cached in memory within a budget.

use super::example::{Example, Shape, Wanted};
use super::ground::PIXEL_MM;
use super::select::{Pick, Selection};
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use furrow_dataset::Set;
use furrow_dataset::model::classes::{Classes, Map};
use std::borrow::Cow;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

/// Approximate number of images whose records are read for the median pixel size.
const ASKED: usize = 256;

/// Images of one or several datasets, by index.
pub struct Store {
    /// Datasets, with the mapping of their labels to classes and the margin of their label masks.
    sets: Vec<(Set, Map, f32)>,
    /// Dataset (index in `sets`) and number of each image.
    images: Vec<(usize, u64)>,
    shape: Shape,
    /// Label maps to read besides the classes, of each dataset.
    wanted: Vec<Wanted>,
    kept: Vec<OnceLock<Example>>,
    /// Index of the first occurrence of each image: repeated images are cached once.
    same: Vec<usize>,
    free: AtomicU64,
}

impl Store {
    /// Opens the images of the selections, in their order. At most `memory` bytes of decoded images are cached. `otherwise` is the
    /// default pick; `seed` decides random picks; `with_plants` also reads plant numbers.
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
        let wanted = vec![Wanted { plants: with_plants, species: Vec::new() }; sets.len()];
        Ok(Self { sets, images, shape: shape.clone(), wanted, kept, same, free: AtomicU64::new(memory) })
    }

    /// Returns the English names of all species of the datasets, sorted.
    pub fn species(&self) -> Vec<String> {
        let all = self.sets.iter().flat_map(|(set, ..)| &set.recipe.species);
        let names: std::collections::BTreeSet<&String> = all.map(|species| &species.name).collect();
        names.into_iter().cloned().collect()
    }

    /// Returns the store such that its images also have the species of each pixel, numbered by their places in `names`.
    #[must_use]
    pub fn with_species(mut self, names: &[String]) -> Self {
        let number = |name: &String| names.iter().position(|own| own == name).map_or(0, |place| place.to_u8() + 1);
        for (wanted, (set, ..)) in self.wanted.iter_mut().zip(&self.sets) {
            wanted.species = set.recipe.species.iter().map(|species| number(&species.name)).collect();
        }
        self.kept = self.images.iter().map(|_| OnceLock::new()).collect();
        self
    }

    /// Returns the number of images, including repetitions.
    pub fn len(&self) -> usize {
        self.images.len()
    }

    /// Returns the number of different images.
    pub fn distinct(&self) -> usize {
        self.same.iter().enumerate().filter(|(place, first)| place == *first).count()
    }

    /// Returns whether there are no images.
    pub fn is_empty(&self) -> bool {
        self.images.is_empty()
    }

    /// Returns the bands and the size of each image.
    pub fn shape(&self) -> &Shape {
        &self.shape
    }

    /// Returns the image with the index `place`, from the cache or read from disk.
    pub fn get(&self, place: usize) -> Result<Cow<'_, Example>> {
        let place = self.same[place];
        if let Some(example) = self.kept[place].get() {
            return Ok(Cow::Borrowed(example));
        }
        let (of, number) = self.images[place];
        let (set, map, margin) = &self.sets[of];
        let example = Example::read(set, number, map, *margin, &self.shape, &self.wanted[of])?;
        Ok(self.keep(place, example))
    }

    /// Reads the image with the index `place` at its own size (width and height, pixels), without caching it.
    pub fn whole(&self, place: usize) -> Result<((u32, u32), Example)> {
        let (of, number) = self.images[place];
        let (set, map, margin) = &self.sets[of];
        Example::read_whole(set, number, map, *margin, &self.shape.bands, &self.wanted[of])
    }

    /// Returns the pixel size on the ground at the network's size, millimetres: the median over a sample of the images whose records
    /// describe their cameras. `None` if there are none.
    pub fn pixel_mm(&self) -> Result<Option<f64>> {
        let mut sizes = Vec::new();
        for place in (0..self.images.len()).step_by(self.images.len().div_ceil(ASKED).max(1)) {
            sizes.extend(self.pixel_mm_of(place)?);
        }
        sizes.sort_by(f64::total_cmp);
        Ok(sizes.get(sizes.len() / 2).copied())
    }

    /// Returns the pixel size on the ground of each image at the network's size, millimetres. Reads all records.
    ///
    /// # Errors
    /// If the record of an image does not describe its camera, or the size is outside [`PIXEL_MM`].
    pub fn pixel_sizes_mm(&self) -> Result<Vec<f64>> {
        let mut sizes: Vec<f64> = Vec::with_capacity(self.images.len());
        for (place, first) in self.same.iter().enumerate() {
            if *first < place {
                sizes.push(sizes[*first]);
                continue;
            }
            let recorded_mm = self.pixel_mm_of(place)?.filter(|mm| PIXEL_MM.contains(mm));
            sizes.push(recorded_mm.ok_or_else(|| self.no_pixel_size(place))?);
        }
        Ok(sizes)
    }

    /// Returns the number of the first image with a readable record that does not give its pixel size, or gives one outside
    /// [`PIXEL_MM`].
    pub fn first_without_pixel_size(&self) -> Option<u64> {
        let has_pixel_size = |place: usize| {
            self.pixel_mm_of(place).map(|recorded_mm| recorded_mm.is_some_and(|mm| PIXEL_MM.contains(&mm)))
        };
        let lacks = |place: &usize| self.same[*place] == *place && matches!(has_pixel_size(*place), Ok(false));
        (0..self.images.len()).find(lacks).map(|place| self.images[place].1)
    }

    /// Returns the error for an image without a valid pixel size.
    fn no_pixel_size(&self, place: usize) -> Error {
        let (set, number) = self.images[place];
        let name = Set::name(number);
        Error::misuse(format!("--augment-scale: image {name} does not record its pixel size on the ground"))
            .help("imported images and cameras that do not look down have none: leave this option out for them")
            .in_file(&self.sets[set].0.folder)
    }

    /// Returns the pixel size of one image, if its record describes its camera.
    fn pixel_mm_of(&self, place: usize) -> Result<Option<f64>> {
        let (set, number) = self.images[place];
        let record = self.sets[set].0.record(number)?;
        let across = record.conditions.as_ref().and_then(|conditions| conditions.camera.pixel_m());
        Ok(across.map(|m| 1e3 * m * f64::from(record.width) / f64::from(self.shape.width)))
    }

    /// Caches an image if the memory budget allows it.
    fn keep(&self, place: usize, example: Example) -> Cow<'_, Example> {
        let bytes = example.bytes();
        let take = |free: u64| free.checked_sub(bytes);
        if self.free.fetch_update(Ordering::Relaxed, Ordering::Relaxed, take).is_err() {
            return Cow::Owned(example);
        }
        if self.kept[place].set(example).is_err() {
            // Another thread has cached the same image meanwhile: its memory is counted once.
            self.free.fetch_add(bytes, Ordering::Relaxed);
        }
        Cow::Borrowed(self.kept[place].get().expect("this thread or another has just cached the image"))
    }

    /// Returns the fingerprint of each dataset and the numbers of its images, which identify the content of the store.
    pub fn fingerprints(&self) -> Result<Vec<(String, Vec<u64>)>> {
        let of = |(i, (set, ..)): (usize, &(Set, Map, f32))| {
            let numbers = self.images.iter().filter(|(s, _)| *s == i).map(|(_, n)| *n).collect();
            Ok((set.recipe.fingerprint()?, numbers))
        };
        self.sets.iter().enumerate().map(of).collect()
    }

    /// Returns the folder of each dataset and its number of images, for reports.
    pub fn image_counts(&self) -> Vec<(String, usize)> {
        let of = |(i, (set, ..)): (usize, &(Set, Map, f32))| {
            (set.folder.display().to_string(), self.images.iter().filter(|(s, _)| *s == i).count())
        };
        self.sets.iter().enumerate().map(of).collect()
    }
}
