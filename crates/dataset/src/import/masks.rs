//! Source with a folder of images and a folder of masks: numbers (grey or indexed) or colours that represent classes.

use super::classes::{Colors, Names};
use super::files::{length, listed, photograph, same_size, unread};
use super::{Labelled, Source, SourceImage};
use crate::model::sample::IGNORE;
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use furrow_output::Map;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Coding of the masks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Coding {
    /// Pixel values are numbers with these meanings.
    Numbers(Names),
    /// Pixel values are colours with these meanings.
    Colors(Colors),
}

/// Folders of images and masks, and how they are read.
#[derive(Clone, Debug)]
pub struct Folders {
    /// Folder of PNG or JPEG images, which are directly in it or in its subfolders `train`, `val` and `test`.
    pub images: PathBuf,
    /// Folder of PNG masks, with the same subfolders.
    pub masks: PathBuf,
    /// Folder of near-infrared images, PNG or JPEG, with the same subfolders.
    pub nir: Option<PathBuf>,
    /// Suffix of the images' names that is removed before matching.
    pub image_suffix: String,
    /// Suffix of the masks' names that is removed before matching.
    pub mask_suffix: String,
    /// Suffix of the infrared images' names that is removed before matching.
    pub nir_suffix: String,
    /// Coding of the masks.
    pub coding: Coding,
    /// Whether values without a meaning become unlabelled; otherwise they are an error.
    pub ignore_others: bool,
}

/// Default meanings: the numbers of `semantics.png`.
const NUMBERS: &str = "0=soil,1=crop,2=weed,255=ignore";

impl Default for Coding {
    fn default() -> Self {
        Self::Numbers(Names::parse(NUMBERS).unwrap_or_default())
    }
}

impl Folders {
    /// Describes images and masks with equal names, with the numbers of `semantics.png`; other numbers are an error.
    pub fn new(images: PathBuf, masks: PathBuf) -> Self {
        Self {
            images,
            masks,
            nir: None,
            image_suffix: String::new(),
            mask_suffix: String::new(),
            nir_suffix: String::new(),
            coding: Coding::default(),
            ignore_others: false,
        }
    }
}

/// The files of an image.
struct Files {
    image: PathBuf,
    mask: PathBuf,
    nir: Option<PathBuf>,
}

/// A source of images with masks.
pub struct Masks {
    folders: Folders,
    images: Vec<SourceImage>,
    files: Vec<Files>,
    words: String,
    warnings: Vec<String>,
}

impl Masks {
    /// Matches images and masks by name; returns an error if an image has no mask.
    pub fn open(folders: Folders) -> Result<Self> {
        let images = listed(&folders.images, &folders.image_suffix)?;
        let mut masks = listed(&folders.masks, &folders.mask_suffix)?;
        let mut nirs = match &folders.nir {
            Some(folder) => listed(folder, &folders.nir_suffix)?,
            None => BTreeMap::new(),
        };
        if images.is_empty() {
            return Err(Error::input(format!(
                "there is no PNG or JPEG image in this folder{}",
                ending(&folders.image_suffix)
            ))
            .in_file(folders.images));
        }
        let mut words = format!("{:?} {}\n", folders.coding, folders.ignore_others);
        let (mut list, mut files) = (Vec::new(), Vec::new());
        for (one, image) in images {
            let mask =
                masks.remove(&one).ok_or_else(|| lacks(&image, "mask", &folders.masks, &folders.mask_suffix, &one))?;
            let nir = match &folders.nir {
                Some(folder) => {
                    let found = nirs.remove(&one);
                    Some(found.ok_or_else(|| lacks(&image, "infrared image", folder, &folders.nir_suffix, &one))?)
                }
                None => None,
            };
            let lengths = [Some(&image), Some(&mask), nir.as_ref()].into_iter().flatten().map(|p| length(p));
            let _ = writeln!(words, "{one:?} {:?}", lengths.collect::<Result<Vec<u64>>>()?);
            list.push(one);
            files.push(Files { image, mask, nir });
        }
        // Masks and infrared images in the same folder are no images that were left out.
        let read = files.iter().flat_map(|of| [Some(&of.image), Some(&of.mask), of.nir.as_ref()]).flatten();
        let suffixes = [folders.mask_suffix.as_str(), folders.nir_suffix.as_str()];
        let others: Vec<&str> = suffixes.into_iter().filter(|suffix| !suffix.is_empty()).collect();
        let mut warnings = unread(&folders.images, &folders.image_suffix, &others, read);
        for (left, what, folder) in
            [(&masks, "masks", Some(&folders.masks)), (&nirs, "infrared images", folders.nir.as_ref())]
        {
            if let Some(folder) = folder.filter(|_| !left.is_empty()) {
                warnings.push(format!("{}: {} {what} have no image and were left out", folder.display(), left.len()));
            }
        }
        Ok(Self { folders, images: list, files, words, warnings })
    }
}

