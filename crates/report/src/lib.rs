//! Reports for users: numbers, tables, charts and HTML pages.
//!
//! A page is one self-contained file that needs no network: style, charts and images are embedded. The content of a
//! page is defined by the module that writes it: `furrow_compare`,
//! `furrow_dataset::report` and `furrow_train::figure`. All text passes through
//! `maud`, which escapes it.
//!
//! | file | idea |
//! |---|---|
//! | `text`, `markdown` | formatting of numbers and plurals; escaping of foreign text in Markdown |
//! | `csv`, `table` | rows of values; a table as Markdown, CSV, JSON and HTML |
//! | `histogram`, `tally` | histograms; histograms with exact mean and range |
//! | `axis` | ticks of an axis |
//! | `chart` | histograms, curves, shares, colours and sun positions as inline SVG |
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
