//! Output of a comparison as text and files.

use super::comparison::Comparison;
use super::{page, table};
use furrow_base::Result;
use std::path::{Path, PathBuf};

/// Names of the files that are written.
pub const FILES: [&str; 4] = ["compare.json", "compare.csv", "compare.md", "compare.html"];

impl Comparison {
    /// Returns the means as a readable Markdown table.
    pub fn table(&self) -> String {
        table::means(self)
    }

    /// Writes [`FILES`] into `folder` and returns their paths.
    pub fn write(&self, folder: &Path) -> Result<Vec<PathBuf>> {
        let texts = [table::json(self)?, table::csv(self), table::markdown(self), page::html(self)];
        let files: Vec<_> = FILES.into_iter().zip(texts.map(String::into_bytes)).collect();
        furrow_output::write_files(folder, &files)
    }
}
