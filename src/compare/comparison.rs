//! All of it: from two paths to figures.

use super::figures::{Compared, figures, maps};
use super::flip::PIXELS_PER_DEGREE;
use super::pairs::{Pair, Pairs};
use super::picture::{Picture, read_labels};
use super::shot::{Shot, worst};
use super::summary::{Summary, summaries};
use crate::{Error, Result, output};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// How pictures are compared.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// A file or folder of labels; those beside the reference unless given.
    pub labels: Option<PathBuf>,
    /// Pixels in a degree of the view of the eye that FLIP imagines.
    pub pixels_per_degree: f32,
    /// How many pairs are kept to be looked at, those of the largest FLIP; 0 where only numbers are wanted.
    pub shown: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { labels: None, pixels_per_degree: PIXELS_PER_DEGREE, shown: 12 }
    }
}

/// Every pair of two pictures or folders, measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// What was compared.
    pub found: Pairs,
    /// Pixels in a degree of view.
    pub pixels_per_degree: f32,
    /// The pairs, in the order of their names.
    pub pairs: Vec<Compared>,
    /// Means over the pairs, for each band and region.
    pub means: Vec<Summary>,
    /// The pairs to look at, the largest FLIP first.
    pub shots: Vec<Shot>,
}

/// Compares `b` with the reference `a`: two pictures, or two folders whose pictures are paired by name.
pub fn folders(a: &Path, b: &Path, options: &Options) -> Result<Comparison> {
    Comparison::of(Pairs::find(a, b, options.labels.as_deref())?, options, &|| ())
}

impl Comparison {
    /// Measures pairs that were found; `done` is called after each. An error before the first where sizes differ.
    pub fn of(found: Pairs, options: &Options, done: &(dyn Fn() + Sync)) -> Result<Self> {
        for pair in &found.pairs {
            check(pair, &found)?;
        }
        let shown = options.shown.min(found.pairs.len());
        let mut compared = Vec::with_capacity(found.pairs.len());
        let mut shots = Vec::new();
        // As many at a time as there are threads, so that pictures to look at are few in memory.
        for some in found.pairs.chunks(rayon::current_num_threads()) {
            let measured = some.par_iter().map(|pair| {
                let measured = measure(pair, options.pixels_per_degree, shown);
                done();
                measured
            });
            // Of several faults that of the first name is told.
            for measured in measured.collect::<Vec<Result<_>>>() {
                let (pair, shot) = measured?;
                compared.push(pair);
                shots.extend(shot);
            }
            worst(&mut shots, shown);
        }
        let means = summaries(&compared);
        Ok(Self { found, pixels_per_degree: options.pixels_per_degree, pairs: compared, means, shots })
    }
}

/// Both pictures can be read and have one size.
fn check(pair: &Pair, found: &Pairs) -> Result<()> {
    let (a, b) = (output::photo_size(&pair.a)?, output::photo_size(&pair.b)?);
    if a == b {
        return Ok(());
    }
    Err(Error::input(format!(
        "{} has {} × {} pixels in {}, {} × {} in {}",
        pair.name, a.0, a.1, found.a, b.0, b.1, found.b
    ))
    .help("pixels stand for each other; render both at one --width, or resize one"))
}

/// Measures a pair; with a picture of it for pages that show so many.
fn measure(pair: &Pair, pixels_per_degree: f32, shown: usize) -> Result<(Compared, Option<Shot>)> {
    let nir = pair.nir.as_ref();
    let a = Picture::read(&pair.a, nir.map(|(a, _)| a.as_path()))?;
    let b = Picture::read(&pair.b, nir.map(|(_, b)| b.as_path()))?;
    let labels = pair.labels.as_ref().map(|path| read_labels(path, a.size())).transpose()?;
    let maps = maps(&a, &b, pixels_per_degree)?;
    let figures = figures(&a, &b, labels.as_deref(), &maps)?;
    let shot = (shown > 0).then(|| Shot::take(&pair.name, (&a, &b), &maps, &figures, shown)).transpose()?;
    Ok((Compared { name: pair.name.clone(), width: a.width, height: a.height, figures }, shot))
}
