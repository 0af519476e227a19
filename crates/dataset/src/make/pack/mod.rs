//! Writes packs: archives of many images instead of one folder per image. [`crate::read::packs`] describes packs.

mod adopt;
mod check;
pub mod store;

pub use check::{check, refuse_archives};
