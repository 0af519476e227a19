//! A sample as the files of its folder `images/NAME/`, and back.
//!
//! | file | holds |
//! |---|---|
//! | `rgb.png`, `nir.png` | the photographs, 8 bit; none where images are labels alone |
//! | `semantics.png` | class, indexed: 0 soil, 1 crop, 2 weed, 255 no label |
//! | `species.png` | number of the species in `dataset.json`, 8 bit, 0 for none |
//! | `parts.png` | what is there, indexed: organs and things on the ground, as `parts/names.json` of the format parts; where classes need it |
//! | `plants.png` | number of the plant, 0 for none; 16 bit, or R + 256 G + 65536 B where the image shows a plant above 65,535 |
//! | `leaves.png` | number of the leaf on its plant, 0 for none; 16 bit |
//! | `coverage.png` | share of soil, crop, weed in the pixel as R, G, B; sums to 255 |
//! | `geometry.exr` | `depth.Z` (metres along the optical axis), `normal.X/Y/Z` (world), in the precision that the recipe keeps |
//! | `record.json` | what is known in words and numbers |

use super::File;
use super::keep::Kept;
use super::recipe::{Recipe, compact};
use super::record::Record;
use super::sample::{IGNORE, Sample};
use crate::output::{self, Picture, Precision};
use crate::scene::PartKind;
use crate::scene::tag::Class;
use crate::{Error, Result};
use std::io;
use std::path::{Path, PathBuf};

/// The name of an image: its number.
pub fn image_name(index: u64) -> String {
    format!("{index:06}")
}

/// The folder of an image, below that of the dataset.
pub fn folder(name: &str) -> String {
    format!("images/{name}")
}

/// Colours of `semantics.png`: the classes' in their order, grey up to 255 for pixels without a label.
pub fn palette(with_ignore: bool) -> Vec<[u8; 3]> {
    let mut colors: Vec<[u8; 3]> = Class::ALL.iter().map(|c| c.color()).collect();
    if with_ignore {
        colors.resize(usize::from(IGNORE) + 1, [128; 3]);
    }
    colors
}

/// The files of a sample; `text` goes into the pictures' comments.
pub fn files(recipe: &Recipe, sample: &Sample, text: &str) -> Result<Vec<File>> {
    let (w, h) = sample.size();
    let base = folder(&sample.record.name);
    let mut files = Vec::new();
    let mut add = |name: &str, bytes: Vec<u8>| files.push(File { path: format!("{base}/{name}"), bytes });
    let png = |picture: &Picture<'_>| output::encode_png(w, h, picture, text);
    let colors = palette(sample.semantics.contains(&IGNORE));
    if !sample.rgb.is_empty() {
        add("rgb.png", png(&Picture::Rgb(&sample.rgb))?);
    }
    if !sample.nir.is_empty() {
        add("nir.png", png(&Picture::Gray(&sample.nir))?);
    }
    add("semantics.png", png(&Picture::Indexed(&sample.semantics, &colors))?);
    if !sample.species.is_empty() {
        add("species.png", png(&Picture::Gray(&sample.species))?);
    }
    if !sample.parts.is_empty() {
        add("parts.png", png(&Picture::Indexed(&sample.parts, &PartKind::palette()))?);
    }
    add("plants.png", png(&Picture::Numbers(&sample.plants))?);
    add("leaves.png", png(&Picture::Gray16(&sample.leaves))?);
    if !sample.coverage.is_empty() {
        add("coverage.png", png(&Picture::Linear(&sample.coverage))?);
    }
    if !sample.depth.is_empty() || !sample.normals.is_empty() {
        let small = !(recipe.keeps(Kept::Depth32) && recipe.keeps(Kept::Normals16));
        let depth = if recipe.keeps(Kept::Depth) { Precision::Half } else { Precision::Single };
        add("geometry.exr", output::encode_geometry(w, h, (&sample.depth, depth), &sample.normals, small)?);
    }
    add("record.json", compact(&sample.record)?);
    Ok(files)
}

