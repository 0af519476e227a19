//! Writes a sample as the files of its folder `images/NAME/`, and reads it from them.
//!
//! | file | contents |
//! |---|---|
//! | `rgb.png`, `nir.png` | colour and near-infrared image, 8 bit; `rgb.jpg`, `nir.jpg` for JPEG; none for labels-only images |
//! | `semantics.png` | class, indexed: 0 soil, 1 crop, 2 weed, 255 no label |
//! | `species.png` | number of the species in `dataset.json`, 8 bit, 0 for none |
//! | `parts.png` | organ or object on the ground, indexed, numbered as in `parts/names.json` of the format parts; if classes need it |
//! | `plants.png` | number of the plant, 0 for none; 16 bit, or R + 256 G + 65536 B if a visible plant is above 65,535 |
//! | `leaves.png` | number of the leaf on its plant, 0 for none; 16 bit |
//! | `coverage.png` | fraction of soil, crop, weed in the pixel as R, G, B; sums to 255 |
//! | `geometry.exr` | `depth.Z` (metres along the optical axis), `normal.X/Y/Z` (world), with the precision in the recipe |
//! | `record.json` | labels and metadata |
//!
//! [`image_files`] determines from the recipe which of them an image has; other files with these names are neither
//! written nor read. If `species.png`, `plants.png` or `leaves.png` is omitted, the map is made from the record.

use crate::File;
use crate::model::image_files::{self, NAMES};
use crate::model::image_format::{ImageFormat, Jpegs};
use crate::model::optional_maps::OptionalMap;
use crate::model::recipe::{Recipe, compact};
use crate::model::record::Record;
use crate::model::sample::{IGNORE, Sample};
use crate::read::label_maps;
use furrow_base::{Error, Result};
use furrow_field::PartKind;
use furrow_output::{ImageData, Precision};
use furrow_render::scene::tag::Class;
use std::io;
use std::path::{Path, PathBuf};

/// Returns the name of an image: its number in six digits or more.
pub fn image_name(index: u64) -> String {
    format!("{index:06}")
}

/// Returns the folder of an image, relative to the dataset's folder.
pub fn folder(name: &str) -> String {
    format!("images/{name}")
}

/// Returns the palette of `semantics.png`: the colours of the classes by number, and with `with_ignore` grey for all
/// further numbers up to 255, no label.
pub fn palette(with_ignore: bool) -> Vec<[u8; 3]> {
    let mut colors: Vec<[u8; 3]> = Class::ALL.iter().map(|c| c.color()).collect();
    if with_ignore {
        colors.resize(usize::from(IGNORE) + 1, [128; 3]);
    }
    colors
}

