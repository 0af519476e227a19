//! A dataset in a folder: its recipe, its images by name, and the files that belong to all images.

use crate::model::recipe::{FILE, Recipe};
use crate::model::record::Record;
use crate::model::sample::Sample;
use crate::model::split::Split;
use crate::read::archive::entry_name;
use crate::read::checksum::Checksum;
use crate::read::checksum_record::ChecksumRecord;
use crate::read::links;
use crate::read::native::{self, Files};
use crate::read::packs::Id;
use crate::read::packs::Packing;
use crate::read::packs::record::Packs;
use crate::read::place::{gone, place};
use furrow_base::error::Kind;
use furrow_base::input::below;
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use furrow_output::stream_atomically;
use rayon::prelude::*;
use serde::Serialize;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// A dataset on disk.
#[derive(Clone, Debug)]
pub struct Set {
    /// Folder of the dataset.
    pub folder: PathBuf,
    /// Recipe of the dataset.
    pub recipe: Recipe,
    /// Archives that contain images.
    pub(crate) packs: Packs,
}

impl Set {
    /// Returns the dataset with this recipe in `folder`, without accessing the disk.
    pub fn new(folder: &Path, recipe: Recipe) -> Self {
        Self { folder: folder.into(), recipe, packs: Packs::default() }
    }

    /// Opens the dataset in `folder`. An error if a folder in it is a symbolic link, since datasets may come from other
    /// people.
    pub fn open(folder: &Path) -> Result<Self> {
        let recipe = Recipe::read(folder)?;
        links::refuse(folder, &recipe)?;
        Ok(Self::new(folder, recipe))
    }

    /// Returns the error of work on this dataset. If its recipe has disappeared since it was opened, that is the cause of
    /// missing files, and the same command may succeed later.
    #[must_use]
    pub fn blame(&self, error: Error) -> Error {
        let wrong = matches!(error.kind(), Kind::Input | Kind::Misuse);
        if !wrong || self.folder.join(FILE).is_file() {
            return error;
        }
        gone(&self.folder)
    }

    /// Returns the name of an image: its number in six digits or more.
    pub fn name(index: u64) -> String {
        native::image_name(index)
    }

    /// Returns the names of a split's images, in the order of their numbers.
    pub fn names(&self, split: Split) -> Vec<String> {
        (0..self.recipe.count).filter(|k| self.recipe.split_of(*k) == split).map(Self::name).collect()
    }

    /// Reads the records of a split's images, in the order of their numbers.
    pub fn records(&self, split: Split) -> impl Iterator<Item = Result<Record>> + '_ {
        in_parallel((0..self.recipe.count).filter(move |k| self.recipe.split_of(*k) == split), |k| self.record(k))
    }

    /// Reads the records of all images, in the order of their numbers.
    pub fn all(&self) -> impl Iterator<Item = Result<Record>> + '_ {
        in_parallel(0..self.recipe.count, |k| self.record(k))
    }

    /// Reads the checksum records of all images, in the order of their numbers; `None` if a record is missing or
    /// damaged.
    pub(crate) fn all_checksums(&self) -> impl Iterator<Item = Option<ChecksumRecord>> + '_ {
        in_parallel(0..self.recipe.count, |k| self.checksums(k))
    }

    /// Reads an image with all its maps.
    pub fn sample(&self, index: u64) -> Result<Sample> {
        native::sample(self, &Self::name(index))
    }

    /// Reads the record of an image, without its maps.
    pub fn record(&self, index: u64) -> Result<Record> {
        native::record(self, &Self::name(index))
    }

    /// Reads the checksum record of an image, from its own file or from its pack; `None` if it is missing or damaged.
    pub fn checksums(&self, index: u64) -> Option<ChecksumRecord> {
        ChecksumRecord::read(&self.folder, index).or_else(|| {
            let id = Packing::of(&self.recipe)?.id(index);
            self.packs.get(&self.folder, id)?.image(index).cloned()
        })
    }

    /// Returns the missing and the changed files of an image, each with a description of the difference.
    pub fn faults(&self, image: &ChecksumRecord) -> Vec<(String, String)> {
        self.faults_where(image, |_| true)
    }

    /// Returns the same for the files outside packs, which are those of formats.
    pub(crate) fn faults_beside_packs(&self, image: &ChecksumRecord) -> Vec<(String, String)> {
        self.faults_where(image, |path| !native::is_native(path))
    }

    /// Returns the same for the image's record alone; all files that cover many images are made from records.
    pub(crate) fn fault_of_record(&self, image: &ChecksumRecord) -> Option<(String, String)> {
        self.faults_where(image, |path| native::is_native(path) && path.ends_with("/record.json")).pop()
    }

    fn faults_where(&self, image: &ChecksumRecord, which: impl Fn(&str) -> bool) -> Vec<(String, String)> {
        let fault = |(path, sum): (&String, &Checksum)| match below(&self.folder, path) {
            Ok(_) => Some((path.clone(), sum.fault_of(self.length(path), || Ok(Checksum::of(&self.contents(path)?)))?)),
            Err(_) => Some((path.clone(), "does not lie in the dataset's folder".into())),
        };
        image.files.iter().filter(|(path, _)| which(path)).filter_map(fault).collect()
    }

    /// Returns the length of an image's file, which is in the dataset's folder or in a pack.
    pub(crate) fn length(&self, path: &str) -> io::Result<u64> {
        self.find(
            path,
            |full| {
                let about = std::fs::metadata(full)?;
                if about.is_file() { Ok(about.len()) } else { Err(io::ErrorKind::IsADirectory.into()) }
            },
            |packs, id| packs.length(&self.folder, id, path),
        )
    }

    /// Searches the folder first, since its files are newer than those of the pack, then the pack.
    fn find<T>(
        &self,
        path: &str,
        in_folder: impl FnOnce(&Path) -> io::Result<T>,
        in_pack: impl FnOnce(&Packs, Id) -> io::Result<T>,
    ) -> io::Result<T> {
        match in_folder(&self.folder.join(path)) {
            Err(e) if e.kind() == io::ErrorKind::NotFound => match self.pack_of(path) {
                Some(id) => in_pack(&self.packs, id),
                None => Err(e),
            },
            other => other,
        }
    }

    /// Returns the pack that a file belongs to.
    fn pack_of(&self, path: &str) -> Option<Id> {
        let packing = Packing::of(&self.recipe)?;
        let (name, _) = path.strip_prefix("images/")?.split_once('/')?;
        Some(packing.id(name.parse().ok()?))
    }
}

