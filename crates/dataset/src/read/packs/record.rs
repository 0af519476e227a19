//! What is known of a pack: its checksum, where each file lies in it, and the checksums of its images.
//!
//! It is written last and holds a hash of itself, so a damaged record is none.

use super::Id;
use crate::model::recipe::compact;
use crate::read::archive::entry_name;
use crate::read::checksum::Checksum;
use crate::read::checksum_record::ChecksumRecord;
use furrow_base::Result;
use furrow_base::input;
use furrow_output::write_atomically;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

/// A pack that is there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct PackRecord {
    /// Its name.
    pub(crate) pack: String,
    /// Its archive.
    pub(crate) tar: Checksum,
    /// Where the contents of each file begin in the archive, and their length.
    pub(crate) members: BTreeMap<String, (u64, u64)>,
    /// Its images in the order of their numbers.
    pub(crate) images: Vec<ChecksumRecord>,
}

/// A record as it lies on disk.
#[derive(Serialize, Deserialize)]
struct Written {
    #[serde(flatten)]
    record: PackRecord,
    /// SHA-256 of the rest.
    seal_sha256: String,
}

impl PackRecord {
    /// The checksums of an image.
    pub(crate) fn image(&self, index: u64) -> Option<&ChecksumRecord> {
        self.images.get(self.images.binary_search_by_key(&index, |image| image.index).ok()?)
    }

    /// Reads a pack's record; `None` where there is none or it is damaged.
    pub(crate) fn read(folder: &Path, id: Id) -> Option<Self> {
        let bytes = input::contents(&folder.join(id.seal())).ok()?;
        let written: Written = serde_json::from_slice(&bytes).ok()?;
        let own = written.record.hash().ok()?;
        (own == written.seal_sha256 && written.record.pack == id.name()).then_some(written.record)
    }

    /// Writes it: after its archive.
    pub(crate) fn write(&self, folder: &Path, id: Id) -> Result<()> {
        let written = Written { seal_sha256: self.hash()?, record: self.clone() };
        write_atomically(&input::below(folder, &id.seal())?, &compact(&written)?)
    }

    /// SHA-256 over everything in it, hex.
    pub(crate) fn hash(&self) -> Result<String> {
        Ok(hex::encode(Sha256::digest(compact(self)?)))
    }
}

/// Most records of packs that are kept in memory: each takes some megabytes for a thousand images.
const MOST_KEPT: usize = 32;

/// The packs of one dataset, their records read when they are needed.
#[derive(Clone, Debug, Default)]
pub(crate) struct Packs(Arc<Mutex<Known>>);

/// Records that were read, and when each was last asked for, in calls.
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

    /// Keeps one in the place of the one that nobody has asked for the longest.
    fn keep(&mut self, id: Id, record: Arc<PackRecord>) {
        if self.records.len() >= MOST_KEPT {
            let oldest = self.records.iter().min_by_key(|(_, (last, _))| *last).map(|(id, _)| *id);
            oldest.and_then(|id| self.records.remove(&id));
        }
        self.records.insert(id, (self.calls, record));
    }
}

impl Packs {
    /// A pack's record, where there is one.
    pub(crate) fn get(&self, folder: &Path, id: Id) -> Option<Arc<PackRecord>> {
        let lock = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = lock().get(id) {
            return Some(known);
        }
        // Read without the lock: others may need other packs meanwhile.
        let record = Arc::new(PackRecord::read(folder, id)?);
        lock().keep(id, Arc::clone(&record));
        Some(record)
    }

    /// Forgets a pack that was written or taken apart.
    pub(crate) fn forget(&self, id: Id) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).records.remove(&id);
    }

    /// Length of an image's file in a pack.
    pub(crate) fn length(&self, folder: &Path, id: Id, path: &str) -> io::Result<u64> {
        let (record, (_, length)) = self.member(folder, id, path)?;
        let there = std::fs::metadata(folder.join(id.path()))?.len();
        if there == record.tar.bytes { Ok(length) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
    }

    /// Contents of an image's file in a pack.
    pub(crate) fn contents(&self, folder: &Path, id: Id, path: &str) -> io::Result<Vec<u8>> {
        let (record, (offset, length)) = self.member(folder, id, path)?;
        if offset.checked_add(length).is_none_or(|end| end > record.tar.bytes) {
            return Err(io::ErrorKind::InvalidData.into());
        }
        let mut file = input::open(&folder.join(id.path()))?;
        file.seek(SeekFrom::Start(offset))?;
        let mut bytes = Vec::new();
        file.take(length).read_to_end(&mut bytes)?;
        if bytes.len() as u64 == length { Ok(bytes) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
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

    /// Expected: a record comes back as it was written, and one of which a digit was changed is none.
    #[test]
    fn records_come_back_as_they_were() {
        let folder = tempfile::tempdir().unwrap();
        let id = Id { split: Split::Val, number: 3 };
        let sum = Checksum::of(b"x");
        let image = ChecksumRecord {
            index: 7,
            recipe: "ab".into(),
            labelling: None,
            files: [("images/000007/rgb.png".to_owned(), sum.clone())].into(),
        };
        let members = [("000007.rgb.png".to_owned(), (512, 1))].into();
        let record = PackRecord { pack: id.name(), tar: sum, members, images: vec![image] };
        record.write(folder.path(), id).unwrap();
        assert_eq!(PackRecord::read(folder.path(), id).as_ref(), Some(&record));
        assert!(record.image(7).is_some() && record.image(8).is_none());
        let path = folder.path().join(id.seal());
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, text.replace("512", "513")).unwrap();
        assert_eq!(PackRecord::read(folder.path(), id), None);
    }

    /// Packs of three splits are read side by side. Expected: the one in use stays, however many of others come and go.
    #[test]
    fn what_is_in_use_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let of = |number| Id { split: Split::Train, number };
        for number in 0..=MOST_KEPT as u64 {
            let id = of(number);
            let record =
                PackRecord { pack: id.name(), tar: Checksum::of(b"x"), members: BTreeMap::new(), images: Vec::new() };
            record.write(folder.path(), id).unwrap();
        }
        let packs = Packs::default();
        for number in 1..=MOST_KEPT as u64 {
            assert!(packs.get(folder.path(), of(0)).is_some() && packs.get(folder.path(), of(number)).is_some());
        }
        // What is kept needs no file.
        std::fs::remove_dir_all(folder.path().join("seals")).unwrap();
        assert!(packs.get(folder.path(), of(0)).is_some() && packs.get(folder.path(), of(1)).is_none());
        packs.forget(of(0));
        assert!(packs.get(folder.path(), of(0)).is_none());
    }
}
