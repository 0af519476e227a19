//! ExG threshold and component-size baselines: what a network must beat to have learned more than "green is a plant, and a large one is
//! the crop".
//!
//! A pixel is vegetation where its excess green index (ExG) is not below a threshold.
//!
//! - `otsu`: of chromatic coordinates (Woebbecke et al. 1995), with the threshold that Otsu 1979 finds in each image by itself. Where there is
//!   little green it finds two kinds of soil.
//! - `fitted`: the threshold at which green and the plants of the training images have the largest I/U, with whichever of two indices
//!   and of five blurs beforehand does best there. On dark images with artificial light chromatic coordinates do, for which noise must be
//!   blurred; under a bright sun plain differences do.
//!
//! What vegetation is classified as depends on the kind of baseline:
//!
//! - `exg`: crop;
//! - `exg-size`: crop in 8-connected components from one share of the image's pixels on, weed from a smaller share on, soil below it; both
//!   are those of the largest mean I/U on the training images. Shares carry over to the same view at another resolution.
//!
//! Classes are soil 0, crop 1, weed 2, and 255 in the truth no label.

pub mod files;
mod green;
mod size;

pub use green::Index;
pub use size::SizeRule;

use self::green::{LEVELS, begin, blurred, histogram, level, otsu};
use self::size::{CLASSES, CROP, SOIL, Sizes};
use crate::dataset::sample::IGNORE;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};

/// Standard deviations of the blur that are tried, as shares of the image's diagonal: none to six pixels of 1296 × 966.
const BLURS: [f64; 5] = [0.0, 0.0005, 0.001, 0.002, 0.004];

/// A kind of baseline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// ExG threshold: all vegetation is crop.
    Exg,
    /// ExG threshold and component size: large components are crop, small ones weed.
    ExgSize,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Exg, Self::ExgSize];

    /// Its name: `exg`, `exg-size`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Exg => "exg",
            Self::ExgSize => "exg-size",
        }
    }

    /// The kind of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }
}

/// Where the threshold comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Cut {
    /// From each image by itself.
    Otsu,
    /// From the training images.
    Fitted,
}

/// A training image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Example {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// 8-bit sRGB, row by row from the top.
    pub rgb: Vec<[u8; 3]>,
    /// Class of each pixel; 255 is no label.
    pub truth: Vec<u8>,
}

/// A fitted baseline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Baseline {
    /// Its kind.
    pub kind: Kind,
    /// What green is measured in.
    pub index: Index,
    /// Standard deviation of the blur before it, as a share of the image's diagonal.
    pub blur: f64,
    /// Excess green from which on a pixel is green; `None` where each image gives its own.
    pub threshold: Option<f64>,
    /// Which green regions are what; `None` where all are crop.
    pub sizes: Option<SizeRule>,
}

impl Baseline {
    /// Fits a baseline. `images` gives the training images anew each time it is asked, which is at most twice, so that none need stay in
    /// memory; a baseline that has nothing to learn does not ask.
    pub fn fit<I: IntoIterator<Item = Result<Example>>>(kind: Kind, cut: Cut, images: impl Fn() -> I) -> Result<Self> {
        let colour = match cut {
            Cut::Otsu => Self { kind, index: Index::Chromatic, blur: 0.0, threshold: None, sizes: None },
            Cut::Fitted => Self::fit_colour(kind, images())?,
        };
        let sizes = match kind {
            Kind::Exg => None,
            Kind::ExgSize => Some(colour.fit_sizes(images())?),
        };
        Ok(Self { sizes, ..colour })
    }

    /// Classes of an image's pixels, row by row.
    pub fn predict(&self, width: u32, height: u32, rgb: &[[u8; 3]]) -> Vec<u8> {
        let green = self.green(width, height, rgb);
        match &self.sizes {
            Some(rule) => rule.classes(width, height, &green),
            None => green.into_iter().map(|green| if green { CROP } else { SOIL }).collect(),
        }
    }

    /// Which pixels are green.
    fn green(&self, width: u32, height: u32, rgb: &[[u8; 3]]) -> Vec<bool> {
        let levels = levels(self.index, &smooth(width, height, rgb, self.blur));
        let first = self.threshold.map_or_else(|| otsu(&histogram(&levels)), level);
        levels.into_iter().map(|level| level >= first).collect()
    }

