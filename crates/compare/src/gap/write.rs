//! Output of a gap as text and files.

use super::sets::Gap;
use super::{page, table};
use furrow_base::Result;
use std::path::{Path, PathBuf};

/// Names of the files that are written.
pub const FILES: [&str; 3] = ["gap.json", "gap.csv", "gap.html"];
impl Gap {
    /// Returns the distances as a readable Markdown table, followed by the large ones.
    pub fn table(&self) -> String {
        table::text(self)
    }

    /// Writes [`FILES`] into `folder` and returns their paths.
    pub fn write(&self, folder: &Path) -> Result<Vec<PathBuf>> {
        let texts = [table::json(self)?, table::csv(self), page::html(self)];
        let files: Vec<_> = FILES.into_iter().zip(texts.map(String::into_bytes)).collect();
        furrow_output::write_files(folder, &files)
    }
}
