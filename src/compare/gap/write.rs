//! The distances of two sets as text and as files.

use super::sets::Gap;
use super::{page, table};
use crate::{Result, output};
use std::path::{Path, PathBuf};

/// The files that are written, by name.
pub const FILES: [&str; 3] = ["gap.json", "gap.csv", "gap.html"];
impl Gap {
    /// The distances as a table in Markdown, which is also fit to be read as it is, and which of them are large.
    pub fn table(&self) -> String {
        table::text(self)
    }

    /// Writes [`FILES`] into `folder` and returns their paths.
    pub fn write(&self, folder: &Path) -> Result<Vec<PathBuf>> {
        let texts = [table::json(self)?, table::csv(self), page::html(self)];
        let files: Vec<_> = FILES.into_iter().zip(texts.map(String::into_bytes)).collect();
        output::write_files(folder, &files)
    }
}
