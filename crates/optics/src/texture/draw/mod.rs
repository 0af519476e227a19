//! Generated textures: `trace texture RECIPE.ron` writes the PNG next to the recipe.
//!
//! A recipe is a RON file like a scene file. The same recipe gives the same bytes.

mod canvas;
mod cells;
mod crust;
mod generated;
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

pub use generated::{GeneratedTexture, HeightImage};
pub use leaf_recipe::{LeafRecipe, LeafRelief, TissueVariation};
pub use lobed::{Lean, Lobed};
pub use lyrate::Lyrate;
pub use shape::{Margin, Sinus};
pub use soil_recipe::{Crumbs, Ground, Litter, SoilRecipe};
pub use veins::Veins;
pub use write::{encode, encode_height, targets, write};

use furrow_base::error::Result;
use furrow_base::ron_file::RonFile;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Texture to generate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum Recipe {
    /// Upper side of a leaf, cut out by its opacity.
    Leaf(Box<LeafRecipe>),
    /// Tileable square of ground.
    Soil(SoilRecipe),
}

/// Reads a recipe from a file.
pub fn read(path: &Path) -> Result<Recipe> {
    RonFile::read(path)?.parse_all()
}

/// Generates the texture of a recipe.
pub fn draw(recipe: &Recipe) -> Result<GeneratedTexture> {
    match recipe {
        Recipe::Leaf(leaf) => leaf::draw(leaf),
        Recipe::Soil(soil) => soil::draw(soil),
    }
}
