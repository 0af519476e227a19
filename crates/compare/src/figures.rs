//! Measures of one pair: error maps, and their means over the image and each class.

use super::raster_image::RasterImage;
use super::{color, flip, ssim};
use furrow_base::math::{ToFloat, ToInt};
use furrow_base::{Error, Result};
use furrow_render::scene::tag::Class;
use serde::Serialize;

/// Compared band of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Band {
    /// Colour.
    Rgb,
    /// Near infrared.
    Nir,
}

/// Set of pixels in an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Region {
    /// All pixels, including those without a label.
    All,
    /// Pixels of the class soil.
    Soil,
    /// Pixels of the class crop.
    Crop,
    /// Pixels of the class weed.
    Weed,
    /// Pixels of the classes crop and weed.
    Vegetation,
}

impl Region {
    /// All regions, in the order of tables.
    pub const ALL: [Self; 5] = [Self::All, Self::Soil, Self::Crop, Self::Weed, Self::Vegetation];

    /// Returns the lower-case name.
    pub fn name(self) -> &'static str {
        match self {
            Self::All => "all",
            Self::Soil => Class::Soil.name(),
            Self::Crop => Class::Crop.name(),
            Self::Weed => Class::Weed.name(),
            Self::Vegetation => "vegetation",
        }
    }

    /// Returns `true` if pixels with this label belong to the region.
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
    /// Returns the lower-case name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rgb => "rgb",
            Self::Nir => "nir",
        }
    }
}

/// Error maps: one value per pixel, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Maps {
    /// FLIP, 0 to 1.
    pub flip: Vec<f32>,
    /// SSIM of the luma around the pixel, −1 to 1.
    pub ssim: Vec<f32>,
    /// ΔE₀₀.
    pub ciede2000: Vec<f32>,
}

/// Measures of one band over one region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegionFigures {
    /// The band.
    pub band: Band,
    /// The region.
    pub region: Region,
    /// Number of pixels.
    pub pixels: u64,
    /// Mean squared error of values between 0 and 1.
    pub mse: f64,
    /// Mean SSIM; `None` if no pixel of the region has a window of 11 × 11 pixels inside the image.
    pub ssim: Option<f64>,
    /// Mean FLIP, for colour only.
    pub flip: Option<f64>,
    /// Mean ΔE₀₀, for colour only.
    pub ciede2000: Option<f64>,
}

impl RegionFigures {
    /// Returns the peak signal-to-noise ratio in dB; `None`, for infinity, if the images are equal.
    pub fn psnr_db(&self) -> Option<f64> {
        psnr_db(self.mse)
    }
}

/// Returns the PSNR in dB for an MSE of values between 0 and 1; `None` for 0.
pub(super) fn psnr_db(mse: f64) -> Option<f64> {
    (mse > 0.0).then(|| -10.0 * mse.log10())
}

/// Measures of a pair: the whole image first, then its classes, then the same for near infrared. Regions without a
/// pixel are omitted.
#[derive(Clone, Debug, PartialEq)]
pub struct Figures {
    /// One row for each band and region.
    pub rows: Vec<RegionFigures>,
}

impl Figures {
    /// Returns the measures of the whole image in colour.
    pub fn all(&self) -> &RegionFigures {
        &self.rows[0]
    }

    /// Returns the measures of a band over a region; `None` if it has no pixel there, or is unknown.
    pub fn of(&self, band: Band, region: Region) -> Option<&RegionFigures> {
        self.rows.iter().find(|row| (row.band, row.region) == (band, region))
    }
}

/// Compares `b` with the reference `a`. `labels` holds the class of each pixel, as in `semantics.png`. Near infrared is
/// compared if both images have it. Returns an error if the sizes differ.
///
/// ```
/// use furrow_compare::{PIXELS_PER_DEGREE, RasterImage, pair};
/// let gray = |value| RasterImage { width: 16, height: 16, rgb: vec![[value; 3]; 256], nir: Vec::new() };
/// let figures = pair(&gray(100), &gray(151), None, PIXELS_PER_DEGREE)?;
/// assert!((figures.all().mse - 0.04).abs() < 1e-12);
/// # Ok::<(), furrow_base::Error>(())
/// ```
pub fn pair(a: &RasterImage, b: &RasterImage, labels: Option<&[u8]>, pixels_per_degree: f32) -> Result<Figures> {
    let maps = maps(a, b, pixels_per_degree)?;
    figures(a, b, labels, &maps)
}

