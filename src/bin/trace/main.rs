//! `trace`: builds procedural crop fields, path traces and labels them, and writes the results.

#![warn(clippy::print_stderr)]

#[cfg(feature = "datasets")]
mod ablate;
mod catalogue;
mod check;
#[cfg(feature = "datasets")]
mod compare;
#[cfg(feature = "datasets")]
mod dataset;
#[cfg(feature = "datasets")]
mod datasets;
#[cfg(feature = "raster")]
mod display;
mod explain;
mod export;
mod field;
mod growing;
mod init;
mod leaf;
#[cfg(not(all(feature = "datasets", feature = "watch")))]
mod left_out;
mod list;
mod pages;
mod preview;
mod profile;
mod quality;
mod render;
mod scan;
#[cfg(feature = "datasets")]
mod sequence;
#[cfg(feature = "datasets")]
mod serve;
#[cfg(feature = "datasets")]
mod stream;
mod texture;
#[cfg(feature = "datasets")]
mod variants;
#[cfg(feature = "watch")]
mod watch;

use clap::{Parser, Subcommand};
use furrow_base::supervise::supervised;
use furrow_cli::cli::{self, signal};
use std::process::ExitCode;

/// Builds a procedural crop field, path traces it, and labels every pixel exactly.
///
/// A scene file describes a distribution over fields. Scene file, seed and index identify one field, always with the
/// same bits.
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
  trace --scene scenes/field.ron --index 7              another field of the same distribution
  trace --scene scenes/field.ron --width 324 --spp 16   a quick preview: the same view at a quarter of the size
  trace --scene scenes/field.ron --target-error 0.02    adaptive sampling to a relative error of 2 %
  trace --scene scenes/field.ron --time 30s             the best image within half a minute
  trace --scene scenes/field.ron --crop 500,400,200,150 only a part of the image, at full resolution
  trace --scene scenes/field.ron --engine raster        the same field, rasterized like a game engine (feature `raster`)
  trace --scene scenes/field.ron --integrator ids       the part of each pixel, in false colours
  trace --scene scenes/field.ron --pixel 648,483        a description of that pixel
  trace check scenes/field.ron                          all mistakes of a scene file at once
  trace watch scenes/field.ron                          a web page that renders the field whenever the file is saved
  trace preview scenes/field.ron --indices 0..12 --out sheet.png   twelve fields on one sheet
  trace dataset --scene scenes/field.ron --count 100 --out data   a labelled dataset of 100 images, resumable
  trace stream --scene scenes/field.ron | python3 train.py        images for another program on demand, without files
  trace sequence --scene scenes/09-drive.ron --out drive          images of a stereo pair driving along a row
  trace sequence --scene scenes/03-one-row.ron --days 8..32/8 --out row    one field on several days of growth
  trace ablate --scene scenes/field.ron --count 100 --out ab      the same dataset with one change at a time
  trace scan --scene scenes/field.ron --lidar Vlp16     a simulated LiDAR scan as a labelled point cloud
  trace export --scene scenes/field.ron --format gltf   the same field for another program
  trace compare out/field out/noisy                     difference between two images: PSNR, SSIM, FLIP, by class
  trace compare --real photos --synthetic data          gap between a dataset and photographs: colour, spectra, noise, plants
  trace texture textures/leaf/sugar_beet.ron            generate a texture from its recipe
  trace catalogue --species sugar_beet,galium           images of plants at every growth stage, with scale bars
  trace leaf photo.jpg --out leaf.png                   a leaf cut out of a photograph, for a species file
  trace explain soil.clods                              reference of a scene file's fields; `trace explain` lists all
  trace init my-field                                   a starter scene file with all files that it names
  trace species                                         shipped species; also: trace cameras, trace soils

Files of an image:
  rgb.png, nir.png   images in colour and near infrared, 8 bit
  radiance.exr       linear radiance in R, G, B, NIR; variance, albedo, normal, depth, ids
  semantics.png      class of each pixel: 0 soil, 1 crop, 2 weed (indexed, with a palette)
  plants.png         number of the plant, 0 for none; 16 bit, or R + 256 G + 65536 B where one is above 65535
  leaves.png         number of the leaf on that plant, 16 bit, 0 for none
  overlay.png        labels drawn over the colour image, for inspection
  *_denoised.png, denoised.exr   with --denoise

More samples reduce noise: doubling --spp doubles the time and multiplies the noise by 0.7.
The scene files scenes/01-one-leaf.ron to 13-lidar.ron are lessons. From any folder, --scene field finds the shipped file.
Paths go to stdout, everything else to stderr.
Exit codes: 0 done, 1 failed, 2 wrong input, 75 stopped cleanly (Ctrl-C, TERM, HUP, USR1).";

#[derive(Subcommand)]
enum Verb {
    /// Render every species at every growth stage, with scale bars.
    Catalogue(catalogue::Args),
    #[cfg(feature = "datasets")]
    #[command(flatten)]
    Datasets(datasets::Verb),
    /// Scan a field with a rotating LiDAR: points with ranges, intensities and labels.
    Scan(scan::Args),
    /// Check a scene file and the files that it names, and report all mistakes at once.
    Check(check::Args),
    /// Export a field as a scene of another program.
    Export(export::Args),
    /// Render several fields of a scene file on one sheet, each with its index.
    Preview(Box<preview::Args>),
    #[cfg(not(all(feature = "datasets", feature = "watch")))]
    #[command(flatten)]
    LeftOut(left_out::Verb),
    #[cfg(feature = "watch")]
    /// Show a scene file's field on a local web page, rendered again whenever the file is saved.
    Watch(Box<watch::Args>),
    /// Generate textures from their recipes; images are written next to the recipes.
    Texture(texture::Args),
    /// Cut a leaf out of a photograph, as a texture for a species file.
    Leaf(leaf::Args),
    /// Explain the fields of a scene file, a species file or a texture recipe, with unit, range, default and an
    /// example.
    Explain(explain::Args),
    /// Write the generated pages of the documentation.
    #[command(hide = true)]
    Reference(pages::Args),
    /// Create a folder with a commented scene file, its species and textures.
    Init(init::Args),
    /// List the shipped species.
    Species,
    /// List the predefined cameras for scene files.
    Cameras,
    /// List the shipped soils: colours and textures.
    Soils,
}

fn main() -> ExitCode {
    #[cfg(feature = "raster")]
    display::need_none();
    let signals = signal::Signals::watch();
    let cli = match cli::parse::<Cli>(furrow_render::accel::version) {
        Ok(cli) => cli,
        Err(code) => return code,
    };
    // A panic ends the program with exit code 1 and a message like any other error.
    let done = supervised(|| match cli.verb {
        Some(Verb::Catalogue(args)) => catalogue::run(&args, &signals),
        #[cfg(feature = "datasets")]
        Some(Verb::Datasets(verb)) => datasets::run(&verb, &signals),
        #[cfg(not(all(feature = "datasets", feature = "watch")))]
        Some(Verb::LeftOut(verb)) => left_out::run(&verb),
        Some(Verb::Check(args)) => check::run(&args),
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
        #[cfg(feature = "watch")]
        Some(Verb::Watch(args)) => watch::run(&args, &signals),
        None => render::run(&cli.render, &signals),
    });
    cli::end(done.and_then(|done| done))
}
