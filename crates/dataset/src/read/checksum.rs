//! Checksum of a file: its length and its SHA-256.

use furrow_base::math::ToInt;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::io;
use std::path::Path;

/// Length and SHA-256 of a file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Checksum {
    /// SHA-256, in hex.
    pub sha256: String,
    /// Length, bytes.
    pub bytes: u64,
}

impl Checksum {
    /// Returns the checksum of the contents of a file.
    pub fn of(bytes: &[u8]) -> Self {
        Self { sha256: hex::encode(Sha256::digest(bytes)), bytes: bytes.len().to_u64() }
    }

    /// Returns the checksum of a file. The file is read in pieces, since an archive may be larger than memory.
    pub fn of_file(path: &Path) -> io::Result<Self> {
        let mut hash = Sha256::new();
        let bytes = io::copy(&mut furrow_base::input::open(path)?, &mut hash)?;
        Ok(Self { sha256: hex::encode(hash.finalize()), bytes })
    }

    /// Returns whether the file exists and has this checksum.
    pub fn holds(&self, path: &Path) -> bool {
        self.fault(path).is_none()
    }

    /// Describes how a file differs from this checksum; `None` if it does not.
    pub fn fault(&self, path: &Path) -> Option<String> {
        self.fault_of(std::fs::metadata(path).map(|about| about.len()), || Self::of_file(path))
    }

    /// Returns whether the contents of a file have this checksum.
    pub fn is_of(&self, bytes: &[u8]) -> bool {
        Self::of(bytes) == *self
    }

    /// Compares a file's length, and then the checksum that `found` computes, and describes the first difference.
    pub(crate) fn fault_of(&self, length: io::Result<u64>, found: impl FnOnce() -> io::Result<Self>) -> Option<String> {
        self.fault_of_length(length).or_else(|| match found() {
            Err(e) => Some(format!("cannot be read: {e}")),
            Ok(found) if found != *self => Some("was changed: its SHA-256 differs".into()),
            Ok(_) => None,
        })
    }

    /// Compares a file's length, and describes a difference.
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

    /// A pack of a thousand large images can be larger than any file that is read whole. Expected: its bytes are
    /// checked nevertheless.
    #[test]
    #[ignore = "takes the checksum of 4 GiB"]
    fn files_of_any_length_are_looked_at() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let sum = Checksum { bytes: LARGEST + 1, ..Checksum::of(b"") };
        assert_eq!(sum.fault(file.path()), Some(format!("has 0 bytes instead of {}", sum.bytes)));
        // A sparse file, which takes no disk space.
        file.as_file().set_len(LARGEST + 1).unwrap();
        assert_eq!(sum.fault(file.path()), Some("was changed: its SHA-256 differs".into()));
    }

    #[test]
    fn a_file_is_recognised_by_its_bytes() {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), [7; 10_000]).unwrap();
        let sum = Checksum::of(&[7; 10_000]);
        assert_eq!(Checksum::of_file(file.path()).unwrap(), sum);
        assert!(sum.holds(file.path()));
        std::fs::write(file.path(), [8; 10_000]).unwrap();
        assert!(!sum.holds(file.path()));
    }
}
