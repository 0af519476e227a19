//! What tells a file: its length and its SHA-256.

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::io;
use std::path::Path;

/// What tells a file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Checksum {
    /// SHA-256, hex.
    pub sha256: String,
    /// Length.
    pub bytes: u64,
}

impl Checksum {
    /// Of a file's contents.
    pub fn of(bytes: &[u8]) -> Self {
        Self { sha256: hex::encode(Sha256::digest(bytes)), bytes: bytes.len() as u64 }
    }

    /// Of a file, read piece by piece: an archive may be larger than memory.
    pub fn of_file(path: &Path) -> io::Result<Self> {
        let mut hash = Sha256::new();
        let bytes = io::copy(&mut furrow_base::input::open(path)?, &mut hash)?;
        Ok(Self { sha256: hex::encode(hash.finalize()), bytes })
    }

    /// Whether the file is there and has these contents.
    pub fn holds(&self, path: &Path) -> bool {
        self.fault(path).is_none()
    }

    /// What is wrong with the file, in words.
    pub fn fault(&self, path: &Path) -> Option<String> {
        self.fault_of(std::fs::metadata(path).map(|about| about.len()), || Self::of_file(path))
    }

    /// Whether a file has these contents.
    pub fn is_of(&self, bytes: &[u8]) -> bool {
        Self::of(bytes) == *self
    }

    /// What is wrong with a file of this length and with what its contents are told by, in words.
    pub(crate) fn fault_of(&self, length: io::Result<u64>, found: impl FnOnce() -> io::Result<Self>) -> Option<String> {
        self.fault_of_length(length).or_else(|| match found() {
            Err(e) => Some(format!("cannot be read: {e}")),
            Ok(found) if found != *self => Some("was changed: its SHA-256 differs".into()),
            Ok(_) => None,
        })
    }

    /// What is wrong with a file of this length, in words.
    pub(crate) fn fault_of_length(&self, length: io::Result<u64>) -> Option<String> {
        match length {
            Err(e) if e.kind() == io::ErrorKind::NotFound => Some("is missing".into()),
            Err(e) => Some(format!("cannot be read: {e}")),
            Ok(length) if length != self.bytes => Some(format!("has {length} bytes instead of {}", self.bytes)),
            Ok(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::input::LARGEST;

    /// A pack of a thousand large images is larger than any file that is read whole. Expected: its bytes are looked at all the same.
    #[test]
    #[ignore = "takes the checksum of 4 GiB"]
    fn files_of_any_length_are_looked_at() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let sum = Checksum { bytes: LARGEST + 1, ..Checksum::of(b"") };
        assert_eq!(sum.fault(file.path()), Some(format!("has 0 bytes instead of {}", sum.bytes)));
        // Of holes alone: it takes no room.
        file.as_file().set_len(LARGEST + 1).unwrap();
        assert_eq!(sum.fault(file.path()), Some("was changed: its SHA-256 differs".into()));
    }

    #[test]
    fn a_file_is_told_by_its_bytes() {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), [7; 10_000]).unwrap();
        let sum = Checksum::of(&[7; 10_000]);
        assert_eq!(Checksum::of_file(file.path()).unwrap(), sum);
        assert!(sum.holds(file.path()));
        std::fs::write(file.path(), [8; 10_000]).unwrap();
        assert!(!sum.holds(file.path()));
    }
}
