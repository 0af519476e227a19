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

    /// Whether the file is there and has these contents.
    pub fn holds(&self, path: &Path) -> bool {
        self.fault(path).is_none()
    }

    /// What is wrong with the file, in words.
    pub fn fault(&self, path: &Path) -> Option<String> {
        self.fault_of(std::fs::metadata(path).map(|about| about.len()), || crate::input::contents(path))
    }

    /// Whether a file has these contents.
    pub fn is_of(&self, bytes: &[u8]) -> bool {
        Self::of(bytes) == *self
    }

    /// What is wrong with a file of this length and these contents, in words.
    pub(super) fn fault_of(
        &self,
        length: io::Result<u64>,
        contents: impl FnOnce() -> io::Result<Vec<u8>>,
    ) -> Option<String> {
        match length {
            Err(e) => {
                return Some(if e.kind() == io::ErrorKind::NotFound {
                    "is missing".into()
                } else {
                    format!("cannot be read: {e}")
                });
            }
            Ok(length) if length != self.bytes => {
                return Some(format!("has {length} bytes instead of {}", self.bytes));
            }
            Ok(_) => {}
        }
        match contents() {
            Err(e) => Some(format!("cannot be read: {e}")),
            Ok(bytes) if !self.is_of(&bytes) => Some("was changed: its SHA-256 differs".into()),
            Ok(_) => None,
        }
    }
}
