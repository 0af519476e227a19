//! Folders of pictures: what is in them, and what is known of each.
//!
//! Pictures are found as `trace compare` finds them: below `images/` where there is such a folder; of datasets and renders each `rgb.png` or `rgb.jpg`.
//! Labels are `labels/NAME.png` or `semantics.png` beside such a picture; near infrared is `nir/NAME.png`, or the file whose name begins with
//! `nir` where the picture's begins with `rgb`.

use crate::compare::pairs::{beside, beside_rgb, first, stem, told, walk};
use crate::{Error, Result, output};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// One picture and what is known of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Photo {
    /// Name below the folder, without the extension.
    pub name: String,
    /// Its colours.
    pub rgb: PathBuf,
    /// Near infrared.
    pub nir: Option<PathBuf>,
    /// Classes of the pixels.
    pub labels: Option<PathBuf>,
}

/// Finds the pictures of a folder, by name. `option` is what it was given as. An error where there is none.
pub fn photos(folder: &Path, option: &str) -> Result<Vec<Photo>> {
    if !folder.is_dir() {
        let what = if folder.exists() { "this is no folder" } else { "there is no such folder" };
        return Err(Error::input(format!("{option} {}: {what}", folder.display()))
            .help("give a folder with images/ and, if there are any, labels/ and nir/; or a dataset"));
    }
    let mut found = BTreeMap::new();
    let images = folder.join("images");
    if let Some(rendered) = output::photograph_in(folder, "rgb") {
        found.insert(stem(&rendered), rendered);
    } else if images.is_dir() {
        walk(&images, "", &mut found)?;
    } else {
        walk(folder, "", &mut found)?;
        found.retain(|name, _| !name.starts_with("labels/") && !name.starts_with("nir/"));
    }
    let partners: Vec<PathBuf> = found.values().filter_map(|rgb| beside_rgb(rgb, "nir")).collect();
    found.retain(|_, rgb| !partners.contains(rgb));
    if found.is_empty() {
        return Err(Error::input(format!("{option} {}: there is no PNG or JPEG in this folder", folder.display()))
            .help("give a folder with images/, or a dataset"));
    }
    let photo = |(name, rgb): (String, PathBuf)| {
        let below = |other: &str| first([folder.join(other).join(format!("{name}.png"))]);
        let nir = beside_rgb(&rgb, "nir").or_else(|| below("nir"));
        Photo { labels: beside(&rgb).or_else(|| below("labels")), nir, rgb, name }
    };
    Ok(found.into_iter().map(photo).collect())
}

/// A sentence where only some pictures of a set have labels or near infrared.
pub(super) fn warnings(set: &str, photos: &[Photo]) -> Vec<String> {
    let some = |what: &str, has: &dyn Fn(&Photo) -> bool| {
        let without: Vec<String> = photos.iter().filter(|photo| !has(photo)).map(|photo| photo.name.clone()).collect();
        let mixed = !without.is_empty() && without.len() < photos.len();
        mixed.then(|| format!("{} pictures of {set} have no {what}: {}", without.len(), told(&without)))
    };
    let labels = some("labels", &|photo| photo.labels.is_some());
    [labels, some("near infrared", &|photo| photo.nir.is_some())].into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(files: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for file in files {
            let path = folder.path().join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, "").unwrap();
        }
        folder
    }

    fn found(files: &[&str]) -> Vec<(String, bool, bool)> {
        let photos = photos(folder(files).path(), "--real").unwrap();
        photos.into_iter().map(|photo| (photo.name, photo.nir.is_some(), photo.labels.is_some())).collect()
    }

    #[test]
    fn labels_and_near_infrared_are_found_beside_pictures() {
        let of = |name: &str, nir, labels| (name.to_owned(), nir, labels);
        let files = ["images/a.jpg", "images/b.png", "labels/a.png", "nir/b.png", "labels/c.png"];
        assert_eq!(found(&files), [of("a", false, true), of("b", true, false)]);
        assert_eq!(
            found(&["rgb_1.png", "nir_1.png", "rgb_2.png"]),
            [of("rgb_1", true, false), of("rgb_2", false, false)]
        );
        assert_eq!(found(&["a.jpg", "labels/a.png", "nir/a.png"]), [of("a", true, true)]);
        let dataset = ["images/000001/rgb.png", "images/000001/semantics.png", "images/000001/nir.png"];
        assert_eq!(found(&dataset), [of("000001", true, true)]);
        let jpeg = dataset.map(|file| file.replace("rgb.png", "rgb.jpg").replace("nir.png", "nir.jpg"));
        assert_eq!(found(&jpeg.each_ref().map(String::as_str)), [of("000001", true, true)]);
        assert_eq!(found(&["rgb.png", "semantics.png"]), [of("rgb", false, true)]);
    }

    #[test]
    fn folders_without_pictures_are_told() {
        let empty = folder(&["labels/a.png"]);
        let missing = empty.path().join("nothing");
        for (path, words) in [(empty.path(), "there is no PNG or JPEG"), (&missing, "there is no such folder")] {
            let error = photos(path, "--real").unwrap_err();
            assert_eq!(error.exit_code(), 2);
            assert!(error.to_string().contains(words), "{error}");
        }
    }
}
