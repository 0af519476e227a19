//! Checks of packs: combinations that a dataset in packs cannot have, and readers that need image folders.

use crate::format;
use crate::model::recipe::{FILE, Recipe};
use furrow_base::{Error, Result};
use std::path::Path;

/// Returns an error if a dataset cannot have the packs that its recipe asks for.
pub fn check(recipe: &Recipe) -> Result<()> {
    let Some(images) = recipe.pack else { return Ok(()) };
    let captures = recipe.captures();
    if !images.is_multiple_of(captures) || images == 0 {
        let near = (images / captures).max(1) * captures;
        return Err(Error::misuse(format!("--pack {images} would cut fields of {captures} images"))
            .help(format!("give a multiple of {captures}, such as --pack {near}")));
    }
    match format::all(recipe)?.into_iter().find(|(_, format)| format.names_photographs()) {
        None => Ok(()),
        Some((name, _)) => {
            Err(Error::misuse(format!("--format {name} names the files in images/, which --pack puts into archives"))
                .help(format!("omit --pack or --format {name}")))
        }
    }
}

/// Returns an error if `path` is a dataset in packs, its folder of archives or one of these, for readers that need
/// image folders. The folder `images` of such a dataset is refused as well, since it contains only user files.
pub fn refuse_archives(path: &Path) -> Result<()> {
    let is_archive = path.extension().is_some_and(|ending| ending == "tar");
    let within = if is_archive { path.parent() } else { Some(path) };
    let above = within.filter(|within| within.ends_with("packs") || within.ends_with("images")).and_then(Path::parent);
    let is_packed =
        |dir: &&Path| dir.join(FILE).is_file() && Recipe::read(dir).is_ok_and(|recipe| recipe.pack.is_some());
    match above.into_iter().chain([path]).find(is_packed) {
        None => Ok(()),
        Some(dir) => Err(Error::misuse("the images of this dataset are in archives, and this command reads folders")
            .in_file(dir)
            .help(format!(
                "unpack them with GNU tar and give `unpacked`: mkdir -p unpacked/images && for pack in \"{}\"/packs/*.tar; do tar -xf \"$pack\" \
                 -C unpacked/images --transform 's|[.]|/|'; done",
                dir.display()
            ))),
    }
}