/// Returns the files of a sample that belong to images of this recipe. `text` is the comment of label maps, and of
/// colour and near-infrared images if the recipe was written by an earlier version.
pub fn files(recipe: &Recipe, sample: &Sample, text: &str) -> Result<Vec<File>> {
    let (w, h) = sample.size();
    let base = folder(&sample.record.name);
    let mut files = Vec::new();
    let mut add = |name: &str, encode: &dyn Fn() -> Result<Vec<u8>>| -> Result<()> {
        if image_files::belongs(recipe, name) {
            files.push(File { path: format!("{base}/{name}"), bytes: encode()? });
        }
        Ok(())
    };
    let png = |picture: &ImageData<'_>| furrow_output::encode_png(w, h, picture, text);
    let colors = palette(sample.semantics.contains(&IGNORE));
    let of_photograph = if recipe.has_comments() { text } else { "" };
    if let Some(jpeg) = &sample.jpeg {
        for (name, bytes) in [("rgb.jpg", &jpeg.rgb), ("nir.jpg", &jpeg.nir)] {
            if !bytes.is_empty() {
                add(name, &|| Ok(bytes.clone()))?;
            }
        }
    } else {
        if !sample.rgb.is_empty() {
            add("rgb.png", &|| furrow_output::encode_png(w, h, &ImageData::Rgb(&sample.rgb), of_photograph))?;
        }
        if !sample.nir.is_empty() {
            add("nir.png", &|| furrow_output::encode_png(w, h, &ImageData::Brightness(&sample.nir), of_photograph))?;
        }
    }
    add("semantics.png", &|| png(&ImageData::Indexed(&sample.semantics, &colors)))?;
    if !sample.species.is_empty() {
        add("species.png", &|| png(&ImageData::Gray(&sample.species)))?;
    }
    if !sample.parts.is_empty() {
        let colors = PartKind::palette(recipe.models().len());
        add("parts.png", &|| png(&ImageData::Indexed(&sample.parts, &colors)))?;
    }
    add("plants.png", &|| png(&ImageData::Numbers(&sample.plants)))?;
    add("leaves.png", &|| png(&ImageData::Gray16(&sample.leaves)))?;
    if !sample.coverage.is_empty() {
        add("coverage.png", &|| png(&ImageData::Linear(&sample.coverage)))?;
    }
    if !sample.depth.is_empty() || !sample.normals.is_empty() {
        let small = !(recipe.keeps(OptionalMap::Depth32) && recipe.keeps(OptionalMap::Normals16));
        let depth = if recipe.keeps(OptionalMap::Depth) { Precision::Half } else { Precision::Single };
        let encode = || furrow_output::encode_geometry(w, h, (&sample.depth, depth), &sample.normals, small);
        add("geometry.exr", &encode)?;
    }
    add("record.json", &|| compact(&sample.record))?;
    Ok(files)
}

/// Source of the files of images.
pub trait Files {
    /// Returns the contents of a file; `path` is relative to the dataset's folder.
    fn contents(&self, path: &str) -> io::Result<Vec<u8>>;

    /// Returns the path of a file for error messages, whether it exists or not.
    fn place(&self, path: &str) -> PathBuf;

    /// Returns the recipe, which determines the files of images. If there is `None`, all files belong to the images.
    fn recipe(&self) -> Option<&Recipe>;
}

/// A dataset with a folder for each image. Its recipe is read once.
struct Folder<'a> {
    path: &'a Path,
    /// `None` if no recipe can be read.
    recipe: Option<Recipe>,
}

impl<'a> Folder<'a> {
    fn open(path: &'a Path) -> Self {
        Self { path, recipe: Recipe::read(path).ok() }
    }
}

impl Files for Folder<'_> {
    fn contents(&self, path: &str) -> io::Result<Vec<u8>> {
        furrow_base::input::contents(&self.path.join(path))
    }

    fn place(&self, path: &str) -> PathBuf {
        self.path.join(path)
    }

    fn recipe(&self) -> Option<&Recipe> {
        self.recipe.as_ref()
    }
}

/// Reads an image that has a folder of its own.
pub fn read(dataset: &Path, name: &str) -> Result<Sample> {
    sample(&Folder::open(dataset), name)
}

/// Reads the record of an image that has a folder of its own, without its maps.
pub fn read_record(dataset: &Path, name: &str) -> Result<Record> {
    // The recipe is not needed, since every image has a record.
    record(&Folder { path: dataset, recipe: None }, name)
}

/// Name of the near-infrared image without extension.
const NIR: &str = "nir";

/// A grey image that was read from a file.
pub struct GrayFile {
    /// Path of the file for error messages.
    pub place: PathBuf,
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Grey values, row by row from the top.
    pub values: Vec<u8>,
}

/// Reader of the files of one image.
pub struct Image<'a, F: Files> {
    files: &'a F,
    name: &'a str,
}

impl<'a, F: Files> Image<'a, F> {
    /// Returns the reader of the image with this name.
    pub fn of(files: &'a F, name: &'a str) -> Self {
        Self { files, name }
    }

    fn path(&self, file: &str) -> String {
        format!("{}/{file}", folder(self.name))
    }

    /// Returns the path of a file for error messages, whether it exists or not.
    pub fn place(&self, file: &str) -> PathBuf {
        self.files.place(&self.path(file))
    }

