//! A sample as the files of its folder `images/NAME/`, and back.
//!
//! | file | holds |
//! |---|---|
//! | `rgb.png`, `nir.png` | the photographs, 8 bit; none where images are labels alone |
//! | `semantics.png` | class, indexed: 0 soil, 1 crop, 2 weed, 255 no label |
//! | `species.png` | number of the species in `dataset.json`, 8 bit, 0 for none |
//! | `parts.png` | what is there, indexed: organs and things on the ground, as `parts/names.json` of the format parts; where classes need it |
//! | `plants.png`, `leaves.png` | number of the plant, of the leaf on it; 16 bit, 0 for none |
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
    add("plants.png", png(&Picture::Gray16(&sample.plants))?);
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

/// Reads a sample from its files.
pub fn read(dataset: &Path, name: &str) -> Result<Sample> {
    let at = |file: &str| -> PathBuf { dataset.join(folder(name)).join(file) };
    let record = read_record(dataset, name)?;
    let size = (record.width, record.height);
    let rgb = if record.has_photograph() || at("rgb.png").is_file() {
        let (w, h, rgb) = output::read_rgb(&at("rgb.png"))?;
        check(&at("rgb.png"), size, (w, h))?;
        rgb
    } else {
        Vec::new()
    };
    let gray = |file: &str| -> Result<Vec<u8>> {
        let (w, h, values) = output::read_gray(&at(file))?;
        check(&at(file), size, (w, h))?;
        Ok(values)
    };
    let gray16 = |file: &str| -> Result<Vec<u16>> {
        let (w, h, values) = output::read_gray16(&at(file))?;
        check(&at(file), size, (w, h))?;
        Ok(values)
    };
    let indexed = |file: &str| -> Result<Vec<u8>> {
        let (w, h, values) = output::read_indexed(&at(file))?;
        check(&at(file), size, (w, h))?;
        Ok(values)
    };
    let coverage = if at("coverage.png").is_file() {
        let (w, h, values) = output::read_rgb(&at("coverage.png"))?;
        check(&at("coverage.png"), size, (w, h))?;
        values
    } else {
        Vec::new()
    };
    let (depth, normals) = if at("geometry.exr").is_file() {
        let (w, h, depth, normals) = output::read_geometry(&at("geometry.exr"))?;
        check(&at("geometry.exr"), size, (w, h))?;
        (depth, normals)
    } else {
        (Vec::new(), Vec::new())
    };
    Ok(Sample {
        record,
        rgb,
        nir: if at("nir.png").is_file() { gray("nir.png")? } else { Vec::new() },
        semantics: indexed("semantics.png")?,
        species: if at("species.png").is_file() { gray("species.png")? } else { Vec::new() },
        parts: if at("parts.png").is_file() { indexed("parts.png")? } else { Vec::new() },
        plants: gray16("plants.png")?,
        leaves: gray16("leaves.png")?,
        coverage,
        depth,
        normals,
        film: None,
    })
}

/// Reads what is known of an image, without its maps.
pub fn read_record(dataset: &Path, name: &str) -> Result<Record> {
    let path = dataset.join(folder(name)).join("record.json");
    let bytes = crate::input::contents(&path).map_err(Error::io(&path))?;
    let record: Record = serde_json::from_slice(&bytes)
        .map_err(|e| Error::damaged(format!("this is no record: {e}")).in_file(path.clone()))?;
    // Formats name their files by it.
    if record.name != name || image_name(record.index) != name {
        return Err(Error::damaged(format!("this is the record of image `{}`, number {}", record.name, record.index))
            .help(format!("restore the one of image {name}, or render it again"))
            .in_file(path));
    }
    Ok(record)
}

fn check(path: &Path, expected: (u32, u32), found: (u32, u32)) -> Result<()> {
    if expected == found {
        return Ok(());
    }
    let ((w, h), (x, y)) = (expected, found);
    Err(Error::damaged(format!("it has {x} × {y} pixels, its record says {w} × {h}")).in_file(path))
}
