//! `trace compare`: how far pictures are from others of the same things; with `--real` and `--synthetic`, how far one set is from another.

use crate::dataset::progress::Progress;
use crate::quality::threads;
use furrow::compare::{Comparison, Options, PIXELS_PER_DEGREE, Pairs, gap};
use furrow::dataset::pack::refuse_archives;
use furrow::{Error, Result, cli, render};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// What is compared, and how.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// The reference: a PNG or JPEG, a folder of such, a rendered image's folder, or a dataset.
    #[arg(required_unless_present = "real", requires = "b")]
    a: Option<PathBuf>,
    /// What is measured against it; of folders, pictures of the same name are pairs.
    b: Option<PathBuf>,
    /// Real pictures, of which none shows what a synthetic one does: a folder with images/ and, if known, labels/ and nir/; or a dataset.
    /// Writes how far colours, spectra, noise, plants are, beside the same between halves of the real set: gap.json, .csv and .html.
    #[arg(long, value_name = "DIR", requires = "synthetic", conflicts_with_all = ["a", "labels", "ppd"])]
    real: Option<PathBuf>,
    /// The pictures that are to be like the real ones: a folder of the same kind, as a rule a dataset.
    #[arg(long, value_name = "DIR", requires = "real")]
    synthetic: Option<PathBuf>,
    /// Millimetres of ground that a pixel of the real pictures sees, so that the finer set can be made as coarse as the other; read off their records
    /// where they have such.
    #[arg(long, value_name = "MM", requires = "real", value_parser = pixel_mm)]
    pixel_mm: Option<f64>,
    /// Labels as PNG files (0 soil, 1 crop, 2 weed, 255 none), for figures of each class; semantics.png beside the reference unless given.
    #[arg(long, value_name = "PATH")]
    labels: Option<PathBuf>,
    /// Folder for compare.json, .csv, .md and .html, or gap.json, .csv and .html.
    #[arg(long, value_name = "DIR", default_value = "out/compare")]
    out: PathBuf,
    /// Pixels in a degree of the view of the eye that FLIP imagines; 67 is a 4K screen of 0.7 m at 0.7 m.
    #[arg(long, value_name = "N", default_value_t = PIXELS_PER_DEGREE, value_parser = pixels_per_degree)]
    ppd: f32,
    /// Most pairs that the report shows, those of the largest FLIP; of sets, pictures of each.
    #[arg(long, value_name = "N", default_value_t = 12)]
    show: usize,
    /// Threads; 0 for one on each core.
    #[arg(long, default_value_t = 0, value_parser = threads)]
    threads: usize,
    /// Print nothing but errors, warnings and the paths of the files.
    #[arg(long)]
    quiet: bool,
}

/// Parses pixels in a degree: below 1 nothing is left to see, above 500 the filters are larger than pictures.
fn pixels_per_degree(text: &str) -> Result<f32, String> {
    text.parse().ok().filter(|n| (1.0..=500.0).contains(n)).ok_or_else(|| "write a number from 1 to 500".into())
}

/// Parses a pixel's side on the ground.
fn pixel_mm(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|mm| (0.001..=10_000.0).contains(mm))
        .ok_or_else(|| "write millimetres, such as 0.3".into())
}

/// Measures what was asked for, writes tables and a page, and shows the figures.
pub(crate) fn run(args: &Args) -> Result<Vec<PathBuf>> {
    cli::check_folder(&args.out)?;
    // Beside archives lie pictures of formats, label maps among them, which are no photographs. Sets are read out of archives.
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
    let start = |pictures: usize| progress.expect(pictures as u64);
    let pool = render::pool(args.threads)?;
    let gap = pool.install(|| gap::Gap::of(real, synthetic, &options, &start, &|| progress.add()))?;
    progress.finish();
    for warning in &gap.warnings {
        furrow::tell!("warning: {warning}");
    }
    let paths = gap.write(&args.out)?;
    if !args.quiet {
        furrow::tell!("{}", gap.table().trim_end());
    }
    Ok(paths)
}

fn pairs(args: &Args, a: &Path, b: &Path) -> Result<Vec<PathBuf>> {
    let found = Pairs::find(a, b, args.labels.as_deref())?;
    for warning in found.warnings() {
        furrow::tell!("warning: {warning}");
    }
    let progress = Progress::new(Instant::now(), args.quiet);
    progress.expect(found.pairs.len() as u64);
    let options = Options { labels: args.labels.clone(), pixels_per_degree: args.ppd, shown: args.show };
    let pool = render::pool(args.threads)?;
    let comparison = pool.install(|| Comparison::of(found, &options, &|| progress.add()))?;
    progress.finish();
    let paths = comparison.write(&args.out)?;
    if !args.quiet {
        furrow::tell!("{}", comparison.table().trim_end());
    }
    Ok(paths)
}
