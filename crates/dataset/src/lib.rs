//! Datasets: images of crop fields with all labels, from one to many thousands, in the formats of common tools.
//!
//! Image k depends on the scene file, the seed and k only. The process, the machine and the order of the images have no
//! influence, so the work can be split, killed, moved and resumed anywhere.
//!
//! ```text
//! dataset.json          recipe: everything that affects a byte of the images
//! scene/                the scene file and all files that it reads, so that the folder is self-contained
//! images/000123/        one image: colour and near-infrared image, label maps, record.json
//! packs/train-000000.tar  if the recipe has a pack size: archive of many images instead of their folders
//! coco/ phenobench/ …   the same images in the formats of other tools
//! seals/000123.json     checksum record: SHA-256 of each file of the image; written last
//! ledger/               timing log, one file per run: start, end, time of each image, failures; the only clock times
//! jobs/                 job files that `emit` wrote for a scheduler, and their logs; belong to no image
//! pushed/000123.json    hash of a unit that `--push` has uploaded
//! manifest.json         list of everything above; written when all images are complete
//! images.parquet, plants.parquet  tables for selecting images and plants
//! report.html           summary of the dataset, one page
//! ```
//!
//! | module | contents |
//! |---|---|
//! | [`model`] | recipe, classes, splits; one image with all labels, its record, and the rules that it satisfies |
//! | [`read`] | a dataset on disk: checksums, image folders, packs (archives of many images) |
//! | [`index`] | tables of images and plants |
//! | [`mod@format`] | files in the formats of other tools |
//! | [`report`] | one HTML page about a dataset |
//! | [`mod@make`] | plan, render, write packs, finish; cost estimate and status |
//! | [`deliver`] | tar streams, a node's own disk, job files for clusters |
//! | [`check`] | verification |
//! | [`import`] | images and labels from other tools |

pub mod check;
pub mod deliver;
pub mod format;
pub mod import;
pub mod index;
pub mod make;
pub mod model;
pub mod read;
pub mod report;

pub use check::verify::{Findings, verify};
pub use make::generate::{Callbacks, Shard, Work};
pub use make::plan::Order;
pub use make::{begin, make, make_watched};
pub use model::recipe::{MOST_IMAGES, Recipe};
pub use model::record::Record;
pub use model::sample::Sample;
pub use model::split::{Shares, Split};
pub use read::set::Set;

/// A file of a dataset.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct File {
    /// Path relative to the dataset's folder, with `/` as separator.
    pub path: String,
    /// Contents.
    pub bytes: Vec<u8>,
}
