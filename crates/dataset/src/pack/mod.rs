//! Writing packs: archives of many images in place of one folder each. See [`crate::read::packs`] for what a pack is.

mod adopt;
mod check;
pub mod store;

pub use check::{check, refuse_archives};
