//! What dataset: `trace dataset plan`.

use crate::field::{MemoryArgs, SceneArgs};
use crate::growing::Line;
use crate::quality::{TechniqueArgs, samples};
use furrow::ablation::{Edit, FULL};
use furrow::cli::signal::Signals;
use furrow::dataset::classes::Classes;
use furrow::dataset::keep::{self, Kept, Omitted};
use furrow::dataset::labelling::Labelling;
use furrow::dataset::photo::Photo;
use furrow::dataset::plan::{self, Order};
use furrow::dataset::split::Shares;
use furrow::dataset::{self, Set, format, pack};
use furrow::settings::{Quality, RenderOptions};
use furrow::{Error, Result, cli};
use std::path::{Path, PathBuf};

/// What is made.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    pub(crate) images: ImageArgs,
    /// Change one thing of every field, by its name; `trace ablate --list` tells them.
    #[arg(long, value_name = "NAME")]
    edit: Option<String>,
    /// Put so many images into a tar archive (WebDataset) instead of a folder each; also those of a dataset that has folders.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=pack::MOST))]
    pack: Option<u64>,
}

/// Which images, in what form.
#[derive(clap::Args)]
pub(crate) struct ImageArgs {
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    pub(crate) memory: MemoryArgs,
    /// How many images. A dataset may get longer later.
    #[arg(long, value_name = "N", required = true, value_parser = clap::value_parser!(u64).range(1..=dataset::MOST_IMAGES))]
    count: Option<u64>,
    /// Folder of the dataset.
    #[arg(long, value_name = "DIR", required = true)]
    out: Option<PathBuf>,
    /// Formats to write beside the native one, separated by commas.
    #[arg(long, value_delimiter = ',', value_name = "FORMAT", value_parser = formats())]
    format: Vec<String>,
    #[command(flatten)]
    labels: LabelArgs,
    #[command(flatten)]
    content: ContentArgs,
    /// What others may do with the images, such as CC-BY-4.0; stands in the manifest.
    #[arg(long, value_name = "TEXT", default_value = Order::NO_LICENCE)]
    licence: String,
    #[command(flatten)]
    look: LookArgs,
}

/// What an image is given.
#[derive(clap::Args)]
pub(crate) struct ContentArgs {
    /// Maps to keep beside photograph, labels and record, separated by commas; none for nothing more. Where label maps are named, or
    /// rgb, those that are not named are left out: `--keep rgb,semantics` keeps nothing else. Records tell them all the same, so every
    /// format can still be made.
    #[arg(long, value_delimiter = ',', value_name = "MAP", default_value = "nir,coverage,depth", value_parser = maps())]
    keep: Vec<String>,
    /// How photographs are stored: png, or jpeg with a quality from 50 to 100, such as jpeg95, whose colours are not subsampled.
    #[arg(long, value_name = "png|jpegQ", default_value_t = Photo::Png, value_parser = Photo::parse)]
    photo: Photo,
    /// Shares of train, val and test.
    #[arg(long, value_name = "TRAIN,VAL,TEST", default_value = "8,1,1", value_parser = Shares::parse)]
    split: Shares,
}

/// How photographs are rendered.
#[derive(clap::Args)]
pub(crate) struct LookArgs {
    /// Samples a pixel.
    #[arg(long, default_value_t = Quality::SPP, value_parser = samples())]
    spp: u32,
    /// Draw no photographs: labels and records alone, of the same fields. Nothing is lit, and no sensor is asked; of --keep only depth,
    /// normals and label maps can be had, depth and normals where they are named.
    #[arg(long, conflicts_with_all = ["spp", "denoise", "engine", "without", "max_depth", "clamp"])]
    pub(crate) labels_only: bool,
    /// Take the noise of few samples out of the photographs; needs Open Image Denoise.
    #[arg(long)]
    denoise: bool,
    #[command(flatten)]
    technique: TechniqueArgs,
}

/// How formats label what images show.
#[derive(clap::Args)]
pub(crate) struct LabelArgs {
    /// Classes of the formats, such as `soil; beet=BEAVX; fat hen=CHEAL; weed; ignore=stone`: names with their labels. A label is soil,
    /// crop, weed, a species by name or EPPO code, an organ, or a thing on the ground; the most particular decides. Pixels of no
    /// class, and those of one named ignore, have no label.
    #[arg(long, value_name = "CLASSES", value_parser = Classes::parse)]
    classes: Option<Classes>,
    /// Leave plants and leaves of fewer pixels out of the formats' lists.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    min_pixels: Option<u32>,
    /// Leave those out of which less is shown: share of all of it, with what others hide and what lies beyond the frame.
    #[arg(long, value_name = "SHARE", value_parser = share)]
    min_visible: Option<f64>,
}

