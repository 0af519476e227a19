//! `trace explain`: reference of the fields of scene files, species files and texture recipes.

use furrow_base::Result;
use furrow_cli::cli;
use furrow_cli::reference::{answer, distribution, scene, species, texture};
use std::path::PathBuf;

/// The path to explain.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Path such as soil.clods or crops.rows.spacing_m: in a scene file, unless it starts with species, texture or
    /// distribution. Default: the tree of all paths.
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
