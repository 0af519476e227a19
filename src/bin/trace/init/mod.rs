//! `trace init`: creates a starter folder with a commented scene file, the species and textures it names, and a README.

use furrow_base::input::shipped;
use furrow_base::ron_file::RonFile;
use furrow_base::{Error, Result};
use furrow_cli::cli;
use furrow_field::desc::{FieldDesc, SpeciesDesc};
use furrow_output::{is_unfinished, remove_unfinished, write_files};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Text of the scene file.
const SCENE: &str = include_str!("starter.ron");
/// Text of the README.
const README: &str = include_str!("starter.md");

/// Folder to create.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder to create; it must be empty if it exists, or hold a part of the files that an interrupted run left.
    dir: PathBuf,
}

/// Writes the folder. Returns the paths of its files.
pub(crate) fn run(args: &Args) -> Result<Vec<PathBuf>> {
    let files = files(&shipped::folder()?)?;
    refuse_full(&args.dir, &files)?;
    cli::check_folder(&args.dir)?;
    if args.dir.is_dir() {
        remove_unfinished(&args.dir)?;
    }
    let files: Vec<(&str, Vec<u8>)> = files.iter().map(|(name, bytes)| (name.as_str(), bytes.clone())).collect();
    let paths = write_files(&args.dir, &files)?;
    furrow_cli::message!(
        "{}: now run trace --scene {} --spp 16",
        args.dir.display(),
        args.dir.join("field.ron").display()
    );
    Ok(paths)
}

/// Returns an error if the folder is not empty, unless it holds only a part of `files`: a run that was killed, or whose
/// disk was full, is completed.
fn refuse_full(folder: &Path, files: &BTreeMap<String, Vec<u8>>) -> Result<()> {
    let mut found = 0;
    if is_part(folder, "", files, &mut found) && found < files.len() {
        return Ok(());
    }
    let help = "give an empty folder, or one that does not exist yet; nothing was written";
    Err(Error::misuse("this folder is not empty").in_file(folder).help(help))
}

/// Returns `true` if the folder `below` in `folder` holds nothing but unchanged `files`, whose number is added to `found`,
/// and unfinished ones. A folder that cannot be read counts as empty; writing to it gives the error.
fn is_part(folder: &Path, below: &str, files: &BTreeMap<String, Vec<u8>>, found: &mut usize) -> bool {
    let Ok(entries) = std::fs::read_dir(folder.join(below)) else { return true };
    entries.filter_map(std::result::Result::ok).all(|entry| {
        let name = format!("{below}{}", entry.file_name().to_string_lossy());
        if is_unfinished(&entry.file_name()) {
            return true;
        }
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            let within = format!("{name}/");
            return files.keys().any(|file| file.starts_with(&within)) && is_part(folder, &within, files, found);
        }
        *found += 1;
        let same = |bytes: &Vec<u8>| furrow_base::input::contents(&entry.path()).is_ok_and(|there| there == *bytes);
        files.get(&name).is_some_and(same)
    })
}

/// Files of the folder: the scene file, and the files it names, taken from the shipped data in `from`.
fn files(from: &Path) -> Result<BTreeMap<String, Vec<u8>>> {
    let mut files = BTreeMap::from([("field.ron".to_owned(), SCENE.into()), ("README.md".to_owned(), README.into())]);
    let scene: FieldDesc = RonFile::of(SCENE).parse()?;
    let mut pictures: Vec<String> = Vec::new();
    for layer in scene.soil.iter().flat_map(|soil| &soil.layers) {
        pictures.extend([&layer.albedo, &layer.height].map(|path| path.to_string_lossy().into_owned()));
    }
    let crops = scene.crops.iter().map(|crop| &crop.species);
    for name in crops.chain(scene.weeds.iter().map(|weed| &weed.species)) {
        let page = RonFile::read(&from.join("scenes").join(name))?;
        let species: SpeciesDesc = page.parse()?;
        for texture in species.textures().filter_map(nearer) {
            // A leaf image may have a height map next to it.
            let relief = Path::new(&texture).with_extension("height.png").to_string_lossy().into_owned();
            pictures.extend(from.join(&relief).is_file().then_some(relief));
            pictures.push(texture);
        }
        let text = page.replace_quoted(|path| nearer(path).map(|path| format!("../{path}"))).unwrap_or(page.text);
        files.insert(name.clone(), text.into_bytes());
    }
    for picture in pictures {
        let path = from.join(&picture);
        let bytes = std::fs::read(&path).map_err(Error::reading(&path))?;
        files.insert(picture, bytes);
    }
    Ok(files)
}

/// Path of an image named by a species file, relative to the starter folder, where `textures/` is next to `species/`.
fn nearer(path: &str) -> Option<String> {
    path.strip_prefix("../../textures/").map(|rest| format!("textures/{rest}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: a full disk or a kill leaves a part of the folder, and the same command must complete it. Expected: a
    /// part is accepted, also with empty folders and unfinished files; the whole, a changed file and any other file or
    /// folder are refused.
    #[test]
    fn a_part_of_the_folder_is_completed() {
        let files = BTreeMap::from(["a".to_owned(), "b/c".into(), "b/d".into()].map(|name| (name, b"x".to_vec())));
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let is_accepted = || refuse_full(folder.path(), &files).is_ok();
        assert!(is_accepted() && refuse_full(&at("new"), &files).is_ok());
        std::fs::create_dir(at("b")).unwrap();
        assert!(is_accepted());
        std::fs::write(at("b/.furrow-x1"), "").unwrap();
        std::fs::write(at("b/c"), "x").unwrap();
        std::fs::write(at("a"), "x").unwrap();
        assert!(is_accepted());
        std::fs::write(at("b/d"), "x").unwrap();
        assert!(!is_accepted(), "it is complete");
        std::fs::write(at("b/d"), "y").unwrap();
        assert!(!is_accepted(), "the user has changed a file");
        std::fs::remove_file(at("b/d")).unwrap();
        for stranger in ["e", "b/e"] {
            std::fs::write(at(stranger), "x").unwrap();
            assert!(!is_accepted(), "{stranger}");
            std::fs::remove_file(at(stranger)).unwrap();
            std::fs::create_dir(at(stranger)).unwrap();
            assert!(!is_accepted(), "{stranger}");
            std::fs::remove_dir(at(stranger)).unwrap();
        }
        assert!(is_accepted());
    }
}
