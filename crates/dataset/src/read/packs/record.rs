//! Record of a pack: the checksum of the archive, the position of each file in it, and the checksum records of its
//! images.
//!
//! The record is written last and contains a hash of itself, so a damaged record counts as missing.

use super::Id;
use crate::model::recipe::compact;
use crate::read::archive::{BLOCK, entry_name};
use crate::read::checksum::Checksum;
use crate::read::checksum_record::ChecksumRecord;
use crate::read::native;
use crate::read::place::place;
use furrow_base::Result;
use furrow_base::input;
use furrow_base::math::ToInt;
use furrow_output::write_atomically;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

/// Record of a complete pack.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct PackRecord {
    /// Name of the pack.
    pub(crate) pack: String,
    /// Checksum of the archive.
    pub(crate) tar: Checksum,
    /// Offset of the contents of each file in the archive, and their length, in bytes.
    pub(crate) members: BTreeMap<String, (u64, u64)>,
    /// Checksum records of its images, in the order of their numbers.
    pub(crate) images: Vec<ChecksumRecord>,
}

/// A record as it is stored on disk.
#[derive(Serialize, Deserialize)]
struct Written {
    #[serde(flatten)]
    record: PackRecord,
    /// SHA-256 of the rest.
    seal_sha256: String,
}

impl PackRecord {
    /// Returns the checksum record of an image.
    pub(crate) fn image(&self, index: u64) -> Option<&ChecksumRecord> {
        self.images.get(self.images.binary_search_by_key(&index, |image| image.index).ok()?)
    }

    /// Reads the record of a pack; `None` if it is missing or damaged.
    pub(crate) fn read(folder: &Path, id: Id) -> Option<Self> {
        let bytes = input::contents(&folder.join(id.seal())).ok()?;
        let written: Written = serde_json::from_slice(&bytes).ok()?;
        let own = written.record.hash().ok()?;
        // The hash covers the values; the bytes could have other spaces, or fields that are not read.
        let whole = own == written.seal_sha256 && compact(&written).is_ok_and(|own| own == bytes);
        (whole && written.record.pack == id.name() && written.record.is_consistent()).then_some(written.record)
    }

    /// Returns whether the archive can have these files at these positions: the native files of each image, in the
    /// order of the images, with the lengths in their checksums.
    fn is_consistent(&self) -> bool {
        let mut end = 0_u64;
        let mut files = 0;
        for image in &self.images {
            for path in native::in_order(image.files.keys().filter(|path| native::is_native(path))) {
                let Some((offset, length)) = self.members.get(&entry_name(path)) else { return false };
                if *length != image.files[path].bytes || *offset < end.saturating_add(BLOCK) {
                    return false;
                }
                end = offset.saturating_add(*length);
                files += 1;
            }
        }
        let ascending = self.images.is_sorted_by(|a, b| a.index < b.index);
        ascending && files == self.members.len() && end <= self.tar.bytes
    }

    /// Writes the record, which must happen after the archive is written.
    pub(crate) fn write(&self, folder: &Path, id: Id) -> Result<()> {
        let written = Written { seal_sha256: self.hash()?, record: self.clone() };
        write_atomically(&place(folder, &id.seal())?, &compact(&written)?)
    }

    /// Returns the SHA-256 of all fields, in hex.
    pub(crate) fn hash(&self) -> Result<String> {
        Ok(hex::encode(Sha256::digest(compact(self)?)))
    }
}

/// Maximum number of pack records in memory: each takes some megabytes for a thousand images.
const MOST_KEPT: usize = 32;

/// Packs of one dataset. Their records are read when they are needed.
#[derive(Clone, Debug, Default)]
pub(crate) struct Packs(Arc<Mutex<Known>>);

/// Cache of records, each with the number of the call that last used it.
#[derive(Debug, Default)]
struct Known {
    records: BTreeMap<Id, (u64, Arc<PackRecord>)>,
    calls: u64,
}

impl Known {
    fn get(&mut self, id: Id) -> Option<Arc<PackRecord>> {
        self.calls += 1;
        let (last, record) = self.records.get_mut(&id)?;
        *last = self.calls;
        Some(Arc::clone(record))
    }

    /// Stores a record; in a full cache it replaces the least recently used one.
    fn keep(&mut self, id: Id, record: Arc<PackRecord>) {
        if self.records.len() >= MOST_KEPT {
            let oldest = self.records.iter().min_by_key(|(_, (last, _))| *last).map(|(id, _)| *id);
            oldest.and_then(|id| self.records.remove(&id));
        }
        self.records.insert(id, (self.calls, record));
    }
}

impl Packs {
    /// Returns the record of a pack; `None` if it is missing or damaged.
    pub(crate) fn get(&self, folder: &Path, id: Id) -> Option<Arc<PackRecord>> {
        let lock = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = lock().get(id) {
            return Some(known);
        }
        // The lock is released while the file is read, since other threads may need other packs.
        let record = Arc::new(PackRecord::read(folder, id)?);
        lock().keep(id, Arc::clone(&record));
        Some(record)
    }

