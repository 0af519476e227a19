//! `trace sequence`: all images of a drive through one field or several, or of their days, as a dataset.

use crate::dataset::bill::{self, DryRunArgs};
use crate::dataset::order::{ContentArgs, LookArgs, begin, formats};
use crate::dataset::render::{WorkArgs, generate};
use crate::field::{MemoryArgs, SceneArgs};
use furrow::cli::signal::Signals;
use furrow::dataset::finish;
use furrow::dataset::generate::Shard;
use furrow::dataset::plan::Order;
use furrow::job::SceneFile;
use furrow::scene::days::DaysDesc;
use furrow::{Error, Result};
use std::path::PathBuf;

/// Which drives, and how they are written.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    /// Days on which all images are taken, instead of the scene file's: `8..40/4` for every fourth from 8 to 40, `8,12,20` one by one. They
    /// count from the emergence of the first crop.
    #[arg(long, value_name = "DAYS", value_parser = days)]
    days: Option<Days>,
    /// How many fields are seen, from number 0.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    fields: u64,
    /// Folder of the dataset.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Formats to write beside the native one, separated by commas.
    #[arg(long, value_delimiter = ',', value_name = "FORMAT", default_value = "colmap,flow,mots,nerf,tum", value_parser = formats())]
    format: Vec<String>,
    #[command(flatten)]
    content: ContentArgs,
    #[command(flatten)]
    look: LookArgs,
    #[command(flatten)]
    memory: MemoryArgs,
    #[command(flatten)]
    work: WorkArgs,
    #[command(flatten)]
    dry: DryRunArgs,
}

/// Days, in order.
#[derive(Clone)]
struct Days(Vec<u32>);

fn days(text: &str) -> Result<Days, String> {
    DaysDesc::read(text).map(Days).map_err(|e| e.to_string())
}

/// Makes what is missing of the dataset, or tells what it will cost.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    args.scene.check()?;
    let days = args.days.as_ref().map_or(&[][..], |days| &days.0);
    let scene = SceneFile::open(args.scene.path())?.days(days);
    let captures = scene.captures();
    if captures == 1 && scene.seen_days().is_empty() {
        return Err(Error::input("it takes one image of each field, which is no sequence")
            .help("add `drive: (frames: 20, path: AlongRows())` to it, further `cameras`, or days with --days 8..40/4; see: trace explain drive")
            .in_file(args.scene.path()));
    }
    let mut order = Order::new(args.scene.path(), args.fields * captures);
    (order.seed, order.width, order.height) = (args.scene.seed, args.scene.width, args.scene.height);
    order.days = days.to_vec();
    order.memory = args.memory.bytes;
    order.formats.clone_from(&args.format);
    order.formats.sort();
    order.formats.dedup();
    order.options = args.look.options();
    order.labels_only = args.look.labels_only;
    args.content.enter(&mut order)?;
    if args.dry.dry_run {
        return bill::run(&args.out, order, args.work.threads, args.work.quiet, signals);
    }
    let set = begin(&args.out, order, args.work.quiet, signals)?;
    generate(&set, &args.work, Shard::ALL, args.memory.bytes, signals)?;
    finish::finish(&set, None)
}
