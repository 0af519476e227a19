//! Import of foreign images and labels into a dataset, so that training and comparison read real sets like rendered
//! ones.
//!
//! A [`Source`] lists its images and reads one of them. Everything else is common to all sources: images are numbered
//! by split and name and written one by one with a checksum record, and the same call continues an interrupted import.
//! Values that a source does not provide (coverage, depth, hidden parts) are omitted, not estimated.
//!
//! | file | contents |
//! |---|---|
//! | `classes` | the numbers, colours or names of soil, crop and weed |
//! | `files` | matching of images and label files by name |
//! | `instances` | plant and leaf numbers that agree with the classes |
//! | `masks`, `phenobench`, `coco` | one source each |

pub mod classes;
pub mod coco;
mod files;
mod instances;
pub mod masks;
pub mod phenobench;

use crate::make::begin::{self, refuse_full};
use crate::make::generate;
use crate::make::task::{Task, task};
use crate::model::annotate;
use crate::model::invariants;
use crate::model::labelling::Labelling;
use crate::model::recipe::{FILE, ImageOrigin, Recipe};
use crate::model::record::{Keypoint, Record};
use crate::model::sample::Sample;
use crate::model::split::{Shares, Split};
use crate::read::checksum_record::{ChecksumRecord, write_files};
use crate::read::native;
use crate::read::set::Set;
use furrow_base::Result;
use furrow_base::math::ToInt;
use rayon::prelude::*;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Foreign images and labels to import.
pub trait Source: Sync {
    /// Returns the name of the format.
    fn name(&self) -> &'static str;

    /// Returns the images, sorted by split and name. Either all images have a split or none has.
    fn images(&self) -> &[SourceImage];

    /// Returns a text that determines the contents of the import: options, names and lengths of files. It contains no
    /// absolute path, so it is equal on all machines.
    fn words(&self) -> &str;

    /// Returns whether the images have near infrared: either all or none.
    fn has_nir(&self) -> bool {
        false
    }

    /// Returns warnings about the source as a whole.
    fn warnings(&self) -> &[String] {
        &[]
    }

    /// Reads the image at position `place` of [`Source::images`].
    fn read(&self, place: usize) -> Result<Labelled>;
}

/// An image of a source.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct SourceImage {
    /// Its split; `None` if the source has no splits.
    pub split: Option<Split>,
    /// Its name in the source.
    pub name: String,
}

/// An image with its labels, one value per pixel, as in a [`Sample`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Labelled {
    /// Width and height in pixels.
    pub size: (u32, u32),
    /// Colour, 8-bit sRGB.
    pub rgb: Vec<[u8; 3]>,
    /// Near infrared, 8 bits; empty if the source [has none](Source::has_nir).
    pub nir: Vec<u8>,
    /// Class, or [`crate::model::sample::IGNORE`].
    pub semantics: Vec<u8>,
    /// Number of the plant, 0 for none.
    pub plants: Vec<u32>,
    /// Number of the leaf on its plant, 0 for none.
    pub leaves: Vec<u16>,
    /// Keypoints (stem, base and tip) by plant and leaf; the stem belongs to leaf 0.
    pub points: BTreeMap<(u32, u16), [Option<Keypoint>; 3]>,
    /// Warnings about this image, one for each kind. A warning that counts something begins with the number.
    pub warnings: Vec<String>,
}

/// Settings of an import.
#[derive(Clone, Debug)]
pub struct ImportSettings {
    /// Shares of the splits, for a source without splits.
    pub split: Shares,
    /// Licence of the images, as free text.
    pub licence: String,
}

