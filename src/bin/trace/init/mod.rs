//! `trace init`: a folder to begin with: a scene file with comments, the species and textures that it names, a page to read.

use furrow::input::shipped;
use furrow::output::write_files;
use furrow::ron_file::RonFile;
use furrow::scene::desc::{FieldDesc, SpeciesDesc};
use furrow::{Error, Result, cli};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The scene file.
const SCENE: &str = include_str!("starter.ron");
/// What there is to know of the folder.
const README: &str = include_str!("starter.md");

/// Where to begin.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder that is made; it must be empty where it is there.
    dir: PathBuf,
}

/// Writes the folder; returns the paths of its files.
pub(crate) fn run(args: &Args) -> Result<Vec<PathBuf>> {
    refuse_full(&args.dir)?;
    cli::check_folder(&args.dir)?;
    let files = files(&shipped::folder()?)?;
    let files: Vec<(&str, Vec<u8>)> = files.iter().map(|(name, bytes)| (name.as_str(), bytes.clone())).collect();
    let paths = write_files(&args.dir, &files)?;
    furrow::tell!("{}: now run trace --scene {} --spp 16", args.dir.display(), args.dir.join("field.ron").display());
    Ok(paths)
}

/// Refuses a folder in which something lies.
fn refuse_full(folder: &Path) -> Result<()> {
    let first = std::fs::read_dir(folder).ok().and_then(|mut entries| entries.next());
    if first.is_none() {
        return Ok(());
    }
    let help = "name one that is empty or not there yet; nothing was written";
    Err(Error::misuse("this folder is not empty").in_file(folder).help(help))
}

/// The files of the folder: the scene file, and what it names of the data that ship in `from`.
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
            // A leaf's relief lies beside its picture, where it has one.
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

/// A picture that a species file names, below the folder: there, `textures/` lies beside `species/`.
fn nearer(path: &str) -> Option<String> {
    path.strip_prefix("../../textures/").map(|rest| format!("textures/{rest}"))
}
