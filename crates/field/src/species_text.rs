//! The merged text of a species file: its own text, the file that `like` names, and the table of leaves.

use super::desc::SpeciesDesc;
use furrow_base::ron_file::{RonFile, Spliced, Step, choose};
use furrow_base::{Error, Result};

/// The merged text of a species file and of the files that it refers to.
pub struct SpeciesFile(pub(super) Spliced);

impl SpeciesFile {
    /// Parses the merged text.
    pub fn parse(&self) -> Result<SpeciesDesc> {
        self.0.page.parse_all().map_err(|error| self.locate(error))
    }

    /// Returns an error if the plant uses a material that is not defined, or if the requested file itself defines a material that
    /// nothing uses. Inherited materials may be unused. The error's position refers to the merged text; see [`Self::locate`].
    pub(super) fn check_materials(&self, desc: &SpeciesDesc) -> Result<()> {
        let (page, used) = (self.page(), desc.plant.materials());
        if let Some(key) = used.iter().find(|key| !desc.materials.contains_key(*key)) {
            let known: Vec<&str> = desc.materials.keys().map(String::as_str).collect();
            let message = format!("the plant uses a material \"{key}\", which `materials` does not have");
            let help = format!(
                "add \"{key}\": Leaf(…) to `materials`, or name one of them; {}",
                choose("materials", &known, key)
            );
            // Point at the key if the text contains it, otherwise at `materials`: some keys are defaults.
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

    /// Returns the merged text, under the path of the requested file.
    pub fn page(&self) -> &RonFile {
        &self.0.page
    }

    /// Returns the files that the text was merged from, the requested file first.
    pub fn sources(&self) -> impl ExactSizeIterator<Item = &RonFile> {
        self.0.sources()
    }

    /// Maps the position of an error in the merged text to the file, line and column where the faulty text was written.
    #[must_use]
    pub fn locate(&self, error: Error) -> Error {
        self.0.locate(error)
    }
}
