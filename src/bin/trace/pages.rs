//! `trace reference`: writes the documentation pages that are generated from the program.

use clap::CommandFactory;
use furrow_base::Result;
use furrow_cli::cli;
use furrow_cli::reference::{manual, scene, species, texture};
use furrow_output::write_files;
use std::path::PathBuf;

/// Output folder.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder for the pages.
    #[arg(long, value_name = "DIR", default_value = "docs/reference")]
    out: PathBuf,
}

/// Writes the pages.
pub(crate) fn run<C: CommandFactory>(args: &Args) -> Result<Vec<PathBuf>> {
    let mut pages = vec![("trace.md".to_owned(), manual(C::command()))];
    pages.extend([scene(), species(), texture()].map(|of| (format!("{}.md", of.root), of.markdown("trace"))));
    cli::check_folder(&args.out)?;
    let files: Vec<(&str, Vec<u8>)> =
        pages.iter().map(|(name, page)| (name.as_ref(), page.clone().into_bytes())).collect();
    write_files(&args.out, &files)
}
