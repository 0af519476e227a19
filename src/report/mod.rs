//! Reports that people read: numbers, tables, charts and the HTML pages around them.
//!
//! A page is one file that needs no network and nothing beside it: style, charts and pictures lie inside. What a page is about belongs to
//! the module that writes it: [`compare`](crate::compare), [`dataset::report`](crate::dataset::report) and
//! [`train::figure`](crate::train::figure). All text passes through `maud`, which escapes it.
//!
//! | file | idea |
//! |---|---|
//! | `text`, `markdown` | numbers and plurals in words; text of other people in Markdown |
//! | `csv`, `table` | rows of values; a table as Markdown, CSV, JSON and HTML |
//! | `histogram`, `tally` | counts in bins; the same with exact mean and range |
//! | `axis` | ticks of an axis |
//! | `chart` | histograms, curves, shares, colours and suns as inline SVG |
//! | `page` | the HTML page and its parts |

mod axis;
pub mod chart;
mod csv;
mod histogram;
pub mod markdown;
mod page;
mod table;
mod tally;
mod text;

pub use csv::{Lines, csv};
pub use histogram::{Bins, Histogram};
pub use page::{Number, Page, color, data_url, keyed, legend, list, numbers, pairs, section, swatch};
pub use table::{Cell, Table};
pub use tally::{Bar, Tally};
pub use text::{count, number, percent, whole};
