//! `trace explain`: what may stand in scene files, species files and texture recipes.

use furrow::Result;
use furrow::reference::{answer, distribution, scene, species, texture};
use std::io::Write;
use std::path::PathBuf;

/// What to explain.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// A path such as soil.clods or crops.rows.spacing_m, of a scene file unless it begins with species, texture or distribution; the tree of
    /// all paths unless given.
    #[arg(value_name = "PATH")]
    path: Option<String>,
}

/// Prints the explanation.
pub(crate) fn run(args: &Args) -> Result<Vec<PathBuf>> {
    let words =
        answer(args.path.as_deref().unwrap_or_default(), &[scene(), species(), texture(), distribution()], "trace")?;
    // The words are the result; a closed pipe is no failure.
    let _ = std::io::stdout().write_all(words.as_bytes());
    Ok(Vec::new())
}
