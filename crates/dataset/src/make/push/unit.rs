//! Units: sets of files that are pushed together, and the records of what was pushed.

use crate::model::recipe::{FILE, MANIFEST};
use crate::read::checksum::Checksum;
use crate::read::checksum_record::ChecksumRecord;
use crate::read::native;
use crate::read::packs::{Id, Packing};
use crate::read::set::Set;
use crate::{index, report};
use furrow_base::{Error, Result};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// A set of files that are pushed together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unit {
    /// The recipe and the scene.
    Recipe,
    /// A pack.
    Pack(Id),
    /// An image in a folder of its own.
    Image(u64),
    /// The files of the whole dataset that `finish` writes.
    Whole,
}

impl Unit {
    /// Returns the unit of an image.
    pub(crate) fn of(set: &Set, index: u64) -> Self {
        Packing::of(&set.recipe).map_or(Self::Image(index), |packing| Self::Pack(packing.id(index)))
    }

    pub(crate) fn name(self) -> String {
        match self {
            Self::Recipe => "recipe".into(),
            Self::Pack(id) => id.name(),
            Self::Image(index) => Set::name(index),
            Self::Whole => "whole".into(),
        }
    }

    pub(super) fn record_path(self, folder: &Path) -> PathBuf {
        folder.join("pushed").join(format!("{}.json", self.name()))
    }

    /// Returns the paths of its files below the dataset's folder and a hash of their contents; `None` if the unit is
    /// not finished.
    pub(crate) fn contents(self, set: &Set) -> Result<Option<(Vec<String>, String)>> {
        let folder = &set.folder;
        Ok(match self {
            Self::Recipe => {
                let mut files = vec![FILE.to_owned()];
                below_folder(folder, "scene", &mut files)?;
                Some(hashed(folder, files)?)
            }
            Self::Whole => {
                let mut files = vec![MANIFEST.to_owned(), report::FILE.to_owned()];
                files.extend([index::IMAGES.to_owned(), index::PLANTS.to_owned()]);
                files.extend(set.recipe.formats.iter().flat_map(|format| lists(folder, set, format)));
                files.retain(|file| folder.join(file).is_file());
                Some(hashed(folder, files)?)
            }
            Self::Pack(id) => match set.packs.get(folder, id) {
                None => None,
                Some(record) => {
                    let formats = record.images.iter().flat_map(|image| image.files.keys());
                    let mut files: Vec<String> = formats.filter(|path| !native::is_native(path)).cloned().collect();
                    files.extend([id.path(), id.seal()]);
                    Some((files, record.hash()?))
                }
            },
            Self::Image(index) => match ChecksumRecord::read(folder, index) {
                None => None,
                Some(record) => {
                    let mut files: Vec<String> = record.files.keys().cloned().collect();
                    files.push(format!("seals/{}.json", Set::name(index)));
                    Some((files, record.hash()?))
                }
            },
        })
    }

    /// Returns the record of its push if it was pushed with the contents that have this hash.
    pub(super) fn noted(self, set: &Set, hash: &str) -> Option<PushRecord> {
        let bytes = furrow_base::input::contents(&self.record_path(&set.folder)).ok()?;
        serde_json::from_slice(&bytes).ok().filter(|note: &PushRecord| note.sha256 == hash)
    }

    /// Returns `true` if its local files were removed after it was pushed.
    pub(crate) fn is_freed(self, set: &Set) -> bool {
        if !self.record_path(&set.folder).is_file() {
            return false;
        }
        let hash = self.contents(set).ok().flatten().map(|(_, hash)| hash);
        hash.and_then(|hash| self.noted(set, &hash)).is_some_and(|note| note.freed)
    }
}

/// Record of a pushed unit, stored in `pushed/UNIT.json`.
#[derive(Serialize, Deserialize)]
pub(super) struct PushRecord {
    pub(super) unit: String,
    /// Hash of the unit's checksum record, or of its files if it has none.
    pub(super) sha256: String,
    /// Whether its local files were removed.
    pub(super) freed: bool,
    /// Address of the bucket; empty for a command, whose destination is not known.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub(super) to: String,
}

/// Adds the paths of all files below the folder `within` of the dataset to `files`.
fn below_folder(folder: &Path, within: &str, files: &mut Vec<String>) -> Result<()> {
    let Ok(entries) = std::fs::read_dir(folder.join(within)) else { return Ok(()) };
    for entry in entries {
        let entry = entry.map_err(Error::io(&folder.join(within)))?;
        let path = format!("{within}/{}", entry.file_name().to_string_lossy());
        if entry.path().is_dir() {
            below_folder(folder, &path, files)?;
        } else {
            files.push(path);
        }
    }
    files.sort();
    Ok(())
}

/// Returns the files of a format that belong to no image, from the list of all files in the manifest.
fn lists(folder: &Path, set: &Set, format: &str) -> Vec<String> {
    #[derive(Deserialize)]
    struct Listed {
        files: BTreeMap<String, Checksum>,
    }
    let bytes = furrow_base::input::contents(&folder.join(MANIFEST)).unwrap_or_default();
    let listed: Option<Listed> = serde_json::from_slice(&bytes).ok();
    let mut all: Vec<String> = listed.map(|listed| listed.files.into_keys().collect()).unwrap_or_default();
    all.retain(|path| path.strip_prefix(format).is_some_and(|rest| rest.starts_with('/')));
    let of_images: BTreeSet<String> = set.all_checksums().flatten().flat_map(|image| image.files.into_keys()).collect();
    all.retain(|path| !of_images.contains(path));
    all
}

fn hashed(folder: &Path, files: Vec<String>) -> Result<(Vec<String>, String)> {
    let mut words = String::new();
    for file in &files {
        let path = folder.join(file);
        let sum = Checksum::of_file(&path).map_err(Error::io(&path))?;
        words.extend([sum.sha256.as_str(), " ", file, "\n"]);
    }
    Ok((files, Checksum::of(words.as_bytes()).sha256))
}