/// Returns the error maps of `b` for a viewer with `pixels_per_degree`. Returns an error if the sizes differ or the
/// images are empty.
pub fn maps(a: &RasterImage, b: &RasterImage, pixels_per_degree: f32) -> Result<Maps> {
    if a.size() != b.size() || a.rgb.is_empty() {
        return Err(Error::input(format!(
            "images of {} × {} and {} × {} pixels cannot be compared",
            a.width, a.height, b.width, b.height
        ))
        .help("images are compared pixel by pixel, so their sizes must be equal"));
    }
    let (flip, (ssim, ciede2000)) = rayon::join(
        || flip::map(a, b, pixels_per_degree),
        || {
            let luma = |of: &RasterImage| of.rgb.iter().map(|p| ssim::luma(*p)).collect::<Vec<f64>>();
            (ssim::map(a.width.to_usize(), a.height.to_usize(), &luma(a), &luma(b)), color::map(a, b))
        },
    );
    Ok(Maps { flip, ssim, ciede2000 })
}

/// Computes the means of the error maps and the other measures.
pub(super) fn figures(a: &RasterImage, b: &RasterImage, labels: Option<&[u8]>, maps: &Maps) -> Result<Figures> {
    if labels.is_some_and(|labels| labels.len() != a.rgb.len()) {
        return Err(Error::misuse("there must be a label for each pixel"));
    }
    let width = a.width.to_usize();
    let regions = if labels.is_some() { &Region::ALL[..] } else { &Region::ALL[..1] };
    let mut rows = Vec::new();
    let mut add = |band: Band, square: &dyn Fn(usize) -> f64, ssim: &[f32]| {
        for region in regions {
            let mut sums = Sums::default();
            for pixel in (0..a.rgb.len()).filter(|k| labels.is_none_or(|labels| region.holds(labels[*k]))) {
                sums.pixels += 1;
                sums.square += square(pixel);
                if ssim::is_whole(pixel % width, pixel / width, width, a.height.to_usize()) {
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
        let gray = |of: &RasterImage| of.nir.iter().map(|v| f64::from(*v) / 255.0).collect::<Vec<f64>>();
        let ssim = ssim::map(width, a.height.to_usize(), &gray(a), &gray(b));
        add(Band::Nir, &|k| squared(a.nir[k], b.nir[k]), &ssim);
    }
    Ok(Figures { rows })
}

/// Returns the squared difference of two values as fractions of white.
fn squared(a: u8, b: u8) -> f64 {
    let d = f64::from(a.abs_diff(b)) / 255.0;
    d * d
}

/// Sums over a region's pixels.
#[derive(Default)]
struct Sums {
    pixels: u64,
    square: f64,
    /// Number of pixels whose window is inside the image.
    whole: u64,
    ssim: f64,
    flip: f64,
    ciede2000: f64,
}

impl Sums {
    fn row(&self, band: Band, region: Region) -> Option<RegionFigures> {
        let n = self.pixels.to_f64();
        let colors = |sum: f64| (band == Band::Rgb).then_some(sum / n);
        (self.pixels > 0).then(|| RegionFigures {
            band,
            region,
            pixels: self.pixels,
            mse: self.square / n,
            ssim: (self.whole > 0).then(|| self.ssim / self.whole.to_f64()),
            flip: colors(self.flip),
            ciede2000: colors(self.ciede2000),
        })
    }
}

/// Measured pair.
#[derive(Clone, Debug, PartialEq)]
pub struct Compared {
    /// Name of both images.
    pub name: String,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Measures of the pair.
    pub figures: Figures,
}
