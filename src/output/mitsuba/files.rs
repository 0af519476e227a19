//! What all parts of a scene of Mitsuba are written with: its unit, its bands, its folder.

use super::xml::Element;
use crate::Result;
use crate::math::{Spectrum, Vec3};
use crate::output::{Together, exr};
use std::path::Path;

/// Units of length to a metre.
pub(super) const SCALE: f32 = 100.0;

/// Which bands a scene shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Band {
    /// R, G, B.
    Color,
    /// Near infrared, as grey.
    Nir,
}

impl Band {
    /// A spectrum as an element.
    pub(super) fn rgb(self, name: &str, s: Spectrum) -> Element {
        let [r, g, b, nir] = s.to_array();
        let value = match self {
            Self::Color => format!("{r} {g} {b}"),
            Self::Nir => format!("{nir} {nir} {nir}"),
        };
        Element::property("rgb", name, value)
    }

    /// The picture of these bands.
    pub(super) fn path(self, stem: &str) -> String {
        match self {
            Self::Color => format!("{stem}.exr"),
            Self::Nir => format!("{stem}-nir.exr"),
        }
    }
}

/// Whose scattering plugins a scene names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Plugins {
    /// Mitsuba's.
    BuiltIn,
    /// Ours.
    Own,
}

/// The files of the folder: written as they come, and there when all are.
pub(super) struct Files<'a> {
    pub(super) folder: &'a Path,
    pub(super) together: Together,
}

impl Files<'_> {
    pub(super) fn write(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        self.together.add(&self.folder.join(name), bytes)
    }

    /// Plain numbers, one vector a channel.
    pub(super) fn numbers(&mut self, name: &str, width: u32, height: u32, channels: &[(&str, Vec<f32>)]) -> Result<()> {
        self.write(name, &exr::encode_map(width, height, channels)?)
    }

    /// `STEM.exr` with R, G, B and `STEM-nir.exr`.
    pub(super) fn spectra(&mut self, stem: &str, width: u32, height: u32, pixels: &[Spectrum]) -> Result<()> {
        let band = |i: usize| pixels.iter().map(|p| p.to_array()[i]).collect::<Vec<f32>>();
        self.numbers(&Band::Color.path(stem), width, height, &[("R", band(0)), ("G", band(1)), ("B", band(2))])?;
        self.numbers(&Band::Nir.path(stem), width, height, &[("Y", band(3))])
    }
}

/// `<transform name="to_world">` from its columns.
pub(super) fn matrix([x, y, z]: [Vec3; 3], origin: Vec3) -> Element {
    let row = |i: usize| format!("{} {} {} {}", x[i], y[i], z[i], origin[i]);
    let value = format!("{}  {}  {}  0 0 0 1", row(0), row(1), row(2));
    Element::new("transform").with("name", "to_world").inside([Element::new("matrix").with("value", value)])
}
