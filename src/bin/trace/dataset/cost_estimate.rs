//! Cost estimate of a dataset: `trace dataset … --dry-run`, `trace sequence … --dry-run` and `trace dataset plan …
//! --estimate`.

use crate::growing::Line;
use furrow_base::Result;
use furrow_base::math::{ToFloat, ToInt};
use furrow_base::shell::quoted;
use furrow_cli::cli;
use furrow_cli::cli::signal::Signals;
use furrow_dataset::Order;
use furrow_dataset::make::cost_estimate::{self, CostEstimate, Step};
use furrow_job::Threads;
use furrow_report::{count, number};
use std::path::{Path, PathBuf};

/// Default number of cores per shard in `emit`.
const CORES: u32 = 8;
/// Safety factor on the memory requested from a scheduler, which kills jobs that exceed it.
const SPARE: f64 = 1.25;
/// Bytes per GiB.
const GIB: f64 = (1_u32 << 30) as f64;

/// Whether to render or only estimate.
#[derive(clap::Args)]
pub(crate) struct DryRunArgs {
    /// Render nothing except three to sixteen probe images with fewer samples, and estimate core hours, disk, files,
    /// memory and a number of shards.
    #[arg(long)]
    pub(crate) dry_run: bool,
    #[command(flatten)]
    pub(crate) price: PriceArgs,
}

/// Price of the computation.
#[derive(Clone, Copy, clap::Args)]
pub(crate) struct PriceArgs {
    /// Price of one core for an hour, in any currency; adds the price of the dataset to an estimate.
    #[arg(long, value_name = "PRICE", value_parser = price)]
    pub(crate) price_per_core_hour: Option<f64>,
}

fn price(text: &str) -> std::result::Result<f64, String> {
    let price = text.parse::<f64>().ok().filter(|price| (0.0..=1e6).contains(price));
    price.ok_or_else(|| "a price is a number from 0 to 1000000, such as 0.04".into())
}

/// Prints the estimated cost of an order, or an error if its folder cannot be used. Writes nothing there. `quiet` hides
/// the progress.
pub(crate) fn run(
    folder: &Path,
    mut order: Order,
    threads: usize,
    quiet: bool,
    price: PriceArgs,
    signals: &Signals,
) -> Result<Vec<PathBuf>> {
    cli::check_folder(folder)?;
    let threads = Threads::new(threads)?;
    let growing = Line::begin(quiet);
    order.progress.clone_from(growing.progress());
    let outcome =
        cost_estimate::estimate_cost(folder, &order, &threads, &|step| growing.say(&words(step)), signals.catch());
    growing.end();
    let (cost, warnings) = outcome?;
    for warning in warnings {
        furrow_cli::message!("warning: {warning}");
    }
    cli::print_rows(&rows(folder, &cost, threads.count(), price))?;
    Ok(Vec::new())
}

/// Describes the current step of an estimate.
fn words(step: Step) -> String {
    match step {
        Step::Image { number, least, most } if least == most => format!("rendering images, {number} of {most}"),
        Step::Image { number, least, most } if number <= least => {
            format!("rendering images, {number} of {least} to {most}")
        }
        Step::Image { number, most, .. } => format!("rendering images, {number} of at most {most}"),
        Step::Lists => "writing lists and tables".into(),
    }
}

/// Lists the first images and the total number.
fn listed(names: &[String]) -> String {
    match names {
        [first, second, .., last] if names.len() > 3 => format!("{first}, {second}, … {last} ({} images)", names.len()),
        _ => names.join(", "),
    }
}

/// Formats an estimate as rows of a table.
fn rows(folder: &Path, cost: &CostEstimate, threads: usize, price: PriceArgs) -> Vec<[String; 2]> {
    let CostEstimate { images, fields, core_s, grow_s, sample_s, bytes, files, .. } = *cost;
    let row = |name: &str, words: String| [name.to_owned(), words];
    let part = |seconds: f64| format!("{:.0} %", 100.0 * seconds / core_s.max(1e-9));
    let mut probes: Vec<String> = cost.probes.iter().map(|index| furrow_dataset::Set::name(*index)).collect();
    probes.sort();
    let [fewer, more] = cost.spp;
    let samples = if fewer == more { more.to_string() } else { format!("{fewer} and {more}") };
    let with = count(threads.to_u64(), "thread", "threads");
    let of_fields = if fields < images { format!(" of {}", count(fields, "field", "fields")) } else { String::new() };
    let memory = (cost.memory(CORES.to_usize()).to_f64() * SPARE / GIB).ceil().max(1.0);
    let price = price.price_per_core_hour.map(|price| {
        row("price", format!("{} in the currency of --price-per-core-hour", number(price * core_s / 3600.0)))
    });
    let shards = cost.shards(CORES);
    let mut rows = vec![
        row("from", format!("{} with {samples} samples per pixel", listed(&probes))),
        row(
            "core hours",
            format!(
                "{} ({} core seconds: {} rendering, {} building scenes, {} labels and files)",
                number(core_s / 3600.0),
                number(core_s),
                part(sample_s),
                part(grow_s),
                part(core_s - sample_s - grow_s)
            ),
        ),
        row("here", format!("{} hours with {with}", number(core_s / 3600.0 / threads.to_f64()))),
        row("disk", format!("{} GB ({} MB)", number(bytes.to_f64() / 1e9), number(bytes.to_f64() / 1e6))),
        row("files", format!("{} ({}{of_fields})", number(files.to_f64()), count(images, "image", "images"))),
        row(
            "memory",
            format!(
                "{} GiB for one image at a time, {} GiB with {}",
                number(cost.memory(1).to_f64() / GIB),
                number(cost.memory(threads).to_f64() / GIB),
                count(threads.to_u64(), "core", "cores")
            ),
        ),
        row(
            "shards",
            format!(
                "{shards} with {CORES} cores, about {} hours each",
                number(core_s / 3600.0 / f64::from(CORES) / shards.to_f64())
            ),
        ),
        row(
            "once planned",
            format!(
                "trace dataset emit {} --scheduler slurm --shards {shards} --cpus {CORES} --memory {memory:.0}",
                quoted(&folder.to_string_lossy())
            ),
        ),
    ];
    rows.splice(2..2, price);
    rows
}
