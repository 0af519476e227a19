//! What a dataset in packs cannot have.

use crate::dataset::format;
use crate::dataset::recipe::Recipe;
use crate::{Error, Result};

/// An error where a dataset cannot have the packs that its recipe asks for.
pub fn check(recipe: &Recipe) -> Result<()> {
    let Some(images) = recipe.pack else { return Ok(()) };
    let captures = recipe.captures();
    if !images.is_multiple_of(captures) || images == 0 {
        let near = (images / captures).max(1) * captures;
        return Err(Error::misuse(format!("--pack {images} would cut fields of {captures} images each"))
            .help(format!("give a multiple of {captures}, such as --pack {near}")));
    }
    match format::all(recipe)?.into_iter().find(|(_, format)| format.names_photographs()) {
        None => Ok(()),
        Some((name, _)) => {
            Err(Error::misuse(format!("--format {name} names the files in images/, which --pack puts into archives"))
                .help(format!("leave --pack or --format {name} out")))
        }
    }
}
