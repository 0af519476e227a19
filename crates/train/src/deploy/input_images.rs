//! Input images of a prediction: how they and their bands are found, and the names of the prediction files.
//!
//! An input is a PNG or JPEG file of any size, a folder (every image directly in it), or images of a dataset (`DIR`, `DIR@PICK`).
//! Red, green and blue come from the RGB image. Any other band, such as nir, is a gray image of the same size. For `a.jpg` it is
//! `a.nir.png` beside it; for a file with `rgb` in its name, the file with `nir` instead; or `a.png` in the folder that `--band`
//! gives for the band. Files that are a band of another image are not images of their own.
//!
//! Images of a packed dataset are read from its archives.

use super::guard::Implausible;
use crate::data::{Band, Pick, Resize, Selection, Shape, bands};
use crate::refine::{Evidence, Refine};
use crate::run::{self, ModelCard};
use furrow_base::{Error, Result};
use furrow_dataset::Set;
use furrow_dataset::make::pack::refuse_archives;
use furrow_dataset::model::image_files::photograph_in;
use furrow_dataset::read::native;
use furrow_dataset::read::native::Image;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// File name extensions of input images.
const ENDINGS: [&str; 3] = ["png", "jpg", "jpeg"];
/// File name of the RGB image in a dataset image's folder, unless it is stored as JPEG.
const PHOTO: &str = "rgb.png";
/// Metadata file of a dataset image. It is written last: an image is complete once it exists.
const RECORD: &str = "record.json";

/// An input image without labels.
#[derive(Clone, Debug)]
pub struct InputImage {
    /// Base name of the prediction files.
    pub name: String,
    /// Path of the RGB image; for an image in a pack, the path that it would have in an unpacked dataset.
    pub photo: PathBuf,
    source: Source,
}

#[derive(Clone, Debug)]
enum Source {
    /// Loose files: the source of each band of the network.
    Files(Vec<Plane>),
    /// A packed image of this dataset, and the bands of the network.
    Packed(Arc<Set>, Vec<Band>),
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Plane {
    /// A channel of the RGB image: 0 red, 1 green, 2 blue.
    Channel(usize),
    /// The image file itself, read as gray.
    Photo,
    /// Another file, read as gray.
    File(PathBuf),
}

/// Pixels of an input image in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Pixels {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// 8-bit sRGB pixels, row by row.
    pub rgb: Vec<[u8; 3]>,
    /// One 8-bit plane for each band of the network.
    pub planes: Vec<Vec<u8>>,
}

impl InputImage {
    /// Reads the image and its bands. Fails if a file is not an image, if the image is gray but the network takes colour, or if the bands
    /// differ in size.
    pub fn read(&self) -> Result<Pixels> {
        let planes = match &self.source {
            Source::Files(planes) => planes,
            Source::Packed(set, of) => {
                let image = Image::of(set.as_ref(), &self.name);
                let (width, height, planes) = bands::read(&image, of)?;
                let (w, h, rgb) = image.photograph()?;
                if (w, h) != (width, height) {
                    let what = format!("the bands are {width} × {height} pixels, the RGB image {w} × {h}");
                    return Err(Error::input(what).in_file(self.photo.clone()));
                }
                return Ok(Pixels { width, height, rgb, planes });
            }
        };
        let colored = planes.iter().any(|p| matches!(p, Plane::Channel(_)));
        let read = if colored { furrow_output::read_color_photo } else { furrow_output::read_photo };
        let (width, height, rgb) = read(&self.photo)?;
        let plane = |plane: &Plane| {
            let path = match plane {
                Plane::Channel(c) => return Ok(rgb.iter().map(|p| p[*c]).collect()),
                Plane::Photo => &self.photo,
                Plane::File(path) => path,
            };
            let (w, h, values) = furrow_output::read_gray_photo(path)?;
            if (w, h) != (width, height) {
                return Err(Error::input(format!(
                    "it is {w} × {h} pixels, but the image {} is {width} × {height}",
                    self.photo.display()
                ))
                .in_file(path.clone()));
            }
            Ok(values)
        };
        let planes = planes.iter().map(plane).collect::<Result<_>>()?;
        Ok(Pixels { width, height, rgb, planes })
    }

