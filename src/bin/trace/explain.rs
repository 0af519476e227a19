//! `trace explain`: reference of the fields of scene files, species files and texture recipes.

use furrow_base::input::shipped;
use furrow_base::ron_file::RonFile;
use furrow_base::{Error, Result};
use furrow_cli::cli;
use furrow_cli::reference::{Answer, Reference, answer, distribution, scene, search, species, texture};
use furrow_field::shipped::{Shipped, all_species, called};
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
        let found = found(word, &references)?;
        if found.is_empty() {
            return Err(Error::misuse(format!("nothing contains `{word}`")).help(NOTHING));
        }
        print_found(found)?;
        return Ok(Vec::new());
    }
    let path = args.path.as_deref().unwrap_or_default();
    match answer(path, &references, "trace") {
        Ok(Answer { text, is_ambiguous }) => {
            cli::print(&text)?;
            if is_ambiguous && !path.contains('.') {
                cli::print(&format!("\nEntries about `{path}`:\n"))?;
                print_found(found(path, &references)?)?;
            }
        }
        Err(error) if path.contains('.') => return Err(error),
        Err(_) => {
            let found = found(path, &references)?;
            if found.is_empty() {
                return Err(Error::misuse(format!("there is no `{path}`")).help(NOTHING));
            }
            cli::print(&format!("Entries about `{path}`:\n"))?;
            print_found(found)?;
        }
    }
    Ok(Vec::new())
}

/// Help where a word finds nothing.
const NOTHING: &str = "`trace explain` lists all paths, `trace species` lists the species that ship; others are files of your own \
                       (docs/guide/species.md) or models";

/// Returns the lines about a word: the species that a scene file finds by it, then what contains it.
fn found(word: &str, references: &[Reference]) -> Result<Vec<(String, String)>> {
    let all = all_species()?.0;
    let mut lines: Vec<(String, String)> = called(&all, word).into_iter().map(line).collect();
    for other in search(word, references, &shipped_files(&all)?) {
        if !lines.contains(&other) {
            lines.push(other);
        }
    }
    Ok(lines)
}

/// Returns the line of a species: what a scene file writes for it, and all its names.
fn line(species: &Shipped) -> (String, String) {
    (format!("species: {:?}", species.stem()), species.names().join(", "))
}

/// Prints a line for each entry.
fn print_found(found: Vec<(String, String)>) -> Result<()> {
    cli::print_rows(&found.into_iter().map(<[String; 2]>::from).collect::<Vec<_>>())?;
    Ok(())
}

/// Returns the shipped scene files with their first comments, the species with all their names, and the soil textures.
fn shipped_files(all_species: &[Shipped]) -> Result<Vec<(String, String)>> {
    let mut all = Vec::new();
    for name in shipped::scene_names()? {
        let text = RonFile::read(&shipped::scene_file(name.clone().into())).map(|page| page.text).unwrap_or_default();
        let comment = text.lines().map_while(|line| line.strip_prefix("//")).collect::<String>();
        all.push((format!("trace --scene {name}"), comment.trim().to_owned()));
    }
    all.extend(all_species.iter().map(line));
    let soils = shipped::soil_textures()?;
    all.extend(soils.iter().map(|file| (file.display().to_string(), "soil texture".to_owned())));
    Ok(all)
}
