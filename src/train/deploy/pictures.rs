//! Which pictures are predicted, where their bands lie, and what the files of their predictions are called.
//!
//! A picture is a PNG or JPEG file of any size, every one directly in a folder, or the images of a set (`DIR`, `DIR@PICK`). Red, green and
//! blue are the photograph's. Another band, such as nir, is a gray picture of the same size: of `a.jpg`, the file `a.nir.png` beside
//! it; of a photograph with `rgb` in its name, the file with `nir` instead; or the file of the photograph's name, `a.png`, in a
//! folder that is named for the band. Files that are another's band are no pictures of their own.
//!
//! Images of a set in packs are read out of their archives.

use crate::dataset::image_files::photograph_in;
use crate::dataset::native::Image;
use crate::dataset::pack::refuse_archives;
use crate::dataset::{Set, native};
use crate::output;
use crate::train::data::{Band, Pick, Resize, Selection, Shape, bands};
use crate::train::refine::Refine;
use crate::train::run::{self, ModelCard};
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What pictures' names end with.
const ENDINGS: [&str; 3] = ["png", "jpg", "jpeg"];
/// The photograph of a set's image, unless it is stored as JPEG.
const PHOTO: &str = "rgb.png";
/// What is known of a set's image: the last file of one that is whole.
const RECORD: &str = "record.json";

/// A picture without labels.
#[derive(Clone, Debug)]
pub struct Picture {
    /// What its prediction is called.
    pub name: String,
    /// The photograph; of an image in a pack, where it would lie as a file.
    pub photo: PathBuf,
    source: Source,
}

#[derive(Clone, Debug)]
enum Source {
    /// Files: where each band of the network lies.
    Files(Vec<Plane>),
    /// An image of this set, in a pack, and the bands of the network.
    Packed(Arc<Set>, Vec<Band>),
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Plane {
    /// A channel of the photograph.
    Channel(usize),
    /// The photograph itself, in gray.
    Photo,
    /// A gray picture.
    File(PathBuf),
}

/// A picture in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Pixels {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// 8-bit sRGB.
    pub rgb: Vec<[u8; 3]>,
    /// One 8-bit plane for each band of the network.
    pub planes: Vec<Vec<u8>>,
}

impl Picture {
    /// Reads it. An error where it is no picture, is gray to a network that sees colours, or where bands differ in size.
    pub fn read(&self) -> Result<Pixels> {
        let planes = match &self.source {
            Source::Files(planes) => planes,
            Source::Packed(set, of) => {
                let image = Image::of(set.as_ref(), &self.name);
                let (width, height, planes) = bands::read(&image, of)?;
                let (w, h, rgb) = image.photograph()?;
                if (w, h) != (width, height) {
                    let what = format!("it is {width} × {height} pixels, the photograph {w} × {h}");
                    return Err(Error::input(what).in_file(self.photo.clone()));
                }
                return Ok(Pixels { width, height, rgb, planes });
            }
        };
        let colored = planes.iter().any(|p| matches!(p, Plane::Channel(_)));
        let read = if colored { output::read_color_photo } else { output::read_photo };
        let (width, height, rgb) = read(&self.photo)?;
        let plane = |plane: &Plane| {
            let path = match plane {
                Plane::Channel(c) => return Ok(rgb.iter().map(|p| p[*c]).collect()),
                Plane::Photo => &self.photo,
                Plane::File(path) => path,
            };
            let (w, h, values) = output::read_gray_photo(path)?;
            if (w, h) != (width, height) {
                return Err(Error::input(format!(
                    "it is {w} × {h} pixels, the photograph {} is {width} × {height}",
                    self.photo.display()
                ))
                .in_file(path.clone()));
            }
            Ok(values)
        };
        let planes = planes.iter().map(plane).collect::<Result<_>>()?;
        Ok(Pixels { width, height, rgb, planes })
    }

    /// What tells it from all others, whatever its path is written like.
    fn identity(&self) -> Result<String> {
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

/// The pictures that files, folders and sets hold, in their order, the files of a folder by name; each once. `elsewhere` names folders of
/// bands. An error where there is none, where a band is missing, or where two pictures have one name.
pub fn find(inputs: &[PathBuf], shape: &Shape, elsewhere: &[(Band, PathBuf)]) -> Result<Vec<Picture>> {
    for (band, folder) in elsewhere {
        if !shape.bands.contains(band) {
            let names: Vec<&str> = shape.bands.iter().map(Band::name).collect();
            return Err(Error::misuse(format!("the network does not see the band `{}`", band.name()))
                .help(format!("its bands are {}", names.join(", "))));
        }
        std::fs::read_dir(folder).map_err(Error::reading(folder))?;
    }
    let mut pictures: Vec<Picture> = Vec::new();
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
            pictures.push(Picture { name: stem(&photo), photo, source: Source::Files(planes) });
        }
    }
    let pictures = first_of_each(pictures, |picture| picture.photo.clone());
    one_name_each(&pictures)?;
    Ok(pictures)
}

