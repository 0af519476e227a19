//! RON files: scene, species, experiment and texture files, read with errors that show their place.
//!
//! [`RonFile`] is the text of one file: `read` takes it from the disk, `parse` makes a value of it, `print` makes text of a
//! value, `blame` puts an error at the place that a path of fields and items ([`Step`]) leads to. [`Num`] and [`Vary`] are
//! the numbers of such files: fixed, or drawn for every field from a distribution, within the [`Bound`] that their type says.
//!
//! [`Spliced`] is a text put together from several files, whose errors are shown where their words were written.
//!
//! `quantities` lists the numbers and distributions of a text with their places, for programs that show or replace one.
//!
//! Types that read themselves from raw text use [`from_raw`]; what they refuse is a [`Fault`], which keeps its place.

mod bound;
mod entries;
mod fault;
mod file;
mod num;
mod place;
mod quantities;
mod renamed;
mod schema;
mod spliced;
mod suggest;
mod vary;

pub use bound::{Bound, Count, Elevation, Factor, Finite, Fraction, NonNegative, Positive, PositiveCount};
pub use entries::entries;
pub use fault::{Fault, from_raw, inside, parse_in, whole};
pub use file::RonFile;
pub use num::Num;
pub use place::{Step, place};
pub use quantities::{Quantity, Value, quantities};
pub use renamed::{Keyword, RENAMED, Renamed};
pub use schema::{DEFAULT, DRAWN, FIXED, KIND, PICKED, RANGE};
pub use spliced::Spliced;
pub use suggest::{choose, nearest};
pub use vary::{DISTRIBUTION_WORDS, Distribution, Pick, Vary};
