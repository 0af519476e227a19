//! Places of new files in a dataset. Folders are created below the dataset's folder only: a run whose dataset is moved
//! away must not create that folder again, or moving it back fails.

use crate::model::recipe::FILE;
use furrow_base::input::below;
use furrow_base::{Error, Result};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Returns the path of the file `path` in the dataset's `folder`, and creates the folders between them.
pub(crate) fn place(folder: &Path, path: &str) -> Result<PathBuf> {
    let full = below(folder, path)?;
    create_folders(folder, Path::new(path).parent().unwrap_or(Path::new("")))?;
    Ok(full)
}

/// Creates `path` below the dataset's `folder`, which must exist.
pub(crate) fn create_folders(folder: &Path, path: &Path) -> Result<()> {
    let root = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    if root.join(path).is_dir() {
        return Ok(());
    }
    let mut full = root.to_path_buf();
    for part in path {
        full.push(part);
        match std::fs::create_dir(&full) {
            Err(e) if e.kind() == ErrorKind::NotFound => return Err(gone(folder)),
            Err(e) if e.kind() != ErrorKind::AlreadyExists => return Err(Error::io(&full)(e)),
            _ => {}
        }
    }
    if root.is_dir() { Ok(()) } else { Err(gone(folder)) }
}

/// Returns the error about a dataset that is no longer in its folder. The same command may succeed later.
pub(crate) fn gone(folder: &Path) -> Error {
    Error::failed(format!("{FILE} has disappeared from this folder during the work"))
        .help("if the folder was moved or its disk was unmounted, bring it back and run the same command again")
        .in_file(folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: a run created the folder of its dataset again after it was moved, and the dataset could not be moved
    /// back. Expected: folders appear below an existing folder; without it, nothing is created.
    #[test]
    fn the_folder_of_a_dataset_is_not_created_again() {
        let around = tempfile::tempdir().unwrap();
        let folder = around.path().join("set");
        for path in ["a/b/c.png", "dataset.json"] {
            let error = place(&folder, path).unwrap_err();
            assert!(
                error.exit_code() == 1 && error.to_string().contains("has disappeared from this folder"),
                "{error}"
            );
        }
        assert!(!folder.exists());
        std::fs::create_dir(&folder).unwrap();
        for path in ["a/b/c.png", "a/d/e.png", "dataset.json"] {
            assert_eq!(place(&folder, path).unwrap(), folder.join(path));
        }
        assert!(folder.join("a/b").is_dir() && folder.join("a/d").is_dir());
        std::fs::write(folder.join("f"), "").unwrap();
        assert_eq!(place(&folder, "f/g/h").unwrap_err().exit_code(), 1);
    }
}