    /// The index, blur and threshold that separate plants and soil of the training set best.
    fn fit_colour(kind: Kind, images: impl IntoIterator<Item = Result<Example>>) -> Result<Self> {
        let ways: Vec<(f64, Index)> = BLURS.iter().flat_map(|blur| Index::ALL.map(|index| (*blur, index))).collect();
        // Of each way, the levels of soil and of plants.
        let mut counts = vec![[vec![0_u64; LEVELS], vec![0_u64; LEVELS]]; ways.len()];
        for image in images {
            let image = image?;
            check(&image)?;
            for (ways, counts) in ways.chunks_exact(Index::ALL.len()).zip(counts.chunks_exact_mut(Index::ALL.len())) {
                let colours = smooth(image.width, image.height, &image.rgb, ways[0].0);
                for ((_, index), counts) in ways.iter().zip(counts) {
                    let levels = levels(*index, &colours);
                    for (level, truth) in levels.iter().zip(&image.truth).filter(|(_, truth)| **truth != IGNORE) {
                        counts[usize::from(*truth != SOIL)][*level] += 1;
                    }
                }
            }
        }
        let found = ways.iter().zip(&counts).filter_map(|(way, [soil, plants])| Some((way, threshold(soil, plants)?)));
        let best = found.reduce(|a, b| if b.1.0 > a.1.0 { b } else { a });
        let ((blur, index), (_, level)) = best.ok_or_else(|| {
            Error::input("no pixel of the training images is a plant: what is green cannot be fitted, but Otsu's threshold needs no training")
        })?;
        Ok(Self { kind, index: *index, blur: *blur, threshold: Some(begin(level)), sizes: None })
    }

    fn fit_sizes(&self, images: impl IntoIterator<Item = Result<Example>>) -> Result<SizeRule> {
        let (mut sizes, mut any) = (Sizes::new(), false);
        for image in images {
            let image = image?;
            check(&image)?;
            sizes.add(image.width, image.height, &self.green(image.width, image.height, &image.rgb), &image.truth);
            any = true;
        }
        if any { Ok(sizes.best()) } else { Err(Error::input("there is no image to learn sizes of plants from")) }
    }
}

/// The colours of an image, blurred by a share of its diagonal.
fn smooth(width: u32, height: u32, rgb: &[[u8; 3]], blur: f64) -> Vec<[f32; 3]> {
    blurred(width as usize, height as usize, rgb, blur * f64::from(width).hypot(f64::from(height)))
}

fn levels(index: Index, colours: &[[f32; 3]]) -> Vec<usize> {
    colours.iter().map(|colour| level(f64::from(index.of(*colour)))).collect()
}

/// The largest I/U of green and plants, and the level from which on a pixel is green; the lowest of equals. `None` without plants.
fn threshold(soil: &[u64], plants: &[u64]) -> Option<(f64, usize)> {
    let all: u64 = plants.iter().sum();
    let (mut hit, mut wrong) = (0, 0);
    let mut best = None;
    for level in (0..LEVELS).rev() {
        hit += plants[level];
        wrong += soil[level];
        let iou = hit as f64 / (all + wrong) as f64;
        if all > 0 && best.is_none_or(|(most, _)| iou >= most) {
            best = Some((iou, level));
        }
    }
    best
}

/// A training image of as many pixels as it says, of the three classes.
fn check(image: &Example) -> Result<()> {
    let n = image.width as usize * image.height as usize;
    if image.rgb.len() != n || image.truth.len() != n {
        let (rgb, truth) = (image.rgb.len(), image.truth.len());
        return Err(Error::misuse(format!(
            "a training image of {} × {} pixels has {rgb} colours and {truth} labels",
            image.width, image.height
        )));
    }
    match image.truth.iter().find(|class| **class != IGNORE && usize::from(**class) >= CLASSES) {
        Some(class) => Err(Error::misuse(format!(
            "a training image has the class {class}; colour baselines know soil 0, crop 1, weed 2, and 255 for no label"
        ))),
        None => Ok(()),
    }
}
