//! Symbolic links in a dataset's folder: behind one that leads to another folder, files would be written and removed elsewhere.
//!
//! All folders of a dataset are looked through when it is opened; [`below`](furrow_base::input::below) looks again wherever a file is written or
//! removed, at the folders on its path. Links to files may stay: a file is replaced, and never written through.

use crate::model::recipe::Recipe;
use furrow_base::Result;
use furrow_base::input::link_error;
use std::fs::{DirEntry, FileType};
use std::path::{Path, PathBuf};

/// Folders of a dataset beside those of its formats. That for job files may be anywhere: `cluster` looks at it.
const FOLDERS: [&str; 6] = [IMAGES, "ledger", "packs", "pushed", "scene", "seals"];

/// The one whose folders are many, and hold files alone.
const IMAGES: &str = "images";

/// An error where a folder of this dataset, or one in it, is a symbolic link to a folder. The dataset's own folder may be one, and so may
/// what else lies in it: that is the user's.
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

/// The folders and links in a folder, without a look at each of its files. A folder that is gone by now holds none; in one that cannot be
/// listed they are found where something is written.
fn in_folder(folder: &Path) -> impl Iterator<Item = (PathBuf, FileType)> {
    let no_file = |entry: DirEntry| {
        let kind = entry.file_type().ok()?;
        (!kind.is_file()).then(|| (entry.path(), kind))
    };
    std::fs::read_dir(folder).into_iter().flatten().filter_map(std::io::Result::ok).filter_map(no_file)
}
