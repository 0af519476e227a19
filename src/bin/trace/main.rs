//! `trace`: grows a field, path traces it, labels it, writes it.

#![warn(clippy::print_stderr)]

mod ablate;
mod catalogue;
mod compare;
mod dataset;
#[cfg(feature = "raster")]
mod display;
mod explain;
mod export;
mod field;
mod growing;
mod init;
mod leaf;
mod letters;
mod list;
mod pages;
mod preview;
mod quality;
mod render;
mod scan;
mod sequence;
mod stream;
mod texture;
mod watch;

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
  trace watch scenes/field.ron                          a page that shows the field whenever the file is saved
  trace preview scenes/field.ron --indices 0..12 --out sheet.png   twelve fields of the same kind on one sheet
  trace dataset --scene scenes/field.ron --count 100 --out data   a hundred of them, labelled, resumable
  trace stream --scene scenes/field.ron | python3 train.py        fields as a program asks for them, without files
  trace sequence --scene scenes/09-drive.ron --out drive          a stereo pair that drives along a row
  trace sequence --scene scenes/03-one-row.ron --days 8..32/8 --out row    one field while it grows
  trace ablate --scene scenes/field.ron --count 100 --out ab      the same hundred with one thing changed at a time
  trace scan --scene scenes/field.ron --lidar Vlp16     what a LiDAR measures there, as a cloud of labelled points
  trace export --scene scenes/field.ron --format gltf   the same field for another program
  trace compare out/field out/noisy                     how far one image is from another: PSNR, SSIM, FLIP, by class
  trace compare --real photos --synthetic data          how far a dataset is from photographs: colour, spectra, noise, plants
  trace texture textures/leaf/sugar_beet.ron            draw a texture from its recipe
  trace catalogue --species sugar_beet,galium           plants at every stage, with a scale, to look at
  trace leaf photo.jpg --out leaf.png                   a leaf cut out of a photograph, for a species file
  trace explain soil.clods                              what may stand there in a scene file; `trace explain` alone: all
  trace init my-field                                   a scene file of your own to begin with, and all that it names
  trace species                                         what ships; so do trace cameras and trace soils

Files of an image:
  rgb.png, nir.png   photographs in colour and near infrared, 8 bit
  radiance.exr       linear radiance in R, G, B, NIR; variance, albedo, normal, depth, ids
  semantics.png      class of each pixel: 0 soil, 1 crop, 2 weed (indexed, with a palette)
  plants.png         number of its plant, 0 for none; 16 bit, or R + 256 G + 65536 B where one is above 65535
  leaves.png         number of its leaf on that plant, 16 bit, 0 for none
  overlay.png        labels drawn over the photograph, to look at
  *_denoised.png, denoised.exr   with --denoise

More samples make less noise: twice the --spp takes twice the time and leaves 0.7 of it.
The scene files scenes/01-one-leaf.ron to 10 teach how a scene is written. From any folder, --scene field finds what ships.
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
    /// Write images with their labels to stdout as they are made, as a tar archive for a program that reads them.
    Stream(Box<stream::Args>),
    /// Drive through a field, or come back to it on several days, and take all images of its cameras: poses, optical flow, tracks.
    Sequence(Box<sequence::Args>),
    /// Make a dataset, and the same again with one thing changed at a time: what does each matter to a network?
    Ablate(Box<ablate::Args>),
    /// Scan a field with a rotating LiDAR: points with ranges, intensities and labels.
    Scan(scan::Args),
    /// Write a field as a scene of another program.
    Export(export::Args),
    /// Draw several fields of a scene file on one sheet, each with its index.
    Preview(Box<preview::Args>),
    /// Show a scene file's field on a page of this machine, again whenever the file is saved.
    Watch(Box<watch::Args>),
    /// Draw textures from their recipes; images are written beside them.
    Texture(texture::Args),
    /// Cut a leaf out of a photograph, as a texture for a species file.
    Leaf(leaf::Args),
    /// Explain what may stand in a scene file, a species file or a texture recipe: every field with its unit, range, default and an example.
    Explain(explain::Args),
    /// Write the generated pages of the documentation.
    #[command(hide = true)]
    Reference(pages::Args),
    /// Begin a folder of your own: a scene file with comments, its species and textures.
    Init(init::Args),
    /// List the species that ship.
    Species,
    /// List the cameras that a scene file may name.
    Cameras,
    /// List the soils that ship: colours and pictures.
    Soils,
}

fn main() -> ExitCode {
    #[cfg(feature = "raster")]
    display::need_none();
    let signals = signal::Signals::watch();
    let cli = match cli::parse::<Cli>(furrow::accel::version) {
        Ok(cli) => cli,
        Err(code) => return code,
    };
    let done = match cli.verb {
        Some(Verb::Catalogue(args)) => catalogue::run(&args, &signals),
        Some(Verb::Compare(args)) => compare::run(&args),
        Some(Verb::Dataset(args)) => dataset::run(&args, &signals),
        Some(Verb::Ablate(args)) => ablate::run(&args, &signals),
        Some(Verb::Sequence(args)) => sequence::run(&args, &signals),
        Some(Verb::Stream(args)) => stream::run(&args, &signals),
        Some(Verb::Export(args)) => export::run(&args),
        Some(Verb::Scan(args)) => scan::run(&args),
        Some(Verb::Texture(args)) => texture::run(&args),
        Some(Verb::Leaf(args)) => leaf::run(&args),
        Some(Verb::Explain(args)) => explain::run(&args),
        Some(Verb::Reference(args)) => pages::run::<Cli>(&args),
        Some(Verb::Init(args)) => init::run(&args),
        Some(Verb::Species) => list::species(),
        Some(Verb::Cameras) => list::cameras(),
        Some(Verb::Soils) => list::soils(),
        Some(Verb::Preview(args)) => preview::run(&args, &signals),
        Some(Verb::Watch(args)) => watch::run(&args, &signals),
        None => render::run(&cli.render, &signals),
    };
    cli::end(done)
}
