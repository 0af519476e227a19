//! File of a layer. It is written in pieces: the text of a field takes gigabytes.

use super::text::Text;
use furrow_base::{Error, Result};
use std::io::Write;
use std::path::Path;

/// A layer that is being written.
pub(super) struct Layer<'a> {
    pub(super) out: &'a mut (dyn Write + Send),
    /// Path of the finished file, for errors.
    pub(super) path: &'a Path,
}

impl Layer<'_> {
    /// Adds text.
    pub(super) fn add(&mut self, text: &Text) -> Result<()> {
        self.out.write_all(text.bytes()).map_err(Error::io(self.path))
    }
}
