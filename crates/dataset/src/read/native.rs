//! A sample as the files of its folder `images/NAME/`, and back.
//!
//! | file | holds |
//! |---|---|
//! | `rgb.png`, `nir.png` | the photographs, 8 bit; `rgb.jpg`, `nir.jpg` where the recipe says so; none where images are labels alone |
//! | `semantics.png` | class, indexed: 0 soil, 1 crop, 2 weed, 255 no label |
//! | `species.png` | number of the species in `dataset.json`, 8 bit, 0 for none |
//! | `parts.png` | what is there, indexed: organs and things on the ground, as `parts/names.json` of the format parts; where classes need it |
//! | `plants.png` | number of the plant, 0 for none; 16 bit, or R + 256 G + 65536 B where the image shows a plant above 65,535 |
//! | `leaves.png` | number of the leaf on its plant, 0 for none; 16 bit |
//! | `coverage.png` | share of soil, crop, weed in the pixel as R, G, B; sums to 255 |
//! | `geometry.exr` | `depth.Z` (metres along the optical axis), `normal.X/Y/Z` (world), in the precision that the recipe keeps |
//! | `record.json` | what is known in words and numbers |
//!
//! Which of them an image has, [`image_files`] says by the recipe; others of these names are neither written nor read. Where `species.png`,
//! `plants.png` or `leaves.png` is left out, the record tells it.

use crate::File;
use crate::model::image_files::{self, NAMES};
use crate::model::keep::Kept;
use crate::model::photo::{Jpegs, Photo};
use crate::model::recipe::{Recipe, compact};
use crate::model::record::Record;
use crate::model::sample::{IGNORE, Sample};
use crate::read::label_maps;
use furrow_base::{Error, Result};
use furrow_field::PartKind;
use furrow_output::{Picture, Precision};
use furrow_render::scene::tag::Class;
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

/// The files of a sample that belong to images of a recipe; `text` goes into the comments of label maps, and of photographs where the recipe is
/// one of before.
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
    let png = |picture: &Picture<'_>| furrow_output::encode_png(w, h, picture, text);
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
            add("rgb.png", &|| furrow_output::encode_png(w, h, &Picture::Rgb(&sample.rgb), of_photograph))?;
        }
        if !sample.nir.is_empty() {
            add("nir.png", &|| furrow_output::encode_png(w, h, &Picture::Gray(&sample.nir), of_photograph))?;
        }
    }
    add("semantics.png", &|| png(&Picture::Indexed(&sample.semantics, &colors)))?;
    if !sample.species.is_empty() {
        add("species.png", &|| png(&Picture::Gray(&sample.species)))?;
    }
    if !sample.parts.is_empty() {
        let colors = PartKind::palette(recipe.models().len());
        add("parts.png", &|| png(&Picture::Indexed(&sample.parts, &colors)))?;
    }
    add("plants.png", &|| png(&Picture::Numbers(&sample.plants)))?;
    add("leaves.png", &|| png(&Picture::Gray16(&sample.leaves)))?;
    if !sample.coverage.is_empty() {
        add("coverage.png", &|| png(&Picture::Linear(&sample.coverage)))?;
    }
    if !sample.depth.is_empty() || !sample.normals.is_empty() {
        let small = !(recipe.keeps(Kept::Depth32) && recipe.keeps(Kept::Normals16));
        let depth = if recipe.keeps(Kept::Depth) { Precision::Half } else { Precision::Single };
        let encode = || furrow_output::encode_geometry(w, h, (&sample.depth, depth), &sample.normals, small);
        add("geometry.exr", &encode)?;
    }
    add("record.json", &|| compact(&sample.record))?;
    Ok(files)
}

/// Files that images are read from.
pub trait Files {
    /// Contents of a file by its path below the dataset's folder.
    fn contents(&self, path: &str) -> io::Result<Vec<u8>>;

