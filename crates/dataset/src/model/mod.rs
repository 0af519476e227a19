//! The data model: recipe, classes, one image with its labels and record, and the rules that each image satisfies.

pub mod annotate;
pub mod box3;
pub mod classes;
pub mod image_files;
pub mod image_format;
pub mod invariants;
pub mod labelling;
pub mod optional_maps;
pub mod recipe;
pub mod record;
pub mod rle;
pub mod sample;
pub mod split;
pub(crate) mod warnings;