/// Files that images are read from.
pub trait Files {
    /// Contents of a file by its path below the dataset's folder.
    fn contents(&self, path: &str) -> io::Result<Vec<u8>>;

    /// Where it lies, or would, for messages.
    fn place(&self, path: &str) -> PathBuf;
}

impl Files for Path {
    fn contents(&self, path: &str) -> io::Result<Vec<u8>> {
        crate::input::contents(&self.join(path))
    }

    fn place(&self, path: &str) -> PathBuf {
        self.join(path)
    }
}

/// Reads an image of a dataset that lies in a folder of its own.
pub fn read(dataset: &Path, name: &str) -> Result<Sample> {
    sample(dataset, name)
}

/// Reads what is known of an image that lies in a folder of its own, without its maps.
pub fn read_record(dataset: &Path, name: &str) -> Result<Record> {
    record(dataset, name)
}

/// The files of one image.
pub(crate) struct Image<'a, F: Files + ?Sized> {
    files: &'a F,
    name: &'a str,
}

impl<'a, F: Files + ?Sized> Image<'a, F> {
    pub(crate) fn of(files: &'a F, name: &'a str) -> Self {
        Self { files, name }
    }

    fn path(&self, file: &str) -> String {
        format!("{}/{file}", folder(self.name))
    }

    /// Where a file lies, or would, for messages.
    pub(crate) fn place(&self, file: &str) -> PathBuf {
        self.files.place(&self.path(file))
    }

    /// A file that may be left out, with what errors call it.
    fn optional(&self, file: &str) -> Result<Option<(PathBuf, Vec<u8>)>> {
        let place = self.place(file);
        match self.files.contents(&self.path(file)) {
            Ok(bytes) => Ok(Some((place, bytes))),
            Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(e) => Err(Error::reading(&place)(e)),
        }
    }

    fn needed(&self, file: &str) -> Result<(PathBuf, Vec<u8>)> {
        let place = self.place(file);
        let bytes = self.files.contents(&self.path(file)).map_err(Error::reading(&place))?;
        Ok((place, bytes))
    }

    /// Whether there is such a file.
    pub(crate) fn has(&self, file: &str) -> Result<bool> {
        Ok(self.optional(file)?.is_some())
    }

    /// An 8-bit RGB picture: width, height, three numbers a pixel.
    pub(crate) fn rgb(&self, file: &str) -> Result<(u32, u32, Vec<[u8; 3]>)> {
        let (place, bytes) = self.needed(file)?;
        output::decode_rgb(&place, &bytes)
    }

    /// An 8-bit gray picture.
    pub(crate) fn gray(&self, file: &str) -> Result<(u32, u32, Vec<u8>)> {
        let (place, bytes) = self.needed(file)?;
        output::decode_gray(&place, &bytes)
    }

    /// The same, where there is one.
    pub(crate) fn gray_if_there(&self, file: &str) -> Result<Option<(u32, u32, Vec<u8>)>> {
        self.optional(file)?.map(|(place, bytes)| output::decode_gray(&place, &bytes)).transpose()
    }

    /// A 16-bit gray picture.
    pub(crate) fn gray16(&self, file: &str) -> Result<(u32, u32, Vec<u16>)> {
        let (place, bytes) = self.needed(file)?;
        output::decode_gray16(&place, &bytes)
    }

    /// A picture of plants' numbers.
    pub(crate) fn numbers(&self, file: &str) -> Result<(u32, u32, Vec<u32>)> {
        let (place, bytes) = self.needed(file)?;
        output::decode_numbers(&place, &bytes)
    }

    /// An 8-bit indexed picture.
    pub(crate) fn indexed(&self, file: &str) -> Result<(u32, u32, Vec<u8>)> {
        let (place, bytes) = self.needed(file)?;
        output::decode_indexed(&place, &bytes)
    }
}