    /// Returns a canonical path that identifies the image however its path is written.
    pub(super) fn identity(&self) -> Result<String> {
        let place = match &self.source {
            Source::Files(_) => std::fs::canonicalize(&self.photo).map_err(Error::reading(&self.photo))?,
            Source::Packed(set, _) => {
                let folder = std::fs::canonicalize(&set.folder).map_err(Error::reading(&set.folder))?;
                folder.join(native::folder(&self.name)).join(PHOTO)
            }
        };
        Ok(place.to_string_lossy().into_owned())
    }
}

/// Lists the images that `inputs` (files, folders, datasets) hold, each once, in the order of the inputs; files of a folder are sorted by
/// name. `elsewhere` gives folders for bands. Fails if an input holds no image, a band is missing, or two images would have the same
/// prediction file.
pub fn find(inputs: &[PathBuf], shape: &Shape, elsewhere: &[(Band, PathBuf)]) -> Result<Vec<InputImage>> {
    for (band, folder) in elsewhere {
        if !shape.bands.contains(band) {
            let names: Vec<&str> = shape.bands.iter().map(Band::name).collect();
            return Err(Error::misuse(format!("the network does not see the band `{}`", band.name()))
                .help(format!("its bands are {}", names.join(", "))));
        }
        std::fs::read_dir(folder).map_err(Error::reading(folder))?;
    }
    let mut pictures: Vec<InputImage> = Vec::new();
    for input in inputs {
        if let Some(selection) = selection(input)? {
            pictures.extend(images(&selection, shape)?);
            continue;
        }
        for photo in photos(input, shape)? {
            let named = |band: &Band| elsewhere.iter().find(|(b, _)| b == band).map(|(_, folder)| folder);
            let beside = |band: &Band| match named(band) {
                Some(folder) => same_name(&photo, folder),
                None => companion(&photo, band.name()),
            };
            let planes = planes(&photo, shape, &beside)?;
            pictures.push(InputImage { name: stem(&photo), photo, source: Source::Files(planes) });
        }
    }
    let pictures = first_of_each(pictures, |picture| picture.photo.clone());
    one_name_each(&pictures)?;
    Ok(pictures)
}

/// Removes all but the first item of each key; keeps the order.
fn first_of_each<T, K: Ord>(items: Vec<T>, key: impl Fn(&T) -> K) -> Vec<T> {
    let mut seen = BTreeSet::new();
    items.into_iter().filter(|item| seen.insert(key(item))).collect()
}

/// Returns the dataset selection if the input is a dataset folder or has the form `DIR@PICK`; `None` otherwise.
fn selection(input: &Path) -> Result<Option<Selection>> {
    if input.is_dir() {
        return Ok(input.join(furrow_dataset::model::recipe::FILE).is_file().then(|| Selection::of(input)));
    }
    match input.to_str() {
        Some(text) if !input.exists() && text.contains('@') => Selection::parse(text).map(Some).map_err(Error::input),
        _ => Ok(None),
    }
}

/// Lists the selected images of a dataset, in folders or in packs, each with the files that the dataset's recipe defines.
fn images(selection: &Selection, shape: &Shape) -> Result<Vec<InputImage>> {
    let (set, numbers) = selection.open(Pick::All, 0)?;
    if set.recipe.labels_only() {
        return Err(Error::input("this dataset holds labels only, no images")
            .help("predict images of a dataset that was made without --labels-only")
            .in_file(set.folder.clone()));
    }
    let set = Arc::new(set);
    let recipe = Some(&set.recipe);
    let image = |number: u64| {
        let name = Set::name(number);
        let folder = set.folder.join(native::folder(&name));
        // A packed dataset may still have a folder of this name without a complete image: leftovers, or files that a user put there.
        let is_packed = set.recipe.pack.is_some() && !folder.join(RECORD).is_file();
        if is_packed && Image::of(set.as_ref(), &name).has(RECORD)? {
            let source = Source::Packed(Arc::clone(&set), shape.bands.clone());
            return Ok(InputImage { photo: folder.join(PHOTO), name, source });
        }
        if !is_packed && folder.is_dir() {
            let missing = || folder.join(format!("rgb.{}", set.recipe.image_format().ending()));
            let photo = photograph_in(&folder, "rgb", recipe).unwrap_or_else(missing);
            let beside = |band: &Band| photograph_in(&folder, band.name(), recipe);
            let source = Source::Files(planes(&photo, shape, &beside)?);
            return Ok(InputImage { name, photo, source });
        }
        Err(Error::input("this image is not there yet").in_file(folder).help("run the command that made the set again"))
    };
    numbers.into_iter().map(image).collect()
}

