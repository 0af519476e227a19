//! Comparison of two folders: from images to distances.

use super::feature::{Feature, Pool, Samples};
use super::known::SetRecords;
use super::pixel::{PixelSizes, coarsen, coarser_size};
use super::source::{Photo, photos, warnings};
use super::window::Window;
use super::{frequency, measure, sampling, wasserstein};
use crate::pairs;
use furrow_base::Result;
use furrow_base::sampling::rng::{Purpose, Stream};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;

/// Ratio above which a distance is a gap.
pub const LARGE: f64 = 2.0;
/// Number of random splits of the real set into halves.
const HALVES: u64 = 32;

/// Options of the comparison of two sets.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Number of images per set shown on the page; 0 to compute numbers only.
    pub shown: usize,
    /// Side of a real image's pixel on the ground, millimetres; by default from its records.
    pub pixel_mm: Option<f64>,
}

impl Default for Options {
    fn default() -> Self {
        Self { shown: 12, pixel_mm: None }
    }
}

/// Measured set of images.
#[derive(Clone, Debug, PartialEq)]
pub struct Set {
    /// The end of its path, long enough to distinguish it from the other set.
    pub name: String,
    /// Images of the set.
    pub photos: Vec<Photo>,
    /// Combined measurements by feature.
    pub pools: BTreeMap<Feature, Pool>,
    /// Images shown on the page.
    pub windows: Vec<Window>,
}

/// Distance of the sets in one feature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// Measured feature.
    pub feature: Feature,
    /// Distance in the feature's unit.
    pub distance: f64,
    /// Median distance of two halves of the real set; `None` if no split has the feature in both.
    pub halves: Option<f64>,
}

impl Distance {
    /// Returns the distance divided by that of halves: infinite if halves do not differ but the sets do, `None` if
    /// neither do.
    pub fn ratio(&self) -> Option<f64> {
        let ratio = self.distance / self.halves?;
        (!ratio.is_nan()).then_some(ratio)
    }

    /// Returns `true` if the distance is more than twice that of halves.
    pub fn is_large(&self) -> bool {
        self.ratio().is_some_and(|ratio| ratio > LARGE)
    }
}

/// Real and synthetic set with their distances.
#[derive(Clone, Debug, PartialEq)]
pub struct Gap {
    /// Real set.
    pub real: Set,
    /// Synthetic set.
    pub synthetic: Set,
    /// Ground size of a pixel of each set; if both are known, the finer set was downscaled to the other.
    pub pixels: PixelSizes,
    /// Side of the tiles for spectra, pixels; `None` if images are too small.
    pub tile: Option<usize>,
    /// Distances of all features that both sets have.
    pub distances: Vec<Distance>,
    /// Warnings about omitted or limited comparisons, one sentence each.
    pub warnings: Vec<String>,
}

impl Gap {
    /// Compares the images of two folders. `start` receives their number, `done` is called after each.
    pub fn of(
        real: &Path,
        synthetic: &Path,
        options: &Options,
        start: &dyn Fn(usize),
        done: &(dyn Fn() + Sync),
    ) -> Result<Self> {
        let (name, other) = pairs::names(real, synthetic);
        let (real, synthetic) = (photos(real, "--real")?, photos(synthetic, "--synthetic")?);
        let known = [SetRecords::of(&real)?, SetRecords::of(&synthetic)?];
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
            warned.push(format!("images with fewer than {} pixels on a side have no spectrum", frequency::TILES.1));
        }
        let [take_real, take_synthetic] = factors.map(|factor| MeasureSettings { factor, tile, shown: options.shown });
        let (of_real, real) = set(name, real, &take_real, done)?;
        let (_, synthetic) = set(other, synthetic, &take_synthetic, done)?;
        warned.extend(noisy(&known[1], &real, &synthetic, factors[1]));
        if of_real.len() < 2 {
            warned.push("a single real image has no halves: there are distances but no ratios".into());
        }
        let halves = halves(&of_real);
        let distances = Feature::all().into_iter().filter_map(|feature| {
            let distance = real.pools.get(&feature)?.distance(synthetic.pools.get(&feature)?);
            Some(Distance { feature, distance, halves: halves.get(&feature).copied() })
        });
        let distances = distances.collect();
        Ok(Self { real, synthetic, pixels, tile, distances, warnings: warned })
    }

    /// Returns the distance in a feature; `None` if one of the sets lacks it.
    pub fn distance(&self, feature: Feature) -> Option<&Distance> {
        self.distances.iter().find(|distance| distance.feature == feature)
    }
}

