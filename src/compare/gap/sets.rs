//! All of it: from two folders to distances.

use super::feature::{Feature, Pool, Samples};
use super::known::Known;
use super::pixel::{PixelSizes, coarsen, coarser_size};
use super::source::{Photo, photos, warnings};
use super::window::Window;
use super::{frequency, measure, sampling, wasserstein};
use crate::Result;
use crate::compare::pairs;
use crate::sampling::rng::{Purpose, Stream};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;

/// A ratio above this is a gap.
pub const LARGE: f64 = 2.0;
/// How often the real set is cut into halves.
const HALVES: u64 = 32;

/// How sets are compared.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Pictures of each set that the page shows; 0 where only numbers are wanted.
    pub shown: usize,
    /// Side of a real picture's pixel on the ground, millimetres; what its records say unless given.
    pub pixel_mm: Option<f64>,
}

impl Default for Options {
    fn default() -> Self {
        Self { shown: 12, pixel_mm: None }
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
    /// How much ground a pixel of each set sees; the finer set was made as coarse as the other where both are known.
    pub pixels: PixelSizes,
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
        let known = [Known::of(&real)?, Known::of(&synthetic)?];
        let pixels = PixelSizes { real_mm: options.pixel_mm.or(known[0].pixel_mm), synthetic_mm: known[1].pixel_mm };
        let factors = pixels.factors();
        let mut least = u32::MAX;
        for (photos, factor) in [(&real, factors[0]), (&synthetic, factors[1])] {
            for photo in photos {
                let (width, height) = coarser_size(photo.size()?, factor);
                least = least.min(width).min(height);
            }
        }
        let tile = frequency::tile(least);
        start(real.len() + synthetic.len());
        let mut warned = [warnings("--real", &real), warnings("--synthetic", &synthetic)].concat();
        warned.extend(one_sided(&real, &synthetic));
        warned.extend(unknown(&pixels));
        if tile.is_none() {
            warned.push(format!("pictures of fewer than {} pixels a side have no spectrum", frequency::TILES.1));
        }
        let [take_real, take_synthetic] = factors.map(|factor| Take { factor, tile, shown: options.shown });
        let (of_real, real) = set(name, real, &take_real, done)?;
        let (_, synthetic) = set(other, synthetic, &take_synthetic, done)?;
        warned.extend(noisy(&known[1], &real, &synthetic, factors[1]));
        if of_real.len() < 2 {
            warned.push("a single real picture has no halves: there are distances but no ratios".into());
        }
        let halves = halves(&of_real);
        let distances = Feature::all().into_iter().filter_map(|feature| {
            let distance = real.pools.get(&feature)?.distance(synthetic.pools.get(&feature)?);
            Some(Distance { feature, distance, halves: halves.get(&feature).copied() })
        });
        let distances = distances.collect();
        Ok(Self { real, synthetic, pixels, tile, distances, warnings: warned })
    }

    /// How far the sets are in a feature; `None` where one has none of it.
    pub fn distance(&self, feature: Feature) -> Option<&Distance> {
        self.distances.iter().find(|distance| distance.feature == feature)
    }
}

/// A sentence where the sets cannot be brought to one pixel size.
fn unknown(pixels: &PixelSizes) -> Option<String> {
    let what = match (pixels.real_mm, pixels.synthetic_mm) {
        (None, _) => "how much ground a pixel of --real sees is not known: tell it by --pixel-mm",
        (Some(_), None) => {
            "how much ground a pixel of --synthetic sees is not known: it has no records of cameras that look down"
        }
        (Some(_), Some(_)) => return None,
    };
    Some(format!("{what}; pixels are compared as they are"))
}

/// A sentence where the synthetic pictures have so few samples that their noise counts, or where nobody knows.
fn noisy(known: &Known, real: &Set, synthetic: &Set, factor: f64) -> Option<String> {
    let values = |set: &Set, feature| match set.pools.get(&feature) {
        Some(Pool::Values(values)) => wasserstein::median(values.clone()),
        _ => None,
    };
    let Some((spp, error)) = known.sampling else {
        return known.rendered.then(|| {
            "how much sampling noise --synthetic has is not known: it was denoised, or its records do not tell".into()
        });
    };
    let luminance = values(synthetic, Feature::Exposure)?.exp2();
    sampling::warning(spp, sampling::levels(luminance, error, factor), values(real, Feature::Noise)?)
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
    let labels = missing("labels", "classes, cover and blobs are left out", &|photo| photo.has_labels());
    let infrared = missing("near infrared", "NDVI is left out", &|photo| photo.has_nir());
    labels.into_iter().chain(infrared).collect()
}

/// How the pictures of a set are taken.
struct Take {
    /// How many pixels become one, along each axis.
    factor: f64,
    tile: Option<usize>,
    shown: usize,
}

/// Measures every picture of a set.
fn set(name: String, photos: Vec<Photo>, take: &Take, done: &(dyn Fn() + Sync)) -> Result<(Vec<Samples>, Set)> {
    let shown = take.shown.min(photos.len());
    // Evenly over the names, the middle one of each part.
    let is_shown = |k: usize| (0..shown).any(|s| (2 * s + 1) * photos.len() / (2 * shown) == k);
    let measured = photos.par_iter().enumerate().map(|(k, photo)| {
        let (picture, labels) = photo.read()?;
        let (picture, labels) = coarsen(picture, labels, take.factor);
        let samples = measure::measure(&picture, labels.as_deref(), take.tile);
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
