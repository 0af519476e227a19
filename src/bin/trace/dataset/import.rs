//! Import of other data: `trace dataset import`.

use super::progress::Progress;
use crate::quality::threads;
use clap::ValueEnum;
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use furrow_cli::cli;
use furrow_cli::cli::signal::Signals;
use furrow_dataset::import::classes::{Colors, Meaning, Names};
use furrow_dataset::import::coco::{Coco, Crowds};
use furrow_dataset::import::masks::{Coding, Folders, Masks};
use furrow_dataset::import::phenobench::PhenoBench;
use furrow_dataset::import::{self, ImportSettings, Source};
use furrow_dataset::make::finish;
use furrow_dataset::model::split::Shares;
use furrow_render::render;
use std::path::PathBuf;
use std::time::Instant;

/// Source, and target dataset.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Format of the source.
    #[arg(long, value_enum)]
    format: Format,
    /// Folder of the new dataset.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Source. For phenobench: the folder with train/ and val/. For coco: a JSON file of instances, or the folder with
    /// annotations/.
    #[arg(long, value_name = "PATH")]
    from: Option<PathBuf>,
    /// Folder of the images (masks, coco). Subfolders train/, val/ and test/ become the splits.
    #[arg(long, value_name = "DIR")]
    images: Option<PathBuf>,
    /// Folder of the masks: PNG files with the names of the images (masks).
    #[arg(long, value_name = "DIR")]
    masks: Option<PathBuf>,
    /// Folder of near-infrared images with the names of the images (masks).
    #[arg(long, value_name = "DIR")]
    nir: Option<PathBuf>,
    /// Suffix of image names that mask names do not have, such as _rgb.
    #[arg(long, value_name = "TEXT", default_value = "")]
    image_suffix: String,
    /// Suffix of mask names, such as _mask.
    #[arg(long, value_name = "TEXT", default_value = "")]
    mask_suffix: String,
    /// Suffix of near-infrared image names.
    #[arg(long, value_name = "TEXT", default_value = "")]
    nir_suffix: String,
    /// Meaning of the numbers in masks or of the categories in coco: soil, crop, weed, ignore, or leaf (coco). Default for
    /// masks: 0=soil,1=crop,2=weed,255=ignore; for coco: categories with these names.
    #[arg(long, value_name = "NAME=CLASS,…", value_parser = Names::parse)]
    classes: Option<Names>,
    /// Meaning of the colours in masks.
    #[arg(long, value_name = "R,G,B=CLASS;…", value_parser = Colors::parse, conflicts_with = "classes")]
    colors: Option<Colors>,
    /// What to do with numbers and colours without a class.
    #[arg(long, value_enum, default_value_t = Others::Error)]
    others: Others,
    /// What an annotation with `iscrowd` 1 is (coco). CVAT marks masks painted with a brush so.
    #[arg(long, value_enum, default_value_t = CrowdMeaning::Class)]
    crowds: CrowdMeaning,
    /// Proportions of train, val and test, for a source without splits.
    #[arg(long, value_name = "TRAIN,VAL,TEST", default_value = "8,1,1", value_parser = Shares::parse)]
    split: Shares,
    /// Licence of the images, in their owner's words.
    #[arg(long, value_name = "TEXT", default_value = "not stated")]
    licence: String,
    /// Number of threads; 0 for one per core.
    #[arg(long, default_value_t = 0, value_parser = threads)]
    threads: usize,
    /// Print nothing but errors, warnings and the paths of the files.
    #[arg(long)]
    quiet: bool,
}

/// Format of a source.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// A folder of images, and one of masks whose numbers or colours are classes.
    Masks,
    /// PhenoBench's folders: semantics, plants and leaves.
    Phenobench,
    /// COCO instances: plants, and leaves if present.
    Coco,
}

/// Handling of unknown numbers and colours.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Others {
    /// Stop with an error that gives the position.
    Error,
    /// Assign no label.
    Ignore,
}

/// Meaning of crowds.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum CrowdMeaning {
    /// Pixels of a class without a plant.
    Class,
    /// A plant.
    Instances,
}

/// Imports the source and writes the dataset-wide files.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    cli::check_folder(&args.out)?;
    let source = source(args)?;
    for warning in source.warnings() {
        furrow_cli::message!("warning: {warning}");
    }
    let progress = Progress::new(Instant::now(), args.quiet);
    progress.expect(source.images().len().to_u64());
    let order = ImportSettings { split: args.split, licence: args.licence.clone() };
    let done = |_| progress.add();
    let stop = signals.catch();
    let pool = render::pool(args.threads)?;
    let set = pool.install(|| import::import(&args.out, source.as_ref(), &order, &done, stop))?;
    progress.finish();
    let files = finish::finish(&set, None)?;
    for warning in finish::dropped(&set)? {
        furrow_cli::message!("warning: {warning}");
    }
    Ok(files)
}

fn source(args: &Args) -> Result<Box<dyn Source>> {
    let needed = |path: &Option<PathBuf>, option: &str| {
        path.clone().ok_or_else(|| {
            Error::misuse(format!("this --format needs {option}")).help("see `trace dataset import --help`")
        })
    };
    let has_leaf = args.classes.iter().flat_map(|names| names.0.values()).any(|meaning| *meaning == Meaning::Leaf)
        || args.colors.iter().flat_map(|colors| colors.0.values()).any(|meaning| *meaning == Meaning::Leaf);
    let useless = [
        (
            args.masks.is_some() || args.nir.is_some() || args.colors.is_some(),
            args.format != Format::Masks,
            "--masks, --nir and --colors",
        ),
        (
            args.others != Others::Error
                || [&args.image_suffix, &args.mask_suffix, &args.nir_suffix].iter().any(|s| !s.is_empty()),
            args.format != Format::Masks,
            "--others, --image-suffix, --mask-suffix and --nir-suffix",
        ),
        (args.from.is_some(), args.format == Format::Masks, "--from"),
        (has_leaf, args.format == Format::Masks, "the class leaf"),
        (args.crowds != CrowdMeaning::Class, args.format != Format::Coco, "--crowds"),
        (args.images.is_some() || args.classes.is_some(), args.format == Format::Phenobench, "--images and --classes"),
    ];
    if let Some((.., options)) = useless.into_iter().find(|(given, useless, _)| *given && *useless) {
        return Err(Error::misuse(format!("without effect with this --format: {options}")).help("leave them out"));
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
            let crowds = match args.crowds {
                CrowdMeaning::Class => Crowds::Class,
                CrowdMeaning::Instances => Crowds::Instances,
            };
            let (from, images) = (needed(&args.from, "--from")?, args.images.as_deref());
            Box::new(Coco::open(&from, images, args.classes.as_ref(), crowds)?)
        }
    })
}