/// A share from 0 to 1.
fn share(text: &str) -> std::result::Result<f64, String> {
    let share = text.trim().parse().ok().filter(|share| (0.0..=1.0).contains(share));
    share.ok_or_else(|| "it is a share: a number from 0 to 1, such as 0.2".into())
}

impl LabelArgs {
    /// What they ask for.
    pub(crate) fn labelling(&self) -> Labelling {
        let Self { classes, min_pixels, min_visible } = self;
        Labelling { classes: classes.clone(), min_pixels: *min_pixels, min_visible: *min_visible }
    }
}

/// The names of the maps that may be kept, with what they are.
fn maps() -> clap::builder::PossibleValuesParser {
    let value =
        |(name, _, words): &(&'static str, Kept, &'static str)| clap::builder::PossibleValue::new(*name).help(*words);
    let none = clap::builder::PossibleValue::new("none").help("nothing more");
    let label = |(name, words): (&'static str, &'static str)| clap::builder::PossibleValue::new(name).help(words);
    let labels = Omitted::NEVER.into_iter().chain(Omitted::NAMED.map(|(name, _, words)| (name, words))).map(label);
    clap::builder::PossibleValuesParser::new(Kept::NAMED.iter().map(value).chain([none]).chain(labels))
}

/// The names of the formats, with what they are.
pub(crate) fn formats() -> clap::builder::PossibleValuesParser {
    let value = |(name, words): &(&'static str, &'static str)| clap::builder::PossibleValue::new(*name).help(*words);
    clap::builder::PossibleValuesParser::new(format::NAMES.iter().map(value))
}

impl Args {
    /// The dataset that is asked for.
    pub(crate) fn order(&self) -> Result<Order> {
        let order = self.images.order(self.edit.as_deref().map_or(Ok(&FULL), Edit::named)?)?;
        Ok(Order { pack: self.pack, ..order })
    }
}

/// Begins the dataset, or finds it begun; `quiet` shows nothing meanwhile.
pub(crate) fn run(args: &Args, quiet: bool, signals: &Signals) -> Result<Set> {
    begin(args.images.folder(), args.order()?, quiet, signals)
}

/// Tells how many plants images are to be expected to show; `quiet` leaves only warnings.
pub(super) fn tell_plants(set: &Set, quiet: bool) -> Result<()> {
    match dataset::render::scene_file(set)?.plants_in_view(set.recipe.count) {
        Some(plants) if plants.warning().is_some() || !quiet => furrow::tell!("{}", plants.told()),
        _ => {}
    }
    Ok(())
}

/// Begins a dataset, or finds it begun; `quiet` shows nothing meanwhile. A signal ends it while the first field grows.
pub(crate) fn begin(folder: &Path, mut order: Order, quiet: bool, signals: &Signals) -> Result<Set> {
    cli::check_folder(folder)?;
    let growing = Line::begin(quiet);
    order.progress.clone_from(growing.progress());
    let planned = plan::plan(folder, &order, signals.heed());
    growing.end();
    let (set, warnings) = planned?;
    for warning in warnings {
        furrow::tell!("warning: {warning}");
    }
    Ok(set)
}

impl LookArgs {
    /// How images are rendered without an edit.
    pub(crate) fn options(&self) -> RenderOptions {
        let spp = if self.labels_only { 1 } else { self.spp };
        self.technique.options(Quality { denoise: self.denoise, ..Quality::spp(spp) })
    }
}

impl ContentArgs {
    /// Enters what is asked for into an order.
    pub(crate) fn enter(&self, order: &mut Order) -> Result<()> {
        if order.labels_only && self.keep.iter().any(|name| name == "rgb") {
            return Err(Error::misuse("--keep rgb is a photograph, and --labels-only draws none")
                .help("leave one of them out; semantics can be kept alone"));
        }
        (order.keep, order.omit) = keep::asked(&self.keep)?;
        (order.photo, order.split) = (self.photo, self.split);
        Ok(())
    }
}

impl ImageArgs {
    /// Where they go.
    pub(crate) fn folder(&self) -> &Path {
        self.out.as_deref().unwrap_or(Path::new(""))
    }

    /// How the images are rendered without an edit.
    pub(crate) fn options(&self) -> RenderOptions {
        self.look.options()
    }

    /// A dataset of these images as an edit has them.
    pub(crate) fn order(&self, edit: &'static Edit) -> Result<Order> {
        self.scene.check()?;
        let mut formats = self.format.clone();
        formats.sort();
        formats.dedup();
        let mut order = Order {
            seed: self.scene.seed,
            width: self.scene.width,
            height: self.scene.height,
            formats,
            labelling: self.labels.labelling(),
            licence: self.licence.clone(),
            options: self.options(),
            labels_only: self.look.labels_only,
            edit,
            memory: self.memory.bytes,
            ..Order::new(self.scene.path(), self.count.unwrap_or(0))
        };
        self.content.enter(&mut order)?;
        Ok(order)
    }
}
