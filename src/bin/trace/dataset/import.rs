//! Other people's data: `trace dataset import`.

use super::progress::Progress;
use crate::quality::threads;
use clap::ValueEnum;
use furrow::cli::signal::Signals;
use furrow::dataset::import::classes::{Colors, Names};
use furrow::dataset::import::coco::Coco;
use furrow::dataset::import::masks::{Coding, Folders, Masks};
use furrow::dataset::import::phenobench::PhenoBench;
use furrow::dataset::import::{self, Order, Source};
use furrow::dataset::split::Shares;
use furrow::{Error, Result, cli, render};
use std::path::PathBuf;
use std::time::Instant;

/// What is brought in, and where to.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// What the source is.
    #[arg(long, value_enum)]
    format: Format,
    /// Folder of the dataset that is made.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// The source: for phenobench the folder that holds train/ and val/; for coco a JSON file of instances, or the folder that holds annotations/.
    #[arg(long, value_name = "PATH")]
    from: Option<PathBuf>,
    /// Folder of the images (masks, coco); train/, val/ and test/ in it become the splits.
    #[arg(long, value_name = "DIR")]
    images: Option<PathBuf>,
    /// Folder of the masks: PNG files with the images' names (masks).
    #[arg(long, value_name = "DIR")]
    masks: Option<PathBuf>,
    /// Folder of near infrared images with the images' names (masks).
    #[arg(long, value_name = "DIR")]
    nir: Option<PathBuf>,
    /// What the names of images end in and those of masks do not, such as _rgb.
    #[arg(long, value_name = "TEXT", default_value = "")]
    image_suffix: String,
    /// What the names of masks end in, such as _mask.
    #[arg(long, value_name = "TEXT", default_value = "")]
    mask_suffix: String,
    /// What the names of infrared images end in.
    #[arg(long, value_name = "TEXT", default_value = "")]
    nir_suffix: String,
    /// What the numbers of masks or the categories of coco mean: soil, crop, weed, leaf or ignore. Masks: 0=soil,1=crop,2=weed,255=ignore unless
    /// said otherwise; coco: categories of these names.
    #[arg(long, value_name = "NAME=CLASS,…", value_parser = Names::parse)]
    classes: Option<Names>,
    /// What the colours of masks mean.
    #[arg(long, value_name = "R,G,B=CLASS;…", value_parser = Colors::parse, conflicts_with = "classes")]
    colors: Option<Colors>,
    /// What to do with numbers and colours that no class was given for.
    #[arg(long, value_enum, default_value_t = Others::Error)]
    others: Others,
    /// Shares of train, val and test, for a source that has no splits.
    #[arg(long, value_name = "TRAIN,VAL,TEST", default_value = "8,1,1", value_parser = Shares::parse)]
    split: Shares,
    /// What others may do with the images, in their owner's words.
    #[arg(long, value_name = "TEXT", default_value = "not stated")]
    licence: String,
    /// Threads; 0 for one on each core.
    #[arg(long, default_value_t = 0, value_parser = threads)]
    threads: usize,
    /// Print nothing but errors, warnings and the paths of the files.
    #[arg(long)]
    quiet: bool,
}

/// What a source is.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// A folder of images and one of masks whose numbers or colours are classes.
    Masks,
    /// PhenoBench's folders: semantics, plants and leaves.
    Phenobench,
    /// COCO instances: plants, and leaves where it has them.
    Coco,
}

/// What to do with the unknown.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Others {
    /// Stop and say where it is.
    Error,
    /// Give it no label.
    Ignore,
}

/// Brings it in and writes what belongs to all.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    cli::check_folder(&args.out)?;
    let source = source(args)?;
    for warning in source.warnings() {
        furrow::tell!("warning: {warning}");
    }
    let progress = Progress::new(Instant::now(), args.quiet);
    progress.expect(source.images().len() as u64);
    let order = Order { split: args.split, licence: args.licence.clone() };
    let done = |_| progress.add();
    let stop = signals.heed();
    let pool = render::pool(args.threads)?;
    let set = pool.install(|| import::import(&args.out, source.as_ref(), &order, &done, stop))?;
    progress.finish();
    furrow::dataset::finish::finish(&set, None)
}

fn source(args: &Args) -> Result<Box<dyn Source>> {
    let needed = |path: &Option<PathBuf>, option: &str| {
        path.clone().ok_or_else(|| {
            Error::misuse(format!("this --format needs {option}")).help("`trace dataset import --help` tells what for")
        })
    };
    let useless = [
        (
            args.masks.is_some() || args.nir.is_some() || args.colors.is_some(),
            args.format != Format::Masks,
            "--masks, --nir and --colors",
        ),
        (args.from.is_some(), args.format == Format::Masks, "--from"),
        (args.images.is_some() || args.classes.is_some(), args.format == Format::Phenobench, "--images and --classes"),
    ];
    if let Some((.., options)) = useless.into_iter().find(|(given, useless, _)| *given && *useless) {
        return Err(Error::misuse(format!("{options} say nothing for this --format")).help("leave them out"));
    }
    Ok(match args.format {
        Format::Masks => {
            let coding = match (&args.colors, &args.classes) {
                (Some(colors), _) => Coding::Colors(colors.clone()),
                (None, Some(names)) => Coding::Numbers(names.clone()),
                (None, None) => Coding::default(),
            };
            Box::new(Masks::open(Folders {
                images: needed(&args.images, "--images")?,
                masks: needed(&args.masks, "--masks")?,
                nir: args.nir.clone(),
                image_suffix: args.image_suffix.clone(),
                mask_suffix: args.mask_suffix.clone(),
                nir_suffix: args.nir_suffix.clone(),
                coding,
                ignore_others: args.others == Others::Ignore,
            })?)
        }
        Format::Phenobench => Box::new(PhenoBench::open(&needed(&args.from, "--from")?)?),
        Format::Coco => {
            Box::new(Coco::open(&needed(&args.from, "--from")?, args.images.as_deref(), args.classes.as_ref())?)
        }
    })
}