    /// Removes a pack from the cache after it was written or unpacked.
    pub(crate) fn forget(&self, id: Id) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).records.remove(&id);
    }

    /// Returns the length of an image's file in a pack. An error if the archive does not have its recorded length.
    pub(crate) fn length(&self, folder: &Path, id: Id, path: &str) -> io::Result<u64> {
        let (record, (_, length)) = self.member(folder, id, path)?;
        let there = std::fs::metadata(folder.join(id.path()))?.len();
        if there == record.tar.bytes { Ok(length) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
    }

    /// Returns the contents of an image's file in a pack.
    pub(crate) fn contents(&self, folder: &Path, id: Id, path: &str) -> io::Result<Vec<u8>> {
        let (record, (offset, length)) = self.member(folder, id, path)?;
        if offset.checked_add(length).is_none_or(|end| end > record.tar.bytes) {
            return Err(io::ErrorKind::InvalidData.into());
        }
        let mut file = input::open(&folder.join(id.path()))?;
        file.seek(SeekFrom::Start(offset))?;
        let mut bytes = Vec::new();
        file.take(length).read_to_end(&mut bytes)?;
        if bytes.len().to_u64() == length { Ok(bytes) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
    }

    fn member(&self, folder: &Path, id: Id, path: &str) -> io::Result<(Arc<PackRecord>, (u64, u64))> {
        let not_found = || io::Error::from(io::ErrorKind::NotFound);
        let record = self.get(folder, id).ok_or_else(not_found)?;
        let place = *record.members.get(&entry_name(path)).ok_or_else(not_found)?;
        Ok((record, place))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::split::Split;

    /// Expected: a record is read as it was written, and counts as missing after one digit was changed.
    #[test]
    fn records_come_back_as_they_were() {
        let folder = tempfile::tempdir().unwrap();
        let id = Id { split: Split::Val, number: 3 };
        let sum = Checksum::of(b"x");
        let tar = Checksum { bytes: 4 * BLOCK, ..sum.clone() };
        let image = ChecksumRecord {
            index: 7,
            recipe: "ab".into(),
            labelling: None,
            files: [("images/000007/rgb.png".to_owned(), sum.clone())].into(),
        };
        let members = [("000007.rgb.png".to_owned(), (512, 1))].into();
        let record = PackRecord { pack: id.name(), tar, members, images: vec![image.clone()] };
        record.write(folder.path(), id).unwrap();
        assert_eq!(PackRecord::read(folder.path(), id).as_ref(), Some(&record));
        assert!(record.image(7).is_some() && record.image(8).is_none());
        let path = folder.path().join(id.seal());
        let text = std::fs::read_to_string(&path).unwrap();
        let spaced = format!(" {text}");
        let unread = text.replacen('{', "{\"other\":1,", 1);
        for changed in [text.replace("512", "513"), spaced, unread] {
            std::fs::write(&path, &changed).unwrap();
            assert_eq!(PackRecord::read(folder.path(), id), None, "{changed}");
        }
        // Records with the right hash that no archive can have.
        let with = |change: &dyn Fn(&mut PackRecord)| {
            let mut other = record.clone();
            change(&mut other);
            other.write(folder.path(), id).unwrap();
            PackRecord::read(folder.path(), id)
        };
        assert!(with(&|_| ()).is_some());
        for change in [
            &(|r: &mut PackRecord| r.members.clear()) as &dyn Fn(&mut PackRecord),
            &|r| _ = r.members.insert("x".into(), (0, 1)),
            &|r| _ = r.members.insert("000007.rgb.png".into(), (512, 2)),
            &|r| _ = r.members.insert("000007.rgb.png".into(), (0, 1)),
            &|r| r.tar.bytes = 512,
            &|r| r.images.clear(),
            &|r| r.images.push(image.clone()),
        ] {
            assert_eq!(with(change), None);
        }
    }

    /// Packs of three splits are read alternately. Expected: a pack in use stays in the cache, regardless of the number
    /// of other packs that are read.
    #[test]
    fn what_is_in_use_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let of = |number| Id { split: Split::Train, number };
        for number in 0..=MOST_KEPT.to_u64() {
            let id = of(number);
            let record =
                PackRecord { pack: id.name(), tar: Checksum::of(b"x"), members: BTreeMap::new(), images: Vec::new() };
            record.write(folder.path(), id).unwrap();
        }
        let packs = Packs::default();
        for number in 1..=MOST_KEPT.to_u64() {
            assert!(packs.get(folder.path(), of(0)).is_some() && packs.get(folder.path(), of(number)).is_some());
        }
        // A cached record needs no file.
        std::fs::remove_dir_all(folder.path().join("seals")).unwrap();
        assert!(packs.get(folder.path(), of(0)).is_some() && packs.get(folder.path(), of(1)).is_none());
        packs.forget(of(0));
        assert!(packs.get(folder.path(), of(0)).is_none());
    }
}