    /// Returns whether a file with this name belongs to the image.
    pub fn owns(&self, file: &str) -> bool {
        self.files.recipe().is_none_or(|recipe| image_files::belongs(recipe, file))
    }

    /// Returns the contents of a file. A file that does not belong to the image counts as missing, even if it exists.
    fn contents(&self, file: &str) -> io::Result<Vec<u8>> {
        if self.owns(file) {
            return self.files.contents(&self.path(file));
        }
        Err(io::Error::new(io::ErrorKind::NotFound, "images of this dataset have no such file"))
    }

    /// Returns the path for error messages and the contents of a file; `None` if it is missing.
    pub fn optional(&self, file: &str) -> Result<Option<(PathBuf, Vec<u8>)>> {
        let place = self.place(file);
        match self.contents(file) {
            Ok(bytes) => Ok(Some((place, bytes))),
            Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(e) => Err(Error::reading(&place)(e)),
        }
    }

    fn needed(&self, file: &str) -> Result<(PathBuf, Vec<u8>)> {
        let place = self.place(file);
        let bytes = self.contents(file).map_err(Error::reading(&place))?;
        Ok((place, bytes))
    }

    /// Returns whether the file exists and belongs to the image.
    pub fn has(&self, file: &str) -> Result<bool> {
        Ok(self.optional(file)?.is_some())
    }

    /// Reads the colour image, PNG or JPEG. Returns width, height and pixels.
    pub fn photograph(&self) -> Result<(u32, u32, Vec<[u8; 3]>)> {
        match self.stored("rgb")? {
            Some(stored) => stored.rgb(),
            None => Err(self.no_photograph()),
        }
    }

    /// Returns the error for a missing colour image.
    fn no_photograph(&self) -> Error {
        let file = if self.owns("rgb.png") || !self.owns("rgb.jpg") { "rgb.png" } else { "rgb.jpg" };
        let source = io::Error::new(io::ErrorKind::NotFound, "the colour image is missing");
        Error::reading(&self.place(file))(source)
    }

    /// Reads a grey band such as `nir`, PNG or JPEG; `None` if there is none.
    pub fn band(&self, name: &str) -> Result<Option<GrayFile>> {
        let read = |stored: Stored| {
            // Bands other than near infrared are user files.
            let (width, height, values) = stored.gray().map_err(|e| if name == NIR { e.in_dataset() } else { e })?;
            Ok(GrayFile { place: stored.place, width, height, values })
        };
        self.stored(name)?.map(read).transpose()
    }

    /// Reads the image file with this name, given without extension; `None` if there is none.
    fn stored(&self, name: &str) -> Result<Option<Stored>> {
        for ending in furrow_output::ENDINGS {
            if let Some((place, bytes)) = self.optional(&format!("{name}.{ending}"))? {
                return Ok(Some(Stored { place, bytes, is_jpeg: ending != ImageFormat::Png.ending() }));
            }
        }
        Ok(None)
    }

    /// Returns width, height and species numbers, from `species.png` or, if it is missing, from the record, which must
    /// have the given `size`. `known` is the record if it was read before. An imported image without the file has no
    /// values.
    pub fn species(&self, size: (u32, u32), known: Option<&Record>) -> Result<(u32, u32, Vec<u8>)> {
        match self.optional("species.png")? {
            Some((place, bytes)) => furrow_output::decode_gray(&place, &bytes).map_err(Error::in_dataset),
            None => self.derived(size, known, label_maps::species),
        }
    }

    /// Returns plant numbers in the same way.
    pub fn plants(&self, size: (u32, u32), known: Option<&Record>) -> Result<(u32, u32, Vec<u32>)> {
        match self.optional("plants.png")? {
            Some((place, bytes)) => furrow_output::decode_numbers(&place, &bytes).map_err(Error::in_dataset),
            None => self.derived(size, known, label_maps::plants),
        }
    }