/// Returns the subfolders with images of the folders among `inputs`, which [`find`] passes over; those with predictions are not
/// listed.
pub fn passed_over(inputs: &[PathBuf]) -> Vec<PathBuf> {
    let entries =
        |folder: &Path| std::fs::read_dir(folder).ok().into_iter().flatten().filter_map(|e| Some(e.ok()?.path()));
    let is_image = |path: &PathBuf| {
        let ending = path.extension().and_then(OsStr::to_str).map(str::to_ascii_lowercase);
        ending.is_some_and(|e| ENDINGS.contains(&e.as_str())) && path.is_file()
    };
    let folders = inputs.iter().filter(|input| input.is_dir() && selection(input).is_ok_and(|found| found.is_none()));
    let within = folders.flat_map(|folder| entries(folder)).filter(|path| path.is_dir());
    let mut found: Vec<PathBuf> =
        within.filter(|path| !path.join(PREDICTION).is_file() && entries(path).any(|path| is_image(&path))).collect();
    found.sort();
    found
}

/// Lists the image file `input`, or all image files directly in the folder `input` except those that are bands of others.
fn photos(input: &Path, shape: &Shape) -> Result<Vec<PathBuf>> {
    if !input.exists() {
        return Err(Error::input("there is no such image")
            .help("give PNG or JPEG files, folders of them, or images of a dataset: DIR@PICK")
            .in_file(input));
    }
    refuse_archives(input)?;
    if !input.is_dir() {
        return Ok(vec![input.into()]);
    }
    let mut photos = Vec::new();
    for entry in std::fs::read_dir(input).map_err(Error::reading(input))? {
        let path = entry.map_err(Error::reading(input))?.path();
        let ending = path.extension().and_then(OsStr::to_str).map(str::to_ascii_lowercase);
        if path.is_file() && ending.is_some_and(|e| ENDINGS.contains(&e.as_str())) {
            photos.push(path);
        }
    }
    photos.sort();
    // Near-infrared files are recognized as bands even if the network does not use them.
    let bands: BTreeSet<&str> = shape.bands.iter().filter(|b| !b.is_color()).map(Band::name).chain(["nir"]).collect();
    let others: BTreeSet<PathBuf> =
        photos.iter().flat_map(|photo| bands.iter().filter_map(|band| companion(photo, band))).collect();
    photos.retain(|photo| !others.contains(photo));
    if photos.is_empty() {
        return Err(Error::input("there is no image in this folder")
            .help(format!(
                "images are PNG or JPEG files directly in it; a dataset has a {}",
                furrow_dataset::model::recipe::FILE
            ))
            .in_file(input));
    }
    Ok(photos)
}

