//! Shared parts of a Mitsuba scene export: length unit, bands, folder.

use super::xml::Element;
use crate::{FileSet, exr};
use furrow_base::Result;
use furrow_base::math::{Spectrum, Vec3};
use std::path::Path;

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

/// Files of the export: written to temporary names first, and renamed when all are complete.
pub(super) struct Files<'a> {
    pub(super) folder: &'a Path,
    pub(super) together: FileSet,
}

impl Files<'_> {
    pub(super) fn write(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        self.together.add(&self.folder.join(name), bytes)
    }

    /// Writes raw numbers, one vector per channel.
    pub(super) fn numbers(&mut self, name: &str, width: u32, height: u32, channels: &[(&str, Vec<f32>)]) -> Result<()> {
        self.write(name, &exr::encode_map(width, height, channels)?)
    }

    /// Writes `STEM.exr` with R, G, B and `STEM-nir.exr`.
    pub(super) fn spectra(&mut self, stem: &str, width: u32, height: u32, pixels: &[Spectrum]) -> Result<()> {
        let band = |i: usize| pixels.iter().map(|p| p.to_array()[i]).collect::<Vec<f32>>();
        self.numbers(&Band::Color.path(stem), width, height, &[("R", band(0)), ("G", band(1)), ("B", band(2))])?;
        self.numbers(&Band::Nir.path(stem), width, height, &[("Y", band(3))])
    }
}

/// Returns `<transform name="to_world">` from its columns.
pub(super) fn matrix([x, y, z]: [Vec3; 3], origin: Vec3) -> Element {
    let row = |i: usize| format!("{} {} {} {}", x[i], y[i], z[i], origin[i]);
    let value = format!("{}  {}  {}  0 0 0 1", row(0), row(1), row(2));
    Element::new("transform").with("name", "to_world").inside([Element::new("matrix").with("value", value)])
}
