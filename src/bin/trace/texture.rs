//! `trace texture`: draws textures from their recipes.

use furrow::ron_file::{RENAMED, RonFile};
use furrow::{Result, texture};
use std::path::PathBuf;

/// What to draw.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Texture recipes, for example textures/leaf/sugar_beet.ron.
    #[arg(required = true)]
    recipes: Vec<PathBuf>,
}

/// Draws; returns the images' paths.
pub(crate) fn run(args: &Args) -> Result<Vec<PathBuf>> {
    let mut paths = Vec::new();
    for recipe in &args.recipes {
        for warning in RonFile::read(recipe)?.renamed(RENAMED) {
            furrow::tell!("warning: {warning}");
        }
        paths.extend(texture::draw::write(recipe)?);
    }
    Ok(paths)
}
