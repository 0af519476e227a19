//! Images and labels as they are compared.

use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use furrow_output::Map;
use furrow_render::scene::tag::Class;
use std::path::Path;

/// Label of a pixel without a class.
const NONE: u8 = 255;

/// Image, with its pixels row by row from the top.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RasterImage {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// 8-bit sRGB.
    pub rgb: Vec<[u8; 3]>,
    /// Near infrared, 8 bit; empty if it is not known.
    pub nir: Vec<u8>,
}

impl RasterImage {
    /// Reads a PNG or JPEG of any depth, and near infrared from a separate file.
    pub fn read(path: &Path, nir: Option<&Path>) -> Result<Self> {
        let (width, height, rgb) = furrow_output::read_photo(path)?;
        let nir = match nir {
            Some(path) => {
                let (w, h, nir) = furrow_output::read_gray_photo(path)?;
                same_size(path, (w, h), (width, height))?;
                nir
            }
            None => Vec::new(),
        };
        Ok(Self { width, height, rgb, nir })
    }

    /// Returns width and height in pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }
}

/// Reads the labels of an image of this size from an indexed or gray PNG: 0 soil, 1 crop, 2 weed, 255 none.
pub fn read_labels(path: &Path, size: (u32, u32)) -> Result<Vec<u8>> {
    let (w, h, map) = furrow_output::read_map(path)?;
    same_size(path, (w, h), size)?;
    match map {
        Map::Numbers(numbers) | Map::Indexed(numbers, _) => known(path, numbers),
        Map::Colors(_) => Err(wrong(path, "these labels are colours, not numbers".into())),
    }
}

/// Converts labels to classes. Returns an error that names the file if one is not a class.
pub(super) fn known(path: &Path, numbers: Vec<u16>) -> Result<Vec<u8>> {
    let is_known = |n: u16| n < Class::ALL.len().to_u16() || n == u16::from(NONE);
    match numbers.iter().find(|n| !is_known(**n)) {
        Some(n) => Err(wrong(path, format!("no class has the number {n}"))),
        None => Ok(numbers.into_iter().map(ToInt::to_u8).collect()),
    }
}

fn wrong(path: &Path, what: String) -> Error {
    Error::input(what)
        .help("labels are numbers: 0 soil, 1 crop, 2 weed, 255 none; --labels selects other files")
        .in_file(path)
}

pub(super) fn same_size(path: &Path, (w, h): (u32, u32), (width, height): (u32, u32)) -> Result<()> {
    if (w, h) == (width, height) {
        return Ok(());
    }
    let help = if (w, h) == (height, width) {
        "width and height are exchanged: an image is turned by its EXIF orientation, a label map is not; turn this file"
    } else {
        ""
    };
    Err(Error::input(format!("it has {w} × {h} pixels, its image {width} × {height}")).help(help).in_file(path))
}
