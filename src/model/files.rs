//! The files of a model: its own, and those that it names.

use super::settle::Wrong;
use crate::input::{self, Outside, Refusal, Scope};
use crate::texture::{Allowance, Header, Need};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What helps where a model names a file outside its folder.
const HELP: &str =
    "put the file into the model's folder; of a model that you trust, write allow_outside: true in the scene file";

/// Reads a model's files and notes which.
pub(super) struct Files<'a> {
    /// Its own file.
    path: &'a Path,
    scope: Scope,
    /// What was read so far, with the SHA-256 of the bytes.
    pub(super) read: BTreeMap<PathBuf, [u8; 32]>,
    /// What its pictures may take.
    allowance: Allowance,
    /// What its pictures so far take.
    pub(super) pictures: Need,
}

impl<'a> Files<'a> {
    /// Of the model at `path`: the files that it names lie in its folder and below, or, where that is `lifted`, in this scope. Its
    /// pictures may take so much memory.
    pub(super) fn of(path: &'a Path, lifted: Option<&Scope>, allowance: Allowance) -> Self {
        let own = || Scope::Below { folder: folder(path).into(), help: HELP };
        let scope = lifted.cloned().unwrap_or_else(own);
        Self { path, scope, read: BTreeMap::new(), allowance, pictures: Need::default() }
    }

    /// The bytes of the model's own file; in words why there are none.
    pub(super) fn own(&mut self) -> Result<Vec<u8>, Wrong> {
        self.bytes(self.path.into())
    }

    /// The bytes of a file that it names.
    pub(super) fn named(&mut self, name: &str) -> Result<Vec<u8>, Wrong> {
        let outside =
            |outside: Outside| Wrong { what: format!("it names a file elsewhere: {outside}"), help: outside.help };
        let path = self.scope.resolve(folder(self.path), name).map_err(outside)?;
        self.bytes(path)
    }

    /// Counts the picture of this name that is about to be decoded from these bytes; in words why it may not be.
    pub(super) fn count(&mut self, name: &str, data: &[u8], need: fn(&Header) -> Need) -> Result<(), Wrong> {
        // What has no header is told when it is decoded.
        let Some(header) = Header::of(data) else { return Ok(()) };
        let need = need(&header);
        let wrong = |what: String| Wrong { what: format!("its picture {name}: {what}"), help: Allowance::HELP };
        self.allowance.take(&header, need).map_err(wrong)?;
        self.pictures = self.pictures + need;
        Ok(())
    }

    fn bytes(&mut self, path: PathBuf) -> Result<Vec<u8>, Wrong> {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let bytes = input::read(&path, input::LARGEST).map_err(|refusal| match refusal {
            Refusal::Io(e) if e.kind() == std::io::ErrorKind::NotFound => {
                format!("it needs a file `{name}`, which is not there")
            }
            Refusal::Folder => format!("it needs a file `{name}`, which is a folder"),
            other => format!("{name}: {other}"),
        })?;
        self.read.insert(path, Sha256::digest(&bytes).into());
        Ok(bytes)
    }
}

/// The folder of a file.
fn folder(path: &Path) -> &Path {
    path.parent().unwrap_or(Path::new(""))
}
