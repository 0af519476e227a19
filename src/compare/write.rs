//! A comparison as text and as files.

use super::comparison::Comparison;
use super::{page, table};
use crate::{Result, output};
use std::path::{Path, PathBuf};

/// The files that are written, by name.
pub const FILES: [&str; 4] = ["compare.json", "compare.csv", "compare.md", "compare.html"];

impl Comparison {
    /// The means as a table in Markdown, which is also fit to be read as it is.
    pub fn table(&self) -> String {
        table::means(self)
    }

    /// Writes [`FILES`] into `folder` and returns their paths.
    pub fn write(&self, folder: &Path) -> Result<Vec<PathBuf>> {
        let texts = [table::json(self)?, table::csv(self), table::markdown(self), page::html(self)];
        let files: Vec<_> = FILES.into_iter().zip(texts.map(String::into_bytes)).collect();
        output::write_files(folder, &files)
    }
}
