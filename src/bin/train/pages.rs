//! `train reference`: writes the documentation pages that are generated from the program.

use clap::CommandFactory;
use furrow_base::Result;
use furrow_cli::cli;
use furrow_cli::reference::{experiment, manual};
use furrow_output::write_files;
use std::path::PathBuf;

/// Arguments of `train reference`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder for the pages.
    #[arg(long, value_name = "DIR", default_value = "docs/reference")]
    out: PathBuf,
}

/// Writes the pages; returns their paths.
pub(crate) fn run<C: CommandFactory>(args: &Args) -> Result<Vec<PathBuf>> {
    let pages = [("train.md", manual(C::command())), ("experiment.md", experiment().markdown("train"))];
    cli::check_folder(&args.out)?;
    let files: Vec<(&str, Vec<u8>)> = pages.iter().map(|(name, page)| (*name, page.clone().into_bytes())).collect();
    write_files(&args.out, &files)
}
