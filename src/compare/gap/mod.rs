//! How far a set of made-up pictures is from a set of real ones: `trace compare --real DIR --synthetic DIR`.
//!
//! No picture of one set shows what one of the other does, so distributions are compared, one distance a feature, which falls as a scene
//! comes nearer. What distance is small is told by the real set alone: it is cut at random into halves, and the median of their distances
//! stands beside. At a ratio of 1 the sets are as near as two halves of the real one; more than twice that is a gap.
//!
//! | feature | of | distance |
//! |---|---|---|
//! | exposure | each picture's mean luminance, stops | W₁ |
//! | colour | L*, a*, b* of pixels, by class | mean of three W₁, ΔE |
//! | NDVI | (NIR − R) / (NIR + R) of coded values, by class | W₁ |
//! | gradients | luminance over its mean, dB | W₁ |
//! | power spectrum, its slope | the same, by thirds of octaves | RMS difference, dB; W₁ |
//! | noise | deviation in flat ground, 8-bit levels | W₁ |
//! | cover, blobs and their sizes | labels | W₁ |
//! | contrast | a class and the soil around it, L* and a*b* | W₁ |
//! | outlines | how far outside of the leaves labels end, pixels | W₁ |
//!
//! W₁ is the Wasserstein distance of [`Histogram`](crate::report::Histogram). Classes are compared where both sets have labels, NDVI where both have near infrared.
//!
//! | file | idea |
//! |---|---|
//! | `source` | which pictures there are |
//! | `feature` | what is measured, and how sets differ in it |
//! | `known`, `pixel` | what records of rendered pictures tell; one pixel size for both sets |
//! | `measure` | one picture, measured |
//! | `wasserstein`, `frequency`, `noise`, `regions`, `outline` | how |
//! | `sets` | all of it, from two folders to distances |
//! | `sampling` | noise of few samples, beside that of real cameras |
//! | [`advice`] | which fields of a scene file to turn, and which way |
//! | `window` | what the page shows of a picture |
//! | `table`, `curves`, `page`, `write` | how it is written: JSON, CSV, text; curves; one HTML page |

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
