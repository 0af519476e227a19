//! Sets of images in folders, with their near infrared, labels and records.
//!
//! Images are found as `trace compare` finds them: below `images/` if there is such a folder; in datasets and renders
//! each `rgb.png` or `rgb.jpg`. Labels are `labels/NAME.png`, or `semantics.png` next to such an image. Near infrared
//! is `nir/NAME.png`, or the file whose name starts with `nir` where the image's starts with `rgb`.
//!
//! Images of a dataset in packs are read from its archives; files that a dataset omits are not read.

use crate::pairs::{beside, beside_rgb, first, name_list, recipe_of, stem, walk};
use crate::raster_image::{self, RasterImage};
use furrow_base::{Error, Result};
use furrow_dataset::make::pack::refuse_archives;
use furrow_dataset::model::image_files::photograph_in;
use furrow_dataset::model::recipe::FILE;
use furrow_dataset::read::native::Image;
use furrow_dataset::read::set::Set;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Image with the data that belongs to it.
#[derive(Clone, Debug)]
pub struct Photo {
    /// Name below the folder, without the extension.
    pub name: String,
    place: Place,
}

/// Location of an image and its data.
#[derive(Clone, Debug)]
enum Place {
    Files {
        rgb: PathBuf,
        nir: Option<PathBuf>,
        labels: Option<PathBuf>,
    },
    /// Image in an archive of this dataset.
    Pack {
        set: Arc<Set>,
        nir: bool,
        labels: bool,
    },
}

impl PartialEq for Photo {
    fn eq(&self, other: &Self) -> bool {
        (&self.name, self.path()) == (&other.name, other.path())
    }
}

impl Photo {
    /// Returns `true` if the image has near infrared.
    pub fn has_nir(&self) -> bool {
        matches!(&self.place, Place::Files { nir: Some(_), .. } | Place::Pack { nir: true, .. })
    }

    /// Returns `true` if the classes of its pixels are known.
    pub fn has_labels(&self) -> bool {
        matches!(&self.place, Place::Files { labels: Some(_), .. } | Place::Pack { labels: true, .. })
    }

    /// Returns its path, which for an archive is where it would be unpacked.
    fn path(&self) -> PathBuf {
        match &self.place {
            Place::Files { rgb, .. } => rgb.clone(),
            Place::Pack { set, .. } => Image::of(set.as_ref(), &self.name).place("rgb.png"),
        }
    }

    /// Returns width and height in pixels.
    pub(super) fn size(&self) -> Result<(u32, u32)> {
        match &self.place {
            Place::Files { rgb, .. } => furrow_output::photo_size(rgb),
            Place::Pack { set, .. } => {
                let (width, height, _) = Image::of(set.as_ref(), &self.name).photograph()?;
                Ok((width, height))
            }
        }
    }

    /// Reads the image, and its labels if it has any.
    pub(super) fn read(&self) -> Result<(RasterImage, Option<Vec<u8>>)> {
        match &self.place {
            Place::Files { rgb, nir, labels } => {
                let picture = RasterImage::read(rgb, nir.as_deref())?;
                let labels = labels.as_ref().map(|path| raster_image::read_labels(path, picture.size())).transpose()?;
                Ok((picture, labels))
            }
            Place::Pack { set, nir, labels } => packed(&Image::of(set.as_ref(), &self.name), *nir, *labels),
        }
    }

    /// Returns the record of an image named `rgb.png`, and its path; `None` if there is none.
    pub(super) fn record(&self) -> Result<Option<(PathBuf, Vec<u8>)>> {
        match &self.place {
            Place::Files { rgb, .. } => {
                let path = rgb.with_file_name("record.json");
                if rgb.file_stem().is_none_or(|stem| stem != "rgb") || !path.is_file() {
                    return Ok(None);
                }
                let bytes = std::fs::read(&path).map_err(Error::reading(&path))?;
                Ok(Some((path, bytes)))
            }
            Place::Pack { set, .. } => Image::of(set.as_ref(), &self.name).optional("record.json"),
        }
    }
}

/// Reads an image of a dataset in packs, with near infrared and labels if it has them.
fn packed(image: &Image<'_, Set>, nir: bool, labels: bool) -> Result<(RasterImage, Option<Vec<u8>>)> {
    let (width, height, rgb) = image.photograph()?;
    let near = if nir { image.band("nir")? } else { None };
    if let Some(near) = &near {
        raster_image::same_size(&near.place, (near.width, near.height), (width, height))?;
    }
    let labels = if labels {
        let (w, h, numbers) = image.indexed(LABELS)?;
        let place = image.place(LABELS);
        raster_image::same_size(&place, (w, h), (width, height))?;
        Some(raster_image::known(&place, numbers.into_iter().map(u16::from).collect())?)
    } else {
        None
    };
    Ok((RasterImage { width, height, rgb, nir: near.map_or_else(Vec::new, |near| near.values) }, labels))
}

