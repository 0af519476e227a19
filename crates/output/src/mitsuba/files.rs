//! Shared parts of a Mitsuba scene export: length unit, bands, folder.

use super::xml::Element;
use crate::{FileSet, exr};
use furrow_base::math::{Spectrum, Vec3};
use furrow_base::{Error, Result};
use rayon::prelude::*;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Mitsuba length units per metre.
pub(super) const SCALE: f32 = 100.0;

/// Bands rendered by a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Band {
    /// R, G, B.
    Color,
    /// Near infrared, as grey.
    Nir,
}

impl Band {
    /// Returns a spectrum as an XML element.
    pub(super) fn rgb(self, name: &str, s: Spectrum) -> Element {
        let [r, g, b, nir] = s.to_array();
        let value = match self {
            Self::Color => format!("{r} {g} {b}"),
            Self::Nir => format!("{nir} {nir} {nir}"),
        };
        Element::property("rgb", name, value)
    }

    /// Returns the path of the image with these bands.
    pub(super) fn path(self, stem: &str) -> String {
        match self {
            Self::Color => format!("{stem}.exr"),
            Self::Nir => format!("{stem}-nir.exr"),
        }
    }
}

/// Scattering plugins used by a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Plugins {
    /// Plugins that ship with Mitsuba.
    BuiltIn,
    /// Furrow's plugins.
    Own,
}

/// Number of values of images that are collected before they are encoded on all threads.
const COLLECTED: usize = 1 << 22;

/// Files of the export: written to temporary names first, and renamed when all are complete. Images with equal content
/// become one file.
pub(super) struct Files<'a> {
    folder: &'a Path,
    together: FileSet,
    /// Path or stem of each image.
    known: HashMap<Content, String>,
    /// Images to be encoded.
    collected: Vec<Collected>,
    /// Number of their values.
    values: usize,
}

/// Content of an image; equal images are written once.
#[derive(PartialEq, Eq, Hash)]
struct Content {
    width: u32,
    height: u32,
    /// Names of the channels.
    channels: &'static [&'static str],
    /// Bits of the values, channel by channel.
    bits: Vec<u32>,
}

/// Image to be encoded.
struct Collected {
    path: String,
    width: u32,
    height: u32,
    channels: Vec<(&'static str, Vec<f32>)>,
}

impl<'a> Files<'a> {
    pub(super) fn new(folder: &'a Path) -> Self {
        Self { folder, together: FileSet::default(), known: HashMap::new(), collected: Vec::new(), values: 0 }
    }

    pub(super) fn write(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        self.together.add_unflushed(&self.folder.join(name), bytes)
    }

    /// Writes an image of raw numbers and returns its path, which is that of an equal image if there is one. `values`
    /// holds the channels one after the other.
    pub(super) fn numbers(
        &mut self,
        path: &str,
        (width, height): (u32, u32),
        names: &'static [&'static str],
        values: &[f32],
    ) -> Result<String> {
        let content = Content { width, height, channels: names, bits: values.iter().map(|v| v.to_bits()).collect() };
        if let Some(known) = self.known.get(&content) {
            return Ok(known.clone());
        }
        self.known.insert(content, path.to_owned());
        self.collect(path.to_owned(), (width, height), names, values)?;
        Ok(path.to_owned())
    }

    /// Writes `STEM.exr` with R, G, B and `STEM-nir.exr`. Returns the stem, which is that of equal images if there are
    /// any.
    pub(super) fn spectra(&mut self, stem: &str, (width, height): (u32, u32), pixels: &[Spectrum]) -> Result<String> {
        let bands: Vec<f32> = (0..4).flat_map(|i| pixels.iter().map(move |p| p.to_array()[i])).collect();
        let bits = bands.iter().map(|v| v.to_bits()).collect();
        let content = Content { width, height, channels: &["R", "G", "B", "NIR"], bits };
        if let Some(known) = self.known.get(&content) {
            return Ok(known.clone());
        }
        self.known.insert(content, stem.to_owned());
        let (color, nir) = bands.split_at(3 * pixels.len());
        self.collect(Band::Color.path(stem), (width, height), &["R", "G", "B"], color)?;
        self.collect(Band::Nir.path(stem), (width, height), &["Y"], nir)?;
        Ok(stem.to_owned())
    }

    fn collect(
        &mut self,
        path: String,
        (width, height): (u32, u32),
        names: &[&'static str],
        values: &[f32],
    ) -> Result<()> {
        let planes = values.chunks(values.len() / names.len()).map(<[f32]>::to_vec);
        self.collected.push(Collected { path, width, height, channels: names.iter().copied().zip(planes).collect() });
        self.values += values.len();
        if self.values < COLLECTED { Ok(()) } else { self.flush() }
    }

    /// Encodes and writes the collected images.
    fn flush(&mut self) -> Result<()> {
        self.values = 0;
        let collected = std::mem::take(&mut self.collected);
        let encode = |image: &Collected| exr::encode_map(image.width, image.height, &image.channels);
        let encoded: Vec<Vec<u8>> = collected.par_iter().map(encode).collect::<Result<_>>()?;
        collected.iter().zip(encoded).try_for_each(|(image, bytes)| self.write(&image.path, &bytes))
    }

    /// Renames all files and returns their paths.
    pub(super) fn finish(mut self, last: &[(&str, String)]) -> Result<Vec<PathBuf>> {
        self.flush()?;
        for (name, document) in last {
            self.write(name, document.as_bytes())?;
        }
        let lost = "its temporary files were removed while it was written";
        self.together.finish()?.ok_or_else(|| Error::failed(lost).in_file(self.folder))
    }
}

/// Returns `<transform name="to_world">` from its columns.
pub(super) fn matrix([x, y, z]: [Vec3; 3], origin: Vec3) -> Element {
    let row = |i: usize| format!("{} {} {} {}", x[i], y[i], z[i], origin[i]);
    let value = format!("{}  {}  {}  0 0 0 1", row(0), row(1), row(2));
    Element::new("transform").with("name", "to_world").inside([Element::new("matrix").with("value", value)])
}
