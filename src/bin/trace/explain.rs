//! `trace explain`: reference of the fields of scene files, species files and texture recipes.

use furrow_base::input::shipped;
use furrow_base::ron_file::RonFile;
use furrow_base::{Error, Result};
use furrow_cli::cli;
use furrow_cli::reference::{answer, distribution, scene, search, species, texture};
use furrow_field::shipped::all_species;
use std::path::PathBuf;

/// The path to explain.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Path such as soil.clods or crops.rows.spacing_m: in a scene file, unless it starts with species, texture or
    /// distribution. Any other word lists what contains it, as `--search`. Default: the tree of all paths.
    #[arg(value_name = "PATH", conflicts_with = "search")]
    path: Option<String>,
    /// List the fields, species, shipped scene files and soil textures whose name or description contains this word, or a
    /// word for the same: cracks, tilt, corn.
    #[arg(long, value_name = "WORD")]
    search: Option<String>,
}

/// Prints the explanation, or the entries that a word finds which is no path.
pub(crate) fn run(args: &Args) -> Result<Vec<PathBuf>> {
    let references = [scene(), species(), texture(), distribution()];
    if let Some(word) = &args.search {
        let found = search(word, &references, &shipped_files()?);
        if found.is_empty() {
            return Err(Error::misuse(format!("nothing contains `{word}`")).help("`trace explain` lists all paths"));
        }
        print_found(found)?;
    } else {
        let path = args.path.as_deref().unwrap_or_default();
        match answer(path, &references, "trace") {
            Ok(text) => {
                cli::print(&text)?;
            }
            Err(error) => {
                let found = if path.contains('.') { Vec::new() } else { search(path, &references, &shipped_files()?) };
                if found.is_empty() {
                    return Err(error);
                }
                cli::print(&format!("no path is named `{path}`; these entries contain it:\n"))?;
                print_found(found)?;
            }
        }
    }
    Ok(Vec::new())
}

/// Prints a line for each entry.
fn print_found(found: Vec<(String, String)>) -> Result<()> {
    cli::print_rows(&found.into_iter().map(<[String; 2]>::from).collect::<Vec<_>>())?;
    Ok(())
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
