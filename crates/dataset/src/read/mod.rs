//! Reading a dataset from disk: checksums, archives, image folders.

pub mod archive;
pub mod checksum;
pub mod checksum_record;
pub mod label_maps;
pub mod links;
pub mod native;
pub mod packs;
pub(crate) mod place;
pub mod set;
