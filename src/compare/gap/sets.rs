//! All of it: from two folders to distances.

use super::feature::{Feature, Pool, Samples};
use super::source::{Photo, photos, warnings};
use super::window::Window;
use super::{frequency, measure, wasserstein};
use crate::compare::{Picture, pairs, read_labels};
use crate::sampling::rng::{Purpose, Stream};
use crate::{Result, output};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;

/// A ratio above this is a gap.
pub const LARGE: f64 = 2.0;
/// How often the real set is cut into halves.
const HALVES: u64 = 32;

/// How sets are compared.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// Pictures of each set that the page shows; 0 where only numbers are wanted.
    pub shown: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { shown: 12 }
    }
}

/// One set of pictures, measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Set {
    /// As much of its path's end as tells it from the other.
    pub name: String,
    /// Its pictures.
    pub photos: Vec<Photo>,
    /// What they say together.
    pub pools: BTreeMap<Feature, Pool>,
    /// What the page shows of some.
    pub windows: Vec<Window>,
}

/// How far the sets are in one feature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// What was measured.
    pub feature: Feature,
    /// How far, in the feature's unit.
    pub distance: f64,
    /// Median distance of two halves of the real set; `None` where no cut has it in both.
    pub halves: Option<f64>,
}

impl Distance {
    /// Distance over that of halves; infinite where halves do not differ but the sets do, `None` where neither do.
    pub fn ratio(&self) -> Option<f64> {
        let ratio = self.distance / self.halves?;
        (!ratio.is_nan()).then_some(ratio)
    }

    /// Whether the sets are further apart than twice the halves.
    pub fn is_large(&self) -> bool {
        self.ratio().is_some_and(|ratio| ratio > LARGE)
    }
}

/// A real and a made-up set, and how far they are apart.
#[derive(Clone, Debug, PartialEq)]
pub struct Gap {
    /// The real set.
    pub real: Set,
    /// The other.
    pub synthetic: Set,
    /// Side of the tiles of spectra, pixels; `None` where pictures are too small for them.
    pub tile: Option<usize>,
    /// Each feature that both sets have.
    pub distances: Vec<Distance>,
    /// What was left out, one sentence each.
    pub warnings: Vec<String>,
}

impl Gap {
    /// Compares the pictures of two folders; `start` is told how many there are, `done` is called after each.
    pub fn of(
        real: &Path,
        synthetic: &Path,
        options: &Options,
        start: &dyn Fn(usize),
        done: &(dyn Fn() + Sync),
    ) -> Result<Self> {
        let (name, other) = pairs::names(real, synthetic);
        let (real, synthetic) = (photos(real, "--real")?, photos(synthetic, "--synthetic")?);
        let mut least = u32::MAX;
        for photo in real.iter().chain(&synthetic) {
            let (width, height) = output::photo_size(&photo.rgb)?;
            least = least.min(width).min(height);
        }
        let tile = frequency::tile(least);
        start(real.len() + synthetic.len());
        let mut warned = [warnings("--real", &real), warnings("--synthetic", &synthetic)].concat();
        warned.extend(one_sided(&real, &synthetic));
        if tile.is_none() {
            warned.push(format!("pictures of fewer than {} pixels a side have no spectrum", frequency::TILES.1));
        }
        let (of_real, real) = set(name, real, tile, options.shown, done)?;
        let (_, synthetic) = set(other, synthetic, tile, options.shown, done)?;
        if of_real.len() < 2 {
            warned.push("a single real picture has no halves: there are distances but no ratios".into());
        }
        let halves = halves(&of_real);
        let distances = Feature::all().into_iter().filter_map(|feature| {
            let distance = real.pools.get(&feature)?.distance(synthetic.pools.get(&feature)?);
            Some(Distance { feature, distance, halves: halves.get(&feature).copied() })
        });
        let distances = distances.collect();
        Ok(Self { real, synthetic, tile, distances, warnings: warned })
    }

