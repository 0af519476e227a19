//! `train explain`: explains the fields of experiment files.

use furrow_base::Result;
use furrow_cli::cli;
use furrow_cli::reference::{answer, experiment};
use std::path::PathBuf;

/// Arguments of `train explain`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Path of a field, such as sets.Scene.spp or hyperparameters.rate; by default the tree of all fields is printed.
    #[arg(value_name = "PATH")]
    path: Option<String>,
}

/// Prints the explanation.
pub(crate) fn run(args: &Args) -> Result<Vec<PathBuf>> {
    let words = answer(args.path.as_deref().unwrap_or_default(), &[experiment()], "train")?.text;
    cli::print(&words)?;
    Ok(Vec::new())
}
