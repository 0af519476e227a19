//! Comparison of two paths: finds pairs and measures them.

use super::display_pair::{DisplayPair, worst};
use super::figures::{Compared, figures, maps};
use super::flip::PIXELS_PER_DEGREE;
use super::pairs::{Pair, Pairs};
use super::raster_image::{RasterImage, read_labels};
use super::summary::{Summary, summaries};
use furrow_base::{Error, Result};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Options of a comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// File or folder of labels; by default those next to the reference.
    pub labels: Option<PathBuf>,
    /// Pixels per degree of visual angle, which FLIP assumes for the viewer.
    pub pixels_per_degree: f32,
    /// Number of pairs kept for display, those with the largest FLIP; 0 to compute numbers only.
    pub shown: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { labels: None, pixels_per_degree: PIXELS_PER_DEGREE, shown: 12 }
    }
}

/// Measured pairs of two images or folders.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// The pairs that were found.
    pub found: Pairs,
    /// Pixels per degree of visual angle.
    pub pixels_per_degree: f32,
    /// Measured pairs, by name.
    pub pairs: Vec<Compared>,
    /// Means over the pairs, for each band and region.
    pub means: Vec<Summary>,
    /// Pairs for display, by decreasing FLIP.
    pub display_pairs: Vec<DisplayPair>,
}

/// Compares `b` with the reference `a`: two images, or two folders whose images are paired by name.
pub fn folders(a: &Path, b: &Path, options: &Options) -> Result<Comparison> {
    Comparison::of(Pairs::find(a, b, options.labels.as_deref())?, options, &|| ())
}

impl Comparison {
    /// Measures the pairs; `done` is called after each. Returns an error before the first measurement if sizes differ.
    pub fn of(found: Pairs, options: &Options, done: &(dyn Fn() + Sync)) -> Result<Self> {
        for pair in &found.pairs {
            check(pair, &found)?;
        }
        let shown = options.shown.min(found.pairs.len());
        let mut compared = Vec::with_capacity(found.pairs.len());
        let mut display_pairs = Vec::new();
        // One pair per thread at a time, so that few images for display are in memory.
        for some in found.pairs.chunks(rayon::current_num_threads()) {
            let measured = some.par_iter().map(|pair| {
                let measured = measure(pair, options.pixels_per_degree, shown);
                done();
                measured
            });
            // If several pairs fail, the first one by name is reported.
            for measured in measured.collect::<Vec<Result<_>>>() {
                let (pair, display_pair) = measured?;
                compared.push(pair);
                display_pairs.extend(display_pair);
            }
            worst(&mut display_pairs, shown);
        }
        let means = summaries(&compared);
        Ok(Self { found, pixels_per_degree: options.pixels_per_degree, pairs: compared, means, display_pairs })
    }
}

/// Checks that both images can be read and have the same size.
fn check(pair: &Pair, found: &Pairs) -> Result<()> {
    let (a, b) = (furrow_output::photo_size(&pair.a)?, furrow_output::photo_size(&pair.b)?);
    if a == b {
        return Ok(());
    }
    Err(Error::input(format!(
        "{} has {} × {} pixels in {}, {} × {} in {}",
        pair.name, a.0, a.1, found.a, b.0, b.1, found.b
    ))
    .help("images are compared pixel by pixel; render both at one --width, or resize one"))
}

/// Measures a pair. If `shown`, the number of pairs on the page, is not 0, the images for the page are returned as
/// well.
fn measure(pair: &Pair, pixels_per_degree: f32, shown: usize) -> Result<(Compared, Option<DisplayPair>)> {
    let nir = pair.nir.as_ref();
    let a = RasterImage::read(&pair.a, nir.map(|(a, _)| a.as_path()))?;
    let b = RasterImage::read(&pair.b, nir.map(|(_, b)| b.as_path()))?;
    let labels = pair.labels.as_ref().map(|path| read_labels(path, a.size())).transpose()?;
    let maps = maps(&a, &b, pixels_per_degree)?;
    let figures = figures(&a, &b, labels.as_deref(), &maps)?;
    let display_pair =
        (shown > 0).then(|| DisplayPair::take(&pair.name, (&a, &b), &maps, &figures, shown)).transpose()?;
    Ok((Compared { name: pair.name.clone(), width: a.width, height: a.height, figures }, display_pair))
}