fn ending(suffix: &str) -> String {
    if suffix.is_empty() { String::new() } else { format!(" whose name ends in `{suffix}`") }
}

fn lacks(image: &Path, what: &str, folder: &Path, suffix: &str, one: &SourceImage) -> Error {
    let split = one.split.map(|s| format!("{}/", s.name())).unwrap_or_default();
    Error::input(format!("its {what} is missing: {}/{split}{}{suffix}.png", folder.display(), one.name))
        .in_file(image)
        .help(
            "names must match except for --image-suffix, --mask-suffix and --nir-suffix; \
         add the file, or remove the image",
        )
}

impl Source for Masks {
    fn name(&self) -> &'static str {
        "masks"
    }

    fn images(&self) -> &[SourceImage] {
        &self.images
    }

    fn words(&self) -> &str {
        &self.words
    }

    fn warnings(&self) -> &[String] {
        &self.warnings
    }

    fn has_nir(&self) -> bool {
        self.folders.nir.is_some()
    }

    fn read(&self, place: usize) -> Result<Labelled> {
        let Files { image, mask, nir } = &self.files[place];
        let photo = photograph(furrow_output::open_photo(image)?);
        let (x, y, map) = furrow_output::read_map(mask)?;
        same_size(mask, (x, y), &photo)?;
        let semantics = self.semantics(mask, photo.size.0, map)?;
        let (size, rgb, mut warnings) = (photo.size, photo.pixels.clone(), photo.warnings.clone());
        let nir = match nir {
            Some(path) => {
                let gray = furrow_output::open_gray_photo(path)?;
                if gray.is_colored {
                    warnings.push("its infrared image has colours, of which the brightness was read".into());
                }
                let gray = photograph(gray);
                warnings.extend(gray.warnings.iter().map(|what| format!("infrared image: {what}")));
                same_size(path, gray.size, &photo)?;
                gray.pixels
            }
            None => Vec::new(),
        };
        let (plants, leaves) = (vec![0; semantics.len()], vec![0; semantics.len()]);
        Ok(Labelled { size, rgb, nir, semantics, plants, leaves, warnings, ..Labelled::default() })
    }
}

impl Masks {
    /// Returns the classes of a mask's pixels.
    fn semantics(&self, path: &Path, width: u32, map: Map) -> Result<Vec<u8>> {
        match (&self.folders.coding, map) {
            (Coding::Numbers(names), Map::Numbers(numbers) | Map::Indexed(numbers, _)) => {
                let mut table = BTreeMap::new();
                let meaning =
                    |n: &u16| *table.entry(*n).or_insert_with(|| names.0.get(&n.to_string()).map(|m| m.number()));
                self.all(path, width, &numbers, meaning, |n| format!("the number {n}"), "--classes")
            }
            (Coding::Numbers(_), Map::Colors(_)) => Err(Error::input(
                "this mask contains colours, not numbers; use --colors '0,255,0=crop;…' instead of --classes",
            )
            .in_file(path)),
            (Coding::Colors(colors), map) => {
                let pixels = map.colors();
                let meaning = |c: &[u8; 3]| colors.0.get(c).map(|m| m.number());
                self.all(path, width, &pixels, meaning, |[r, g, b]| format!("the colour {r},{g},{b}"), "--colors")
            }
        }
    }

    fn all<T: Copy>(
        &self,
        path: &Path,
        width: u32,
        pixels: &[T],
        mut meaning: impl FnMut(&T) -> Option<u8>,
        words: impl Fn(T) -> String,
        option: &str,
    ) -> Result<Vec<u8>> {
        let one = |(place, pixel): (usize, &T)| match meaning(pixel) {
            Some(number) => Ok(number),
            None if self.folders.ignore_others => Ok(IGNORE),
            None => Err(Error::input(format!(
                "pixel {},{} has {}, for which no class was given",
                place.to_u32() % width,
                place.to_u32() / width,
                words(*pixel)
            ))
            .help(format!("add it to {option}, or give --others ignore"))
            .in_file(path)),
        };
        pixels.iter().enumerate().map(one).collect()
    }
}
