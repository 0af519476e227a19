//! What tells a file: its length and its SHA-256.

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
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
        match std::fs::metadata(path) {
            Err(e) => {
                return Some(if e.kind() == std::io::ErrorKind::NotFound {
                    "is missing".into()
                } else {
                    format!("cannot be read: {e}")
                });
            }
            Ok(about) if about.len() != self.bytes => {
                return Some(format!("has {} bytes instead of {}", about.len(), self.bytes));
            }
            Ok(_) => {}
        }
        match crate::input::contents(path) {
            Err(e) => Some(format!("cannot be read: {e}")),
            Ok(bytes) if Self::of(&bytes) != *self => Some("was changed: its SHA-256 differs".into()),
            Ok(_) => None,
        }
    }
}
