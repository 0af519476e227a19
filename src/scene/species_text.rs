//! A species file's text, put together of all files that it is written in.

use super::desc::SpeciesDesc;
use crate::ron_file::{RonFile, Spliced};
use crate::{Error, Result};

/// A species file's text, with what other files add to it.
pub struct SpeciesFile(pub(super) Spliced);

impl SpeciesFile {
    /// What stands in it.
    pub fn parse(&self) -> Result<SpeciesDesc> {
        self.0.page.parse_all().map_err(|error| self.locate(error))
    }

    /// The whole text, as one file in the place of the one that was asked for.
    pub fn page(&self) -> &RonFile {
        &self.0.page
    }

    /// The files that it was read from, that which was asked for first.
    pub fn sources(&self) -> &[RonFile] {
        self.0.sources()
    }

    /// An error about the whole text, shown in the file where the words at fault were written.
    #[must_use]
    pub fn locate(&self, error: Error) -> Error {
        self.0.locate(error)
    }
}
