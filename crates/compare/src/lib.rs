//! Comparison of images with other images of the same scenes: `trace compare`.
//!
//! A is the reference, B the test; they may come from any program. All measures use 8-bit sRGB codes, as seen by people
//! and networks. Images with more bits are rounded to 8; alpha is ignored.
//!
//! | measure | computed on | equal images | source |
//! |---|---|---|---|
//! | MSE | coded values between 0 and 1, mean over R, G, B | 0 | |
//! | PSNR | −10 log₁₀ MSE, dB | ∞ | |
//! | SSIM | luma; a Gaussian of σ 1.5 over 11 × 11 pixels | 1 | Wang, Bovik, Sheikh & Simoncelli 2004 |
//! | FLIP | colours and edges as perceived from a given distance, 0 to 1 | 0 | Andersson et al. 2020 |
//! | CIEDE2000 | ΔE₀₀ between pixels, CIELAB with D65; about 1 is just noticeable | 0 | Sharma, Wu & Dalal 2005 |
//!
//! Each is a mean over pixels, and is also reported for the pixels of each class if labels are known. Near infrared has
//! the first three.
//!
//! | file | contents |
//! |---|---|
//! | `pairs` | pairing of images, and their labels |
//! | `picture` | reading of images and labels |
//! | `ssim`, `flip`, `color` | the measures, per pixel |
//! | `figures` | one pair: error maps, and their means over regions |
//! | `summary` | many pairs: means with confidence intervals |
//! | `comparison` | the whole comparison, from paths to measures |
//! | `table`, `shot`, `page`, `write` | output: JSON, Markdown, CSV; images; one HTML page |
//! | [`gap`] | distance of synthetic from real image sets that show different scenes |

mod color;
mod comparison;
mod display_pair;
mod figures;
mod flip;
pub mod gap;
mod page;
mod pairs;
mod raster_image;
mod ssim;
mod summary;
mod table;
mod write;

pub use color::ciede2000;
pub use comparison::{Comparison, Options, folders};
pub use display_pair::DisplayPair;
pub use figures::{Band, Compared, Figures, Maps, Region, RegionFigures, maps, pair};
pub use flip::PIXELS_PER_DEGREE;
pub use pairs::{Pair, Pairs};
pub use raster_image::{RasterImage, read_labels};
pub use summary::{Mean, Summary};
pub use write::FILES;
