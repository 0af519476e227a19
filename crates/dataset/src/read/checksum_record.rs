//! Which files make an image, each with its SHA-256: an image is there when its record of checksums is and every file agrees with it.
//!
//! It is written last and holds a hash of itself, so a damaged record is none.

use crate::File;
use crate::model::recipe::{Recipe, compact};
use crate::read::checksum::Checksum;
use crate::read::native;
use furrow_base::input::below;
use furrow_base::{Error, Result};
use furrow_output::{Together, write_atomically, write_together};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What an image is made of.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChecksumRecord {
    /// Its number.
    pub index: u64,
    /// [`Recipe::fingerprint`] of what made it.
    pub recipe: String,
    /// [`Labelling::fingerprint`](crate::model::labelling::Labelling::fingerprint) of its formats' labels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub labelling: Option<String>,
    /// Its files by path below the dataset's folder.
    pub files: BTreeMap<String, Checksum>,
}

/// A record of checksums as it lies on disk.
#[derive(Serialize, Deserialize)]
struct Written {
    #[serde(flatten)]
    checksums: ChecksumRecord,
    /// SHA-256 of the rest.
    seal_sha256: String,
}

impl ChecksumRecord {
    /// Of files that were just made.
    pub fn of(index: u64, recipe: &Recipe, files: &[File]) -> Result<Self> {
        let files = files.iter().map(|f| (f.path.clone(), Checksum::of(&f.bytes))).collect();
        Ok(Self { index, recipe: recipe.fingerprint()?, labelling: recipe.labelling.fingerprint()?, files })
    }

    /// Where the checksums of an image lie.
    pub fn path(folder: &Path, index: u64) -> PathBuf {
        folder.join(Self::path_below(index))
    }

    /// The same below the dataset's folder.
    pub(crate) fn path_below(index: u64) -> String {
        format!("seals/{}.json", native::image_name(index))
    }

    /// Reads an image's checksums; `None` where there is none or it is damaged.
    pub fn read(folder: &Path, index: u64) -> Option<Self> {
        let bytes = furrow_base::input::contents(&Self::path(folder, index)).ok()?;
        let written: Written = serde_json::from_slice(&bytes).ok()?;
        let own = written.checksums.hash().ok()?;
        (own == written.seal_sha256 && written.checksums.index == index).then_some(written.checksums)
    }

    /// Writes it: after everything that it names.
    pub fn write(&self, folder: &Path) -> Result<()> {
        let written = Written { checksums: self.clone(), seal_sha256: self.hash()? };
        write_atomically(&below(folder, &Self::path_below(self.index))?, &compact(&written)?)
    }

    /// SHA-256 over everything in it, hex.
    pub fn hash(&self) -> Result<String> {
        Ok(hex::encode(Sha256::digest(compact(self)?)))
    }

    /// The same over its native files alone, whatever formats there are.
    pub fn image_hash(&self) -> Result<String> {
        let mut own = self.clone();
        own.files.retain(|path, _| path.starts_with("images/"));
        own.labelling = None;
        own.hash()
    }
}

/// Bytes from which on a file takes more than one block of a disk.
pub(crate) const BLOCK: usize = 4096;

/// Writes files, all of them or none. Those of the same bytes, such as the photograph in several formats, are one file with several
/// names.
pub(crate) fn write_files(folder: &Path, files: &[File]) -> Result<()> {
    write_files_beside(folder, files, &BTreeMap::new())
}

/// The same; files of the same bytes as some that lie there, of which these checksums are known, become further names of those.
pub(crate) fn write_files_beside(folder: &Path, files: &[File], there: &BTreeMap<String, Checksum>) -> Result<()> {
    let known = if there.is_empty() { BTreeMap::new() } else { lying(folder, files, there)? };
    let add_all = |together: &mut Together| {
        let mut large = known.clone();
        for file in files {
            if file.bytes.is_empty() {
                return Err(Error::failed(format!("{}: refused to write an empty file", file.path)));
            }
            let path = below(folder, &file.path)?;
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

/// Large files whose bytes lie there already, and where: none in archives. A checksum says which to look at, the bytes themselves decide.
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
