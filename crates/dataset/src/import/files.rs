//! Matching of the files of a source by the stems of their names, within each split.

use super::Listed;
use crate::model::split::Split;
use furrow_base::{Error, Result};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Extensions of image files.
const PICTURES: [&str; 3] = ["png", "jpg", "jpeg"];

/// Names of the folders of splits.
const SPLITS: [(&str, Split); 6] = [
    ("train", Split::Train),
    ("training", Split::Train),
    ("val", Split::Val),
    ("valid", Split::Val),
    ("validation", Split::Val),
    ("test", Split::Test),
];

/// Returns the image files of a folder whose stems end in `suffix`, by the rest of the stem.
pub(super) fn pictures(folder: &Path, suffix: &str) -> Result<BTreeMap<String, PathBuf>> {
    let mut all: BTreeMap<String, PathBuf> = BTreeMap::new();
    for entry in std::fs::read_dir(folder).map_err(Error::reading(folder))? {
        let path = entry.map_err(Error::reading(folder))?.path();
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        if !PICTURES.contains(&ending.as_str()) || !path.is_file() {
            continue;
        }
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let Some(name) = stem.strip_suffix(suffix) else { continue };
        if let Some(other) = all.insert(name.to_owned(), path.clone()) {
            return Err(Error::input(format!("{} and {} have the same name", other.display(), path.display()))
                .help("remove one of them"));
        }
    }
    Ok(all)
}

/// Returns the image files of the split folders in `folder`, or of `folder` itself if it has none.
pub(super) fn listed(folder: &Path, suffix: &str) -> Result<BTreeMap<Listed, PathBuf>> {
    let mut all = BTreeMap::new();
    for (name, split) in SPLITS {
        let below = folder.join(name);
        if below.is_dir() {
            let found = pictures(&below, suffix)?;
            all.extend(found.into_iter().map(|(name, path)| (Listed { split: Some(split), name }, path)));
        }
    }
    if all.is_empty() {
        let found = pictures(folder, suffix)?;
        all.extend(found.into_iter().map(|(name, path)| (Listed { split: None, name }, path)));
    }
    Ok(all)
}

/// Returns a file's length in bytes. Name and length identify a file without reading it.
pub(super) fn length(path: &Path) -> Result<u64> {
    Ok(std::fs::metadata(path).map_err(Error::reading(path))?.len())
}

/// Returns an error if a label file's size differs from that of its image.
pub(super) fn same_size(path: &Path, found: (u32, u32), expected: (u32, u32)) -> Result<()> {
    if found == expected {
        return Ok(());
    }
    let ((w, h), (x, y)) = (found, expected);
    Err(Error::input(format!("it has {w} × {h} pixels, its image has {x} × {y}; they must be the same")).in_file(path))
}
