//! What a dataset's manifest lists, and what of it is not so.
//!
//! The manifest is written when all images are there. Where some are missing, it is of before: what belongs to no image is still what it lists,
//! and so are images that are there, as long as the recipe is the same. What only all images together can tell is left out.

use crate::make::finish::of_image;
use crate::model::recipe::{FILE, MANIFEST, Recipe};
use crate::model::split::Split;
use crate::read::checksum::Checksum;
use crate::read::set::Set;
use furrow_base::input::below;
use furrow_base::{Error, Result};
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};

/// What was found of it.
#[derive(Default)]
pub(crate) struct Listed {
    /// What is wrong, one sentence each.
    pub(crate) faults: Vec<String>,
    /// What could not be looked at for want of images.
    pub(crate) unchecked: Option<String>,
}

/// A manifest, as far as it is checked.
#[derive(Deserialize)]
struct Manifest {
    #[serde(default)]
    recipe: serde_json::Value,
    files: BTreeMap<String, Checksum>,
}

/// Looks at everything that the manifest lists; `missing` are the images that are not there, or not whole.
pub(crate) fn listed(set: &Set, missing: &[u64]) -> Result<Listed> {
    let whole = missing.is_empty();
    let only = |fault: String| Ok(Listed { faults: vec![fault], unchecked: None });
    let path = set.folder.join(MANIFEST);
    let bytes = match furrow_base::input::contents(&path) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound && whole => {
            return only(format!("{MANIFEST} is missing: `trace dataset finish {}` writes it", set.folder.display()));
        }
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
            let of_all = format!("scene, lists and tables, for {MANIFEST} is written when all images are there");
            return Ok(Listed { faults: Vec::new(), unchecked: Some(of_all) });
        }
        other => other.map_err(Error::io(&path))?,
    };
    let manifest: Manifest = match serde_json::from_slice(&bytes) {
        Ok(manifest) => manifest,
        Err(e) => return only(format!("{MANIFEST} is damaged: {e}")),
    };
    let before = !whole && serde_json::from_value::<Recipe>(manifest.recipe).ok().as_ref() != Some(&set.recipe);
    let mut sealed: BTreeMap<String, Checksum> = BTreeMap::new();
    let mut absent = Absent::default();
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
            // Looked at with its image.
            Some(checksums) if before || checksums == *sum => {}
            Some(_) => faults.push(format!("{path} is another file than {MANIFEST} lists")),
            None if before && path == FILE => {}
            None => match below(&set.folder, path) {
                Ok(full) => {
                    let fault = sum.fault(&full).filter(|_| whole || !absent.have(path));
                    faults.extend(fault.map(|fault| format!("{path} {fault}")));
                }
                Err(_) => faults.push(format!("{path} does not lie in the dataset's folder")),
            },
        }
    }
    if !before && !sealed.is_empty() {
        faults.push(format!("{MANIFEST} lacks {} files: `trace dataset finish` writes it anew", sealed.len()));
    }
    let unlike = format!("{FILE} and images by {MANIFEST}, which tells of another recipe until all images are there");
    Ok(Listed { faults, unchecked: before.then_some(unlike) })
}

/// Images of which not even checksums are there, so that only names tell which files are theirs.
#[derive(Default)]
struct Absent {
    names: BTreeSet<String>,
    /// What the files of other images are called.
    shapes: BTreeSet<String>,
}

impl Absent {
    /// Whether a file is one of theirs: it bears the number of one where files of other images bear theirs.
    fn have(&self, path: &str) -> bool {
        let mut numbers = path.split(|c: char| !c.is_ascii_digit()).filter(|run| self.names.contains(*run));
        // Where no image has checksums, nothing tells files of images from those of fields.
        numbers.any(|name| self.shapes.is_empty() || self.shapes.contains(&shape(path, name)))
    }
}

/// The path of an image's file whatever its number and its split.
fn shape(path: &str, name: &str) -> String {
    let is_split = |part: &str| Split::ALL.iter().any(|split| split.name() == part);
    let parts: Vec<&str> = path.split('/').map(|part| if is_split(part) { "split" } else { part }).collect();
    parts.join("/").replace(name, "*")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: files of an image that is gone are told by those of another one, in whichever split; those of fields and of all images are not theirs.
    #[test]
    fn files_of_absent_images_are_told_by_their_names() {
        let absent = Absent {
            names: BTreeSet::from(["000004".to_owned()]),
            shapes: ["images/000001/rgb.png", "yolo/labels/train/000001.txt"].map(|path| shape(path, "000001")).into(),
        };
        for own in ["images/000004/rgb.png", "yolo/labels/train/000004.txt", "yolo/labels/val/000004.txt"] {
            assert!(absent.have(own), "{own}");
        }
        for other in ["images/000003/rgb.png", "tum/000004-camera.txt", "colmap/000004/images.txt", "coco/train.json"] {
            assert!(!absent.have(other), "{other}");
        }
        assert!(Absent { shapes: BTreeSet::new(), ..absent }.have("yolo/labels/train/000004.txt"));
    }
}