/// Returns the source of each band of the network; `beside` finds the files of bands other than red, green and blue.
fn planes(photo: &Path, shape: &Shape, beside: &dyn Fn(&Band) -> Option<PathBuf>) -> Result<Vec<Plane>> {
    let plane = |band: &Band| match band {
        Band::Red => Ok(Plane::Channel(0)),
        Band::Green => Ok(Plane::Channel(1)),
        Band::Blue => Ok(Plane::Channel(2)),
        Band::Gray(name) => match beside(band) {
            Some(path) => Ok(Plane::File(path)),
            None if shape.bands.len() == 1 => Ok(Plane::Photo),
            None => Err(Error::input(format!("the network sees the band `{name}`, which this image lacks"))
                .help(format!(
                    "put {}.{name}.png beside it, or give the folder of the `{name}` images with --band {name}=DIR",
                    stem(photo)
                ))
                .in_file(photo)),
        },
    };
    shape.bands.iter().map(plane).collect()
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// Returns the file of a band in the folder of its image: `a.nir.png` for `a.jpg`, or the name with `rgb` replaced by the band's name.
fn companion(photo: &Path, band: &str) -> Option<PathBuf> {
    let stem = stem(photo);
    let names = [Some(format!("{stem}.{band}")), stem.contains("rgb").then(|| stem.replace("rgb", band))];
    let beside = |name: &String| picture(photo.parent()?, name);
    names.iter().flatten().find_map(beside)
}

/// Returns the file with the image's name in another folder.
fn same_name(photo: &Path, folder: &Path) -> Option<PathBuf> {
    picture(folder, &stem(photo))
}

fn picture(folder: &Path, stem: &str) -> Option<PathBuf> {
    let endings = ENDINGS.iter().flat_map(|e| [(*e).to_owned(), e.to_ascii_uppercase()]);
    endings.map(|ending| folder.join(format!("{stem}.{ending}"))).find(|path| path.is_file())
}

/// Returns the file names of an image's prediction: the class map, and the overlay on the image.
pub fn files(name: &str) -> [String; 2] {
    [format!("{name}.png"), format!("{name}.overlay.png")]
}

fn one_name_each(pictures: &[InputImage]) -> Result<()> {
    let mut taken: BTreeMap<String, &InputImage> = BTreeMap::new();
    for picture in pictures {
        for file in files(&picture.name) {
            if let Some(other) = taken.insert(file.clone(), picture) {
                return Err(Error::misuse(format!(
                    "{} and {} would both become {file}",
                    other.photo.display(),
                    picture.photo.display()
                ))
                .help("predict them one after the other, each with its own --out"));
            }
        }
    }
    Ok(())
}

/// Contents of `prediction.json`, which describes the predictions in a folder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Prediction {
    /// Version of the program.
    pub furrow: String,
    /// Name of the network architecture.
    pub network: String,
    /// SHA-256 of the network's weights.
    pub weights_sha256: String,
    /// Sizes that images were resized to, in the syntax of `--resize`; the scale factor if the images' ground sampling distance was given.
    #[serde(default = "stretch")]
    pub resize: String,
    /// Ground sampling distance of the images in millimetres a pixel, if it was given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pixel_mm: Option<f64>,
    /// Refinement of the predictions, in the syntax of `--refine`.
    #[serde(default, skip_serializing_if = "Refine::is_none")]
    pub refine: Refine,
    /// Crops that the network was trained for; empty if it was trained for crops of any kind.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub crops: Vec<String>,
    /// Result of the last prediction in this folder, if it labelled implausibly little vegetation as crop.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub implausible: Option<Implausible>,
    /// SHA-256 of the table of points on plants of known class, if one was given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points_sha256: Option<String>,
    /// Whether the last prediction in this folder learnt an appearance model from its images; absent if it was not asked to.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub appearance: Option<bool>,
    /// Class names in the order of the class numbers, with their sRGB colours.
    pub classes: Vec<(String, [u8; 3])>,
    /// Path of the image of each prediction, by prediction name.
    pub pictures: BTreeMap<String, String>,
    /// Changes by refinement in each image, by prediction name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub evidence: BTreeMap<String, Evidence>,
}

/// Default of `resize` for files of version 0.1, which always stretched.
fn stretch() -> String {
    Resize::Stretch.name()
}

/// Name of the file that describes the predictions in a folder.
pub const PREDICTION: &str = "prediction.json";

