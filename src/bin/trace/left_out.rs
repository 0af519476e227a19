//! Names of the commands that this build leaves out, so that they get an error that says how to compile them.

use clap::Subcommand;
use furrow_base::{Error, Result};
use std::path::PathBuf;

#[derive(Subcommand)]
pub(crate) enum Verb {
    /// Needs the feature `datasets`.
    #[cfg(not(feature = "datasets"))]
    #[command(hide = true, aliases = ["stream", "serve", "sequence", "ablate", "compare"])]
    Dataset(Arguments),
    /// Needs the feature `watch`.
    #[cfg(not(feature = "watch"))]
    #[command(hide = true)]
    Watch(Arguments),
}

/// Arguments of a command that is not compiled; they are not read.
#[derive(clap::Args)]
#[command(disable_help_flag = true)]
pub(crate) struct Arguments {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    _rest: Vec<std::ffi::OsString>,
}

/// Returns the error that names the missing feature.
pub(crate) fn run(verb: &Verb) -> Result<Vec<PathBuf>> {
    let feature = match verb {
        #[cfg(not(feature = "datasets"))]
        Verb::Dataset(_) => "datasets",
        #[cfg(not(feature = "watch"))]
        Verb::Watch(_) => "watch",
    };
    let error = Error::input(format!("this command is not part of this build, which lacks the feature `{feature}`"));
    Err(error.help("`cargo build --release` compiles every command"))
}
