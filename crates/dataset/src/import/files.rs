//! Matching of the files of a source by the stems of their names, within each split.

use super::SourceImage;
use crate::model::split::Split;
use furrow_base::{Error, Result};
use furrow_output::Photo;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Extensions of image files.
const PICTURES: [&str; 3] = ["png", "jpg", "jpeg"];

/// Extensions of image files that cannot be read.
const OTHERS: [&str; 12] = ["heic", "heif", "avif", "webp", "tif", "tiff", "dng", "cr2", "nef", "bmp", "gif", "jxl"];

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
pub(super) fn listed(folder: &Path, suffix: &str) -> Result<BTreeMap<SourceImage, PathBuf>> {
    let mut all = BTreeMap::new();
    for (name, split) in SPLITS {
        let below = folder.join(name);
        if below.is_dir() {
            let found = pictures(&below, suffix)?;
            all.extend(found.into_iter().map(|(name, path)| (SourceImage { split: Some(split), name }, path)));
        }
    }
    if all.is_empty() {
        let found = pictures(folder, suffix)?;
        all.extend(found.into_iter().map(|(name, path)| (SourceImage { split: None, name }, path)));
    }
    Ok(all)
}

/// Returns a warning that counts the pictures of other formats in a folder and in the folders of its splits.
pub(super) fn unread(folder: &Path) -> Option<String> {
    let folders = [folder.to_path_buf()].into_iter().chain(SPLITS.iter().map(|(name, _)| folder.join(name)));
    let entries = folders.filter_map(|folder| std::fs::read_dir(folder).ok()).flatten().filter_map(Result::ok);
    let is_other = |path: &PathBuf| {
        path.extension().is_some_and(|ending| OTHERS.contains(&ending.to_string_lossy().to_lowercase().as_str()))
    };
    let count = entries.map(|entry| entry.path()).filter(is_other).count();
    (count > 0).then(|| format!("{}: {count} pictures that are neither PNG nor JPEG were left out", folder.display()))
}

/// Returns a file's length in bytes. Name and length identify a file without reading it.
pub(super) fn length(path: &Path) -> Result<u64> {
    Ok(std::fs::metadata(path).map_err(Error::reading(path))?.len())
}

/// Pixels of a photograph, and what was done to read it.
pub(super) struct Shot<T> {
    /// Width and height in pixels.
    pub(super) size: (u32, u32),
    pub(super) pixels: Vec<T>,
    /// Width and height as stored, before it was turned.
    pub(super) stored: (u32, u32),
    /// EXIF orientation.
    pub(super) orientation: u8,
    pub(super) warnings: Vec<String>,
}

/// Returns a photograph with warnings about what was changed to read it.
pub(super) fn photograph<T>(photo: Photo<T>) -> Shot<T> {
    let Photo { size, pixels, orientation, stored_size: stored, transparent } = photo;
    let mut warnings = Vec::new();
    if orientation != 1 {
        warnings.push(format!("the photograph was turned by its EXIF orientation {orientation}"));
    }
    if transparent > 0 {
        warnings.push(format!("{transparent} transparent pixels were composited over white"));
    }
    Shot { size, pixels, stored, orientation, warnings }
}

/// Returns an error if a label file's size differs from that of its image.
pub(super) fn same_size<T>(path: &Path, found: (u32, u32), image: &Shot<T>) -> Result<()> {
    if found == image.size {
        return Ok(());
    }
    let ((w, h), (x, y)) = (found, image.size);
    let error = if found == image.stored {
        let orientation = image.orientation;
        Error::input(format!(
            "it has {w} × {h} pixels like its image as stored, whose EXIF orientation {orientation} turns it to {x} × {y}"
        ))
        .help("turn this file too, or remove the orientation from the image")
    } else {
        Error::input(format!("it has {w} × {h} pixels, its image has {x} × {y}; they must be the same"))
    };
    Err(error.in_file(path))
}
