//! Files shipped with the program: scene files, species files, textures and trained networks, found from any working
//! directory.
//!
//! They are in `scenes/`, `textures/` and `networks/` of one folder, as in the repository. That folder is the first of:
//!
//! 1. the folder named by the environment variable `FURROW_DATA`;
//! 2. `../share/furrow` relative to the program's own folder: `/usr/local/bin/trace` and `/usr/local/share/furrow`;
//! 3. `../furrow/data`, the location in the Python package;
//! 4. the source tree that the program was built from, for `cargo run` and `cargo install --path .`.
//!
//! Without `FURROW_DATA`, trained networks are first looked for in `networks/` beside the program, as in the Python
//! package `furrow-train`, whose scene files and textures are those of the package `furrow`.

use crate::{Error, Result};
use std::path::{Path, PathBuf};

/// Name of the environment variable that sets the data folder.
pub const VARIABLE: &str = "FURROW_DATA";

/// Returns the data folder, which contains `scenes/` and `textures/`.
pub fn folder() -> Result<PathBuf> {
    if let Some(named) = named() {
        if is_data(&named) {
            return Ok(named);
        }
        return Err(Error::input(format!("{VARIABLE} names a folder without scenes/species and textures"))
            .in_file(named)
            .help("set it to the folder that contains them, or unset it"));
    }
    let program = std::env::current_exe().ok();
    let above = program.as_deref().and_then(Path::parent).and_then(Path::parent);
    let beside = above.into_iter().flat_map(|above| [above.join("share/furrow"), above.join("furrow/data")]);
    let mut places = beside.chain(Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).map(PathBuf::from));
    places.find(|place| is_data(place)).ok_or_else(|| {
        Error::missing("the scene files, species and textures that ship with the program were not found").help(format!(
            "copy scenes/ and textures/ of the repository to share/furrow beside the program's bin/, or set {VARIABLE} to their folder"
        ))
    })
}

/// Folder that the environment variable names.
fn named() -> Option<PathBuf> {
    std::env::var_os(VARIABLE).filter(|name| !name.is_empty()).map(PathBuf::from)
}

fn is_data(folder: &Path) -> bool {
    folder.join("scenes/species").is_dir() && folder.join("textures").is_dir()
}

/// Returns `true` if the path can name a shipped file: a single name without a folder.
pub fn is_bare(path: &str) -> bool {
    !path.is_empty() && !path.contains(['/', '\\']) && path != "." && path != ".."
}

/// Resolves the scene file that a user names: the file itself if it exists, with or without `.ron`; otherwise the
/// shipped scene if the name is a bare one such as `field`; otherwise the path as written.
pub fn scene_file(written: PathBuf) -> PathBuf {
    let Some(name) = written.to_str().filter(|name| is_bare(name) && !written.exists()) else { return written };
    let file = if is_ron(&written) { name.to_owned() } else { format!("{name}.ron") };
    if Path::new(&file).is_file() {
        return file.into();
    }
    let shipped = folder().map(|folder| folder.join("scenes").join(file));
    shipped.ok().filter(|path| path.is_file()).unwrap_or(written)
}

/// Names of the shipped scene files without `.ron`, sorted.
pub fn scene_names() -> Result<Vec<String>> {
    let files = ron_files(&folder()?.join("scenes"))?;
    Ok(files.iter().filter_map(|file| Some(file.file_stem()?.to_str()?.to_owned())).collect())
}

/// Paths of the shipped species files, sorted by name.
pub fn species_files() -> Result<Vec<PathBuf>> {
    ron_files(&folder()?.join("scenes/species"))
}

/// Path of a shipped soil texture by file name, such as `dirt.png` or `dirt.height.png`; `None` if it does not exist.
pub fn soil_texture(name: &str) -> Result<Option<PathBuf>> {
    Ok(Some(folder()?.join("textures/soil").join(name)).filter(|path| path.is_file()))
}

/// Colour images of the shipped soils, sorted by name.
pub fn soil_textures() -> Result<Vec<PathBuf>> {
    let mut files = files(&folder()?.join("textures/soil"))?;
    files.retain(|file| {
        file.extension().is_some_and(|e| e == "png") && !file.to_string_lossy().ends_with(".height.png")
    });
    Ok(files)
}

/// Folder of the shipped trained networks.
pub fn networks() -> Result<PathBuf> {
    let program = std::env::current_exe().ok().filter(|_| named().is_none());
    let beside = program.as_deref().and_then(Path::parent).map(|folder| folder.join("networks"));
    beside.filter(|networks| networks.is_dir()).map_or_else(|| Ok(folder()?.join("networks")), Ok)
}

fn ron_files(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut files = files(folder)?;
    files.retain(|file| is_ron(file));
    Ok(files)
}

fn is_ron(path: &Path) -> bool {
    path.extension().is_some_and(|e| e == "ron")
}

/// Files in a folder, sorted by name.
fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder).map_err(Error::reading(folder))?;
    let mut files: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.retain(|file| file.is_file());
    files.sort();
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_ships_is_found_by_its_name_and_what_is_there_comes_first() {
        let folder = folder().unwrap();
        assert_eq!(scene_file("field".into()), folder.join("scenes/field.ron"));
        assert_eq!(scene_file("field.ron".into()), folder.join("scenes/field.ron"));
        // Paths, unknown names, and names of folders (unit tests run in the repository) are returned unchanged.
        for other in ["scenes/field.ron", "./field", "no-such-field", "src", "", "."] {
            assert_eq!(scene_file(other.into()), Path::new(other));
        }
        assert!(soil_texture("dirt.png").unwrap().is_some() && soil_texture("dirt").unwrap().is_none());
        assert!(soil_textures().unwrap().iter().all(|file| !file.ends_with("dirt.height.png")));
        assert!(scene_names().unwrap().contains(&"02-one-plant".to_owned()));
    }
}
