//! `train explain`: what may stand in experiment files.

use furrow::reference::{answer, experiment};
use furrow::{Result, cli};
use std::path::PathBuf;

/// What to explain.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// A path such as sets.Scene.spp or hyperparameters.rate; the tree of all paths unless given.
    #[arg(value_name = "PATH")]
    path: Option<String>,
}

/// Prints the explanation.
pub(crate) fn run(args: &Args) -> Result<Vec<PathBuf>> {
    let words = answer(args.path.as_deref().unwrap_or_default(), &[experiment()], "train")?;
    cli::print(&words)?;
    Ok(Vec::new())
}
