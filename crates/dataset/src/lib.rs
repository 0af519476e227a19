//! Datasets: from one field to a hundred thousand, each with every label, in the formats people use.
//!
//! Image k is field k of the scene file: a function of scene file, seed and k, whichever process on whichever machine makes it, and in which
//! order. So the work may be cut, killed, moved and gone on with anywhere.
//!
//! ```text
//! dataset.json          the recipe: what decides every byte
//! scene/                the scene file and everything that it reads, so that the folder stands alone
//! images/000123/        one image: photographs, label maps, record.json
//! packs/train-000000.tar  the same of a thousand images, where the recipe asks for it
//! coco/ phenobench/ …   the same for other people's tools
//! seals/000123.json     checksums: SHA-256 of each of its files; written last
//! ledger/               timing log: when runs began and ended, how long each image took, which failed; one file a run: the only place with clock times
//! jobs/                 what `emit` wrote for a scheduler, and its logs; belongs to no image
//! manifest.json         everything above in one list, written when all images are there
//! images.parquet, plants.parquet  what images and plants are chosen by
//! report.html           what is in it, for people
//! ```
//!
//! | module | contents |
//! |---|---|
//! | [`model`] | recipe, classes, splits; one image with all labels, its record, and the rules that it satisfies |
//! | [`read`] | a dataset on disk: checksums, image folders, packs (archives of many images), images that remain to be made |
//! | [`index`] | tables of images and plants |
//! | [`format`] | files in the formats of other tools |
//! | [`report`] | one HTML page about a dataset |
//! | [`pack`] | writes packs |
//! | [`make`] | plan, render, finish; cost estimate and status |
//! | [`deliver`] | streams, a node's own disk, job files for clusters |
//! | [`check`] | verification |
//! | [`import`] | images and labels from other tools |

pub mod check;
pub mod deliver;
pub mod format;
pub mod import;
pub mod index;
pub mod make;
pub mod model;
pub mod pack;
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
    /// Below the dataset's folder, with `/`.
    pub path: String,
    /// What it holds.
    pub bytes: Vec<u8>,
}
