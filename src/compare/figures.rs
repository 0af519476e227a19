//! One pair: maps of error, and their means over the picture and over each class.

use super::picture::Picture;
use super::{color, flip, ssim};
use crate::scene::tag::Class;
use crate::{Error, Result};
use serde::Serialize;

/// What of a picture is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Band {
    /// Its colours.
    Rgb,
    /// Near infrared.
    Nir,
}

/// Which pixels of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Region {
    /// All, those without a label too.
    All,
    /// Of the class soil.
    Soil,
    /// Of the class crop.
    Crop,
    /// Of the class weed.
    Weed,
    /// Crop and weed.
    Vegetation,
}

impl Region {
    /// All of them, in the order of tables.
    pub const ALL: [Self; 5] = [Self::All, Self::Soil, Self::Crop, Self::Weed, Self::Vegetation];

    /// Lower-case name.
    pub fn name(self) -> &'static str {
        match self {
            Self::All => "all",
            Self::Soil => Class::Soil.name(),
            Self::Crop => Class::Crop.name(),
            Self::Weed => Class::Weed.name(),
            Self::Vegetation => "vegetation",
        }
    }

    /// Whether pixels of this label are in it.
    pub(super) fn holds(self, label: u8) -> bool {
        let is = |class: Class| label == class as u8;
        match self {
            Self::All => true,
            Self::Soil => is(Class::Soil),
            Self::Crop => is(Class::Crop),
            Self::Weed => is(Class::Weed),
            Self::Vegetation => is(Class::Crop) || is(Class::Weed),
        }
    }
}

impl Band {
    /// Lower-case name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rgb => "rgb",
            Self::Nir => "nir",
        }
    }
}

/// Error of each pixel, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Maps {
    /// FLIP, 0 to 1.
    pub flip: Vec<f32>,
    /// SSIM of the luma around the pixel, −1 to 1.
    pub ssim: Vec<f32>,
    /// ΔE₀₀.
    pub ciede2000: Vec<f32>,
}

/// The measures of one band over one region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegionFigures {
    /// The band.
    pub band: Band,
    /// The region.
    pub region: Region,
    /// Its pixels.
    pub pixels: u64,
    /// Mean squared error of values from 0 to 1.
    pub mse: f64,
    /// Mean SSIM; `None` where no window of 11 × 11 pixels lies in the picture around a pixel of the region.
    pub ssim: Option<f64>,
    /// Mean FLIP; of colours alone.
    pub flip: Option<f64>,
    /// Mean ΔE₀₀; of colours alone.
    pub ciede2000: Option<f64>,
}

impl RegionFigures {
    /// Peak signal-to-noise ratio in dB; `None`, for infinity, where nothing differs.
    pub fn psnr_db(&self) -> Option<f64> {
        psnr_db(self.mse)
    }
}

/// PSNR in dB of an MSE of values from 0 to 1; `None` of 0.
pub(super) fn psnr_db(mse: f64) -> Option<f64> {
    (mse > 0.0).then(|| -10.0 * mse.log10())
}

/// The measures of a pair: the whole picture first, then its classes, then the same of near infrared. Regions without a pixel are left out.
#[derive(Clone, Debug, PartialEq)]
pub struct Figures {
    /// One for each band and region.
    pub rows: Vec<RegionFigures>,
}

impl Figures {
    /// Those of the whole picture in colour.
    pub fn all(&self) -> &RegionFigures {
        &self.rows[0]
    }

    /// Those of a band over a region; `None` where it has no pixel there, or is not known.
    pub fn of(&self, band: Band, region: Region) -> Option<&RegionFigures> {
        self.rows.iter().find(|row| (row.band, row.region) == (band, region))
    }
}

/// Compares `b` with the reference `a`. `labels` has the class of each pixel, as in `semantics.png`; near infrared is compared where both
/// have it. An error where sizes differ.
///
/// ```
/// use furrow::compare::{PIXELS_PER_DEGREE, Picture, pair};
/// let gray = |value| Picture { width: 16, height: 16, rgb: vec![[value; 3]; 256], nir: Vec::new() };
/// let figures = pair(&gray(100), &gray(151), None, PIXELS_PER_DEGREE)?;
/// assert!((figures.all().mse - 0.04).abs() < 1e-12);
/// # Ok::<(), furrow::Error>(())
/// ```
pub fn pair(a: &Picture, b: &Picture, labels: Option<&[u8]>, pixels_per_degree: f32) -> Result<Figures> {
    let maps = maps(a, b, pixels_per_degree)?;
    figures(a, b, labels, &maps)
}

