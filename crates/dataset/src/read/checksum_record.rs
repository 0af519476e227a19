//! Checksum records: an image is complete if its record exists and every file listed in it has the recorded SHA-256.
//!
//! The record is written last and contains a hash of itself, so a damaged record counts as missing.

use crate::File;
use crate::model::recipe::{Recipe, compact};
use crate::read::checksum::Checksum;
use crate::read::native;
use crate::read::place::place;
use furrow_base::input::below;
use furrow_base::{Error, Result};
use furrow_output::{FileSet, write_atomically, write_together};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Checksums of the files of an image.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChecksumRecord {
    /// Number of the image.
    pub index: u64,
    /// [`Recipe::fingerprint`] of the recipe that made the image.
    pub recipe: String,
    /// [`Labelling::fingerprint`](crate::model::labelling::Labelling::fingerprint) of the labels in its formats.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub labelling: Option<String>,
    /// Files by their path relative to the dataset's folder.
    pub files: BTreeMap<String, Checksum>,
}

/// A checksum record as it is stored on disk.
#[derive(Serialize, Deserialize)]
struct Written {
    #[serde(flatten)]
    checksums: ChecksumRecord,
    /// SHA-256 of the rest.
    seal_sha256: String,
}

impl ChecksumRecord {
    /// Returns the record of files that were just made.
    pub fn of(index: u64, recipe: &Recipe, files: &[File]) -> Result<Self> {
        let files = files.iter().map(|f| (f.path.clone(), Checksum::of(&f.bytes))).collect();
        Ok(Self { index, recipe: recipe.fingerprint()?, labelling: recipe.labelling.fingerprint()?, files })
    }

    /// Returns the path of an image's record in the dataset's `folder`.
    pub fn path(folder: &Path, index: u64) -> PathBuf {
        folder.join(Self::path_below(index))
    }

    /// Returns the same path, relative to the dataset's folder.
    pub(crate) fn path_below(index: u64) -> String {
        format!("seals/{}.json", native::image_name(index))
    }

    /// Reads the record of an image; `None` if it is missing or damaged.
    pub fn read(folder: &Path, index: u64) -> Option<Self> {
        let bytes = furrow_base::input::contents(&Self::path(folder, index)).ok()?;
        let written: Written = serde_json::from_slice(&bytes).ok()?;
        let own = written.checksums.hash().ok()?;
        // The hash covers the values; the bytes could have other spaces, or fields that are not read.
        let whole = own == written.seal_sha256 && compact(&written).is_ok_and(|own| own == bytes);
        (whole && written.checksums.index == index).then_some(written.checksums)
    }

    /// Writes the record, which must happen after all files listed in it are written.
    pub fn write(&self, folder: &Path) -> Result<()> {
        let written = Written { checksums: self.clone(), seal_sha256: self.hash()? };
        write_atomically(&place(folder, &Self::path_below(self.index))?, &compact(&written)?)
    }

    /// Returns the SHA-256 of all fields, in hex.
    pub fn hash(&self) -> Result<String> {
        Ok(hex::encode(Sha256::digest(compact(self)?)))
    }

    /// Returns the same hash of the native files alone, independent of the formats.
    pub fn image_hash(&self) -> Result<String> {
        let mut own = self.clone();
        own.files.retain(|path, _| path.starts_with("images/"));
        own.labelling = None;
        own.hash()
    }
}

/// Block size of a disk, bytes. Only larger files are replaced by hard links.
pub(crate) const BLOCK: usize = 4096;

/// Writes all files or none. Files with equal contents, such as the image in several formats, become hard links to one
/// file.
pub(crate) fn write_files(folder: &Path, files: &[File]) -> Result<()> {
    write_files_beside(folder, files, &BTreeMap::new())
}

/// Writes files in the same way. If a file has the contents of an existing one, whose checksum is in `there`, it
/// becomes a hard link to that one.
pub(crate) fn write_files_beside(folder: &Path, files: &[File], there: &BTreeMap<String, Checksum>) -> Result<()> {
    let known = if there.is_empty() { BTreeMap::new() } else { lying(folder, files, there)? };
    let add_all = |together: &mut FileSet| {
        let mut large = known.clone();
        for file in files {
            if file.bytes.is_empty() {
                return Err(Error::failed(format!("{}: refused to write an empty file", file.path)));
            }
            let path = place(folder, &file.path)?;
            match large.get(file.bytes.as_slice()) {
                Some(there) => together.add_equal(there, &path, &file.bytes)?,
                None => together.add(&path, &file.bytes)?,
            }
            if file.bytes.len() > BLOCK {
                large.entry(&file.bytes).or_insert(path);
            }
        }
        Ok(())
    };
    write_together(folder, add_all).map(drop)
}

/// Finds the files above `BLOCK` whose contents already exist on disk, and returns the paths by contents. Archives are
/// not searched. Checksums select the candidates; their bytes are then compared.
fn lying<'a>(
    folder: &Path,
    files: &'a [File],
    there: &BTreeMap<String, Checksum>,
) -> Result<BTreeMap<&'a [u8], PathBuf>> {
    let mut known = BTreeMap::new();
    for file in files.iter().filter(|file| file.bytes.len() > BLOCK) {
        let sum = Checksum::of(&file.bytes);
        for (path, _) in there.iter().filter(|(path, known)| **known == sum && **path != file.path) {
            let path = below(folder, path)?;
            let is_file = std::fs::symlink_metadata(&path).is_ok_and(|about| about.is_file());
            if is_file && furrow_base::input::contents(&path).is_ok_and(|bytes| bytes == file.bytes) {
                known.insert(file.bytes.as_slice(), path);
            }
        }
    }
    Ok(known)
}
