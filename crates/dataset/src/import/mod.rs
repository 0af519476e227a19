//! Other people's images and labels as a dataset of ours, so that real sets enter training and comparison by the same door.
//!
//! A source lists its images and reads one of them; everything else is the same for all: images are numbered in the order of their
//! splits and names, written and sealed one by one, and an interrupted import is gone on with by the same call. What a source does
//! not know (coverage, depth, what is hidden) is left out rather than made up.
//!
//! | file | idea |
//! |---|---|
//! | `classes` | which numbers, colours or names mean crop and weed |
//! | `files` | which files belong together |
//! | `instances` | plants and leaves that agree with the classes |
//! | `masks`, `phenobench`, `coco` | one source each |

pub mod classes;
pub mod coco;
mod files;
mod instances;
pub mod masks;
pub mod phenobench;

use crate::make::begin::{self, refuse_full};
use crate::make::generate;
use crate::model::annotate;
use crate::model::invariants;
use crate::model::labelling::Labelling;
use crate::model::recipe::{FILE, Made, Recipe};
use crate::model::record::{Keypoint, Record};
use crate::model::sample::Sample;
use crate::model::split::{Shares, Split};
use crate::read::checksum_record::{ChecksumRecord, write_files};
use crate::read::native;
use crate::read::set::Set;
use crate::read::task::{Task, task};
use furrow_base::Result;
use rayon::prelude::*;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Images and labels that lie elsewhere.
pub trait Source: Sync {
    /// The format's name.
    fn name(&self) -> &'static str;

    /// The images, sorted by split and name; all have a split or none has.
    fn images(&self) -> &[Listed];

    /// Everything that decides what is read, in words: options, names, lengths of files. No path of a machine.
    fn words(&self) -> &str;

    /// Whether its images have near infrared: all of them or none.
    fn has_nir(&self) -> bool {
        false
    }

    /// What the user should know of the source as a whole.
    fn warnings(&self) -> &[String] {
        &[]
    }

    /// Reads the image at a place of the list.
    fn read(&self, place: usize) -> Result<Labelled>;
}

/// An image of a source.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Listed {
    /// Its split, where the source has splits.
    pub split: Option<Split>,
    /// Its name in the source.
    pub name: String,
}

/// An image with its labels, one value a pixel, as in a [`Sample`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Labelled {
    /// Pixels across and down.
    pub size: (u32, u32),
    /// 8-bit sRGB.
    pub rgb: Vec<[u8; 3]>,
    /// Near infrared; empty where the source [has none](Source::has_nir).
    pub nir: Vec<u8>,
    /// Class, or [`crate::model::sample::IGNORE`].
    pub semantics: Vec<u8>,
    /// Number of the plant, 0 for none.
    pub plants: Vec<u32>,
    /// Number of the leaf on its plant, 0 for none.
    pub leaves: Vec<u16>,
    /// Stem of a plant (leaf 0), base and tip of a leaf: by plant and leaf.
    pub points: BTreeMap<(u32, u16), [Option<Keypoint>; 3]>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// How a source is brought in.
#[derive(Clone, Debug)]
pub struct Order {
    /// Splits for a source that has none.
    pub split: Shares,
    /// What others may do with the images.
    pub licence: String,
}

/// Brings a source in, or goes on with it. Call it inside a pool; `done` is told of every image. The lists of all images are
/// [`crate::make::finish`]'s.
pub fn import(
    folder: &Path,
    source: &dyn Source,
    order: &Order,
    done: &(dyn Fn(u64) + Sync),
    stop: &AtomicBool,
) -> Result<Set> {
    let there = AtomicUsize::new(0);
    // Of several faults the first image's is told, whatever the number of threads.
    let each = |what: &(dyn Fn(u64) -> Result<()> + Sync)| {
        let fault = (0..source.images().len() as u64).into_par_iter().find_map_first(|index| {
            if stop.load(Ordering::Relaxed) {
                return Some(generate::interrupted(folder, there.load(Ordering::Relaxed), source.images().len()));
            }
            what(index).err()
        });
        fault.map_or(Ok(()), Err)
    };
    if !folder.join(FILE).exists() {
        refuse_full(folder)?;
        // Twice the reading, but a fault in the last image leaves nothing behind that a better command would stumble over.
        each(&|index| source.read(index as usize).map(drop))?;
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

/// Writes the recipe, or finds it written.
fn begin(folder: &Path, source: &dyn Source, order: &Order) -> Result<Set> {
    let images = source.images();
    let mut counts = [0_u32; Split::ALL.len()];
    images.iter().filter_map(|i| i.split).for_each(|split| counts[split as usize] += 1);
    // As many for training as there are, then as many for validation: the pattern of splits goes once over all images.
    let split = if counts == [0; 3] { order.split } else { Shares(counts) };
    let recipe = Recipe {
        furrow: env!("CARGO_PKG_VERSION").into(),
        made: Made::Imported {
            from: source.name().into(),
            source_sha256: hex::encode(Sha256::digest(source.words())),
            nir: Some(source.has_nir()),
        },
        count: images.len() as u64,
        split,
        formats: Vec::new(),
        labelling: Labelling::default(),
        pack: None,
        licence: order.licence.clone(),
        species: Vec::new(),
    };
    Ok(Set::new(folder, begin::begin(folder, recipe, &[], false)?))
}

/// Brings in one image, where it is not there yet.
fn bring(set: &Set, source: &dyn Source, index: u64) -> Result<()> {
    let Set { folder, recipe, .. } = set;
    let files = match task(set, index)? {
        Task::Done => return Ok(()),
        Task::Formats | Task::All => {
            let sample = sample(recipe, &source.images()[index as usize], index, source.read(index as usize)?);
            invariants::check(recipe, &sample)?;
            let mut files = native::files(recipe, &sample, "")?;
            files.extend(generate::formatted(set, &sample)?);
            files
        }
    };
    write_files(folder, &files)?;
    ChecksumRecord::of(index, recipe, &files)?.write(folder)
}

/// What was read as a sample of ours.
fn sample(recipe: &Recipe, listed: &Listed, index: u64, read: Labelled) -> Sample {
    let (width, height) = read.size;
    let mut sample = Sample {
        record: Record {
            index,
            name: Set::name(index),
            source: Some(listed.name.clone()),
            split: recipe.split_of(index),
            capture: None,
            width,
            height,
            classes: Vec::new(),
            ignored: 0,
            plants: Vec::new(),
            conditions: None,
            canopy: None,
            exposure: None,
            sampling: None,
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
