//! `trace sequence`: renders all images of a drive through one or several fields, or of several days, as a dataset.

use crate::dataset::cost_estimate::{self, DryRunArgs};
use crate::dataset::order::{ContentArgs, RenderingArgs, begin, formats};
use crate::dataset::render::{WorkArgs, generate};
use crate::field::{MemoryArgs, SceneArgs};
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use furrow_cli::cli::signal::Signals;
use furrow_dataset::format;
use furrow_dataset::make::finish;
use furrow_dataset::make::generate::Shard;
use furrow_dataset::make::plan::Order;
use furrow_field::days::DaysDesc;
use furrow_job::SceneFile;
use std::path::PathBuf;

/// Drives to render, and dataset options.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    /// Days on which all images are rendered, instead of the scene file's: `8..40/4` for every fourth from 8 to 40, or
    /// `8,12,20`. They count from the emergence of the first crop.
    #[arg(long, value_name = "DAYS", value_parser = days)]
    days: Option<Days>,
    /// Number of fields, starting with index 0.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    fields: u64,
    /// Folder of the dataset.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Formats to write in addition to the native one, separated by commas. Default: colmap, flow, mots, nerf and tum,
    /// except those that would be empty: colmap, flow and nerf if a field has one image per day, colmap and nerf with
    /// --labels-only.
    #[arg(long, value_delimiter = ',', value_name = "FORMAT", value_parser = formats())]
    format: Vec<String>,
    #[command(flatten)]
    content: ContentArgs,
    #[command(flatten)]
    look: RenderingArgs,
    #[command(flatten)]
    memory: MemoryArgs,
    #[command(flatten)]
    work: WorkArgs,
    #[command(flatten)]
    dry: DryRunArgs,
}

/// Default formats of a sequence, each with a flag whether it needs several images of one day.
const USUAL: [(&str, bool); 5] = [("colmap", true), ("flow", true), ("mots", false), ("nerf", true), ("tum", false)];

/// Returns those of [`USUAL`] that would not be empty, for fields with `captures` images each on `days` days.
fn usual_formats(captures: u64, days: usize, labels_only: bool) -> Vec<String> {
    let a_day = captures / days.max(1).to_u64();
    let tells = |(name, of_one_day): &(&str, bool)| {
        let images = if *of_one_day { a_day } else { captures };
        images > 1 && !(labels_only && format::named(name).is_some_and(format::Format::needs_photograph))
    };
    USUAL.into_iter().filter(tells).map(|(name, _)| name.to_owned()).collect()
}

/// Days in ascending order.
#[derive(Clone)]
struct Days(Vec<u32>);

fn days(text: &str) -> Result<Days, String> {
    DaysDesc::read(text).map(Days).map_err(|e| e.to_string())
}

/// Renders what is missing of the dataset, or estimates its cost.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    args.scene.check()?;
    let days = args.days.as_ref().map_or(&[][..], |days| &days.0);
    let scene = SceneFile::open(args.scene.path())?.assign(&args.scene.set.values)?.days(days);
    let captures = scene.captures();
    if captures == 1 && scene.seen_days().is_empty() {
        return Err(Error::input("it renders one image of each field, which is not a sequence")
            .help("add `drive: (frames: 20, path: AlongRows())` to it, further `cameras`, or days with --days 8..40/4; see: trace explain drive")
            .in_file(args.scene.path()));
    }
    let mut order = Order::new(args.scene.path(), args.fields * captures * args.look.lights);
    (order.seed, order.width, order.height) = (args.scene.seed, args.scene.width, args.scene.height);
    order.days = days.to_vec();
    order.assigned.clone_from(&args.scene.set.values);
    order.memory = args.memory.bytes;
    order.formats = if args.format.is_empty() {
        usual_formats(captures, scene.seen_days().len(), args.look.labels_only)
    } else {
        args.format.clone()
    };
    order.formats.sort();
    order.formats.dedup();
    order.options = args.look.options();
    order.labels_only = args.look.labels_only;
    order.lights = args.look.lights;
    args.content.enter(&mut order)?;
    if args.dry.dry_run {
        return cost_estimate::run(&args.out, order, args.work.threads, args.work.quiet, args.dry.price, signals);
    }
    let set = begin(&args.out, order, args.work.quiet, signals)?;
    generate(&set, &args.work, Shard::ALL, args.memory.bytes, signals)?;
    finish::finish(&set, None)
}
