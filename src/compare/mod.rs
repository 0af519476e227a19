//! How far pictures are from others of the same things: `trace compare`.
//!
//! A is the reference, B the test; any program may have made them. All measures are taken on 8-bit sRGB as it is coded, which is what
//! people and networks see; deeper pictures are rounded to it, opacity is left out.
//!
//! | measure | of | same | source |
//! |---|---|---|---|
//! | MSE | coded values from 0 to 1, mean over R, G, B | 0 | |
//! | PSNR | −10 log₁₀ MSE, dB | ∞ | |
//! | SSIM | luma; a Gaussian of σ 1.5 over 11 × 11 pixels | 1 | Wang, Bovik, Sheikh & Simoncelli 2004 |
//! | FLIP | colours and edges as an eye at some distance sees them, 0 to 1 | 0 | Andersson et al. 2020 |
//! | CIEDE2000 | ΔE₀₀ between pixels, CIELAB with D65; about 1 is just seen | 0 | Sharma, Wu & Dalal 2005 |
//!
//! Each is a mean over pixels, so each is also told of the pixels of one class, where labels are known. Near infrared has the first three.
//!
//! | file | idea |
//! |---|---|
//! | `pairs` | which picture belongs to which, and where labels are |
//! | `picture` | pictures and labels, read |
//! | `ssim`, `flip`, `color` | the measures, pixel by pixel |
//! | `figures` | one pair: maps of error, and their means over regions |
//! | `summary` | many pairs: means and their intervals |
//! | `comparison` | all of it, from paths to figures |
//! | `table`, `shot`, `page`, `write` | how it is written: JSON, Markdown, CSV; pictures; one HTML page |
//! | [`gap`] | sets whose pictures are of different things: how far synthetic ones are from real ones |

mod color;
mod comparison;
mod figures;
mod flip;
pub mod gap;
mod page;
mod pairs;
mod picture;
mod shot;
mod ssim;
mod summary;
mod table;
mod write;

pub use color::ciede2000;
pub use comparison::{Comparison, Options, folders};
pub use figures::{Band, Compared, Figures, Maps, Region, RegionFigures, maps, pair};
pub use flip::PIXELS_PER_DEGREE;
pub use pairs::{Pair, Pairs};
pub use picture::{Picture, read_labels};
pub use shot::Shot;
pub use summary::{Mean, Summary};
pub use write::FILES;
