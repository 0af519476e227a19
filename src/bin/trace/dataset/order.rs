//! What dataset: `trace dataset plan`.

use crate::engine::Engine;
use crate::field::PageArgs;
use crate::raster::Card;
use crate::technique::TechniqueArgs;
use furrow::dataset::plan::{self, Order};
use furrow::dataset::split::Shares;
use furrow::dataset::{Set, format};
use furrow::output::Denoiser;
use furrow::sampling::Sampler;
use furrow::{Error, Result, accel, cli, render};
use std::path::PathBuf;

/// What is made.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    page: PageArgs,
    /// How many images. A dataset may get longer later.
    #[arg(long, value_name = "N", required = true, value_parser = clap::value_parser!(u64).range(1..=99_999_999))]
    count: Option<u64>,
    /// Folder of the dataset.
    #[arg(long, value_name = "DIR", required = true)]
    out: Option<PathBuf>,
    /// Formats to write beside the native one, separated by commas.
    #[arg(long, value_delimiter = ',', value_name = "FORMAT", value_parser = formats())]
    format: Vec<String>,
    /// Shares of train, val and test.
    #[arg(long, value_name = "TRAIN,VAL,TEST", default_value = "8,1,1", value_parser = Shares::parse)]
    split: Shares,
    /// What others may do with the images, such as CC-BY-4.0; stands in the manifest.
    #[arg(long, value_name = "TEXT", default_value = "not stated")]
    licence: String,
    /// What draws the images.
    #[arg(long, value_enum, default_value_t = Engine::Trace)]
    engine: Engine,
    /// Samples a pixel.
    #[arg(long, default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=i64::from(Sampler::MAX_SAMPLES)))]
    spp: u32,
    /// Take the noise of few samples out of the photographs; needs Open Image Denoise.
    #[arg(long)]
    denoise: bool,
    #[command(flatten)]
    technique: TechniqueArgs,
}

/// The names of the formats, with what they are.
pub(super) fn formats() -> clap::builder::PossibleValuesParser {
    let value = |(name, words): &(&'static str, &'static str)| clap::builder::PossibleValue::new(*name).help(*words);
    clap::builder::PossibleValuesParser::new(format::NAMES.iter().map(value))
}

/// Begins the dataset, or finds it begun.
pub(crate) fn run(args: &Args) -> Result<Set> {
    args.page.check()?;
    let out = args.out.clone().unwrap_or_default();
    cli::check_folder(&out)?;
    args.technique.check(args.engine)?;
    if args.denoise && args.engine == Engine::Raster {
        return Err(Error::Dataset(
            "--denoise says nothing with --engine raster, which has no noise\n help: leave it out".into(),
        ));
    }
    // What may change the last bits.
    let kernels = match args.engine {
        Engine::Trace => accel::version()?,
        Engine::Raster => Card::open(&args.technique)?.name().to_owned(),
    };
    if args.denoise {
        // Before hours are spent on what could not be denoised then.
        Denoiser::find()?;
    }
    let mut formats = args.format.clone();
    formats.sort();
    formats.dedup();
    let (max_depth, clamp) = args.technique.limits();
    let order = Order {
        scene: args.page.path().to_path_buf(),
        seed: args.page.seed,
        count: args.count.unwrap_or(0),
        width: args.page.width,
        height: args.page.height,
        formats,
        split: args.split,
        licence: args.licence.clone(),
        engine: args.engine.name().into(),
        kernels,
        // A card draws each pixel once.
        spp: if args.engine == Engine::Raster { 1 } else { args.spp },
        denoise: args.denoise,
        without: args.technique.without(),
        max_depth,
        clamp,
    };
    let (set, warnings) = render::pool(0)?.install(|| plan::plan(&out, &order))?;
    for warning in warnings {
        eprintln!("warning: {warning}");
    }
    Ok(set)
}
