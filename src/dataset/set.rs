//! A dataset that lies in a folder: its recipe, its images by name, the files that belong to all of them.

use super::checksum::Checksum;
use super::native;
use super::recipe::Recipe;
use super::record::Record;
use super::split::Split;
use crate::input::below;
use crate::output::stream_atomically;
use crate::{Error, Result};
use serde::Serialize;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

/// A dataset on disk.
#[derive(Clone, Debug)]
pub struct Set {
    /// Its folder.
    pub folder: PathBuf,
    /// What makes it.
    pub recipe: Recipe,
}

impl Set {
    /// Opens the dataset in a folder.
    pub fn open(folder: &Path) -> Result<Self> {
        Ok(Self { folder: folder.into(), recipe: Recipe::read(folder)? })
    }

    /// The name of an image: its number in six digits or more.
    pub fn name(index: u64) -> String {
        native::image_name(index)
    }

    /// The names of a split's images, in the order of their numbers.
    pub fn names(&self, split: Split) -> Vec<String> {
        (0..self.recipe.count).filter(|k| self.recipe.split_of(*k) == split).map(Self::name).collect()
    }

    /// The records of a split's images, read one by one in the order of their numbers.
    pub fn records(&self, split: Split) -> impl Iterator<Item = Result<Record>> + '_ {
        self.names(split).into_iter().map(|name| native::read_record(&self.folder, &name))
    }

    /// The records of all images, read one by one in the order of their numbers.
    pub fn all(&self) -> impl Iterator<Item = Result<Record>> + '_ {
        (0..self.recipe.count).map(|k| native::read_record(&self.folder, &Self::name(k)))
    }
}

/// Where the files that belong to all images go; keeps what tells them.
pub struct Whole<'a> {
    folder: &'a Path,
    /// The files so far, by path below the dataset's folder.
    pub files: BTreeMap<String, Checksum>,
}

impl<'a> Whole<'a> {
    /// For a dataset's folder.
    pub fn new(folder: &'a Path) -> Self {
        Self { folder, files: BTreeMap::new() }
    }

    /// Writes a file piece by piece, so that it may be larger than memory; it appears whole or not at all.
    pub fn file(&mut self, path: &str, write: impl FnOnce(&mut Stream<'_>) -> Result<()>) -> Result<()> {
        let full = below(self.folder, path)?;
        let mut sum = None;
        stream_atomically(&full, |file| {
            let mut stream = Stream { path: &full, file, hash: Sha256::new(), bytes: 0 };
            write(&mut stream)?;
            sum = Some(Checksum { sha256: hex::encode(stream.hash.finalize()), bytes: stream.bytes });
            Ok(())
        })?;
        self.files.extend(sum.map(|sum| (path.to_owned(), sum)));
        Ok(())
    }
}

/// A file under way.
pub struct Stream<'a> {
    path: &'a Path,
    file: &'a mut dyn Write,
    hash: Sha256,
    bytes: u64,
}

impl Stream<'_> {
    /// Adds text or bytes.
    pub fn put(&mut self, bytes: impl AsRef<[u8]>) -> Result<()> {
        self.write_all(bytes.as_ref()).map_err(Error::io(self.path))
    }

    /// Adds a value as JSON, on one line.
    pub fn json(&mut self, value: &impl Serialize) -> Result<()> {
        let path = self.path;
        serde_json::to_writer(&mut *self, value).map_err(|e| Error::io(path)(e.into()))
    }

    /// Adds values as the items of a JSON list, one a line: what stands between the brackets.
    pub fn items<T: Serialize>(&mut self, items: impl Iterator<Item = Result<T>>) -> Result<()> {
        for (i, item) in items.enumerate() {
            self.put(if i == 0 { "\n" } else { ",\n" })?;
            self.json(&item?)?;
        }
        self.put("\n")
    }
}

impl Write for Stream<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let n = self.file.write(bytes)?;
        self.hash.update(&bytes[..n]);
        self.bytes += n as u64;
        Ok(n)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.file.flush()
    }
}
