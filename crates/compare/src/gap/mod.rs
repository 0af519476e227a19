//! Domain gap between a set of synthetic images and a set of real ones: `trace compare --real DIR --synthetic DIR`.
//!
//! The sets show different scenes, so distributions of features are compared, with one distance per feature, which
//! decreases as the scene becomes more realistic. The real set alone defines which distance is small: it is split at
//! random into halves, and the median of their distances is reported as well. At a ratio of 1 the sets are as close as
//! two halves of the real one; more than twice that is a gap.
//!
//! | feature | measured on | distance |
//! |---|---|---|
//! | exposure | each image's mean luminance, stops | W₁ |
//! | colour | L*, a*, b* of pixels, by class | mean of three W₁, ΔE |
//! | NDVI | (NIR − R) / (NIR + R) of coded values, by class | W₁ |
//! | gradients | luminance relative to its mean, dB | W₁ |
//! | power spectrum, its slope | the same, in third-octave bands | RMS difference, dB; W₁ |
//! | noise | standard deviation on flat ground, 8-bit levels | W₁ |
//! | cover, blobs (connected components) and their sizes | labels | W₁ |
//! | contrast | a class and the surrounding soil, L* and a*b* | W₁ |
//! | outlines | distance of label outlines outside the leaves, pixels | W₁ |
//!
//! W₁ is the Wasserstein distance of [`Histogram`](furrow_report::Histogram). Classes are compared if both sets have
//! labels, NDVI if both have near infrared.
//!
//! | file | contents |
//! |---|---|
//! | `source` | the images of a set |
//! | `feature` | features and their distances between sets |
//! | `known`, `pixel` | data from the records of rendered images; one pixel size for both sets |
//! | `measure` | measurement of one image |
//! | `wasserstein`, `frequency`, `noise`, `regions`, `outline` | the individual measurements |
//! | `sets` | the whole comparison, from two folders to distances |
//! | `sampling` | sampling noise compared to that of real cameras |
//! | [`advice`] | the fields of a scene file to change, and the directions |
//! | `window` | the parts of images shown on the page |
//! | `table`, `curves`, `page`, `write` | output: JSON, CSV, text; curves; one HTML page |

pub mod advice;
mod curves;
mod feature;
mod frequency;
mod known;
mod measure;
mod noise;
mod outline;
mod page;
mod pixel;
mod regions;
mod sampling;
mod sets;
mod source;
mod table;
mod wasserstein;
mod window;
mod write;

pub use feature::{Feature, Pool};
pub use pixel::PixelSizes;
pub use sets::{Distance, Gap, LARGE, Options, Set};
pub use source::{Photo, photos};
pub use window::Window;
pub use write::FILES;
