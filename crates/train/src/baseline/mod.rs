//! Baselines that use an ExG threshold and component sizes. A network must beat them to have learned more than "green pixels are
//! plants, and large plants are crop".
//!
//! A pixel is vegetation if its excess green index (ExG) is at least a threshold. There are two ways to choose it:
//!
//! - `otsu`: ExG of chromatic coordinates (Woebbecke et al. 1995), with Otsu's threshold (Otsu 1979) of each image. With little green
//!   in the image it separates two kinds of soil.
//! - `fitted`: the threshold, one of two ExG indices and one of five blur radii that together maximize the I/U of vegetation on the
//!   training images. Chromatic coordinates suit dark images with artificial light, whose noise must be blurred; plain differences
//!   suit bright sunlight.
//!
//! The class of a vegetation pixel depends on the kind of baseline:
//!
//! - `exg`: crop;
//! - `exg-size`: by the area of its 8-connected component, as a fraction of the image. Large components are crop, smaller ones weed,
//!   the smallest soil. The two area thresholds maximize the mean I/U on the training images. As fractions of the image they carry
//!   over to the same view at another resolution.
//!
//! Classes are 0 soil, 1 crop and 2 weed; 255 in the ground truth is no label.

pub mod files;
mod green;
mod size;

pub use green::Index;
pub use size::SizeRule;

use self::green::{LEVELS, begin, blurred, histogram, level, otsu};
use self::size::{CLASSES, CROP, SOIL, Sizes};
use furrow_base::math::{ToFloat, ToInt};
use furrow_base::{Error, Result};
use furrow_dataset::model::sample::IGNORE;
use serde::{Deserialize, Serialize};

/// Candidate standard deviations of the blur, as fractions of the image diagonal: 0 to 6 pixels at 1296 × 966.
const BLURS: [f64; 5] = [0.0, 0.0005, 0.001, 0.002, 0.004];

/// Kind of baseline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// ExG threshold: all vegetation is crop.
    Exg,
    /// ExG threshold and component size: large components are crop, small ones weed.
    ExgSize,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 2] = [Self::Exg, Self::ExgSize];

    /// Returns the name: `exg` or `exg-size`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Exg => "exg",
            Self::ExgSize => "exg-size",
        }
    }

    /// Returns the kind with this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }
}

/// Source of the ExG threshold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Cut {
    /// Otsu's threshold of each image.
    Otsu,
    /// Fitted to the training images.
    Fitted,
}

/// Training image of a baseline.
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

/// Fitted baseline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Baseline {
    /// Kind of baseline.
    pub kind: Kind,
    /// Excess green index.
    pub index: Index,
    /// Standard deviation of the blur applied before the index, as a fraction of the image diagonal.
    pub blur: f64,
    /// Minimum excess green of vegetation; `None` for Otsu's threshold of each image.
    pub threshold: Option<f64>,
    /// Rule that classifies green regions by area; `None` if all are crop.
    pub sizes: Option<SizeRule>,
}

impl Baseline {
    /// Fits a baseline. `images` returns an iterator over the training images; it is called at most twice, so that the images need
    /// not stay in memory, and not at all for `exg` with Otsu's threshold. Fails if no training pixel is a plant (fitted threshold)
    /// or if there are no images (component sizes).
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

    /// Predicts the class of each pixel of an image, row by row.
    pub fn predict(&self, width: u32, height: u32, rgb: &[[u8; 3]]) -> Vec<u8> {
        let green = self.green(width, height, rgb);
        match &self.sizes {
            Some(rule) => rule.classes(width, height, &green),
            None => green.into_iter().map(|green| if green { CROP } else { SOIL }).collect(),
        }
    }

    /// Returns the vegetation mask of an image.
    fn green(&self, width: u32, height: u32, rgb: &[[u8; 3]]) -> Vec<bool> {
        let levels = levels(self.index, &smooth(width, height, rgb, self.blur));
        let first = self.threshold.map_or_else(|| otsu(&histogram(&levels)), level);
        levels.into_iter().map(|level| level >= first).collect()
    }

    /// Fits the index, blur and threshold that separate plants from soil in the training set best.
    fn fit_colour(kind: Kind, images: impl IntoIterator<Item = Result<Example>>) -> Result<Self> {
        let ways: Vec<(f64, Index)> = BLURS.iter().flat_map(|blur| Index::ALL.map(|index| (*blur, index))).collect();
        // For each (blur, index) pair, histograms of the ExG levels of soil and of plants.
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
            Error::input("no pixel of the training images is a plant: the ExG threshold cannot be fitted; Otsu's threshold needs no training")
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
        if any { Ok(sizes.best()) } else { Err(Error::input("there is no training image to fit plant sizes to")) }
    }
}

/// Blurs the colours of an image; `blur` is the standard deviation as a fraction of the image diagonal.
fn smooth(width: u32, height: u32, rgb: &[[u8; 3]], blur: f64) -> Vec<[f32; 3]> {
    blurred(width.to_usize(), height.to_usize(), rgb, blur * f64::from(width).hypot(f64::from(height)))
}

fn levels(index: Index, colours: &[[f32; 3]]) -> Vec<usize> {
    colours.iter().map(|colour| level(f64::from(index.of(*colour)))).collect()
}

/// Returns the largest I/U of vegetation and plants, and the threshold level that reaches it, the lowest of equals. The arguments are
/// histograms of the levels of soil and plants. Returns `None` without plants.
fn threshold(soil: &[u64], plants: &[u64]) -> Option<(f64, usize)> {
    let all: u64 = plants.iter().sum();
    let (mut hit, mut wrong) = (0, 0);
    let mut best = None;
    for level in (0..LEVELS).rev() {
        hit += plants[level];
        wrong += soil[level];
        let iou = hit.to_f64() / (all + wrong).to_f64();
        if all > 0 && best.is_none_or(|(most, _)| iou >= most) {
            best = Some((iou, level));
        }
    }
    best
}

/// Checks that a training image has the number of pixels of its size and only the three classes.
fn check(image: &Example) -> Result<()> {
    let n = image.width.to_usize() * image.height.to_usize();
    if image.rgb.len() != n || image.truth.len() != n {
        let (rgb, truth) = (image.rgb.len(), image.truth.len());
        return Err(Error::misuse(format!(
            "a training image of {} × {} pixels has {rgb} colours and {truth} labels",
            image.width, image.height
        )));
    }
    match image.truth.iter().find(|class| **class != IGNORE && usize::from(**class) >= CLASSES) {
        Some(class) => Err(Error::misuse(format!(
            "a training image has the class {class}; baselines support 0 soil, 1 crop, 2 weed and 255 for no label"
        ))),
        None => Ok(()),
    }
}
