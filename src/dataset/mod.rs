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
//! | file | idea |
//! |---|---|
//! | `recipe`, `split` | what makes a dataset; which image is for what |
//! | `keep`, `photo` | which maps images keep; how photographs are stored |
//! | `classes`, `labelling`, `labels` | a user's own classes; what else may be asked of labels; how formats name and choose what images show |
//! | `render` | an image from its field, by [`crate::job`] |
//! | `sample`, `record`, `annotate`, `rle`, `label_maps` | one image and all that is known of it; label maps to records, and back |
//! | `image_files` | which files an image has |
//! | `native`, `format` | as files: ours (`images/`), and those of other tools |
//! | `checksum`, `checksum_record`, `set` | SHA-256 of a file; those of an image's files; the dataset on disk |
//! | `links` | symbolic links in a dataset's folder, which are refused |
//! | `pack`, `archive` | images in archives instead of folders; names in them |
//! | `push` | sends what is finished elsewhere, by a command of the user's |
//! | `make` | all of it in one call |
//! | `plan`, `gather`, `begin`, `task`, `generate`, `timing_log`, `finish` | from a scene file, copied with all that it names, to images and a manifest; what remains to be done is found by looking at the disk |
//! | `bill`, `meter` | what a dataset will cost, from some of its images; what this process has taken |
//! | `status`, `time_left` | how far a dataset is, from what lies in its folder; how long a run still takes |
//! | `stream` | the images of a dataset without its folder, as an archive for a program that reads them as they are made |
//! | `scratch` | the images of a shard on a node's own disk, brought home as they are finished |
//! | `cluster` | the same on many machines: job files for schedulers |
//! | `invariants`, `difference`, `listed`, `verify` | what must hold of every image; how far two of them lie apart; what the manifest lists and is not so; whether all is so |
//! | `import` | other people's images and labels |
//! | `index` | what images and plants are chosen by, as tables |
//! | `report` | all of it on one page, for people |

#[doc(hidden)]
pub mod annotate;
mod archive;
mod begin;
#[doc(hidden)]
pub mod bill;
#[doc(hidden)]
pub mod checksum;
#[doc(hidden)]
pub mod checksum_record;
#[doc(hidden)]
pub mod classes;
#[doc(hidden)]
pub mod cluster;
#[doc(hidden)]
pub mod damage;
#[doc(hidden)]
pub mod difference;
#[doc(hidden)]
pub mod finish;
#[doc(hidden)]
pub mod flow;
#[doc(hidden)]
pub mod format;
mod gather;
#[doc(hidden)]
pub mod generate;
#[doc(hidden)]
pub mod image_files;
#[doc(hidden)]
pub mod import;
#[doc(hidden)]
pub mod index;
#[doc(hidden)]
pub mod invariants;
#[doc(hidden)]
pub mod keep;
mod label_maps;
#[doc(hidden)]
pub mod labelling;
#[doc(hidden)]
pub mod labels;
mod links;
mod listed;
mod make;
#[doc(hidden)]
pub mod meter;
#[doc(hidden)]
pub mod native;
#[doc(hidden)]
pub mod pack;
#[doc(hidden)]
pub mod photo;
#[doc(hidden)]
pub mod plan;
#[doc(hidden)]
pub mod push;
#[doc(hidden)]
pub mod recipe;
pub mod record;
#[doc(hidden)]
pub mod render;
#[doc(hidden)]
pub mod report;
#[doc(hidden)]
pub mod rle;
#[doc(hidden)]
pub mod sample;
#[doc(hidden)]
pub mod scratch;
#[doc(hidden)]
pub mod set;
#[doc(hidden)]
pub mod split;
#[doc(hidden)]
pub mod status;
#[doc(hidden)]
pub mod stream;
mod task;
#[doc(hidden)]
pub mod time_left;
#[doc(hidden)]
pub mod timing_log;
#[doc(hidden)]
pub mod verify;

pub use generate::{Callbacks, Shard, Work};
pub use make::{begin, make, make_watched};
pub use plan::Order;
pub use recipe::{MOST_IMAGES, Recipe};
pub use record::Record;
pub use sample::Sample;
pub use set::Set;
pub use split::{Shares, Split};
pub use verify::{Findings, verify};

/// A file of a dataset.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct File {
    /// Below the dataset's folder, with `/`.
    pub path: String,
    /// What it holds.
    pub bytes: Vec<u8>,
}