/// The first of all items with one key, in their order.
fn first_of_each<T, K: Ord>(items: Vec<T>, key: impl Fn(&T) -> K) -> Vec<T> {
    let mut seen = BTreeSet::new();
    items.into_iter().filter(|item| seen.insert(key(item))).collect()
}

/// A set's images, where the input is a set or picks images of one.
fn selection(input: &Path) -> Result<Option<Selection>> {
    if input.is_dir() {
        return Ok(input.join(crate::dataset::recipe::FILE).is_file().then(|| Selection::of(input)));
    }
    match input.to_str() {
        Some(text) if !input.exists() && text.contains('@') => Selection::parse(text).map(Some).map_err(Error::input),
        _ => Ok(None),
    }
}

/// A set's images, in folders or in packs, each with the files that the set's recipe gives it.
fn images(selection: &Selection, shape: &Shape) -> Result<Vec<Picture>> {
    let (set, numbers) = selection.open(Pick::All, 0)?;
    if set.recipe.labels_only() {
        return Err(Error::input("there are no photographs in this set: it holds labels alone")
            .help("predict images of a set that was made without --labels-only")
            .in_file(set.folder.clone()));
    }
    let set = Arc::new(set);
    let recipe = Some(&set.recipe);
    let image = |number: u64| {
        let name = Set::name(number);
        let folder = set.folder.join(native::folder(&name));
        // A folder beside packs that is no whole image: something was left in it, or put there.
        let is_packed = set.recipe.pack.is_some() && !folder.join(RECORD).is_file();
        if is_packed && Image::of(set.as_ref(), &name).has(RECORD)? {
            let source = Source::Packed(Arc::clone(&set), shape.bands.clone());
            return Ok(Picture { photo: folder.join(PHOTO), name, source });
        }
        if !is_packed && folder.is_dir() {
            let missing = || folder.join(format!("rgb.{}", set.recipe.photo().ending()));
            let photo = photograph_in(&folder, "rgb", recipe).unwrap_or_else(missing);
            let beside = |band: &Band| photograph_in(&folder, band.name(), recipe);
            let source = Source::Files(planes(&photo, shape, &beside)?);
            return Ok(Picture { name, photo, source });
        }
        Err(Error::input("this image is not there yet").in_file(folder).help("the command that began the set makes it"))
    };
    numbers.into_iter().map(image).collect()
}

