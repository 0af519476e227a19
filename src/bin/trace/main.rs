//! `trace`: grows a field, path traces it, labels it, writes it.

#![warn(clippy::print_stderr)]

mod ablate;
mod catalogue;
mod compare;
mod dataset;
mod export;
mod field;
mod quality;
mod render;
mod texture;

use clap::{Parser, Subcommand};
use furrow::cli::{self, signal};
use std::process::ExitCode;

/// Grows a procedural crop field, path traces it, and labels every pixel exactly.
///
/// A scene file describes a distribution over fields; scene file + seed + index is one field, and always the same bits.
#[derive(Parser)]
#[command(name = "trace", version, args_conflicts_with_subcommands = true, arg_required_else_help = true, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    verb: Option<Verb>,
    #[command(flatten)]
    render: render::Args,
}

const EXAMPLES: &str = "\
Examples:
  trace --scene scenes/field.ron --spp 64               the main scene, into out/field/
  trace --scene scenes/field.ron --index 7              another field of the same kind
  trace --scene scenes/field.ron --width 324 --spp 16   a quick look: the same view, a quarter of the size
  trace --scene scenes/field.ron --target-error 0.02    as many samples as 2 % noise needs, where it needs them
  trace --scene scenes/field.ron --time 30s             the best picture within half a minute
  trace --scene scenes/field.ron --crop 500,400,200,150 only a part of it, at full size
  trace --scene scenes/field.ron --engine raster        the same field as a game engine draws it (feature `raster`)
  trace --scene scenes/field.ron --integrator ids       which part each pixel belongs to, in false colours
  trace --scene scenes/field.ron --pixel 648,483        what that pixel shows, in words
  trace dataset --scene scenes/field.ron --count 100 --out data   a hundred of them, labelled, resumable
  trace ablate --scene scenes/field.ron --count 100 --out ab      the same hundred with one thing changed at a time
  trace export --scene scenes/field.ron --format gltf   the same field for another program
  trace compare out/field out/noisy                     how far one image is from another: PSNR, SSIM, FLIP, by class
  trace compare --real photos --synthetic data          how far a dataset is from photographs: colour, spectra, noise, plants
  trace texture textures/leaf/sugar_beet.ron            draw a texture from its recipe
  trace catalogue --species sugar_beet,galium           plants at every stage, with a scale, to look at

Files of an image:
  rgb.png, nir.png   photographs in colour and near infrared, 8 bit
  radiance.exr       linear radiance in R, G, B, NIR; variance, albedo, normal, depth, ids
  semantics.png      class of each pixel: 0 soil, 1 crop, 2 weed (indexed, with a palette)
  plants.png         number of its plant, 16 bit, 0 for none
  leaves.png         number of its leaf on that plant, 16 bit, 0 for none
  overlay.png        labels drawn over the photograph, to look at
  *_denoised.png, denoised.exr   with --denoise

More samples make less noise: twice the --spp takes twice the time and leaves 0.7 of it.
The scene files scenes/01-one-leaf.ron to 08 teach how a scene is written.
Paths go to stdout, everything else to stderr.
Exit codes: 0 done, 1 failed, 2 wrong input, 75 stopped cleanly (Ctrl-C, TERM, HUP, USR1).";

#[derive(Subcommand)]
enum Verb {
    /// Show every species at every stage, with a scale.
    Catalogue(catalogue::Args),
    /// Measure how far pictures are from others of the same things, and show where.
    Compare(compare::Args),
    /// Make many fields with all their labels, in the formats of other tools.
    Dataset(Box<dataset::Cli>),
    /// Make a dataset, and the same again with one thing changed at a time: what does each matter to a network?
    Ablate(Box<ablate::Args>),
    /// Write a field as a scene of another program.
    Export(export::Args),
    /// Draw textures from their recipes; images are written beside them.
    Texture(texture::Args),
}

fn main() -> ExitCode {
    let signals = signal::Signals::watch();
    let cli = Cli::parse();
    let done = match cli.verb {
        Some(Verb::Catalogue(args)) => catalogue::run(&args, &signals),
        Some(Verb::Compare(args)) => compare::run(&args),
        Some(Verb::Dataset(args)) => dataset::run(&args, &signals),
        Some(Verb::Ablate(args)) => ablate::run(&args, &signals),
        Some(Verb::Export(args)) => export::run(&args),
        Some(Verb::Texture(args)) => texture::run(&args),
        None => render::run(&cli.render, &signals),
    };
    cli::end(done)
}