    /// Returns leaf numbers in the same way.
    fn leaves(&self, size: (u32, u32), known: Option<&Record>) -> Result<(u32, u32, Vec<u16>)> {
        match self.optional("leaves.png")? {
            Some((place, bytes)) => furrow_output::decode_gray16(&place, &bytes).map_err(Error::in_dataset),
            None => self.derived(size, known, label_maps::leaves),
        }
    }

    /// Makes a label map from the record, which must have the given `size`.
    fn derived<T>(
        &self,
        size: (u32, u32),
        known: Option<&Record>,
        map: impl Fn(&Record) -> Result<Vec<T>>,
    ) -> Result<(u32, u32, Vec<T>)> {
        let read = if known.is_none() { Some(record(self.files, self.name)?) } else { None };
        let mut values = Vec::new();
        if let Some(record) = known.or(read.as_ref()) {
            // The record determines the size of the map in memory, so it is compared with `size` first.
            check(&self.place("semantics.png"), (record.width, record.height), size)?;
            values = map(record).map_err(|e| e.in_file(self.place("record.json")))?;
        }
        Ok((size.0, size.1, values))
    }

    /// Reads an 8-bit indexed image.
    pub fn indexed(&self, file: &str) -> Result<(u32, u32, Vec<u8>)> {
        let (place, bytes) = self.needed(file)?;
        furrow_output::decode_indexed(&place, &bytes).map_err(Error::in_dataset)
    }
}

/// File of a colour or grey image.
struct Stored {
    /// Path for error messages.
    place: PathBuf,
    bytes: Vec<u8>,
    is_jpeg: bool,
}

impl Stored {
    fn rgb(&self) -> Result<(u32, u32, Vec<[u8; 3]>)> {
        let decode = if self.is_jpeg { furrow_output::decode_jpeg } else { furrow_output::decode_rgb };
        decode(&self.place, &self.bytes).map_err(Error::in_dataset)
    }

    fn gray(&self) -> Result<(u32, u32, Vec<u8>)> {
        if self.is_jpeg {
            furrow_output::decode_gray_jpeg(&self.place, &self.bytes)
        } else {
            furrow_output::decode_gray(&self.place, &self.bytes)
        }
    }
}

/// Pixels of the colour image, pixels of the near-infrared image, and their files if these are JPEG.
type Photographs = (Vec<[u8; 3]>, Vec<u8>, Option<Jpegs>);

/// Reads the colour and the near-infrared image.
fn photographs(image: &Image<'_, impl Files>, record: &Record) -> Result<Photographs> {
    let size = (record.width, record.height);
    let (rgb, nir) = (image.stored("rgb")?, image.stored(NIR)?);
    if rgb.is_none() && record.has_photograph() {
        return Err(image.no_photograph());
    }
    let mut pixels = (Vec::new(), Vec::new());
    if let Some(stored) = &rgb {
        let (w, h, values) = stored.rgb()?;
        check(&stored.place, size, (w, h))?;
        pixels.0 = values;
    }
    if let Some(stored) = &nir {
        let (w, h, values) = stored.gray().map_err(Error::in_dataset)?;
        check(&stored.place, size, (w, h))?;
        pixels.1 = values;
    }
    let bytes = |stored: Option<Stored>| stored.filter(|stored| stored.is_jpeg).map(|stored| stored.bytes);
    let jpeg = match (bytes(rgb), bytes(nir)) {
        (None, None) => None,
        (rgb, nir) => Some(Jpegs { rgb: rgb.unwrap_or_default(), nir: nir.unwrap_or_default() }),
    };
    Ok((pixels.0, pixels.1, jpeg))
}

