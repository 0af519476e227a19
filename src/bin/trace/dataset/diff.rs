//! Differences between two datasets: `trace dataset diff`.

use furrow_base::Result;
use furrow_cli::cli;
use furrow_dataset::Set;
use furrow_dataset::check::changes::{Change, changes};
use std::path::PathBuf;

/// The datasets.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the first dataset.
    before: PathBuf,
    /// Folder of the second dataset.
    after: PathBuf,
}

/// Prints the differences, one a line: path, value in the first dataset, value in the second.
pub(crate) fn run(args: &Args) -> Result<Vec<PathBuf>> {
    let found = changes(&Set::open(&args.before)?, &Set::open(&args.after)?)?;
    if found.is_empty() {
        furrow_cli::message!("the recipes, the scene files and the files that they read are the same");
    }
    let shown = |value: Option<String>| value.unwrap_or_else(|| "none".to_owned());
    let row = |Change { what, before, after }: Change| [what, format!("{} → {}", shown(before), shown(after))];
    cli::print_rows(&found.into_iter().map(row).collect::<Vec<_>>())?;
    Ok(Vec::new())
}
