//! `trace texture`: generates textures from their recipes.

use furrow_base::input;
use furrow_base::{Error, Result};
use furrow_optics::texture::draw;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Recipes to generate.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Texture recipes, for example textures/leaf/sugar_beet.ron.
    #[arg(required = true)]
    recipes: Vec<PathBuf>,
}

/// Generates the textures. Returns the paths of the images.
pub(crate) fn run(args: &Args) -> Result<Vec<PathBuf>> {
    check_targets(&args.recipes)?;
    let mut paths = Vec::new();
    for recipe in &args.recipes {
        paths.extend(draw::write(recipe)?);
    }
    Ok(paths)
}

/// Checks, before anything is written, that the textures of all recipes can be written and that no two have the same
/// file.
fn check_targets(recipes: &[PathBuf]) -> Result<()> {
    let mut taken: HashMap<PathBuf, &Path> = HashMap::new();
    for recipe in recipes {
        for target in draw::targets(recipe)? {
            let plain = input::tidy(&std::path::absolute(&target).map_err(Error::reading(&target))?);
            if let Some(other) = taken.insert(plain, recipe) {
                let (first, second) = (other.display(), recipe.display());
                let error = Error::misuse(format!("{first} and {second} would both be written here"));
                return Err(error.help("give the recipes other names, or name one of them").in_file(target));
            }
        }
    }
    Ok(())
}