/// Imports a source into `folder`, or continues an interrupted import. Must be called inside a thread pool. `done` is
/// called with the index of each imported image; raising `stop` ends the import with an error. [`crate::make::finish`]
/// writes the files of the whole dataset afterwards.
pub fn import(
    folder: &Path,
    source: &dyn Source,
    order: &ImportSettings,
    done: &(dyn Fn(u64) + Sync),
    stop: &AtomicBool,
) -> Result<Set> {
    let there = AtomicUsize::new(0);
    // If there are several errors, returns that of the first image, whatever the number of threads.
    let each = |what: &(dyn Fn(u64) -> Result<()> + Sync)| {
        let fault = (0..source.images().len().to_u64()).into_par_iter().find_map_first(|index| {
            if stop.load(Ordering::Relaxed) {
                return Some(generate::interrupted(folder, there.load(Ordering::Relaxed), source.images().len()));
            }
            what(index).err()
        });
        fault.map_or(Ok(()), Err)
    };
    if !folder.join(FILE).exists() {
        refuse_full(folder)?;
        // Reads all images before writing, so that an error in any of them leaves no partial dataset in the way of the
        // corrected command.
        each(&|index| source.read(index.to_usize()).map(drop))?;
    }
    let set = begin(folder, source, order)?;
    each(&|index| {
        bring(&set, source, index)?;
        there.fetch_add(1, Ordering::Relaxed);
        done(index);
        Ok(())
    })?;
    Ok(set)
}

/// Creates the dataset with the recipe of the import, or opens the existing one.
fn begin(folder: &Path, source: &dyn Source, order: &ImportSettings) -> Result<Set> {
    let images = source.images();
    let mut counts = [0_u32; Split::ALL.len()];
    images.iter().filter_map(|i| i.split).for_each(|split| counts[split as usize] += 1);
    // With the number of images of each split as shares, the periodic pattern of splits covers all images exactly once.
    let split = if counts == [0; 3] { order.split } else { Shares(counts) };
    let recipe = Recipe {
        furrow: env!("CARGO_PKG_VERSION").into(),
        made: ImageOrigin::Imported {
            from: source.name().into(),
            source_sha256: hex::encode(Sha256::digest(source.words())),
            nir: Some(source.has_nir()),
        },
        count: images.len().to_u64(),
        split,
        formats: Vec::new(),
        labelling: Labelling::default(),
        pack: None,
        licence: order.licence.clone(),
        species: Vec::new(),
    };
    Ok(Set::new(folder, begin::begin(folder, recipe, &[], false)?))
}

/// Imports one image, unless it is complete.
fn bring(set: &Set, source: &dyn Source, index: u64) -> Result<()> {
    let Set { folder, recipe, .. } = set;
    let files = match task(set, index)? {
        Task::Done => return Ok(()),
        Task::Formats | Task::All => {
            let sample = sample(recipe, &source.images()[index.to_usize()], index, source.read(index.to_usize())?);
            invariants::check(recipe, &sample)?;
            let mut files = native::files(recipe, &sample, "")?;
            files.extend(generate::formatted(set, &sample)?);
            files
        }
    };
    write_files(folder, &files)?;
    ChecksumRecord::of(index, recipe, &files)?.write(folder)
}

/// Converts an image that was read into a [`Sample`].
fn sample(recipe: &Recipe, listed: &SourceImage, index: u64, read: Labelled) -> Sample {
    let (width, height) = read.size;
    let mut sample = Sample {
        record: Record {
            index,
            name: Set::name(index),
            source: Some(listed.name.clone()),
            split: recipe.split_of(index),
            capture: None,
            light: None,
            width,
            height,
            classes: Vec::new(),
            ignored: 0,
            plants: Vec::new(),
            conditions: None,
            canopy: None,
            exposure: None,
            sampling: None,
            quality: None,
            warnings: read.warnings,
        },
        rgb: read.rgb,
        nir: read.nir,
        semantics: read.semantics,
        species: Vec::new(),
        parts: Vec::new(),
        plants: read.plants,
        leaves: read.leaves,
        coverage: Vec::new(),
        depth: Vec::new(),
        normals: Vec::new(),
        jpeg: None,
        film: None,
    };
    (sample.record.classes, sample.record.ignored) = annotate::classes(&sample);
    let mut plants = annotate::plants(&sample);
    for plant in &mut plants {
        let points = |leaf: u16| read.points.get(&(plant.number, leaf)).copied().unwrap_or_default();
        plant.stem = points(0)[0];
        for leaf in &mut plant.leaves {
            [_, leaf.base, leaf.tip] = points(leaf.number);
        }
    }
    sample.record.plants = plants;
    sample
}
