//! `trace explain`: what may stand in scene files, species files and texture recipes.

use furrow::reference::{answer, distribution, scene, species, texture};
use furrow::{Result, cli};
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
    cli::print(&words)?;
    Ok(Vec::new())
}
