//! Refuses symbolic links to folders in a dataset: files would be written and removed in the folder that the link
//! points to.
//!
//! All folders of a dataset are searched when it is opened. Whenever a file is written or removed,
//! [`below`](furrow_base::input::below) checks the folders on its path again. Links to files are allowed: writing
//! replaces the link and never changes the file that it points to.

use crate::model::recipe::Recipe;
use furrow_base::Result;
use furrow_base::input::link_error;
use std::fs::{DirEntry, FileType};
use std::path::{Path, PathBuf};

/// Folders of a dataset besides those of its formats. The folder of job files may be anywhere; `cluster` checks it.
const FOLDERS: [&str; 6] = [IMAGES, "ledger", "packs", "pushed", "scene", "seals"];

/// Folder with many subfolders, which contain only files.
const IMAGES: &str = "images";

/// Returns an error if a folder that belongs to the dataset, or a folder in one, is a symbolic link to a folder. The
/// dataset's own folder may be a link; other entries in it belong to the user and may be links too.
pub(crate) fn refuse(folder: &Path, recipe: &Recipe) -> Result<()> {
    let formats = recipe.formats.iter().map(String::as_str);
    let names: Vec<&str> = FOLDERS.into_iter().chain(formats).collect();
    let is_own = |path: &Path| path.file_name().is_some_and(|name| names.iter().any(|own| name == *own));
    let images = folder.join(IMAGES);
    let mut todo: Vec<(PathBuf, FileType)> = in_folder(folder).filter(|(path, _)| is_own(path)).collect();
    while let Some((path, kind)) = todo.pop() {
        if kind.is_symlink() && path.is_dir() {
            return Err(link_error(&path));
        }
        if kind.is_dir() && path.parent() != Some(images.as_path()) {
            todo.extend(in_folder(&path));
        }
    }
    Ok(())
}

/// Returns the folders and links in a folder, without examining its files. A folder that no longer exists has none. If
/// a folder cannot be listed, its links are found when something is written to it.
fn in_folder(folder: &Path) -> impl Iterator<Item = (PathBuf, FileType)> {
    let no_file = |entry: DirEntry| {
        let kind = entry.file_type().ok()?;
        (!kind.is_file()).then(|| (entry.path(), kind))
    };
    std::fs::read_dir(folder).into_iter().flatten().filter_map(std::io::Result::ok).filter_map(no_file)
}