/// Returns a warning if the sets cannot be downscaled to the same pixel size.
fn unknown(pixels: &PixelSizes) -> Option<String> {
    let what = match (pixels.real_mm, pixels.synthetic_mm) {
        (None, _) => "the ground size of a pixel of --real is unknown: set it with --pixel-mm",
        (Some(_), None) => {
            "the ground size of a pixel of --synthetic is unknown: it has no records of cameras that look down"
        }
        (Some(_), Some(_)) => return None,
    };
    Some(format!("{what}; images are compared at their own resolution"))
}

/// Returns a warning if the sampling noise of the synthetic images is significant, or unknown.
fn noisy(known: &SetRecords, real: &Set, synthetic: &Set, factor: f64) -> Option<String> {
    let values = |set: &Set, feature| match set.pools.get(&feature) {
        Some(Pool::Values(values)) => wasserstein::median(values.clone()),
        _ => None,
    };
    let Some((spp, error)) = known.sampling else {
        return known.rendered.then(|| {
            "the sampling noise of --synthetic is unknown: it was denoised, or its records do not state it".into()
        });
    };
    let luminance = values(synthetic, Feature::Exposure)?.exp2();
    sampling::warning(spp, sampling::levels(luminance, error, factor), values(real, Feature::Noise)?)
}

/// Returns warnings about data that only one of the sets has.
fn one_sided(real: &[Photo], synthetic: &[Photo]) -> Vec<String> {
    let missing = |what: &str, lost: &str, has: &dyn Fn(&Photo) -> bool| {
        let set = match (real.iter().any(has), synthetic.iter().any(has)) {
            (true, false) => "--synthetic",
            (false, true) => "--real",
            _ => return None,
        };
        Some(format!("{set} has no {what}: {lost}"))
    };
    let labels = missing("labels", "classes, cover and blobs are not compared", &|photo| photo.has_labels());
    let infrared = missing("near infrared", "NDVI is not compared", &|photo| photo.has_nir());
    labels.into_iter().chain(infrared).collect()
}

/// Settings for measuring a set.
struct MeasureSettings {
    /// Downscaling factor along each axis.
    factor: f64,
    tile: Option<usize>,
    shown: usize,
}

/// Measures every image of a set.
fn set(
    name: String,
    photos: Vec<Photo>,
    take: &MeasureSettings,
    done: &(dyn Fn() + Sync),
) -> Result<(Vec<Samples>, Set)> {
    let shown = take.shown.min(photos.len());
    // Evenly distributed over the names: the middle one of each part.
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
    // If several images fail, the first one by name is reported.
    for measured in measured.collect::<Vec<Result<_>>>() {
        let (samples, window) = measured?;
        all.push(samples);
        windows.extend(window);
    }
    let pools = pools(&all.iter());
    Ok((all, Set { name, photos, pools, windows }))
}

/// Combines the measurements of several images.
fn pools<'a>(pictures: &(impl Iterator<Item = &'a Samples> + Clone)) -> BTreeMap<Feature, Pool> {
    let pool = |feature| Some((feature, Pool::of(pictures.clone().filter_map(|samples| samples.get(&feature)))?));
    Feature::all().into_iter().filter_map(pool).collect()
}

/// Returns the median distance of random halves for each feature, always with the same splits. For an odd number one
/// half has one image more.
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
