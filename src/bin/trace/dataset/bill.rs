//! What a dataset will cost: `trace dataset … --dry-run`, `trace sequence … --dry-run` and `trace dataset plan … --bill`.

use crate::growing::Line;
use furrow::cli;
use furrow::cli::signal::Signals;
use furrow::dataset::Order;
use furrow::dataset::bill::{self, Bill, Step};
use furrow::job::Threads;
use furrow::report::{count, number};
use furrow::{Result, dataset};
use std::path::{Path, PathBuf};

/// Cores of a shard, as `emit` takes them unless told otherwise.
const CORES: u32 = 8;
/// Memory that is asked of a scheduler beyond what is expected: it ends what takes more.
const SPARE: f64 = 1.25;
/// Bytes of a GiB.
const GIB: f64 = (1_u64 << 30) as f64;

/// Whether anything is made.
#[derive(clap::Args)]
pub(crate) struct DryRunArgs {
    /// Make nothing: draw three to sixteen images with fewer samples, and tell core hours, disk, files, memory and a number of shards.
    #[arg(long)]
    pub(crate) dry_run: bool,
}

/// Tells what an order will cost, or that it cannot go into its folder, where nothing is written; `quiet` shows nothing meanwhile.
pub(crate) fn run(
    folder: &Path,
    mut order: Order,
    threads: usize,
    quiet: bool,
    signals: &Signals,
) -> Result<Vec<PathBuf>> {
    cli::check_folder(folder)?;
    let threads = Threads::new(threads)?;
    let growing = Line::begin(quiet);
    order.progress.clone_from(growing.progress());
    let told = bill::bill(folder, &order, &threads, &|step| growing.say(&words(step)), signals.heed());
    growing.end();
    let (bill, warnings) = told?;
    for warning in warnings {
        furrow::tell!("warning: {warning}");
    }
    cli::print_rows(&rows(folder, &bill, threads.count()))?;
    Ok(Vec::new())
}

/// What a bill is at, in words.
fn words(step: Step) -> String {
    match step {
        Step::Image { number, least, most } if least == most => format!("drawing images, {number} of {most}"),
        Step::Image { number, least, most } if number <= least => {
            format!("drawing images, {number} of {least} to {most}")
        }
        Step::Image { number, most, .. } => format!("drawing images, {number} of {most} at most"),
        Step::Lists => "writing lists and tables".into(),
    }
}

/// The first of some images, and how many there are.
fn listed(names: &[String]) -> String {
    match names {
        [first, second, .., last] if names.len() > 3 => format!("{first}, {second}, … {last} ({} images)", names.len()),
        _ => names.join(", "),
    }
}

/// A bill in words.
fn rows(folder: &Path, bill: &Bill, threads: usize) -> Vec<[String; 2]> {
    let Bill { images, fields, core_s, grow_s, sample_s, bytes, files, .. } = *bill;
    let row = |name: &str, words: String| [name.to_owned(), words];
    let part = |seconds: f64| format!("{:.0} %", 100.0 * seconds / core_s.max(1e-9));
    let mut probes: Vec<String> = bill.probes.iter().map(|index| dataset::Set::name(*index)).collect();
    probes.sort();
    let [fewer, more] = bill.spp;
    let samples = if fewer == more { more.to_string() } else { format!("{fewer} and {more}") };
    let with = count(threads as u64, "thread", "threads");
    let of_fields = if fields < images { format!(" of {}", count(fields, "field", "fields")) } else { String::new() };
    let memory = (bill.memory(CORES as usize) as f64 * SPARE / GIB).ceil().max(1.0);
    vec![
        row("from", format!("{} with {samples} samples a pixel", listed(&probes))),
        row(
            "core hours",
            format!(
                "{} ({} core seconds: {} drawing, {} growing, {} labels and files)",
                number(core_s / 3600.0),
                number(core_s),
                part(sample_s),
                part(grow_s),
                part(core_s - sample_s - grow_s)
            ),
        ),
        row("here", format!("{} hours with {with}", number(core_s / 3600.0 / threads as f64))),
        row("disk", format!("{} GB ({} MB)", number(bytes as f64 / 1e9), number(bytes as f64 / 1e6))),
        row("files", format!("{} ({}{of_fields})", number(files as f64), count(images, "image", "images"))),
        row(
            "memory",
            format!(
                "{} GiB with one image under way, {} GiB with {}",
                number(bill.memory(1) as f64 / GIB),
                number(bill.memory(threads) as f64 / GIB),
                count(threads as u64, "core", "cores")
            ),
        ),
        row(
            "shards",
            format!(
                "trace dataset emit {} --scheduler slurm --shards {} --cpus {CORES} --memory {memory:.0}: about {} hours each",
                folder.display(),
                bill.shards(CORES),
                number(core_s / 3600.0 / f64::from(CORES) / bill.shards(CORES) as f64)
            ),
        ),
    ]
}
