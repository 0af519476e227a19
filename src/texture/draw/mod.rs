//! Textures drawn by the program from a recipe: `trace texture RECIPE.ron` writes the PNG beside it.
//!
//! A recipe is a page like any other. The same recipe gives the same bytes.

mod canvas;
mod cells;
mod crust;
mod leaf;
mod shape;
mod soil;
mod stamp;
mod tile;
mod tissue;
mod veins;
mod write;

pub use leaf::{LeafRecipe, Look, Relief};
pub use shape::{Margin, Sinus};
pub use soil::{Crumbs, Ground, Litter, SoilRecipe};
pub use veins::Veins;
pub use write::{encode, encode_height, write};

use crate::error::Result;
use crate::ron_file::RonFile;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What a recipe describes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Recipe {
    /// A leaf's upper side, cut out by its opacity.
    Leaf(Box<LeafRecipe>),
    /// A square of ground that tiles.
    Soil(SoilRecipe),
}

/// A drawn texture.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawn {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// R, G, B (sRGB), A of each pixel, row by row, top first.
    pub rgba: Vec<u8>,
    /// True where opacity says nothing and is not written.
    pub opaque: bool,
    /// Heights, where the recipe has any.
    pub relief: Option<Grey>,
}

/// Heights as 16-bit grey.
#[derive(Clone, Debug, PartialEq)]
pub struct Grey {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// One value a pixel, row by row, top first.
    pub values: Vec<u16>,
    /// Height in mm that 65535 stands for; 0 stands for 0.
    pub range_mm: f32,
}

impl Grey {
    /// From heights in mm, held to 0..=`range_mm`. Twelve bits are kept: finer steps are noise that does not compress.
    fn from_mm(width: u32, height: u32, heights: &[f32], range_mm: f32) -> Self {
        let code = |h: &f32| (((h / range_mm).clamp(0.0, 1.0) * 4095.0 + 0.5) as u16) * 16;
        Self { width, height, values: heights.iter().map(code).collect(), range_mm: range_mm * 65535.0 / 65520.0 }
    }
}

/// Reads a recipe.
pub fn read(path: &Path) -> Result<Recipe> {
    RonFile::read(path)?.parse()
}

/// Draws a recipe.
pub fn draw(recipe: &Recipe) -> Result<Drawn> {
    match recipe {
        Recipe::Leaf(leaf) => leaf::draw(leaf),
        Recipe::Soil(soil) => soil::draw(soil),
    }
}
