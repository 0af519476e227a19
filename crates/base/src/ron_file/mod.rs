//! RON files: scene, species, experiment and texture files, read with errors that show their position.
//!
//! [`RonFile`] is the text of one file: `read` loads it from disk, `parse` deserializes it, `print` serializes a value,
//! `blame` locates an error at the value that a path of fields and items ([`Step`]) leads to. [`Num`] and [`Vary`] are
//! the numbers of such files: fixed, or sampled for every field from a distribution, within the [`Bound`] of their
//! type.
//!
//! [`Spliced`] is a text assembled from several files. Its errors are shown where the text was originally written.
//!
//! [`Assignment`] replaces or adds one value of a text by its path.
//!
//! [`Repair`] changes a text at the place of an error, so that further mistakes are found.
//!
//! [`to_json`] and [`from_json`] convert texts for programs that edit them as nested tables.
//!
//! `quantities` lists the numbers and distributions of a text with their positions, for programs that show or replace
//! one of them.
//!
//! Types that deserialize themselves from raw text use [`from_raw`]; they report a [`Fault`], which keeps its position.

mod assignment;
mod bound;
mod entries;
mod fault;
mod file;
mod json;
mod num;
mod place;
mod quantities;
mod repair;
mod schema;
mod spliced;
mod suggest;
mod vary;

pub use assignment::Assignment;
pub use bound::{Bound, Count, Elevation, Factor, Fraction, NonNegative, Positive, PositiveCount, Signed};
pub use entries::entries;
pub use fault::{Fault, from_raw, inside, parse_in, whole};
pub use file::RonFile;
pub use json::{from_json, to_json};
pub use num::Num;
pub use place::{Step, place};
pub use quantities::{Quantity, Value, limits, quantities};
pub use repair::{Repair, Spot};
pub use schema::{DEFAULT, DRAWN, FIXED, KIND, Limits, PICKED, RANGE};
pub use spliced::Spliced;
pub use suggest::{choose, nearest};
pub use vary::{DISTRIBUTION_WORDS, Distribution, Pick, Vary};
