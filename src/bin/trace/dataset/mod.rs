//! `trace dataset`: renders many fields with all labels, in the formats of other tools.

pub(crate) mod cost_estimate;
mod diff;
mod emit;
mod finish;
mod import;
pub(crate) mod order;
pub(crate) mod progress;
pub(crate) mod render;
mod status;
mod verify;

use crate::profile::ProfileArgs;
use crate::quality::threads;
use clap::{Parser, Subcommand};
use furrow_base::{Error, Result};
use furrow_cli::cli::signal::Signals;
use furrow_dataset::make::generate::Work;
use std::path::PathBuf;

/// Creates or continues a dataset of a scene file: `plan`, `render` and `finish` in one command.
///
/// Image k is field k of the scene file, and its bytes depend on nothing else. Repeating the command after a stop,
/// crash or damage renders what is missing and gives the same files.
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
  trace dataset --scene scenes/synthetic-d.ron --count 1300 --out data/d --spp 32 --dry-run   estimate the cost, render nothing
  trace dataset status data/d --watch                   progress, updated every five seconds
  trace dataset verify data/d --rerender 5              check hashes and invariants, render five images again
  trace dataset finish data/d --format yolo             add a format for the same images
  trace dataset import --format masks --images real/images --masks real/labels --out data/real

On several machines with a shared folder:
  trace dataset plan --scene scenes/synthetic-d.ron --count 100000 --out data/d --spp 32
  trace dataset render data/d --shard 0/64              … to 63/64, on any machine, in any order, repeated as needed
  trace dataset finish data/d
  trace dataset emit data/d --scheduler slurm --shards 64  job files for the last two, for `bash data/d/jobs/submit.sh`";

#[derive(Subcommand)]
enum Verb {
    /// Create a dataset: check the scene file, copy all files it reads into the folder, write the recipe.
    Plan(PlanArgs),
    /// Render the missing images of a shard.
    Render(render::Args),
    /// Write the dataset-wide files: lists of the formats, manifest, report.
    Finish(finish::Args),
    /// Import images and labels from other sources: masks, PhenoBench, COCO.
    Import(Box<import::Args>),
    /// Show the progress of a dataset: images done, rate, time left, slow and failed images, by shard.
    Status(status::Args),
    /// Check every file and every label, and render some images again.
    Verify(verify::Args),
    /// Print what differs between two datasets: values of recipes and scene files, and the files that these read.
    Diff(diff::Args),
    /// Write job files for a cluster: Slurm, Kubernetes, or GNU parallel.
    Emit(emit::Args),
}

#[derive(clap::Args)]
struct PlanArgs {
    #[command(flatten)]
    order: order::Args,
    /// Create nothing: render three to sixteen probe images with fewer samples, and estimate core hours, disk, files,
    /// memory and a number of shards.
    #[arg(long, alias = "bill")]
    estimate: bool,
    #[command(flatten)]
    price: cost_estimate::PriceArgs,
    /// Number of threads; 0 for one per core. The files do not depend on it.
    #[arg(long, default_value_t = 0, value_parser = threads)]
    threads: usize,
    /// Print nothing but errors, warnings and the results.
    #[arg(long)]
    quiet: bool,
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
    dry: cost_estimate::DryRunArgs,
    #[command(flatten)]
    profile: ProfileArgs,
}

/// Runs a dataset command. Returns the paths of the main files.
pub(crate) fn run(cli: &Cli, signals: &Signals) -> Result<Vec<PathBuf>> {
    match &cli.verb {
        Some(Verb::Plan(PlanArgs { order, estimate: true, price, threads, quiet })) => {
            cost_estimate::run(order.images.folder(), order.order()?, *threads, *quiet, *price, signals)
        }
        Some(Verb::Plan(PlanArgs { order, estimate: false, threads, quiet, .. })) => {
            let set = furrow_job::Threads::new(*threads)?.install(|| order::run(order, *quiet, signals))?;
            order::print_plants(&set, *quiet)?;
            Ok(vec![set.folder.join(furrow_dataset::model::recipe::FILE)])
        }
        Some(Verb::Render(args)) => render::run(args, signals),
        Some(Verb::Finish(args)) => finish::run(args, signals),
        Some(Verb::Import(args)) => import::run(args, signals),
        Some(Verb::Status(args)) => status::run(args, signals),
        Some(Verb::Verify(args)) => verify::run(args, signals),
        Some(Verb::Diff(args)) => diff::run(args),
        Some(Verb::Emit(args)) => emit::run(args),
        None if cli.make.dry.dry_run && cli.make.profile.profile => {
            Err(Error::misuse("--profile has no effect with --dry-run").help("leave one of them out"))
        }
        None if cli.make.dry.dry_run => {
            let MakeArgs { order, work, dry, .. } = &cli.make;
            cost_estimate::run(order.images.folder(), order.order()?, work.threads, work.quiet, dry.price, signals)
        }
        None => {
            let profiler = cli.make.profile.profiler();
            let push = cli.make.push.push_from_here()?;
            let set = order::run(&cli.make.order, cli.make.work.quiet, signals)?;
            order::print_plants(&set, cli.make.work.quiet)?;
            let memory = cli.make.order.images.memory.bytes;
            let all = furrow_dataset::make::generate::Shard::ALL;
            let work = cli.make.work.of(all, memory);
            let work = Work { push: push.as_ref(), profiler: Some(&profiler).filter(|p| p.is_on()), ..work };
            render::generate_in(&set, None, &work, cli.make.work.quiet, signals)?;
            if cli.make.push.frees() {
                furrow_cli::message!(
                    "all images are pushed: run `trace dataset finish` in the folder that they were pushed to"
                );
                return Ok(Vec::new());
            }
            let files = furrow_job::Threads::new(cli.make.work.threads)?.install(|| {
                let files = furrow_dataset::make::finish::finish(&set, None)?;
                if !cli.make.work.quiet {
                    finish::print_left_out(&set)?;
                }
                Ok::<_, Error>(files)
            })?;
            if let Some(push) = &push {
                let (soon, now) = signals.catch_graceful();
                furrow_dataset::make::push::whole(&set, push, furrow_dataset::make::push::Stop { soon, now })?;
            }
            Ok(files)
        }
    }
}