/// File name of the labels in a dataset's image.
const LABELS: &str = "semantics.png";

/// Finds the images of a folder by name. `option` is the command-line option of the folder, for errors. Returns an
/// error if there are none.
pub fn photos(folder: &Path, option: &str) -> Result<Vec<Photo>> {
    if folder.join(FILE).is_file() && folder.join("packs").is_dir() {
        let set = Set::open(folder)?;
        if set.recipe.pack.is_some() {
            return in_packs(set);
        }
    }
    refuse_archives(folder)?;
    if !folder.is_dir() {
        let what = if folder.exists() { "this is not a folder" } else { "there is no such folder" };
        return Err(Error::input(format!("{option} {}: {what}", folder.display()))
            .help("use a folder with images/ and optionally labels/ and nir/, or a dataset"));
    }
    let recipe = recipe_of(folder);
    let recipe = recipe.as_ref();
    let mut found = BTreeMap::new();
    let images = folder.join("images");
    if let Some(rendered) = photograph_in(folder, "rgb", recipe) {
        found.insert(stem(&rendered), rendered);
    } else if images.is_dir() {
        walk(&images, "", recipe, &mut found)?;
    } else {
        walk(folder, "", recipe, &mut found)?;
        found.retain(|name, _| !name.starts_with("labels/") && !name.starts_with("nir/"));
    }
    let partners: Vec<PathBuf> = found.values().filter_map(|rgb| beside_rgb(rgb, "nir", recipe)).collect();
    found.retain(|_, rgb| !partners.contains(rgb));
    if found.is_empty() {
        return Err(Error::input(format!("{option} {}: there is no PNG or JPEG in this folder", folder.display()))
            .help("use a folder with images/, or a dataset"));
    }
    let photo = |(name, rgb): (String, PathBuf)| {
        let below = |other: &str| first([folder.join(other).join(format!("{name}.png"))]);
        let nir = beside_rgb(&rgb, "nir", recipe).or_else(|| below("nir"));
        let labels = beside(&rgb).or_else(|| below("labels"));
        Photo { name, place: Place::Files { rgb, nir, labels } }
    };
    Ok(found.into_iter().map(photo).collect())
}

/// Returns the available images of a dataset in packs. All have the same data as the first.
fn in_packs(set: Set) -> Result<Vec<Photo>> {
    let set = Arc::new(set);
    let mut names = Vec::new();
    for name in (0..set.recipe.count).map(Set::name) {
        if Image::of(set.as_ref(), &name).has("record.json")? {
            names.push(name);
        }
    }
    let Some(first) = names.first() else {
        return Err(Error::input("this dataset has no images yet").in_file(set.folder.clone()));
    };
    let image = Image::of(set.as_ref(), first);
    let (nir, labels) = (image.band("nir")?.is_some(), image.has(LABELS)?);
    Ok(names
        .into_iter()
        .map(|name| Photo { name, place: Place::Pack { set: Arc::clone(&set), nir, labels } })
        .collect())
}

/// Returns warnings if only some images of a set have labels or near infrared.
pub(super) fn warnings(set: &str, photos: &[Photo]) -> Vec<String> {
    let some = |what: &str, has: &dyn Fn(&Photo) -> bool| {
        let without: Vec<String> = photos.iter().filter(|photo| !has(photo)).map(|photo| photo.name.clone()).collect();
        let mixed = !without.is_empty() && without.len() < photos.len();
        mixed.then(|| format!("{} images of {set} have no {what}: {}", without.len(), name_list(&without)))
    };
    let labels = some("labels", &|photo| photo.has_labels());
    [labels, some("near infrared", &|photo| photo.has_nir())].into_iter().flatten().collect()
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
        photos.into_iter().map(|photo| (photo.name.clone(), photo.has_nir(), photo.has_labels())).collect()
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
    fn folders_without_images_are_reported() {
        let empty = folder(&["labels/a.png"]);
        let missing = empty.path().join("nothing");
        for (path, words) in [(empty.path(), "there is no PNG or JPEG"), (&missing, "there is no such folder")] {
            let error = photos(path, "--real").unwrap_err();
            assert_eq!(error.exit_code(), 2);
            assert!(error.to_string().contains(words), "{error}");
        }
    }
}
