//! `trace explain`: reference of the fields of scene files, species files and texture recipes.

use furrow_base::input::shipped;
use furrow_base::math::ToInt;
use furrow_base::ron_file::RonFile;
use furrow_base::{Error, Result};
use furrow_cli::cli;
use furrow_cli::reference::{Reference, answer, distribution, scene, search, species, texture};
use furrow_field::shipped::all_species;
use furrow_report::count;
use std::path::PathBuf;

/// The path to explain.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Path such as soil.clods or crops.rows.spacing_m: in a scene file, unless it starts with species, texture or
    /// distribution. Default: the tree of all paths.
    #[arg(value_name = "PATH", conflicts_with = "search")]
    path: Option<String>,
    /// List the fields, species, shipped scene files and soil textures whose name or description contains this word, or a
    /// word for the same: cracks, tilt, corn.
    #[arg(long, value_name = "WORD")]
    search: Option<String>,
}

/// Number of entries that an error about an unknown path lists.
const FIRST: usize = 3;

/// Prints the explanation.
pub(crate) fn run(args: &Args) -> Result<Vec<PathBuf>> {
    let references = [scene(), species(), texture(), distribution()];
    if let Some(word) = &args.search {
        let found = search(word, &references, &shipped_files()?);
        if found.is_empty() {
            return Err(Error::misuse(format!("nothing contains `{word}`")).help("`trace explain` lists all paths"));
        }
        cli::print_rows(&found.into_iter().map(<[String; 2]>::from).collect::<Vec<_>>())?;
    } else {
        let path = args.path.as_deref().unwrap_or_default();
        cli::print(&answer(path, &references, "trace").or_else(|error| Err(advised(error, path, &references)?))?)?;
    }
    Ok(Vec::new())
}

/// Adds to the error about a word that is not a path the entries that the word finds.
fn advised(error: Error, word: &str, references: &[Reference]) -> Result<Error> {
    let found = search(word, references, &shipped_files()?);
    if found.is_empty() {
        return Ok(error);
    }
    let entries = count(found.len().to_u64(), "entry", "entries");
    let first: Vec<&str> = found.iter().take(FIRST).map(|(name, _)| name.as_str()).collect();
    Ok(error.help(format!("`trace explain --search {word}` finds {entries}, first: {}", first.join(", "))))
}

/// Returns the shipped scene files with their first comments, the species with all their names, and the soil textures.
fn shipped_files() -> Result<Vec<(String, String)>> {
    let mut all = Vec::new();
    for name in shipped::scene_names()? {
        let text = RonFile::read(&shipped::scene_file(name.clone().into())).map(|page| page.text).unwrap_or_default();
        let comment = text.lines().map_while(|line| line.strip_prefix("//")).collect::<String>();
        all.push((format!("trace --scene {name}"), comment.trim().to_owned()));
    }
    for species in all_species()?.0 {
        all.push((format!("species: {:?}", species.stem()), species.names().join(", ")));
    }
    let soils = shipped::soil_textures()?;
    all.extend(soils.iter().map(|file| (file.display().to_string(), "soil texture".to_owned())));
    Ok(all)
}