impl Prediction {
    /// Reserves a folder for the predictions of these images and writes its `prediction.json`. Fails if the folder holds predictions of
    /// another network, size, refinement or table of points, or files that would be overwritten and are not predictions of these images.
    pub fn claim(
        folder: &Path,
        card: &ModelCard,
        pixel_mm: Option<f64>,
        points_sha256: Option<&str>,
        pictures: &[InputImage],
    ) -> Result<Self> {
        let path = folder.join(PREDICTION);
        let refuse = |path: &Path, what: String| Err(Error::misuse(what).help("give another --out").in_file(path));
        let there: Option<Self> = path.exists().then(|| run::read_json(&path)).transpose()?;
        if there.as_ref().is_some_and(|t| t.weights_sha256 != card.weights_sha256) {
            return refuse(&path, "this folder holds predictions of another network".into());
        }
        let other_pixels = |there: &Self| there.pixel_mm.zip(pixel_mm).is_some_and(|(a, b)| a != b);
        if there.as_ref().is_some_and(|t| t.resize != card.resize.name() || other_pixels(t)) {
            return refuse(&path, "this folder holds predictions at other sizes".into());
        }
        if there.as_ref().is_some_and(|t| t.refine != card.refine) {
            return refuse(&path, "this folder holds predictions with another --refine".into());
        }
        if there.as_ref().is_some_and(|t| t.points_sha256.as_deref() != points_sha256) {
            return refuse(&path, "this folder holds predictions with other points (--like)".into());
        }
        let (mut all, evidence) = there.map(|t| (t.pictures, t.evidence)).unwrap_or_default();
        for picture in pictures {
            let photo = picture.identity()?;
            match all.get(&picture.name) {
                Some(other) if *other == photo => {}
                Some(other) => {
                    let prediction = folder.join(&files(&picture.name)[0]);
                    return refuse(&prediction, format!("this is the prediction of {other} and would be overwritten"));
                }
                None => {
                    let own = files(&picture.name).map(|file| folder.join(file));
                    if let Some(file) = own.iter().find(|file| file.exists()) {
                        return refuse(
                            file,
                            format!("this file is not a prediction and would be overwritten by that of {photo}"),
                        );
                    }
                    all.insert(picture.name.clone(), photo);
                }
            }
        }
        let classes = card.classes.names().into_iter().zip(card.classes.colors()).collect();
        let prediction = Self {
            furrow: env!("CARGO_PKG_VERSION").into(),
            network: card.network.name().into(),
            weights_sha256: card.weights_sha256.clone(),
            resize: card.resize.name(),
            pixel_mm,
            refine: card.refine,
            crops: card.crops.clone(),
            implausible: None,
            points_sha256: points_sha256.map(str::to_owned),
            appearance: None,
            classes,
            pictures: all,
            evidence,
        };
        run::write_json(&path, &prediction)?;
        Ok(prediction)
    }

    /// Adds an implausible result to the `prediction.json` of a folder.
    pub fn note(folder: &Path, implausible: &Implausible) -> Result<()> {
        let path = folder.join(PREDICTION);
        let there: Self = run::read_json(&path)?;
        run::write_json(&path, &Self { implausible: Some(implausible.clone()), ..there })
    }

    /// Adds the changes by refinement, and whether an appearance model was learnt. Removes the images `unread`, which could not be read,
    /// unless a prediction of them exists; deletes the file if none is left.
    pub fn finish(
        mut self,
        folder: &Path,
        unread: &[&str],
        evidence: &BTreeMap<String, Evidence>,
        appearance: bool,
    ) -> Result<()> {
        let names: BTreeSet<&str> = unread.iter().copied().collect();
        self.appearance = self.refine.appearance.then_some(appearance);
        self.evidence.extend(evidence.clone());
        self.pictures.retain(|name, _| !names.contains(name.as_str()) || folder.join(&files(name)[0]).exists());
        let path = folder.join(PREDICTION);
        if self.pictures.is_empty() {
            return std::fs::remove_file(&path).map_err(Error::io(&path));
        }
        run::write_json(&path, &self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::ToInt;
    use std::cell::Cell;
    use std::cmp::Ordering;

    /// A key that counts its comparisons.
    #[derive(Clone)]
    struct Counted<'a>(u64, &'a Cell<u64>);

    impl Ord for Counted<'_> {
        fn cmp(&self, other: &Self) -> Ordering {
            self.1.set(self.1.get() + 1);
            self.0.cmp(&other.0)
        }
    }

    impl PartialOrd for Counted<'_> {
        fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
            Some(self.cmp(other))
        }
    }

    impl PartialEq for Counted<'_> {
        fn eq(&self, other: &Self) -> bool {
            self.cmp(other).is_eq()
        }
    }

    impl Eq for Counted<'_> {}

    /// Rationale: a folder may hold a hundred thousand images. Expected: each item once, in order, with fewer than 4 n log₂ n
    /// comparisons; comparing every key with all others takes n² / 2. Source: height of a balanced tree.
    #[test]
    fn repeated_pictures_are_found_without_comparing_all_with_all() {
        let n = 4096;
        let compared = Cell::new(0);
        let items: Vec<u64> = (0..n).chain(0..n).map(|i| i * 2_654_435_761 % n).collect();
        let kept = first_of_each(items.clone(), |item| Counted(*item, &compared));
        assert_eq!(kept, items[..n.to_usize()]);
        assert!(compared.get() < 4 * 2 * n * 12, "{} comparisons", compared.get());
    }
}
