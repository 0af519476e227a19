//! Matching of the files of a source by the stems of their names, within each split.

use super::SourceImage;
use crate::model::split::Split;
use furrow_base::{Error, Result};
use furrow_output::Photo;
use std::collections::{BTreeMap, BTreeSet};
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
    let mut all: BTreeMap<SourceImage, PathBuf> = BTreeMap::new();
    for (below, split) in split_folders(folder)? {
        for (name, path) in pictures(&below, suffix)? {
            if let Some(other) = all.insert(SourceImage { split: Some(split), name }, path.clone()) {
                let words = format!("{} and {} have the same name and split", other.display(), path.display());
                return Err(Error::input(words).help("rename one of them, or remove it"));
            }
        }
    }
    if all.is_empty() {
        let found = pictures(folder, suffix)?;
        all.extend(found.into_iter().map(|(name, path)| (SourceImage { split: None, name }, path)));
    }
    Ok(all)
}

/// Returns the folders in `folder` that are named after a split, in any capitals.
fn split_folders(folder: &Path) -> Result<Vec<(PathBuf, Split)>> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(Error::reading(folder))? {
        let path = entry.map_err(Error::reading(folder))?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
        let split = SPLITS.iter().find(|(of, _)| *of == name).map(|(_, split)| *split);
        found.extend(split.filter(|_| path.is_dir()).map(|split| (path, split)));
    }
    found.sort();
    Ok(found)
}

/// Largest depth of subfolders that are searched for pictures that are left out.
const MOST_DEPTH: usize = 4;

/// Returns warnings that count the pictures in a folder and below that are left out: those of other formats, and those that
/// are not among `read`. Of these, the ones whose names end in one of `others` are no images.
pub(super) fn unread<'a>(
    folder: &Path,
    suffix: &str,
    others: &[&str],
    read: impl Iterator<Item = &'a PathBuf>,
) -> Vec<String> {
    let read: BTreeSet<&PathBuf> = read.collect();
    let (mut unreadable, mut elsewhere, mut unnamed) = (0_usize, Vec::new(), Vec::new());
    let mut open = vec![(folder.to_path_buf(), 0)];
    while let Some((within, depth)) = open.pop() {
        for entry in std::fs::read_dir(within).ok().into_iter().flatten().filter_map(Result::ok) {
            let path = entry.path();
            if entry.file_type().is_ok_and(|kind| kind.is_dir()) && depth < MOST_DEPTH {
                open.push((path, depth + 1));
                continue;
            }
            let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
            let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
            unreadable += usize::from(OTHERS.contains(&ending.as_str()));
            if !PICTURES.contains(&ending.as_str()) || read.contains(&path) {
                continue;
            }
            if stem.ends_with(suffix) {
                elsewhere.push(path);
            } else if !others.iter().any(|other| stem.ends_with(other)) {
                unnamed.push(path);
            }
        }
    }
    let place = folder.display();
    let mut warnings = Vec::new();
    if unreadable > 0 {
        warnings.push(format!("{place}: {unreadable} pictures that are neither PNG nor JPEG were left out"));
    }
    let places = "images are read in this folder, or, if there are such, in its folders train, val and test".to_owned();
    for (left, why) in [(elsewhere, places), (unnamed, format!("their names do not end in `{suffix}`"))] {
        if let Some(first) = left.iter().min() {
            let first = first.strip_prefix(folder).unwrap_or(first).display();
            warnings.push(format!("{place}: {} pictures were left out, such as {first}: {why}", left.len()));
        }
    }
    warnings
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
    let Photo { size, pixels, orientation, stored_size: stored, transparent, .. } = photo;
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