impl Files for Set {
    fn contents(&self, path: &str) -> io::Result<Vec<u8>> {
        self.find(path, furrow_base::input::contents, |packs, id| packs.contents(&self.folder, id, path))
    }

    fn place(&self, path: &str) -> PathBuf {
        let full = self.folder.join(path);
        match self.pack_of(path) {
            Some(id) if !full.exists() => self.folder.join(id.path()).join(entry_name(path)),
            _ => full,
        }
    }

    fn recipe(&self) -> Option<&Recipe> {
        Some(&self.recipe)
    }
}

/// Number of images that are read at a time: enough for all threads, with little memory.
const AT_ONCE: usize = 256;

/// Calls `read` for each image on several threads and returns the results in the order of the numbers. Images are read
/// in batches of `AT_ONCE`, which are in few packs.
pub(crate) fn in_parallel<'a, T: Send + 'a>(
    mut numbers: impl Iterator<Item = u64> + 'a,
    read: impl Fn(u64) -> T + Sync + 'a,
) -> impl Iterator<Item = T> + 'a {
    let next = move || {
        let some: Vec<u64> = numbers.by_ref().take(AT_ONCE).collect();
        (!some.is_empty()).then(|| some.into_par_iter().map(&read).collect::<Vec<T>>())
    };
    std::iter::from_fn(next).flatten()
}

/// Writer of the files that belong to all images; collects their checksums.
pub struct SetWriter<'a> {
    folder: &'a Path,
    /// Checksums of the files written so far, by path relative to the dataset's folder.
    pub files: BTreeMap<String, Checksum>,
}

impl<'a> SetWriter<'a> {
    /// Returns a writer for the dataset in `folder`.
    pub fn new(folder: &'a Path) -> Self {
        Self { folder, files: BTreeMap::new() }
    }

    /// Writes a file in pieces, so that it may be larger than memory. The file appears complete or not at all.
    pub fn file(&mut self, path: &str, write: impl FnOnce(&mut Stream<'_>) -> Result<()>) -> Result<()> {
        let full = place(self.folder, path)?;
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

/// A file that is being written.
pub struct Stream<'a> {
    path: &'a Path,
    file: &'a mut (dyn Write + Send),
    hash: Sha256,
    bytes: u64,
}

impl Stream<'_> {
    /// Returns the number of bytes written so far.
    pub(crate) fn written(&self) -> u64 {
        self.bytes
    }

    /// Writes text or bytes.
    pub fn put(&mut self, bytes: impl AsRef<[u8]>) -> Result<()> {
        self.write_all(bytes.as_ref()).map_err(Error::io(self.path))
    }

    /// Writes a value as JSON, on one line.
    pub fn json(&mut self, value: &impl Serialize) -> Result<()> {
        let path = self.path;
        serde_json::to_writer(&mut *self, value).map_err(|e| Error::io(path)(e.into()))
    }

    /// Writes values as the items of a JSON list, one per line, without the brackets of the list.
    pub fn items<T: Serialize>(&mut self, items: impl Iterator<Item = Result<T>>) -> Result<()> {
        for (i, item) in items.enumerate() {
            self.put(if i == 0 { "\n" } else { ",\n" })?;
            self.json(&item?)?;
        }
        self.put("\n")
    }
}

impl Write for Stream<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let n = self.file.write(bytes)?;
        self.hash.update(&bytes[..n]);
        self.bytes += n.to_u64();
        Ok(n)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: exit code 1, which a scheduler retries, if the recipe has disappeared; other errors are unchanged.
    #[test]
    fn a_dataset_that_disappears_is_a_failure() {
        let folder = tempfile::tempdir().unwrap();
        let set = Set::new(folder.path(), Recipe::of_species(Vec::new()));
        let missing = || Error::input("there is no file `beet.ron`").help("looked in scene");
        std::fs::write(folder.path().join(FILE), "{}").unwrap();
        assert_eq!(set.blame(missing()).exit_code(), 2);
        std::fs::remove_file(folder.path().join(FILE)).unwrap();
        let error = set.blame(missing());
        assert_eq!(error.exit_code(), 1);
        assert_eq!(error.message(), "dataset.json has disappeared from this folder during the work");
        assert_eq!(set.blame(Error::interrupted()).exit_code(), 75);
    }
}
