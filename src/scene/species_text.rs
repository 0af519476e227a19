//! A species file's text, put together of all files that it is written in.

use super::desc::SpeciesDesc;
use crate::ron_file::{RonFile, Spliced, Step, choose};
use crate::{Error, Result};

/// A species file's text, with what other files add to it.
pub struct SpeciesFile(pub(super) Spliced);

impl SpeciesFile {
    /// What stands in it.
    pub fn parse(&self) -> Result<SpeciesDesc> {
        self.0.page.parse_all().map_err(|error| self.locate(error))
    }

    /// Refuses what was read from it where the plant uses a material that it does not have, or where the file that was asked for writes one that
    /// nothing uses; what it takes from another file may stay unused. The error lies in the whole text.
    pub(super) fn check_materials(&self, desc: &SpeciesDesc) -> Result<()> {
        let (page, used) = (self.page(), desc.plant.materials());
        if let Some(key) = used.iter().find(|key| !desc.materials.contains_key(*key)) {
            let known: Vec<&str> = desc.materials.keys().map(String::as_str).collect();
            let message = format!("the plant uses a material \"{key}\", which `materials` does not have");
            let help = format!(
                "add \"{key}\": Leaf(…) to `materials`, or name one of them; {}",
                choose("materials", &known, key)
            );
            // Where the key is written, or else the table that lacks it: some keys are defaults.
            return Err(if page.text.contains(&format!("\"{key}\"")) {
                page.about(key, message, help)
            } else {
                page.blame(&[Step::Field("materials")], Error::input(message).help(help)).lasting()
            });
        }
        let used: Vec<&str> = used.iter().map(String::as_str).collect();
        let written = self.0.keys(&[Step::Field("materials")]);
        let idle =
            written.into_iter().find(|(name, at)| self.0.source_at(at.start).path == page.path && !used.contains(name));
        idle.map_or(Ok(()), |(name, at)| {
            let message = format!("no leaf, stem or flower is made of the material `{name}`");
            Err(page.about_bytes(at, message, choose("materials that the plant uses", &used, name)))
        })
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