    /// Where it lies, or would, for messages.
    fn place(&self, path: &str) -> PathBuf;

    /// What says which files belong to images; `None` where nobody does, and all of them do.
    fn recipe(&self) -> Option<&Recipe>;
}

/// A folder whose images lie in folders of their own. Its recipe is read once for all of them.
struct Folder<'a> {
    path: &'a Path,
    /// `None` where there is none that can be read.
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

/// Reads an image of a dataset that lies in a folder of its own.
pub fn read(dataset: &Path, name: &str) -> Result<Sample> {
    sample(&Folder::open(dataset), name)
}

/// Reads what is known of an image that lies in a folder of its own, without its maps.
pub fn read_record(dataset: &Path, name: &str) -> Result<Record> {
    // Every image has a record.
    record(&Folder { path: dataset, recipe: None }, name)
}

/// The photograph in near infrared, without its ending.
const NIR: &str = "nir";

/// A picture in gray that lies in a file.
pub struct GrayFile {
    /// What errors call the file.
    pub place: PathBuf,
    pub width: u32,
    pub height: u32,
    pub values: Vec<u8>,
}

/// The files of one image.
pub struct Image<'a, F: Files> {
    files: &'a F,
    name: &'a str,
}

impl<'a, F: Files> Image<'a, F> {
    pub fn of(files: &'a F, name: &'a str) -> Self {
        Self { files, name }
    }

    fn path(&self, file: &str) -> String {
        format!("{}/{file}", folder(self.name))
    }

    /// Where a file lies, or would, for messages.
    pub fn place(&self, file: &str) -> PathBuf {
        self.files.place(&self.path(file))
    }

    /// Whether a file of this name belongs to the image.
    pub fn owns(&self, file: &str) -> bool {
        self.files.recipe().is_none_or(|recipe| image_files::belongs(recipe, file))
    }

    /// Contents of a file; there is none that does not belong to the image, whatever lies there.
    fn contents(&self, file: &str) -> io::Result<Vec<u8>> {
        if self.owns(file) {
            return self.files.contents(&self.path(file));
        }
        Err(io::Error::new(io::ErrorKind::NotFound, "images of this dataset have no such file"))
    }

    /// A file that may be left out, with what errors call it.
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

    /// Whether there is such a file.
    pub fn has(&self, file: &str) -> Result<bool> {
        Ok(self.optional(file)?.is_some())
    }

    /// The photograph in colour, as PNG or as JPEG: width, height, pixels.
    pub fn photograph(&self) -> Result<(u32, u32, Vec<[u8; 3]>)> {
        match self.stored("rgb")? {
            Some(stored) => stored.rgb(),
            None => Err(self.no_photograph()),
        }
    }

    /// The error of an image whose photograph in colour is not there.
    fn no_photograph(&self) -> Error {
        let file = if self.owns("rgb.png") || !self.owns("rgb.jpg") { "rgb.png" } else { "rgb.jpg" };
        let source = io::Error::new(io::ErrorKind::NotFound, "the photograph is not there");
        Error::reading(&self.place(file))(source)
    }

    /// A band in gray, such as `nir`, as PNG or as JPEG, where there is one.
    pub fn band(&self, name: &str) -> Result<Option<GrayFile>> {
        let read = |stored: Stored| {
            // Any other band is a file of the user's.
            let (width, height, values) = stored.gray().map_err(|e| if name == NIR { e.in_dataset() } else { e })?;
            Ok(GrayFile { place: stored.place, width, height, values })
        };
        self.stored(name)?.map(read).transpose()
    }

    /// A photograph of this name without its ending, where there is one.
    fn stored(&self, name: &str) -> Result<Option<Stored>> {
        for ending in furrow_output::ENDINGS {
            if let Some((place, bytes)) = self.optional(&format!("{name}.{ending}"))? {
                return Ok(Some(Stored { place, bytes, is_jpeg: ending != Photo::Png.ending() }));
            }
        }
        Ok(None)
    }

