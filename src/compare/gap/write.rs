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
        let paths = FILES.map(|name| folder.join(name));
        for (path, text) in paths.iter().zip(&texts) {
            output::write_atomically(path, text.as_bytes())?;
        }
        Ok(paths.to_vec())
    }
}
