//! Commands that make and compare sets of images; compiled with the feature `datasets`.

use crate::{ablate, compare, dataset, sequence, serve, stream};
use clap::Subcommand;
use furrow_base::Result;
use furrow_cli::cli::signal::Signals;
use std::path::PathBuf;

#[derive(Subcommand)]
pub(crate) enum Verb {
    /// Measure differences between images, or the gap between a real and a synthetic set.
    Compare(compare::Args),
    /// Render many fields with all labels, in the formats of other tools.
    Dataset(Box<dataset::Cli>),
    /// Write images with their labels to stdout as they are rendered, as a tar archive for another program.
    Stream(Box<stream::Args>),
    /// Render images on request of another program, one after the other, without a process for each.
    Serve(serve::Args),
    /// Drive through a field, or return to it on several days, and render all images of its cameras with poses, optical
    /// flow and tracks.
    Sequence(Box<sequence::Args>),
    /// Render a dataset, and the same dataset with one change at a time, to measure what each change means to a
    /// network.
    Ablate(Box<ablate::Args>),
}

/// Runs the command and returns the paths to print.
pub(crate) fn run(verb: &Verb, signals: &Signals) -> Result<Vec<PathBuf>> {
    match verb {
        Verb::Compare(args) => compare::run(args),
        Verb::Dataset(args) => dataset::run(args, signals),
        Verb::Stream(args) => stream::run(args, signals),
        Verb::Serve(args) => serve::run(args),
        Verb::Sequence(args) => sequence::run(args, signals),
        Verb::Ablate(args) => ablate::run(args, signals),
    }
}