/// Reads an image with all its maps.
pub(crate) fn sample(files: &impl Files, name: &str) -> Result<Sample> {
    let image = Image::of(files, name);
    let record = record(files, name)?;
    let size = (record.width, record.height);
    let (rgb, nir, jpeg) = photographs(&image, &record)?;
    let semantics = sized(&image, "semantics.png", size, image.indexed("semantics.png")?)?;
    let known = Some(&record);
    let species = sized(&image, "species.png", size, image.species(size, known)?)?;
    let plants = sized(&image, "plants.png", size, image.plants(size, known)?)?;
    let leaves = sized(&image, "leaves.png", size, image.leaves(size, known)?)?;
    let coverage = match image.optional("coverage.png")? {
        Some((place, bytes)) => {
            let found = furrow_output::decode_rgb(&place, &bytes).map_err(Error::in_dataset)?;
            sized(&image, "coverage.png", size, found)?
        }
        None => Vec::new(),
    };
    let parts = match image.optional("parts.png")? {
        Some((place, bytes)) => {
            let found = furrow_output::decode_indexed(&place, &bytes).map_err(Error::in_dataset)?;
            sized(&image, "parts.png", size, found)?
        }
        None => Vec::new(),
    };
    let (depth, normals) = match image.optional("geometry.exr")? {
        Some((place, bytes)) => {
            let (w, h, depth, normals) = furrow_output::decode_geometry(&place, bytes).map_err(Error::in_dataset)?;
            check(&place, size, (w, h))?;
            (depth, normals)
        }
        None => (Vec::new(), Vec::new()),
    };
    Ok(Sample {
        rgb,
        nir,
        semantics,
        species,
        parts,
        plants,
        leaves,
        coverage,
        depth,
        normals,
        jpeg,
        film: None,
        record,
    })
}

/// Reads the record of an image, without its maps.
pub(crate) fn record(files: &impl Files, name: &str) -> Result<Record> {
    let path = format!("{}/record.json", folder(name));
    let place = files.place(&path);
    let bytes = files.contents(&path).map_err(Error::io(&place))?;
    let record: Record = serde_json::from_slice(&bytes)
        .map_err(|e| Error::damaged(format!("this is not a record: {e}")).in_file(place.clone()))?;
    // Formats derive file names from it.
    if record.name != name || image_name(record.index) != name {
        return Err(Error::damaged(format!("this is the record of image `{}`, number {}", record.name, record.index))
            .help(format!("restore the record of image {name}, or render the image again"))
            .in_file(place));
    }
    Ok(record)
}

/// Returns the values of a map after checking that it has the size in the record.
fn sized<T>(
    image: &Image<'_, impl Files>,
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
    Err(Error::damaged(format!("it has {x} × {y} pixels instead of {w} × {h} as in its record")).in_file(path))
}

/// Returns whether a file is a native file of an image, instead of a file of a format.
pub(crate) fn is_native(path: &str) -> bool {
    path.starts_with("images/")
}

/// Returns whether a file is the native colour image of an image.
pub(crate) fn is_photograph(path: &str) -> bool {
    is_native(path) && furrow_output::ENDINGS.iter().any(|ending| path.ends_with(&format!("/rgb.{ending}")))
}

/// Sorts the paths of an image's native files into the order of archives.
pub(crate) fn in_order<'a>(paths: impl Iterator<Item = &'a String>) -> Vec<&'a String> {
    let mut all: Vec<&String> = paths.collect();
    all.sort_by_key(|path| NAMES.iter().position(|name| path.ends_with(&format!("/{name}"))));
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::recipe::FILE;

    /// Rationale: reading the recipe again for each map would double the time for small maps. Expected: a recipe that
    /// was read once still decides about the files after its own file is deleted; in a folder without a recipe, all
    /// files belong to images.
    #[test]
    fn the_recipe_of_a_folder_is_read_once() {
        let keep = tempfile::tempdir().unwrap();
        let (recipe, image) = (keep.path().join(FILE), keep.path().join(folder("000000")));
        std::fs::write(&recipe, Recipe::of_species(Vec::new()).text().unwrap()).unwrap();
        std::fs::create_dir_all(&image).unwrap();
        std::fs::write(image.join("coverage.png"), "").unwrap();
        let imported = Folder::open(keep.path());
        std::fs::remove_file(&recipe).unwrap();
        assert!(!Image::of(&imported, "000000").has("coverage.png").unwrap());
        assert!(Image::of(&Folder::open(keep.path()), "000000").has("coverage.png").unwrap());
    }
}
