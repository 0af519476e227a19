//! What dataset: `trace dataset plan`.

use crate::engine::Engine;
use crate::field::PageArgs;
use crate::raster::Card;
use crate::technique::TechniqueArgs;
use furrow::ablation::{Drawing, Edit, FULL};
use furrow::dataset::plan::{self, Order};
use furrow::dataset::split::Shares;
use furrow::dataset::{Set, format};
use furrow::output::Denoiser;
use furrow::sampling::Sampler;
use furrow::{Error, Result, accel, cli, render};
use std::path::{Path, PathBuf};

/// What is made.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    images: ImageArgs,
    /// Change one thing of every field, by its name; `trace ablate --list` tells them.
    #[arg(long, value_name = "NAME")]
    edit: Option<String>,
}

/// Which images, in what form.
#[derive(clap::Args)]
pub(crate) struct ImageArgs {
    #[command(flatten)]
    page: PageArgs,
    /// How many images. A dataset may get longer later.
    #[arg(long, value_name = "N", required = true, value_parser = clap::value_parser!(u64).range(1..=99_999_999))]
    count: Option<u64>,
    /// Folder of the dataset.
    #[arg(long, value_name = "DIR", required = true)]
    pub(crate) out: Option<PathBuf>,
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
    let edit = args.edit.as_deref().map_or(Ok(&FULL), Edit::named)?;
    args.images.begin(&args.images.out.clone().unwrap_or_default(), edit)
}

impl ImageArgs {
    /// How the images are drawn without an edit.
    pub(crate) fn drawing(&self) -> Drawing {
        let (max_depth, _) = self.technique.limits();
        // A card draws each pixel once.
        let spp = if self.engine == Engine::Raster { 1 } else { self.spp };
        Drawing { engine: self.engine.name().into(), spp, denoise: self.denoise, max_depth }
    }

    /// Begins a dataset of these images as an edit has them, or finds it begun.
    pub(crate) fn begin(&self, out: &Path, edit: &'static Edit) -> Result<Set> {
        self.page.check()?;
        cli::check_folder(out)?;
        let drawing = self.drawing();
        let drawn = edit.drawing(drawing.clone());
        let engine = Engine::named(&drawn.engine);
        self.technique.check(engine)?;
        if drawn.denoise && engine == Engine::Raster {
            return Err(Error::Dataset(
                "--denoise says nothing with --engine raster, which has no noise\n help: leave it out".into(),
            ));
        }
        // What may change the last bits.
        let kernels = match engine {
            Engine::Trace => accel::version()?,
            Engine::Raster => Card::open(&self.technique)?.name().to_owned(),
        };
        if drawn.denoise {
            // Before hours are spent on what could not be denoised then.
            Denoiser::find()?;
        }
        let mut formats = self.format.clone();
        formats.sort();
        formats.dedup();
        let (_, clamp) = self.technique.limits();
        let order = Order {
            scene: self.page.path().to_path_buf(),
            seed: self.page.seed,
            count: self.count.unwrap_or(0),
            width: self.page.width,
            height: self.page.height,
            formats,
            split: self.split,
            licence: self.licence.clone(),
            drawing,
            kernels,
            edit,
            without: self.technique.without(),
            clamp,
        };
        let (set, warnings) = render::pool(0)?.install(|| plan::plan(out, &order))?;
        for warning in warnings {
            eprintln!("warning: {warning}");
        }
        Ok(set)
    }
}
