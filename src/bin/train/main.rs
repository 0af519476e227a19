//! `train`: trains, evaluates and applies networks that segment soil, crop and weed.

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
mod make;
mod pages;
mod plants;
mod predict;
mod report;
mod table;
mod zoo;

use clap::{Parser, Subcommand};
use furrow_base::supervise::supervised;
use furrow_cli::cli::{self, signal};
use std::process::ExitCode;

/// Trains segmentation networks on datasets, rendered or real, and evaluates them on real images.
///
/// A dataset is a folder that `trace dataset` made or imported. DIR@PICK selects images of it: DIR@train (training set), DIR@val
/// (validation set), DIR@test (test set), DIR@all, DIR@0..10 (numbers 0 to 9), DIR@1/2 (every second image from number 1 on),
/// DIR@random:100. DIR@0..10*4 oversamples: each image is in an epoch four times. DIR@all+1.4px dilates label masks by 1.4 pixels,
/// DIR@all-1px erodes them: manual masks are dilated by about 1 px, rendered ones end at the leaf edge.
#[derive(Parser)]
#[command(name = "train", version, arg_required_else_help = true, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

const EXAMPLES: &str = "\
Examples:
  train make --crop maize --photos photos/ --out nets/maize   a network for maize, and its predictions
  train fit --set data/d --out runs/d                     Basic SegNet on the training set of a dataset
  train fit --set data/d --set data/real@0..10*4 --network unet --size 240x180 --out runs/augmented
  train eval runs/d --set data/real@12..20                scores on a test set of real images
  train predict runs/d photos/ --out predictions          class masks of photographs, and overlays
  train predict any-field photos/ --out predictions       the same with a network that ships
  train adapt runs/d --images photos/ --out runs/d3       self-training on photographs without labels
  train plants runs/d --set data/d --out runs/d4          a decoder that separates plants one by one
  train calibrate runs/d --set data/d --out runs/d2       calibrated class biases
  train export runs/d --format onnx                       the network for a robot
  train baseline exg-size --from data/real@0..10 --set data/real@12..20
  train table scenes/experiments/paper.ron --real jai=DIR the paper's tables, from scenes and real images
  train report runs/a runs/b --out out/losses             loss curves of several runs in one plot
  train explain hyperparameters.rate                      a field of experiment files

A run that was stopped or killed resumes with the same command, with the same result.
Paths go to stdout, everything else to stderr.
Exit codes: 0 done, 1 failed, 2 wrong input, 75 stopped cleanly (Ctrl-C, TERM, HUP, USR1).";

#[derive(Subcommand)]
enum Verb {
    /// Make a network for a named crop in one command: scene file, images, training, evaluation, predictions for photographs.
    Make(Box<make::Args>),
    /// Train a network.
    Fit(Box<fit::Args>),
    /// Evaluate a trained network on a test set: scores, confusion matrix, report.
    Eval(eval::Args),
    /// Predict the classes of images without labels: class masks, and overlays on the images.
    Predict(predict::Args),
    /// Continue training on photographs without labels (self-training).
    Adapt(adapt::Args),
    /// Add a decoder to a trained network that separates plants one by one (instance segmentation); class scores stay the same.
    Plants(plants::Args),
    /// Calibrate the class biases of a trained network against over- and under-prediction, on images with labels.
    Calibrate(calibrate::Args),
    /// List the trained networks that ship with the program.
    Zoo,
    /// Export a trained network for other programs.
    Export(export::Args),
    /// Fit and evaluate an ExG threshold baseline, with or without component sizes, which a network must beat.
    Baseline(baseline::Args),
    /// Run an experiment file: datasets, training runs, evaluations, tables.
    Table(Box<table::Args>),
    /// Plot the losses and validation scores of several runs together, on one page.
    Report(curves::Args),
    /// Explain the fields of experiment files, each with its range, default and an example.
    Explain(explain::Args),
    /// Write the generated pages of the documentation.
    #[command(hide = true)]
    Reference(pages::Args),
}

fn main() -> ExitCode {
    let verb = match cli::parse::<Cli>(furrow_render::accel::version) {
        Ok(cli) => cli.verb,
        Err(code) => return code,
    };
    furrow_train::memory::keep();
    let signals = signal::Signals::watch();
    // A panic ends the program with exit code 1 and a message like any other error.
    let done = supervised(|| match verb {
        Verb::Make(args) => make::run(&args, &signals),
        Verb::Fit(args) => fit::run(&args, &signals),
        Verb::Eval(args) => eval::run(&args, &signals),
        Verb::Predict(args) => predict::run(&args, &signals),
        Verb::Adapt(args) => adapt::run(&args, &signals),
        Verb::Plants(args) => plants::run(&args, &signals),
        Verb::Calibrate(args) => calibrate::run(&args),
        Verb::Zoo => zoo::run(),
        Verb::Export(args) => export::run(&args),
        Verb::Baseline(args) => baseline::run(&args, &signals),
        Verb::Table(args) => table::run(&args, &signals),
        Verb::Report(args) => curves::run(&args),
        Verb::Explain(args) => explain::run(&args),
        Verb::Reference(args) => pages::run::<Cli>(&args),
    });
    cli::end(done.and_then(|done| done))
}
