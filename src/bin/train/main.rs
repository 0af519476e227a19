//! `train`: trains networks to tell crop from weed, evaluates them and predicts with them.

#![warn(clippy::print_stderr)]

mod adapt;
mod baseline;
mod calibrate;
mod curves;
mod eval;
mod explain;
mod export;
mod fit;
mod inference;
mod machine;
mod pages;
mod predict;
mod renamed;
mod report;
mod table;
mod zoo;

use clap::{Parser, Subcommand};
use furrow::cli::{self, signal};
use std::process::ExitCode;

/// Trains segmentation networks on datasets, rendered or real, and evaluates them on real images.
///
/// A dataset is a folder that `trace dataset` made or imported. DIR@PICK chooses images of it: DIR@train (its training set), DIR@val
/// (validation set), DIR@test, DIR@all, DIR@0..10, DIR@1/2 (every second from number 1 on), DIR@random:100. DIR@0..10*4 oversamples:
/// each image four times an epoch. DIR@all+1.4px dilates label masks by 1.4 pixels (DIR@all-1px erodes them): manual masks are dilated
/// by about 1 px, rendered ones end where the leaf ends.
#[derive(Parser)]
#[command(name = "train", version, arg_required_else_help = true, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

const EXAMPLES: &str = "\
Examples:
  train fit --set data/d --out runs/d                     Basic SegNet on the training set of a dataset
  train fit --set data/d --set data/real@0..10*4 --network unet --size 240x180 --out runs/augmented
  train eval runs/d --set data/real@12..20                scores on a test set of real images
  train predict runs/d photos/ --out predictions          masks of photographs, and masks over them
  train predict any-field photos/ --out predictions       the same by a network that ships
  train adapt runs/d --images photos/ --out runs/d3       goes on learning from photographs without labels
  train calibrate runs/d --set data/d --out runs/d2       class biases calibrated
  train export runs/d --format onnx                       the network for a robot
  train baseline exg-size --from data/real@0..10 --set data/real@12..20
  train table scenes/experiments/paper.ron --real jai=DIR the paper's tables, from scenes and real folders
  train report runs/a runs/b --out out/losses             losses of several runs over each other
  train explain hyperparameters.rate                      what may stand in an experiment file

A run that was stopped or killed goes on with the same command, and ends the same.
Paths go to stdout, everything else to stderr.
Exit codes: 0 done, 1 failed, 2 wrong input, 75 stopped cleanly (Ctrl-C, TERM, HUP, USR1).";

#[derive(Subcommand)]
enum Verb {
    /// Train a network.
    Fit(Box<fit::Args>),
    /// Evaluate a trained network on a test set: scores, confusion matrix, report.
    Eval(eval::Args),
    /// Predict the classes of images without labels: masks, and masks over the images.
    Predict(predict::Args),
    /// Go on training on photographs without labels (self-training).
    Adapt(adapt::Args),
    /// Calibrate the class biases of a trained network against over- and under-prediction, on images with labels.
    Calibrate(calibrate::Args),
    /// List the trained networks that ship with the program.
    Zoo,
    /// Write a trained network for other programs.
    Export(export::Args),
    /// Fit and evaluate an ExG threshold, with component sizes or without: what a network must beat.
    Baseline(baseline::Args),
    /// Run an experiment file: datasets, trainings, evaluations, tables.
    Table(Box<table::Args>),
    /// Draw the losses and validation scores of several runs over each other, on one page.
    Report(curves::Args),
    /// Explain what may stand in an experiment file: every field with its range, default and an example.
    Explain(explain::Args),
    /// Write the generated pages of the documentation.
    #[command(hide = true)]
    Reference(pages::Args),
}

fn main() -> ExitCode {
    let verb = match cli::parse::<Cli>(furrow::accel::version) {
        Ok(cli) => cli.verb,
        Err(code) => return code,
    };
    furrow::train::memory::keep();
    // After that: a process that has replaced itself would warn twice.
    renamed::warn(std::env::args_os());
    let signals = signal::Signals::watch();
    let done = match verb {
        Verb::Fit(args) => fit::run(&args, &signals),
        Verb::Eval(args) => eval::run(&args, &signals),
        Verb::Predict(args) => predict::run(&args, &signals),
        Verb::Adapt(args) => adapt::run(&args, &signals),
        Verb::Calibrate(args) => calibrate::run(&args),
        Verb::Zoo => zoo::run(),
        Verb::Export(args) => export::run(&args),
        Verb::Baseline(args) => baseline::run(&args, &signals),
        Verb::Table(args) => table::run(&args, &signals),
        Verb::Report(args) => curves::run(&args),
        Verb::Explain(args) => explain::run(&args),
        Verb::Reference(args) => pages::run::<Cli>(&args),
    };
    cli::end(done)
}
