//! Definition of a dataset: `trace dataset plan`.

use crate::field::{MemoryArgs, SceneArgs};
use crate::growing::Line;
use crate::quality::{TechniqueArgs, samples};
use furrow_base::{Error, Result};
use furrow_cli::cli;
use furrow_cli::cli::signal::Signals;
use furrow_dataset::make::plan::{self, Order};
use furrow_dataset::model::classes::Classes;
use furrow_dataset::model::image_format::ImageFormat;
use furrow_dataset::model::labelling::Labelling;
use furrow_dataset::model::optional_maps::{self, OmittableMap, OptionalMap};
use furrow_dataset::model::split::Shares;
use furrow_dataset::read::packs;
use furrow_dataset::{Set, format};
use furrow_field::ablation::{Edit, FULL};
use furrow_render::settings::{Quality, RenderOptions};
use std::path::{Path, PathBuf};

/// Dataset options.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    pub(crate) images: ImageArgs,
    /// Apply one edit to every field, by name; `trace ablate --list` lists them.
    #[arg(long, value_name = "NAME")]
    edit: Option<String>,
    /// Put N images into each tar archive (WebDataset) instead of a folder per image; also converts an existing dataset
    /// with folders.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=packs::MOST))]
    pack: Option<u64>,
}

/// Images of a dataset, and their form.
#[derive(clap::Args)]
pub(crate) struct ImageArgs {
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    pub(crate) memory: MemoryArgs,
    /// Number of images. A dataset can be extended later.
    #[arg(long, value_name = "N", required = true, value_parser = clap::value_parser!(u64).range(1..=furrow_dataset::MOST_IMAGES))]
    count: Option<u64>,
    /// Folder of the dataset.
    #[arg(long, value_name = "DIR", required = true)]
    out: Option<PathBuf>,
    /// Formats to write in addition to the native one, separated by commas.
    #[arg(long, value_delimiter = ',', value_name = "FORMAT", value_parser = formats())]
    format: Vec<String>,
    #[command(flatten)]
    labels: LabelArgs,
    #[command(flatten)]
    content: ContentArgs,
    /// Licence of the images, such as CC-BY-4.0; recorded in the manifest.
    #[arg(long, value_name = "TEXT", default_value = Order::NO_LICENCE)]
    licence: String,
    #[command(flatten)]
    look: RenderingArgs,
}

/// Files of an image.
#[derive(clap::Args)]
pub(crate) struct ContentArgs {
    /// Maps to keep in addition to image, labels and record, separated by commas; `none` for no others. If label maps
    /// or rgb are named, those not named are left out: `--keep rgb,semantics` keeps nothing else. Records still
    /// describe them, so every format can still be written.
    #[arg(long, value_delimiter = ',', value_name = "MAP", default_value = "nir,coverage,depth", value_parser = maps())]
    keep: Vec<String>,
    /// Format of the colour images: png, or jpeg with a quality from 50 to 100, such as jpeg95, without chroma
    /// subsampling.
    #[arg(long, alias = "photo", value_name = "png|jpegQ", default_value_t = ImageFormat::Png, value_parser = ImageFormat::parse)]
    image_format: ImageFormat,
    /// Proportions of train, val and test.
    #[arg(long, value_name = "TRAIN,VAL,TEST", default_value = "8,1,1", value_parser = Shares::parse)]
    split: Shares,
}

/// How images are rendered.
#[derive(clap::Args)]
pub(crate) struct RenderingArgs {
    /// Samples per pixel. Default: 64, or 4 with --quality dataset.
    #[arg(long, value_parser = samples())]
    spp: Option<u32>,
    /// Write labels and records of the same fields, without images. No light or sensor is simulated; --keep accepts
    /// only depth, normals and label maps, name depth and normals explicitly: --keep depth,normals.
    #[arg(long, conflicts_with_all = ["spp", "denoise", "engine", "without", "preset", "max_depth", "clamp"])]
    pub(crate) labels_only: bool,
    /// Denoise the images; needs Open Image Denoise.
    #[arg(long)]
    denoise: bool,
    /// Render each view of a field under N lights: its own, and N - 1 for which lights, exposure and sensor are drawn anew
    /// from the scene file. The field is built once, and its labels are the same. Images count one by one, so --count 40
    /// --relight 8 renders 5 fields.
    #[arg(long = "relight", value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=MOST_RELIT))]
    pub(crate) lights: u64,
    #[command(flatten)]
    technique: TechniqueArgs,
}

/// Largest number of lights of a view.
const MOST_RELIT: u64 = 1000;

/// Labels in the formats.
#[derive(clap::Args)]
pub(crate) struct LabelArgs {
    /// Classes of the formats, such as `soil; beet=BEAVX; fat hen=CHEAL; weed; ignore=stone`: names with their labels.
    /// A label is soil, crop, weed, a species by any of its names, an organ, or an object on the ground; the most
    /// specific one decides. Pixels without a class, and those of the class ignore, have no label.
    #[arg(long, value_name = "CLASSES", value_parser = Classes::parse)]
    classes: Option<Classes>,
    /// Leave plants and leaves with fewer pixels out of the formats' lists.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    min_pixels: Option<u32>,
    /// Leave out plants and leaves whose visible fraction is smaller: visible pixels relative to the whole, including
    /// occluded parts and parts outside the frame.
    #[arg(long, value_name = "SHARE", value_parser = share)]
    min_visible: Option<f64>,
}

