//! `trace init`: creates a starter folder with a commented scene file, the species and textures it names, and a README.

use furrow_base::input::shipped;
use furrow_base::ron_file::RonFile;
use furrow_base::{Error, Result};
use furrow_cli::cli;
use furrow_field::desc::{FieldDesc, SpeciesDesc};
use furrow_output::write_files;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Text of the scene file.
const SCENE: &str = include_str!("starter.ron");
/// Text of the README.
const README: &str = include_str!("starter.md");

/// Folder to create.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder to create; it must be empty if it exists.
    dir: PathBuf,
}

/// Writes the folder. Returns the paths of its files.
pub(crate) fn run(args: &Args) -> Result<Vec<PathBuf>> {
    refuse_full(&args.dir)?;
    cli::check_folder(&args.dir)?;
    let files = files(&shipped::folder()?)?;
    let files: Vec<(&str, Vec<u8>)> = files.iter().map(|(name, bytes)| (name.as_str(), bytes.clone())).collect();
    let paths = write_files(&args.dir, &files)?;
    furrow_cli::message!(
        "{}: now run trace --scene {} --spp 16",
        args.dir.display(),
        args.dir.join("field.ron").display()
    );
    Ok(paths)
}

/// Returns an error if the folder is not empty.
fn refuse_full(folder: &Path) -> Result<()> {
    let first = std::fs::read_dir(folder).ok().and_then(|mut entries| entries.next());
    if first.is_none() {
        return Ok(());
    }
    let help = "give an empty folder, or one that does not exist yet; nothing was written";
    Err(Error::misuse("this folder is not empty").in_file(folder).help(help))
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