    /// How far the sets are in a feature; `None` where one has none of it.
    pub fn distance(&self, feature: Feature) -> Option<&Distance> {
        self.distances.iter().find(|distance| distance.feature == feature)
    }
}

/// What only one of the sets has.
fn one_sided(real: &[Photo], synthetic: &[Photo]) -> Vec<String> {
    let missing = |what: &str, lost: &str, has: &dyn Fn(&Photo) -> bool| {
        let set = match (real.iter().any(has), synthetic.iter().any(has)) {
            (true, false) => "--synthetic",
            (false, true) => "--real",
            _ => return None,
        };
        Some(format!("{set} has no {what}: {lost}"))
    };
    let labels = missing("labels", "classes, cover and blobs are left out", &|photo| photo.labels.is_some());
    let infrared = missing("near infrared", "NDVI is left out", &|photo| photo.nir.is_some());
    labels.into_iter().chain(infrared).collect()
}

/// Measures every picture of a set.
fn set(
    name: String,
    photos: Vec<Photo>,
    tile: Option<usize>,
    shown: usize,
    done: &(dyn Fn() + Sync),
) -> Result<(Vec<Samples>, Set)> {
    let shown = shown.min(photos.len());
    // Evenly over the names, the middle one of each part.
    let is_shown = |k: usize| (0..shown).any(|s| (2 * s + 1) * photos.len() / (2 * shown) == k);
    let measured = photos.par_iter().enumerate().map(|(k, photo)| {
        let picture = Picture::read(&photo.rgb, photo.nir.as_deref())?;
        let labels = photo.labels.as_ref().map(|path| read_labels(path, picture.size())).transpose()?;
        let samples = measure::measure(&picture, labels.as_deref(), tile);
        let window = is_shown(k).then(|| Window::take(&photo.name, &picture, labels.as_deref())).transpose()?;
        done();
        Ok((samples, window))
    });
    let (mut all, mut windows) = (Vec::with_capacity(photos.len()), Vec::new());
    // Of several faults that of the first name is told.
    for measured in measured.collect::<Vec<Result<_>>>() {
        let (samples, window) = measured?;
        all.push(samples);
        windows.extend(window);
    }
    let pools = pools(&all.iter());
    Ok((all, Set { name, photos, pools, windows }))
}

/// What several pictures say together.
fn pools<'a>(pictures: &(impl Iterator<Item = &'a Samples> + Clone)) -> BTreeMap<Feature, Pool> {
    let pool = |feature| Some((feature, Pool::of(pictures.clone().filter_map(|samples| samples.get(&feature)))?));
    Feature::all().into_iter().filter_map(pool).collect()
}

/// Median distance of random halves, feature by feature; the same cuts each time. Of an odd number one half has one more.
fn halves(pictures: &[Samples]) -> BTreeMap<Feature, f64> {
    if pictures.len() < 2 {
        return BTreeMap::new();
    }
    let cut = |k: u64| {
        let mut stream = Stream::of(0, 1, Purpose::Resample, k);
        let mut order: Vec<usize> = (0..pictures.len()).collect();
        for end in (1..order.len()).rev() {
            order.swap(end, stream.index(end + 1));
        }
        let (left, right) = order.split_at(order.len() / 2);
        let [left, right] = [left, right].map(|places| pools(&places.iter().map(|k| &pictures[*k])));
        let distance = |(feature, pool): (&Feature, &Pool)| Some((*feature, pool.distance(right.get(feature)?)));
        left.iter().filter_map(distance).collect::<Vec<_>>()
    };
    let mut drawn: BTreeMap<Feature, Vec<f64>> = BTreeMap::new();
    for cut in (0..HALVES).into_par_iter().map(cut).collect::<Vec<_>>() {
        for (feature, distance) in cut {
            drawn.entry(feature).or_default().push(distance);
        }
    }
    drawn.into_iter().filter_map(|(feature, distances)| Some((feature, wasserstein::median(distances)?))).collect()
}
