//! `trace texture`: draws textures from their recipes.

use furrow::ron_file::{RENAMED, RonFile};
use furrow::texture::draw;
use furrow::{Error, Result, input};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// What to draw.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Texture recipes, for example textures/leaf/sugar_beet.ron.
    #[arg(required = true)]
    recipes: Vec<PathBuf>,
}

/// Draws; returns the images' paths.
pub(crate) fn run(args: &Args) -> Result<Vec<PathBuf>> {
    check_targets(&args.recipes)?;
    let mut paths = Vec::new();
    for recipe in &args.recipes {
        for warning in RonFile::read(recipe)?.renamed(RENAMED) {
            furrow::tell!("warning: {warning}");
        }
        paths.extend(draw::write(recipe)?);
    }
    Ok(paths)
}

/// Checks, before anything is written, that the drawing of each recipe can be, and that no two go to one file.
fn check_targets(recipes: &[PathBuf]) -> Result<()> {
    let mut taken: HashMap<PathBuf, &Path> = HashMap::new();
    for recipe in recipes {
        for target in draw::targets(recipe)? {
            let plain = input::tidy(&std::path::absolute(&target).map_err(Error::reading(&target))?);
            if let Some(other) = taken.insert(plain, recipe) {
                let (first, second) = (other.display(), recipe.display());
                let error = Error::misuse(format!("what {first} draws and what {second} draws would both go here"));
                return Err(error.help("give the recipes other names, or name one of them").in_file(target));
            }
        }
    }
    Ok(())
}
