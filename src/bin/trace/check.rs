//! `trace check`: reports all mistakes of a scene file and of the files that it names.

use crate::field::{MemoryArgs, SetArgs, print_warning, scene_file};
use furrow_base::Result;
use furrow_cli::cli;
use furrow_job::SceneFile;
use std::path::PathBuf;

/// Scene file to check.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Scene file (RON). A bare name such as `field` also finds a shipped one.
    #[arg(value_name = "FILE", value_parser = scene_file())]
    scene: PathBuf,
    #[command(flatten)]
    set: SetArgs,
    /// Seed that overrides the scene file's.
    #[arg(long)]
    seed: Option<u64>,
    /// Index of the field whose drawn values are checked.
    #[arg(long, default_value_t = 0)]
    index: u64,
    #[command(flatten)]
    memory: MemoryArgs,
    /// Print nothing but errors and warnings.
    #[arg(long)]
    quiet: bool,
}

const EXAMPLES: &str = "\
Unknown names, values out of bounds, and missing or unusable files are all reported at once, each with its place and what
to do. A file that is not valid RON has one mistake: the first. Mistakes in the drawn values of other fields, and those
that only appear while a field is built, are not found.

Exit codes: 0 no mistake, 2 mistakes.";

/// Checks the scene file. Writes no files.
pub(crate) fn run(args: &Args) -> Result<Vec<PathBuf>> {
    cli::check_scene(&args.scene)?;
    let scene = SceneFile::open(&args.scene)?.assign(&args.set.values)?.seed(args.seed).memory(args.memory.bytes);
    let warnings = scene.check(args.index)?;
    for warning in &warnings {
        print_warning(warning);
    }
    if !args.quiet {
        furrow_cli::message!("{}: no mistakes", args.scene.display());
    }
    Ok(Vec::new())
}
