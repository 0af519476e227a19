//! Files of a model: its own, and those that it refers to.

use super::settle::ModelError;
use furrow_base::input::{self, Outside, Refusal, Scope};
use furrow_optics::texture::{Header, MemoryLimit, Need};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Advice for a model that refers to a file outside its folder.
const HELP: &str =
    "put the file into the model's folder; for a model that you trust, write allow_outside: true in the scene file";

/// Reads a model's files and records them.
pub(super) struct Files<'a> {
    /// Path of the model file.
    path: &'a Path,
    scope: Scope,
    /// Files read so far, with the SHA-256 of their bytes.
    pub(super) read: BTreeMap<PathBuf, [u8; 32]>,
    /// Memory limit of its textures.
    allowance: MemoryLimit,
    /// Memory needed by its textures so far.
    pub(super) pictures: Need,
}

impl<'a> Files<'a> {
    /// Creates a reader for the model at `path`. Files that it refers to must be in its folder or below, or in the
    /// scope `lifted` if given. `allowance` limits the memory of its textures.
    pub(super) fn of(path: &'a Path, lifted: Option<&Scope>, allowance: MemoryLimit) -> Self {
        let own = || Scope::Below { folder: folder(path).into(), help: HELP };
        let scope = lifted.cloned().unwrap_or_else(own);
        Self { path, scope, read: BTreeMap::new(), allowance, pictures: Need::default() }
    }

    /// Reads the model's own file.
    pub(super) fn own(&mut self) -> Result<Vec<u8>, ModelError> {
        self.bytes(self.path.into())
    }

    /// Reads a file that the model refers to.
    pub(super) fn named(&mut self, name: &str) -> Result<Vec<u8>, ModelError> {
        let outside = |outside: Outside| ModelError {
            what: format!("it refers to a file elsewhere: {outside}"),
            help: outside.help,
        };
        let path = self.scope.resolve(folder(self.path), name).map_err(outside)?;
        self.bytes(path)
    }

    /// Counts the texture `name`, which is about to be decoded from `data`. Returns an error if it exceeds the memory
    /// limit.
    pub(super) fn count(&mut self, name: &str, data: &[u8], need: fn(&Header) -> Need) -> Result<(), ModelError> {
        // Data without a valid header is reported when it is decoded.
        let Some(header) = Header::of(data) else { return Ok(()) };
        let need = need(&header);
        let wrong = |what: String| ModelError { what: format!("its picture {name}: {what}"), help: MemoryLimit::HELP };
        self.allowance.take(&header, need).map_err(wrong)?;
        self.pictures = self.pictures + need;
        Ok(())
    }

    fn bytes(&mut self, path: PathBuf) -> Result<Vec<u8>, ModelError> {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let bytes = input::read(&path, input::LARGEST).map_err(|refusal| match refusal {
            Refusal::Io(e) if e.kind() == std::io::ErrorKind::NotFound => {
                format!("it needs a file `{name}`, which does not exist")
            }
            Refusal::Folder => format!("it needs a file `{name}`, which is a folder"),
            other => format!("{name}: {other}"),
        })?;
        self.read.insert(path, Sha256::digest(&bytes).into());
        Ok(bytes)
    }
}

/// Returns the folder of a file.
fn folder(path: &Path) -> &Path {
    path.parent().unwrap_or(Path::new(""))
}
