//! Pictures and labels as they are compared.

use crate::output::{self, Map};
use crate::scene::tag::Class;
use crate::{Error, Result};
use std::path::Path;

/// A pixel's label that stands for none.
const NONE: u8 = 255;

/// A picture, its pixels row by row from the top.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Picture {
    /// Pixels from left to right.
    pub width: u32,
    /// Pixels from top to bottom.
    pub height: u32,
    /// 8-bit sRGB.
    pub rgb: Vec<[u8; 3]>,
    /// Near infrared, 8 bit; empty where it is not known.
    pub nir: Vec<u8>,
}

impl Picture {
    /// Reads a PNG or JPEG of any depth, and near infrared from a file of its own.
    pub fn read(path: &Path, nir: Option<&Path>) -> Result<Self> {
        let (width, height, rgb) = output::read_photo(path)?;
        let nir = match nir {
            Some(path) => {
                let (w, h, nir) = output::read_gray_photo(path)?;
                same_size(path, (w, h), (width, height))?;
                nir
            }
            None => Vec::new(),
        };
        Ok(Self { width, height, rgb, nir })
    }

    /// Width and height in pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }
}

/// Reads the labels of a picture of this size: 0 soil, 1 crop, 2 weed, 255 none; a PNG, indexed or gray.
pub fn read_labels(path: &Path, size: (u32, u32)) -> Result<Vec<u8>> {
    let (w, h, map) = output::read_map(path)?;
    same_size(path, (w, h), size)?;
    match map {
        Map::Numbers(numbers) | Map::Indexed(numbers, _) => known(path, numbers),
        Map::Colors(_) => Err(wrong(path, "these labels are colours".into())),
    }
}

/// Labels that are classes; an error, naming the file, where one is none.
pub(super) fn known(path: &Path, numbers: Vec<u16>) -> Result<Vec<u8>> {
    let is_known = |n: u16| n < Class::ALL.len() as u16 || n == u16::from(NONE);
    match numbers.iter().find(|n| !is_known(**n)) {
        Some(n) => Err(wrong(path, format!("no class has the number {n}"))),
        None => Ok(numbers.into_iter().map(|n| n as u8).collect()),
    }
}

fn wrong(path: &Path, what: String) -> Error {
    Error::input(what).help("labels are numbers: 0 soil, 1 crop, 2 weed, 255 none; --labels names others").in_file(path)
}

pub(super) fn same_size(path: &Path, (w, h): (u32, u32), (width, height): (u32, u32)) -> Result<()> {
    if (w, h) == (width, height) {
        return Ok(());
    }
    Err(Error::input(format!("it has {w} × {h} pixels, its picture {width} × {height}")).in_file(path))
}
