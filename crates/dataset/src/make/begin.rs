//! Writes a dataset's recipe, or finds it written: several programs may begin one dataset at once.

use crate::File;
use crate::format;
use crate::model::keep::Kept;
use crate::model::photo::Photo;
use crate::model::recipe::{FILE, Made, Recipe};
use crate::pack;
use crate::read::checksum_record::write_files;
use crate::read::links;
use furrow_base::{Error, Result};
use furrow_output::{create_atomically, is_unfinished};
use std::path::Path;

/// Begins a dataset of this recipe in `folder`, whose scene is `files`, or goes on with the same one: it may get longer and get more
/// formats, and its label maps must be those of the recipe only where they were `named`. Returns the recipe that is there then. Of two
/// programs that begin different ones at once, one is refused.
pub(crate) fn begin(folder: &Path, recipe: Recipe, files: &[File], named: bool) -> Result<Recipe> {
    let path = folder.join(FILE);
    if path.exists() {
        return go_on(folder, recipe, files, named);
    }
    refuse_full(folder)?;
    write_changed(folder, files)?;
    // Last: a folder with a recipe has its scene.
    if create_atomically(&path, &recipe.text()?)? { Ok(recipe) } else { go_on(folder, recipe, files, named) }
}

/// The recipe that [`begin`] would leave in `folder`. What that refuses is refused here; nothing is written.
pub(crate) fn merged_recipe(folder: &Path, recipe: Recipe, named: bool) -> Result<Recipe> {
    if folder.join(FILE).exists() {
        return joined(folder, recipe, named);
    }
    refuse_full(folder).map(|()| recipe)
}

fn go_on(folder: &Path, recipe: Recipe, files: &[File], named: bool) -> Result<Recipe> {
    let recipe = joined(folder, recipe, named)?;
    write_changed(folder, files)?;
    write_changed(folder, &[File { path: FILE.into(), bytes: recipe.text()? }])?;
    Ok(recipe)
}

/// A recipe with what the dataset that lies in the folder has beside it; an error where that is another dataset.
fn joined(folder: &Path, mut recipe: Recipe, named: bool) -> Result<Recipe> {
    let before = Recipe::read(folder)?;
    // Who asks for nothing in particular leaves labels and maps as they are.
    recipe.labelling = recipe.labelling.over(&before.labelling);
    recipe.pack = recipe.pack.or(before.pack);
    match (&mut recipe.made, &before.made) {
        (Made::Rendered(now), Made::Rendered(then)) => {
            now.parts = then.parts;
            if now.keep == Kept::usual(now.labels_only) {
                now.keep.clone_from(&then.keep);
            }
            if !named {
                now.omit.clone_from(&then.omit);
            }
            if now.photo.unwrap_or_default() == Photo::default() {
                now.photo = then.photo;
            }
        }
        // A recipe of before does not say it; to say it now would change the fingerprint that its images have.
        (Made::Imported { nir, .. }, Made::Imported { nir: None, .. }) => *nir = None,
        _ => {}
    }
    before.check_goes_on(folder, &recipe)?;
    // Formats that are there stay.
    recipe.formats.extend(before.formats);
    // In whatever order they were asked for, it is one dataset.
    recipe.formats.sort();
    recipe.formats.dedup();
    links::refuse(folder, &recipe)?;
    format::check_maps(&recipe).and_then(|()| pack::check(&recipe)).map_err(|e| e.in_file(folder))?;
    Ok(recipe)
}

/// Writes the files that are not there as they are to be: others may be reading them.
pub(crate) fn write_changed(folder: &Path, files: &[File]) -> Result<()> {
    let changed =
        |file: &&File| !furrow_base::input::contents(&folder.join(&file.path)).is_ok_and(|there| there == file.bytes);
    let changed: Vec<File> = files.iter().filter(changed).cloned().collect();
    write_files(folder, &changed)
}

/// Refuses a folder in which other things lie: nothing of the user's may be overwritten.
pub(crate) fn refuse_full(folder: &Path) -> Result<()> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Ok(()) };
    // A dataset that was stopped while it began has left its scene, and perhaps half a file.
    let mut names = entries.filter_map(|e| Some(e.ok()?.file_name()));
    let other = names.find(|name| name != "scene" && !is_unfinished(name));
    match other {
        // Another program has begun the dataset meanwhile.
        Some(_) if folder.join(FILE).exists() => Ok(()),
        Some(name) => Err(Error::misuse(format!("other things lie in this folder, {} among them", name.display()))
            .in_file(folder)
            .help("give --out a folder that is empty or not there yet")),
        None => Ok(()),
    }
}