/// Parses a fraction from 0 to 1.
fn share(text: &str) -> std::result::Result<f64, String> {
    let share = text.trim().parse().ok().filter(|share| (0.0..=1.0).contains(share));
    share.ok_or_else(|| "write a fraction from 0 to 1, such as 0.2".into())
}

impl LabelArgs {
    /// Returns the selected labelling.
    pub(crate) fn labelling(&self) -> Labelling {
        let Self { classes, min_pixels, min_visible } = self;
        Labelling { classes: classes.clone(), min_pixels: *min_pixels, min_visible: *min_visible }
    }
}

/// Names of the maps that can be kept, with descriptions.
fn maps() -> clap::builder::PossibleValuesParser {
    let value = |(name, _, words): &(&'static str, OptionalMap, &'static str)| {
        clap::builder::PossibleValue::new(*name).help(*words)
    };
    let none = clap::builder::PossibleValue::new("none").help("no other maps");
    let label = |(name, words): (&'static str, &'static str)| clap::builder::PossibleValue::new(name).help(words);
    let labels =
        OmittableMap::NEVER.into_iter().chain(OmittableMap::NAMED.map(|(name, _, words)| (name, words))).map(label);
    clap::builder::PossibleValuesParser::new(OptionalMap::NAMED.iter().map(value).chain([none]).chain(labels))
}

/// Names of the formats, with descriptions.
pub(crate) fn formats() -> clap::builder::PossibleValuesParser {
    let value = |(name, words): &(&'static str, &'static str)| clap::builder::PossibleValue::new(*name).help(*words);
    clap::builder::PossibleValuesParser::new(format::NAMES.iter().map(value))
}

impl Args {
    /// Returns the order of the dataset.
    pub(crate) fn order(&self) -> Result<Order> {
        let order = self.images.order(self.edit.as_deref().map_or(Ok(&FULL), Edit::named)?)?;
        Ok(Order { pack: self.pack, ..order })
    }
}

/// Creates the dataset, or opens it if it exists. `quiet` hides the progress.
pub(crate) fn run(args: &Args, quiet: bool, signals: &Signals) -> Result<Set> {
    begin(args.images.folder(), args.order()?, quiet, signals)
}

/// Prints how many plants the images are expected to show. With `quiet`, only warnings are printed.
pub(super) fn print_plants(set: &Set, quiet: bool) -> Result<()> {
    let fields = set.recipe.count.div_ceil(set.recipe.captures());
    match furrow_dataset::make::render::scene_file(set)?.plants_in_view(fields) {
        Some(plants) if plants.warning().is_some() || !quiet => furrow_cli::message!("{}", plants.message()),
        _ => {}
    }
    Ok(())
}

/// Creates a dataset, or opens it if it exists. `quiet` hides the progress. A signal interrupts it while the first
/// field is built.
pub(crate) fn begin(folder: &Path, mut order: Order, quiet: bool, signals: &Signals) -> Result<Set> {
    cli::check_folder(folder)?;
    let growing = Line::begin(quiet);
    order.progress.clone_from(growing.progress());
    let planned = plan::plan(folder, &order, signals.catch());
    growing.end();
    let (set, warnings) = planned?;
    for warning in warnings {
        furrow_cli::message!("warning: {warning}");
    }
    Ok(set)
}

impl RenderingArgs {
    /// Rendering options without an edit.
    pub(crate) fn options(&self) -> RenderOptions {
        let spp = if self.labels_only { 1 } else { self.technique.spp(self.spp) };
        self.technique.options(Quality { denoise: self.denoise, ..Quality::spp(spp) })
    }
}

impl ContentArgs {
    /// Enters these options into an order.
    pub(crate) fn enter(&self, order: &mut Order) -> Result<()> {
        if order.labels_only && self.keep.iter().any(|name| name == "rgb") {
            return Err(Error::misuse("--keep rgb needs images, and --labels-only renders none")
                .help("leave one of them out; semantics can be kept on its own"));
        }
        (order.keep, order.omit) = optional_maps::parse(&self.keep)?;
        (order.image_format, order.split) = (self.image_format, self.split);
        Ok(())
    }
}

impl ImageArgs {
    /// Folder of the dataset.
    pub(crate) fn folder(&self) -> &Path {
        self.out.as_deref().unwrap_or(Path::new(""))
    }

    /// Rendering options without an edit.
    pub(crate) fn options(&self) -> RenderOptions {
        self.look.options()
    }

    /// Returns the order of these images with an edit.
    pub(crate) fn order(&self, edit: &'static Edit) -> Result<Order> {
        self.scene.check()?;
        let mut formats = self.format.clone();
        formats.sort();
        formats.dedup();
        let mut order = Order {
            assigned: self.scene.set.values.clone(),
            seed: self.scene.seed,
            width: self.scene.width,
            height: self.scene.height,
            formats,
            labelling: self.labels.labelling(),
            licence: self.licence.clone(),
            options: self.options(),
            labels_only: self.look.labels_only,
            lights: self.look.lights,
            edit,
            memory: self.memory.bytes,
            ..Order::new(self.scene.path(), self.count.unwrap_or(0))
        };
        self.content.enter(&mut order)?;
        Ok(order)
    }
}