/// Reads an image.
pub(super) fn sample(files: &(impl Files + ?Sized), name: &str) -> Result<Sample> {
    let image = Image::of(files, name);
    let record = record(files, name)?;
    let size = (record.width, record.height);
    let rgb = if record.has_photograph() || image.has("rgb.png")? {
        sized(&image, "rgb.png", size, image.rgb("rgb.png")?)?
    } else {
        Vec::new()
    };
    let of_size =
        |file: &str| image.gray_if_there(file)?.map_or(Ok(Vec::new()), |found| sized(&image, file, size, found));
    let (nir, species) = (of_size("nir.png")?, of_size("species.png")?);
    let coverage = match image.optional("coverage.png")? {
        Some((place, bytes)) => sized(&image, "coverage.png", size, output::decode_rgb(&place, &bytes)?)?,
        None => Vec::new(),
    };
    let parts = match image.optional("parts.png")? {
        Some((place, bytes)) => sized(&image, "parts.png", size, output::decode_indexed(&place, &bytes)?)?,
        None => Vec::new(),
    };
    let (depth, normals) = match image.optional("geometry.exr")? {
        Some((place, bytes)) => {
            let (w, h, depth, normals) = output::decode_geometry(&place, bytes)?;
            check(&place, size, (w, h))?;
            (depth, normals)
        }
        None => (Vec::new(), Vec::new()),
    };
    Ok(Sample {
        rgb,
        nir,
        semantics: sized(&image, "semantics.png", size, image.indexed("semantics.png")?)?,
        species,
        parts,
        plants: sized(&image, "plants.png", size, image.numbers("plants.png")?)?,
        leaves: sized(&image, "leaves.png", size, image.gray16("leaves.png")?)?,
        coverage,
        depth,
        normals,
        film: None,
        record,
    })
}

/// Reads what is known of an image, without its maps.
pub(super) fn record(files: &(impl Files + ?Sized), name: &str) -> Result<Record> {
    let path = format!("{}/record.json", folder(name));
    let place = files.place(&path);
    let bytes = files.contents(&path).map_err(Error::io(&place))?;
    let record: Record = serde_json::from_slice(&bytes)
        .map_err(|e| Error::damaged(format!("this is no record: {e}")).in_file(place.clone()))?;
    // Formats name their files by it.
    if record.name != name || image_name(record.index) != name {
        return Err(Error::damaged(format!("this is the record of image `{}`, number {}", record.name, record.index))
            .help(format!("restore the one of image {name}, or render it again"))
            .in_file(place));
    }
    Ok(record)
}

/// The values of a picture that has its record's size.
fn sized<T>(
    image: &Image<'_, impl Files + ?Sized>,
    file: &str,
    size: (u32, u32),
    (w, h, values): (u32, u32, Vec<T>),
) -> Result<Vec<T>> {
    check(&image.place(file), size, (w, h))?;
    Ok(values)
}

fn check(path: &Path, expected: (u32, u32), found: (u32, u32)) -> Result<()> {
    if expected == found {
        return Ok(());
    }
    let ((w, h), (x, y)) = (expected, found);
    Err(Error::damaged(format!("it has {x} × {y} pixels, its record says {w} × {h}")).in_file(path))
}

/// Names of an image's files, in the order in which [`files`] makes them and archives hold them: what is known of it comes last.
const ORDER: [&str; 10] = [
    "rgb.png",
    "nir.png",
    "semantics.png",
    "species.png",
    "parts.png",
    "plants.png",
    "leaves.png",
    "coverage.png",
    "geometry.exr",
    "record.json",
];

/// Whether a file is an image's own, and of no format.
pub(super) fn is_native(path: &str) -> bool {
    path.starts_with("images/")
}

/// Paths of an image's own files in the order of archives.
pub(super) fn in_order<'a>(paths: impl Iterator<Item = &'a String>) -> Vec<&'a String> {
    let mut all: Vec<&String> = paths.collect();
    all.sort_by_key(|path| ORDER.iter().position(|name| path.ends_with(&format!("/{name}"))));
    all
}