    /// Numbers of species, from their picture or, where there is none, from the record of an image of this size, which may be `known`
    /// already: width, height, values. No values of an imported image.
    pub fn species(&self, size: (u32, u32), known: Option<&Record>) -> Result<(u32, u32, Vec<u8>)> {
        match self.optional("species.png")? {
            Some((place, bytes)) => furrow_output::decode_gray(&place, &bytes).map_err(Error::in_dataset),
            None => self.told(size, known, label_maps::species),
        }
    }

    /// Numbers of plants, in the same way.
    pub fn plants(&self, size: (u32, u32), known: Option<&Record>) -> Result<(u32, u32, Vec<u32>)> {
        match self.optional("plants.png")? {
            Some((place, bytes)) => furrow_output::decode_numbers(&place, &bytes).map_err(Error::in_dataset),
            None => self.told(size, known, label_maps::plants),
        }
    }

    /// Numbers of leaves, in the same way.
    fn leaves(&self, size: (u32, u32), known: Option<&Record>) -> Result<(u32, u32, Vec<u16>)> {
        match self.optional("leaves.png")? {
            Some((place, bytes)) => furrow_output::decode_gray16(&place, &bytes).map_err(Error::in_dataset),
            None => self.told(size, known, label_maps::leaves),
        }
    }

    /// A label map of an image of this size that the record tells.
    fn told<T>(
        &self,
        size: (u32, u32),
        known: Option<&Record>,
        map: impl Fn(&Record) -> Result<Vec<T>>,
    ) -> Result<(u32, u32, Vec<T>)> {
        let read = if known.is_none() { Some(record(self.files, self.name)?) } else { None };
        let mut values = Vec::new();
        if let Some(record) = known.or(read.as_ref()) {
            // A map may be as large as its record says: first what was read of it.
            check(&self.place("semantics.png"), (record.width, record.height), size)?;
            values = map(record).map_err(|e| e.in_file(self.place("record.json")))?;
        }
        Ok((size.0, size.1, values))
    }

    /// An 8-bit indexed picture.
    pub fn indexed(&self, file: &str) -> Result<(u32, u32, Vec<u8>)> {
        let (place, bytes) = self.needed(file)?;
        furrow_output::decode_indexed(&place, &bytes).map_err(Error::in_dataset)
    }
}

/// The file of a photograph.
struct Stored {
    /// Where it lies, for messages.
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

/// Colours, near infrared and the files that they are the pixels of where these are JPEG, of an image of this size.
type Photographs = (Vec<[u8; 3]>, Vec<u8>, Option<Jpegs>);

/// The photographs of an image.
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

/// Reads an image.
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

/// Reads what is known of an image, without its maps.
pub(crate) fn record(files: &impl Files, name: &str) -> Result<Record> {
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
    Err(Error::damaged(format!("it has {x} × {y} pixels, its record says {w} × {h}")).in_file(path))
}

/// Whether a file is an image's own, and of no format.
pub(crate) fn is_native(path: &str) -> bool {
    path.starts_with("images/")
}

/// Whether a file is an image's own photograph in colour.
pub(crate) fn is_photograph(path: &str) -> bool {
    is_native(path) && furrow_output::ENDINGS.iter().any(|ending| path.ends_with(&format!("/rgb.{ending}")))
}

/// Paths of an image's own files in the order of archives.
pub(crate) fn in_order<'a>(paths: impl Iterator<Item = &'a String>) -> Vec<&'a String> {
    let mut all: Vec<&String> = paths.collect();
    all.sort_by_key(|path| NAMES.iter().position(|name| path.ends_with(&format!("/{name}"))));
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::recipe::FILE;

    /// Rationale: a recipe that is read anew for each map costs as much as the smaller maps do. Expected: one that was read is asked again for a file
    /// of any image when it is gone from the disk; a folder without one has every file.
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