/// A photograph, or all in a folder.
fn photos(input: &Path, shape: &Shape) -> Result<Vec<PathBuf>> {
    if !input.exists() {
        return Err(Error::input("there is no such picture")
            .help("name PNG or JPEG files, folders of them, or images of a set: DIR@PICK")
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
    // Near infrared is known for what it is by networks that do not see it, too.
    let bands: BTreeSet<&str> = shape.bands.iter().filter(|b| !b.is_color()).map(Band::name).chain(["nir"]).collect();
    let others: BTreeSet<PathBuf> =
        photos.iter().flat_map(|photo| bands.iter().filter_map(|band| companion(photo, band))).collect();
    photos.retain(|photo| !others.contains(photo));
    if photos.is_empty() {
        return Err(Error::input("there is no picture in this folder")
            .help(format!(
                "pictures are PNG or JPEG files directly in it; a set has a {}",
                crate::dataset::recipe::FILE
            ))
            .in_file(input));
    }
    Ok(photos)
}

/// Where each band lies; `beside` finds those that are not the photograph's own.
fn planes(photo: &Path, shape: &Shape, beside: &dyn Fn(&Band) -> Option<PathBuf>) -> Result<Vec<Plane>> {
    let plane = |band: &Band| match band {
        Band::Red => Ok(Plane::Channel(0)),
        Band::Green => Ok(Plane::Channel(1)),
        Band::Blue => Ok(Plane::Channel(2)),
        Band::Gray(name) => match beside(band) {
            Some(path) => Ok(Plane::File(path)),
            None if shape.bands.len() == 1 => Ok(Plane::Photo),
            None => Err(Error::input(format!("the network sees the band `{name}`, which this picture lacks"))
                .help(format!(
                    "put {}.{name}.png beside it, or name the folder of such pictures with --band {name}=DIR",
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

/// The picture of a band beside its photograph.
fn companion(photo: &Path, band: &str) -> Option<PathBuf> {
    let stem = stem(photo);
    let names = [Some(format!("{stem}.{band}")), stem.contains("rgb").then(|| stem.replace("rgb", band))];
    let beside = |name: &String| picture(photo.parent()?, name);
    names.iter().flatten().find_map(beside)
}

/// The picture of the photograph's name in another folder.
fn same_name(photo: &Path, folder: &Path) -> Option<PathBuf> {
    picture(folder, &stem(photo))
}

fn picture(folder: &Path, stem: &str) -> Option<PathBuf> {
    let endings = ENDINGS.iter().flat_map(|e| [(*e).to_owned(), e.to_ascii_uppercase()]);
    endings.map(|ending| folder.join(format!("{stem}.{ending}"))).find(|path| path.is_file())
}

/// The files of a picture's prediction: classes, and classes over the picture.
pub fn files(name: &str) -> [String; 2] {
    [format!("{name}.png"), format!("{name}.overlay.png")]
}

fn one_name_each(pictures: &[Picture]) -> Result<()> {
    let mut taken: BTreeMap<String, &Picture> = BTreeMap::new();
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

/// What the predictions in a folder are: `prediction.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Prediction {
    /// The program's version.
    pub furrow: String,
    /// The network.
    pub network: String,
    /// SHA-256 of its weights.
    pub weights_sha256: String,
    /// The sizes that pictures were brought to, as `--resize` writes them; the factor on their own where their pixels on the ground were given.
    #[serde(default = "stretch")]
    pub resize: String,
    /// Side of the pictures' pixels on the ground, millimetres, where it was given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pixel_mm: Option<f64>,
    /// How they were refined, as `--refine` writes it.
    #[serde(default, skip_serializing_if = "Refine::is_none")]
    pub refine: Refine,
    /// Classes in the order of their numbers, with their sRGB colours.
    pub classes: Vec<(String, [u8; 3])>,
    /// The photograph of each prediction, by name.
    pub pictures: BTreeMap<String, String>,
}

/// What version 0.1 did.
fn stretch() -> String {
    Resize::Stretch.name()
}

/// The file that says what the predictions in a folder are.
pub const PREDICTION: &str = "prediction.json";

impl Prediction {
    /// Takes a folder for the predictions of these pictures. An error where another network's lie there, or files that are not
    /// predictions of these pictures and would be written over.
    pub fn claim(folder: &Path, card: &ModelCard, pixel_mm: Option<f64>, pictures: &[Picture]) -> Result<Self> {
        let path = folder.join(PREDICTION);
        let refuse = |path: &Path, what: String| Err(Error::misuse(what).help("give another --out").in_file(path));
        let there: Option<Self> = path.exists().then(|| run::read_json(&path)).transpose()?;
        if there.as_ref().is_some_and(|t| t.weights_sha256 != card.weights_sha256) {
            return refuse(&path, "predictions of another network lie in this folder".into());
        }
        let other_pixels = |there: &Self| there.pixel_mm.zip(pixel_mm).is_some_and(|(a, b)| a != b);
        if there.as_ref().is_some_and(|t| t.resize != card.resize.name() || other_pixels(t)) {
            return refuse(&path, "predictions at other sizes lie in this folder".into());
        }
        if there.as_ref().is_some_and(|t| t.refine != card.refine) {
            return refuse(&path, "predictions that were refined otherwise lie in this folder".into());
        }
        let mut all = there.map(|t| t.pictures).unwrap_or_default();
        for picture in pictures {
            let photo = picture.identity()?;
            match all.get(&picture.name) {
                Some(other) if *other == photo => {}
                Some(other) => {
                    let prediction = folder.join(&files(&picture.name)[0]);
                    return refuse(
                        &prediction,
                        format!("this is the prediction of {other}, and would be written over"),
                    );
                }
                None => {
                    let own = files(&picture.name).map(|file| folder.join(file));
                    if let Some(file) = own.iter().find(|file| file.exists()) {
                        return refuse(
                            file,
                            format!("this is no prediction of ours, and that of {photo} would be written over it"),
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
            classes,
            pictures: all,
        };
        run::write_json(&path, &prediction)?;
        Ok(prediction)
    }

    /// Leaves out pictures that came to nothing; the file goes where none is left.
    pub fn forget(mut self, folder: &Path, names: &[&str]) -> Result<()> {
        let names: BTreeSet<&str> = names.iter().copied().collect();
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
    use std::cell::Cell;
    use std::cmp::Ordering;

    /// A key that counts how often it is compared.
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

    /// Rationale: a folder may hold a hundred thousand pictures. Expected: each item once, in order, with fewer than 4 n log₂ n
    /// comparisons; every key against all others takes n² / 2. Source: height of a balanced tree.
    #[test]
    fn repeated_pictures_are_found_without_comparing_all_with_all() {
        let n = 4096;
        let compared = Cell::new(0);
        let items: Vec<u64> = (0..n).chain(0..n).map(|i| i * 2_654_435_761 % n).collect();
        let kept = first_of_each(items.clone(), |item| Counted(*item, &compared));
        assert_eq!(kept, items[..n as usize]);
        assert!(compared.get() < 4 * 2 * n * 12, "{} comparisons", compared.get());
    }
}