/// The error of each pixel of `b`, seen by an eye with so many pixels to a degree. An error where sizes differ or no pixel is there.
pub fn maps(a: &Picture, b: &Picture, pixels_per_degree: f32) -> Result<Maps> {
    if a.size() != b.size() || a.rgb.is_empty() {
        return Err(Error::input(format!(
            "pictures of {} × {} and {} × {} pixels cannot be compared",
            a.width, a.height, b.width, b.height
        ))
        .help("pixels stand for each other, so sizes must be equal"));
    }
    let (flip, (ssim, ciede2000)) = rayon::join(
        || flip::map(a, b, pixels_per_degree),
        || {
            let luma = |of: &Picture| of.rgb.iter().map(|p| ssim::luma(*p)).collect::<Vec<f64>>();
            (ssim::map(a.width as usize, a.height as usize, &luma(a), &luma(b)), color::map(a, b))
        },
    );
    Ok(Maps { flip, ssim, ciede2000 })
}

/// Means of the maps, and what else is measured.
pub(super) fn figures(a: &Picture, b: &Picture, labels: Option<&[u8]>, maps: &Maps) -> Result<Figures> {
    if labels.is_some_and(|labels| labels.len() != a.rgb.len()) {
        return Err(Error::misuse("there must be a label for each pixel"));
    }
    let width = a.width as usize;
    let regions = if labels.is_some() { &Region::ALL[..] } else { &Region::ALL[..1] };
    let mut rows = Vec::new();
    let mut add = |band: Band, square: &dyn Fn(usize) -> f64, ssim: &[f32]| {
        for region in regions {
            let mut sums = Sums::default();
            for pixel in (0..a.rgb.len()).filter(|k| labels.is_none_or(|labels| region.holds(labels[*k]))) {
                sums.pixels += 1;
                sums.square += square(pixel);
                if ssim::is_whole(pixel % width, pixel / width, width, a.height as usize) {
                    sums.whole += 1;
                    sums.ssim += f64::from(ssim[pixel]);
                }
                if band == Band::Rgb {
                    sums.flip += f64::from(maps.flip[pixel]);
                    sums.ciede2000 += f64::from(maps.ciede2000[pixel]);
                }
            }
            rows.extend(sums.row(band, *region));
        }
    };
    let colors = |k: usize| a.rgb[k].into_iter().zip(b.rgb[k]).map(|(a, b)| squared(a, b)).sum::<f64>() / 3.0;
    add(Band::Rgb, &colors, &maps.ssim);
    if !a.nir.is_empty() && a.nir.len() == b.nir.len() {
        let gray = |of: &Picture| of.nir.iter().map(|v| f64::from(*v) / 255.0).collect::<Vec<f64>>();
        let ssim = ssim::map(width, a.height as usize, &gray(a), &gray(b));
        add(Band::Nir, &|k| squared(a.nir[k], b.nir[k]), &ssim);
    }
    Ok(Figures { rows })
}

/// Squared difference of two values as parts of white.
fn squared(a: u8, b: u8) -> f64 {
    let d = f64::from(a.abs_diff(b)) / 255.0;
    d * d
}

/// What a region's pixels add up to.
#[derive(Default)]
struct Sums {
    pixels: u64,
    square: f64,
    /// Pixels whose window lies in the picture.
    whole: u64,
    ssim: f64,
    flip: f64,
    ciede2000: f64,
}

impl Sums {
    fn row(&self, band: Band, region: Region) -> Option<RegionFigures> {
        let n = self.pixels as f64;
        let colors = |sum: f64| (band == Band::Rgb).then_some(sum / n);
        (self.pixels > 0).then(|| RegionFigures {
            band,
            region,
            pixels: self.pixels,
            mse: self.square / n,
            ssim: (self.whole > 0).then(|| self.ssim / self.whole as f64),
            flip: colors(self.flip),
            ciede2000: colors(self.ciede2000),
        })
    }
}

/// One pair, measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Compared {
    /// What both pictures are called.
    pub name: String,
    /// Width of both in pixels.
    pub width: u32,
    /// Height of both in pixels.
    pub height: u32,
    /// The measures.
    pub figures: Figures,
}
