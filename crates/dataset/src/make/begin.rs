//! Writes the recipe of a new dataset or merges it with an existing one. Several processes may create one dataset at
//! the same time.

use crate::File;
use crate::format;
use crate::make::pack;
use crate::model::image_format::ImageFormat;
use crate::model::optional_maps::OptionalMap;
use crate::model::recipe::{FILE, ImageOrigin, Recipe};
use crate::read::checksum_record::write_files;
use crate::read::links;
use furrow_base::{Error, Result};
use furrow_output::{create_atomically, is_unfinished};
use std::path::Path;

/// Creates a dataset with this recipe and the scene `files` in `folder`, or continues the existing one, which may get
/// more images and more formats. Its omitted label maps must equal those of `recipe` only if the user `named` them.
/// Returns the recipe that is in the folder afterwards. If two processes create different datasets in one folder at the
/// same time, one gets an error.
pub(crate) fn begin(folder: &Path, recipe: Recipe, files: &[File], named: bool) -> Result<Recipe> {
    let path = folder.join(FILE);
    if path.exists() {
        return go_on(folder, recipe, files, named);
    }
    refuse_full(folder)?;
    std::fs::create_dir_all(folder).map_err(Error::io(folder))?;
    write_changed(folder, files)?;
    // The recipe is written last, so that a folder with a recipe always has its scene.
    if create_atomically(&path, &recipe.text()?)? { Ok(recipe) } else { go_on(folder, recipe, files, named) }
}

/// Returns the recipe that [`begin`] would write to `folder`, or its error. Writes nothing.
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

/// Merges a recipe with that of the dataset in the folder. Returns an error if that is a different dataset.
fn joined(folder: &Path, mut recipe: Recipe, named: bool) -> Result<Recipe> {
    let before = Recipe::read(folder)?;
    // Default settings keep the labels and maps that the dataset has.
    recipe.labelling = recipe.labelling.over(&before.labelling);
    recipe.pack = recipe.pack.or(before.pack);
    match (&mut recipe.made, &before.made) {
        (ImageOrigin::Rendered(now), ImageOrigin::Rendered(then)) => {
            now.parts = then.parts;
            if now.keep == OptionalMap::usual(now.labels_only) {
                now.keep.clone_from(&then.keep);
            }
            if !named {
                now.omit.clone_from(&then.omit);
            }
            if now.image_format.unwrap_or_default() == ImageFormat::default() {
                now.image_format = then.image_format;
            }
        }
        // Recipes of older versions lack this value; adding it would change the fingerprint that their images have.
        (ImageOrigin::Imported { nir, .. }, ImageOrigin::Imported { nir: None, .. }) => *nir = None,
        _ => {}
    }
    before.check_goes_on(folder, &recipe)?;
    // Formats that the dataset has are kept.
    recipe.formats.extend(before.formats);
    // The dataset does not depend on the order of `--format`.
    recipe.formats.sort();
    recipe.formats.dedup();
    links::refuse(folder, &recipe)?;
    format::check_maps(&recipe).and_then(|()| pack::check(&recipe)).map_err(|e| e.in_file(folder))?;
    Ok(recipe)
}

/// Writes only the files whose contents on disk differ, since other processes may be reading them.
pub(crate) fn write_changed(folder: &Path, files: &[File]) -> Result<()> {
    let changed =
        |file: &&File| !furrow_base::input::contents(&folder.join(&file.path)).is_ok_and(|there| there == file.bytes);
    let changed: Vec<File> = files.iter().filter(changed).cloned().collect();
    write_files(folder, &changed)
}

/// Returns an error if the folder contains files that are not of a dataset, so that none of the user's files is
/// overwritten.
pub(crate) fn refuse_full(folder: &Path) -> Result<()> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Ok(()) };
    // An interrupted start leaves the `scene` folder, and perhaps an unfinished temporary file.
    let mut names = entries.filter_map(|e| Some(e.ok()?.file_name()));
    let other = names.find(|name| name != "scene" && !is_unfinished(name));
    match other {
        // Another process has created the dataset in the meantime.
        Some(_) if folder.join(FILE).exists() => Ok(()),
        Some(name) => Err(Error::misuse(format!("this folder contains other files, such as {}", name.display()))
            .in_file(folder)
            .help("give --out a folder that is empty or does not exist")),
        None => Ok(()),
    }
}
