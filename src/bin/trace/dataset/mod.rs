//! `trace dataset`: many fields, with all their labels, in the formats of other tools.

pub(crate) mod bill;
mod emit;
mod finish;
mod import;
pub(crate) mod order;
pub(crate) mod progress;
pub(crate) mod render;
mod status;
mod verify;

use clap::{Parser, Subcommand};
use furrow::Result;
use furrow::cli::signal::Signals;
use std::path::PathBuf;

/// Makes a dataset from a scene file, or goes on with one: `plan`, `render` and `finish` in one go.
///
/// Image k is field k of the scene file and nothing else decides its bytes. Stopped, killed or damaged, the same command makes what is
/// missing and ends with the same files.
#[derive(Parser)]
#[command(args_conflicts_with_subcommands = true, arg_required_else_help = true, after_help = AFTER)]
pub(crate) struct Cli {
    #[command(subcommand)]
    verb: Option<Verb>,
    #[command(flatten)]
    make: MakeArgs,
}

const AFTER: &str = "\
Examples:
  trace dataset --scene scenes/synthetic-d.ron --count 1300 --out data/d --width 480 --height 360 --spp 32 --format phenobench,coco
  trace dataset --scene scenes/synthetic-d.ron --count 1300 --out data/d --spp 32 --dry-run   what it would take; nothing is made
  trace dataset status data/d --watch                   how far it is, again every five seconds
  trace dataset verify data/d --rerender 5              hashes, invariants, and five images rendered again
  trace dataset finish data/d --format yolo             a further format of the same images
  trace dataset import --format masks --images real/images --masks real/labels --out data/real

On several machines that share a folder:
  trace dataset plan --scene scenes/synthetic-d.ron --count 100000 --out data/d --spp 32
  trace dataset render data/d --shard 0/64              … to 63/64, each anywhere, in any order, as often as needed
  trace dataset finish data/d
  trace dataset emit data/d --scheduler slurm --shards 64  job files that do the last two, for `bash data/d/jobs/submit.sh`";

#[derive(Subcommand)]
enum Verb {
    /// Begin a dataset: check the scene file, take all that it reads into the folder, write the recipe.
    Plan(PlanArgs),
    /// Render the images of a shard that are missing.
    Render(render::Args),
    /// Write what belongs to all images: lists of the formats, manifest, report.
    Finish(finish::Args),
    /// Bring other people's images and labels in: masks, PhenoBench, COCO.
    Import(Box<import::Args>),
    /// Tell how far a dataset is: images done, rate, time left, slow and failed images, shard by shard.
    Status(status::Args),
    /// Check every file and every label; render some images again.
    Verify(verify::Args),
    /// Write job files for a cluster: Slurm, Kubernetes, or GNU parallel.
    Emit(emit::Args),
}

#[derive(clap::Args)]
struct PlanArgs {
    #[command(flatten)]
    order: order::Args,
    /// Begin nothing: draw three to sixteen images with fewer samples, and tell core hours, disk, files, memory and a number of shards.
    #[arg(long)]
    bill: bool,
}

#[derive(clap::Args)]
struct MakeArgs {
    #[command(flatten)]
    order: order::Args,
    #[command(flatten)]
    work: render::WorkArgs,
    #[command(flatten)]
    push: render::PushArgs,
    #[command(flatten)]
    dry: bill::DryRunArgs,
}

/// Runs a verb on datasets; returns the paths of the files that matter.
pub(crate) fn run(cli: &Cli, signals: &Signals) -> Result<Vec<PathBuf>> {
    match &cli.verb {
        Some(Verb::Plan(PlanArgs { order, bill: true })) => {
            bill::run(order.images.folder(), order.order()?, 0, false, signals)
        }
        Some(Verb::Plan(PlanArgs { order, bill: false })) => {
            let set = order::run(order, false, signals)?;
            order::tell_plants(&set, false)?;
            Ok(vec![set.folder.join(furrow::dataset::recipe::FILE)])
        }
        Some(Verb::Render(args)) => render::run(args, signals),
        Some(Verb::Finish(args)) => finish::run(args, signals),
        Some(Verb::Import(args)) => import::run(args, signals),
        Some(Verb::Status(args)) => status::run(args, signals),
        Some(Verb::Verify(args)) => verify::run(args, signals),
        Some(Verb::Emit(args)) => emit::run(args),
        None if cli.make.dry.dry_run => {
            let MakeArgs { order, work, .. } = &cli.make;
            bill::run(order.images.folder(), order.order()?, work.threads, work.quiet, signals)
        }
        None => {
            let push = cli.make.push.push()?;
            let set = order::run(&cli.make.order, cli.make.work.quiet, signals)?;
            order::tell_plants(&set, cli.make.work.quiet)?;
            let memory = cli.make.order.images.memory.bytes;
            let all = furrow::dataset::generate::Shard::ALL;
            render::generate_and_push(&set, &cli.make.work, all, memory, push.as_ref(), signals)?;
            if cli.make.push.frees() {
                furrow::tell!(
                    "all images are pushed: `trace dataset finish` is for the folder that they were pushed to"
                );
                return Ok(Vec::new());
            }
            let files = furrow::job::Threads::new(cli.make.work.threads)?.install(|| {
                let files = furrow::dataset::finish::finish(&set, None)?;
                if !cli.make.work.quiet {
                    finish::tell_left_out(&set)?;
                }
                Ok::<_, furrow::Error>(files)
            })?;
            if let Some(push) = &push {
                furrow::dataset::push::whole(&set, push, signals.heed())?;
            }
            Ok(files)
        }
    }
}
