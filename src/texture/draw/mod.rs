//! Textures drawn by the program from a recipe: `trace texture RECIPE.ron` writes the PNG beside it.
//!
//! A recipe is a RON file like a scene file. The same recipe gives the same bytes.

mod canvas;
mod cells;
mod crust;
mod drawn;
mod leaf;
mod leaf_recipe;
mod lobed;
mod lyrate;
mod shape;
mod soil;
mod soil_recipe;
mod stamp;
mod teeth;
mod tile;
mod tissue;
mod veins;
mod write;

pub use drawn::{Drawn, Grey};
pub use leaf_recipe::{LeafRecipe, LeafRelief, Look};
pub use lobed::{Lean, Lobed};
pub use lyrate::Lyrate;
pub use shape::{Margin, Sinus};
pub use soil_recipe::{Crumbs, Ground, Litter, SoilRecipe};
pub use veins::Veins;
pub use write::{encode, encode_height, targets, write};

use crate::error::Result;
use crate::ron_file::RonFile;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What a recipe describes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum Recipe {
    /// A leaf's upper side, cut out by its opacity.
    Leaf(Box<LeafRecipe>),
    /// A square of ground that tiles.
    Soil(SoilRecipe),
}

/// Reads a recipe.
pub fn read(path: &Path) -> Result<Recipe> {
    RonFile::read(path)?.parse_all()
}

/// Draws a recipe.
pub fn draw(recipe: &Recipe) -> Result<Drawn> {
    match recipe {
        Recipe::Leaf(leaf) => leaf::draw(leaf),
        Recipe::Soil(soil) => soil::draw(soil),
    }
}
