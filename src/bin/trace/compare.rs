//! `trace compare`: differences between pairs of images; with `--real` and `--synthetic`, the gap between two sets.

use crate::dataset::progress::Progress;
use crate::quality::threads;
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use furrow_cli::cli;
use furrow_compare::{Comparison, Options, PIXELS_PER_DEGREE, Pairs, gap};
use furrow_dataset::make::pack::refuse_archives;
use furrow_render::render;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// What to compare, and options.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Reference: a PNG or JPEG, a folder of such images, the folder of a rendered image, or a dataset.
    #[arg(required_unless_present = "real", requires = "b")]
    a: Option<PathBuf>,
    /// Images to compare with the reference. In folders, images with the same name form pairs.
    b: Option<PathBuf>,
    /// Real images that do not show the same scenes as the synthetic ones: a folder with images/ and optionally labels/
    /// and nir/, or a dataset. Writes the gap in colour, spectra, noise and plants, together with the same measures
    /// between halves of the real set: gap.json, .csv and .html.
    #[arg(long, value_name = "DIR", requires = "synthetic", conflicts_with_all = ["a", "labels", "ppd"])]
    real: Option<PathBuf>,
    /// Synthetic images to compare with the real ones: a folder of the same kind, usually a dataset.
    #[arg(long, value_name = "DIR", requires = "real")]
    synthetic: Option<PathBuf>,
    /// Size on the ground of a pixel of the real images, in millimetres, used to reduce the finer set to the coarser
    /// resolution. Default: from the records of the images, if available.
    #[arg(long, value_name = "MM", requires = "real", value_parser = pixel_mm)]
    pixel_mm: Option<f64>,
    /// Labels as PNG files (0 soil, 1 crop, 2 weed, 255 none), for measures by class. Default: semantics.png of the
    /// reference.
    #[arg(long, value_name = "PATH")]
    labels: Option<PathBuf>,
    /// Folder for compare.json, .csv, .md and .html, or gap.json, .csv and .html.
    #[arg(long, value_name = "DIR", default_value = "out/compare")]
    out: PathBuf,
    /// Pixels per degree of visual angle that FLIP assumes; 67 is a 4K screen of 0.7 m seen from 0.7 m.
    #[arg(long, value_name = "N", default_value_t = PIXELS_PER_DEGREE, value_parser = pixels_per_degree)]
    ppd: f32,
    /// Maximum number of pairs in the report, those with the largest FLIP; for sets, of images from each.
    #[arg(long, value_name = "N", default_value_t = 12)]
    show: usize,
    /// Number of threads; 0 for one per core.
    #[arg(long, default_value_t = 0, value_parser = threads)]
    threads: usize,
    /// Print nothing but errors, warnings and the paths of the files.
    #[arg(long)]
    quiet: bool,
}

/// Parses pixels per degree. Below 1 nothing is left to see; above 500 the filters are larger than images.
fn pixels_per_degree(text: &str) -> Result<f32, String> {
    text.parse().ok().filter(|n| (1.0..=500.0).contains(n)).ok_or_else(|| "write a number from 1 to 500".into())
}

/// Parses the size of a pixel on the ground.
fn pixel_mm(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|mm| (0.001..=10_000.0).contains(mm))
        .ok_or_else(|| "write millimetres, such as 0.3".into())
}

/// Compares images or sets, writes tables and a page, and prints the results.
pub(crate) fn run(args: &Args) -> Result<Vec<PathBuf>> {
    cli::check_folder(&args.out)?;
    // Next to archives there may be images written for other formats, such as label maps, which are not colour images.
    // The images of sets are read from the archives.
    [&args.a, &args.b].into_iter().flatten().try_for_each(|path| refuse_archives(path))?;
    match (args.real.as_deref(), args.synthetic.as_deref(), args.a.as_deref(), args.b.as_deref()) {
        (Some(real), Some(synthetic), ..) => sets(args, real, synthetic),
        (.., Some(a), Some(b)) => pairs(args, a, b),
        _ => Err(Error::misuse("nothing to compare").help("give two paths, or --real and --synthetic")),
    }
}

fn sets(args: &Args, real: &Path, synthetic: &Path) -> Result<Vec<PathBuf>> {
    let progress = Progress::new(Instant::now(), args.quiet);
    let options = gap::Options { shown: args.show, pixel_mm: args.pixel_mm };
    let start = |pictures: usize| progress.expect(pictures.to_u64());
    let pool = render::pool(args.threads)?;
    let gap = pool.install(|| gap::Gap::of(real, synthetic, &options, &start, &|| progress.add()))?;
    progress.finish();
    for warning in &gap.warnings {
        furrow_cli::message!("warning: {warning}");
    }
    let paths = gap.write(&args.out)?;
    if !args.quiet {
        furrow_cli::message!("{}", gap.table().trim_end());
    }
    Ok(paths)
}

fn pairs(args: &Args, a: &Path, b: &Path) -> Result<Vec<PathBuf>> {
    let found = Pairs::find(a, b, args.labels.as_deref())?;
    for warning in found.warnings() {
        furrow_cli::message!("warning: {warning}");
    }
    let progress = Progress::new(Instant::now(), args.quiet);
    progress.expect(found.pairs.len().to_u64());
    let options = Options { labels: args.labels.clone(), pixels_per_degree: args.ppd, shown: args.show };
    let pool = render::pool(args.threads)?;
    let comparison = pool.install(|| Comparison::of(found, &options, &|| progress.add()))?;
    progress.finish();
    let paths = comparison.write(&args.out)?;
    if !args.quiet {
        furrow_cli::message!("{}", comparison.table().trim_end());
    }
    Ok(paths)
}
