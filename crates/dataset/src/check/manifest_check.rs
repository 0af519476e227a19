//! Comparison of a dataset's manifest with its files.
//!
//! The manifest is written when all images are complete. If images are missing, it is from an earlier state: its
//! entries for files of no image are still valid, and so are those of existing images if the recipe is unchanged.
//! Checks that need all images are skipped.

use crate::make::finish::of_image;
use crate::model::recipe::{FILE, MANIFEST, Recipe};
use crate::model::split::Split;
use crate::read::checksum::Checksum;
use crate::read::set::Set;
use furrow_base::input::below;
use furrow_base::{Error, Result};
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};

/// Result of checking the manifest.
#[derive(Default)]
pub(crate) struct ManifestCheck {
    /// Faults, one sentence each.
    pub(crate) faults: Vec<String>,
    /// Description of the checks that were skipped because images are missing.
    pub(crate) unchecked: Option<String>,
}

/// The fields of a manifest that are checked.
#[derive(Deserialize)]
struct Manifest {
    #[serde(default)]
    recipe: serde_json::Value,
    files: BTreeMap<String, Checksum>,
}

/// Checks all files that the manifest lists. `missing` contains the indices of missing or incomplete images.
pub(crate) fn check_manifest(set: &Set, missing: &[u64]) -> Result<ManifestCheck> {
    let whole = missing.is_empty();
    let only = |fault: String| Ok(ManifestCheck { faults: vec![fault], unchecked: None });
    let path = set.folder.join(MANIFEST);
    let bytes = match furrow_base::input::contents(&path) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound && whole => {
            return only(format!("{MANIFEST} is missing: `trace dataset finish {}` writes it", set.folder.display()));
        }
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
            let of_all = format!("scene, lists and tables, because {MANIFEST} is written when all images are complete");
            return Ok(ManifestCheck { faults: Vec::new(), unchecked: Some(of_all) });
        }
        other => other.map_err(Error::io(&path))?,
    };
    let manifest: Manifest = match serde_json::from_slice(&bytes) {
        Ok(manifest) => manifest,
        Err(e) => return only(format!("{MANIFEST} is damaged: {e}")),
    };
    let before = !whole && serde_json::from_value::<Recipe>(manifest.recipe).ok().as_ref() != Some(&set.recipe);
    let mut sealed: BTreeMap<String, Checksum> = BTreeMap::new();
    let mut absent = UnrecordedImages::default();
    for (index, image) in (0..).zip(set.all_checksums()) {
        let name = Set::name(index);
        let Some(image) = image else {
            absent.names.insert(name);
            continue;
        };
        for (path, sum) in of_image(&set.recipe, &image) {
            if !whole {
                absent.shapes.insert(shape(path, &name));
            }
            sealed.insert(path.clone(), sum.clone());
        }
    }
    let mut faults = Vec::new();
    for (path, sum) in &manifest.files {
        match sealed.remove(path) {
            // The file itself is checked with its image.
            Some(checksums) if before || checksums == *sum => {}
            Some(_) => faults.push(format!("{path} differs from the file that {MANIFEST} lists")),
            None if before && path == FILE => {}
            None => match below(&set.folder, path) {
                Ok(full) => {
                    let fault = sum.fault(&full).filter(|_| whole || !absent.have(path));
                    faults.extend(fault.map(|fault| format!("{path} {fault}")));
                }
                Err(_) => faults.push(format!("{path} is outside the dataset's folder")),
            },
        }
    }
    if !before && !sealed.is_empty() {
        faults.push(format!("{MANIFEST} lacks {} files: `trace dataset finish` rewrites it", sealed.len()));
    }
    let unlike = format!("{FILE} and images by {MANIFEST}, which is of another recipe until all images are complete");
    Ok(ManifestCheck { faults, unchecked: before.then_some(unlike) })
}

/// Images without a checksum record; their files can only be recognised by name.
#[derive(Default)]
struct UnrecordedImages {
    names: BTreeSet<String>,
    /// Path patterns of other images' files, as [`shape`] returns them.
    shapes: BTreeSet<String>,
}

impl UnrecordedImages {
    /// Returns `true` if a file belongs to one of these images: its path has the image's number in the same place as
    /// the files of other images.
    fn have(&self, path: &str) -> bool {
        let mut numbers = path.split(|c: char| !c.is_ascii_digit()).filter(|run| self.names.contains(*run));
        // If no image has a checksum record, files of images cannot be distinguished from those of fields.
        numbers.any(|name| self.shapes.is_empty() || self.shapes.contains(&shape(path, name)))
    }
}

/// Replaces the image's number and the split in a path, so that equal files of different images have equal patterns.
fn shape(path: &str, name: &str) -> String {
    let is_split = |part: &str| Split::ALL.iter().any(|split| split.name() == part);
    let parts: Vec<&str> = path.split('/').map(|part| if is_split(part) { "split" } else { part }).collect();
    parts.join("/").replace(name, "*")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: files of a missing image are recognised by the paths of another image's files, in any split; files of
    /// fields and of the whole dataset are not.
    #[test]
    fn files_of_absent_images_are_recognised_by_their_names() {
        let absent = UnrecordedImages {
            names: BTreeSet::from(["000004".to_owned()]),
            shapes: ["images/000001/rgb.png", "yolo/labels/train/000001.txt"].map(|path| shape(path, "000001")).into(),
        };
        for own in ["images/000004/rgb.png", "yolo/labels/train/000004.txt", "yolo/labels/val/000004.txt"] {
            assert!(absent.have(own), "{own}");
        }
        for other in ["images/000003/rgb.png", "tum/000004-camera.txt", "colmap/000004/images.txt", "coco/train.json"] {
            assert!(!absent.have(other), "{other}");
        }
        assert!(UnrecordedImages { shapes: BTreeSet::new(), ..absent }.have("yolo/labels/train/000004.txt"));
    }
}
