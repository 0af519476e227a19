//! Progress of a dataset: `trace dataset status`.

mod page;
mod prometheus;

use furrow_base::math::{RoundTo, ToInt};
use furrow_base::{Error, Result};
use furrow_cli::cli;
use furrow_cli::cli::signal::Signals;
use furrow_dataset::Set;
use furrow_dataset::make::status::{FailedImage, ShardStatus, State, Status};
use furrow_output::write_atomically;
use furrow_report::{count, number};
use humantime::format_duration;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Interval between updates.
const EVERY: Duration = Duration::from_secs(5);
/// Interval of checks for signals in between.
const HEED: Duration = Duration::from_millis(50);
/// Maximum number of failed images printed as text; `--json` lists all.
const MOST_LISTED: usize = 20;

/// The dataset, and options.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the dataset.
    dir: PathBuf,
    /// Update every five seconds, until all images are done or Ctrl-C.
    #[arg(long)]
    watch: bool,
    /// Print one JSON object on one line.
    #[arg(long)]
    json: bool,
    /// Also write an HTML page with all shards and all failures. With --watch it is rewritten at every update, and
    /// reloads itself.
    #[arg(long, value_name = "FILE")]
    page: Option<PathBuf>,
    /// Also write the numbers as a text file of Prometheus metrics, such as for the textfile collector of its node
    /// exporter. With --watch it is rewritten at every update.
    #[arg(long, value_name = "FILE")]
    prometheus: Option<PathBuf>,
    /// Number of shards. Default: that of the last run.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=100_000))]
    shards: Option<u64>,
}

/// Prints the status once, or until all images are done.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    for file in [&args.page, &args.prometheus].into_iter().flatten() {
        check_outside(file, &args.dir)?;
    }
    let stop = signals.catch();
    loop {
        // The dataset may have been extended meanwhile.
        let set = Set::open(&args.dir)?;
        let status = Status::of(&set, args.shards, stop)?;
        let text = if args.json { status.json()? + "\n" } else { as_text(&set, &status) };
        if let Some(path) = &args.page {
            let again = (args.watch && !status.is_done()).then_some(EVERY.as_secs());
            write_atomically(path, page::html(&set, &status, again).as_bytes())?;
        }
        if let Some(path) = &args.prometheus {
            write_atomically(path, prometheus::metrics(&set.folder, &status).as_bytes())?;
        }
        let is_read = print(&text, args.watch && !args.json)?;
        if status.is_done() || !args.watch || !is_read {
            return Ok(Vec::new());
        }
        if let Err(stopped) = wait(stop) {
            // Final page without automatic reload.
            if let Some(path) = &args.page {
                write_atomically(path, page::html(&set, &status, None).as_bytes())?;
            }
            return Err(stopped);
        }
    }
}

/// Returns an error if the file is a folder, or inside the dataset's folder.
fn check_outside(file: &Path, dataset: &Path) -> Result<()> {
    cli::check_file(file)?;
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match (folder.canonicalize(), dataset.canonicalize()) {
        (Ok(folder), Ok(dataset)) if folder.starts_with(&dataset) => {
            let error = Error::misuse("this file is inside the dataset's folder").in_file(file);
            Err(error.help("give a file elsewhere"))
        }
        _ => Ok(()),
    }
}

/// Waits for the next update.
fn wait(stop: &AtomicBool) -> Result<()> {
    let begin = Instant::now();
    while begin.elapsed() < EVERY {
        if stop.load(Ordering::Relaxed) {
            return Err(Error::stopped("stopped watching"));
        }
        std::thread::sleep(HEED);
    }
    Ok(())
}

/// Prints the text, replacing the previous one on a terminal. Returns `false` if the reader has closed stdout.
fn print(text: &str, in_place: bool) -> Result<bool> {
    let begin = if in_place && io::stdout().is_terminal() { "\x1b[2J\x1b[H" } else { "" };
    cli::print(&format!("{begin}{text}"))
}

/// Formats a status as text.
fn as_text(set: &Set, status: &Status) -> String {
    let mut text = format!("{}: {}\n", set.folder.display(), summary(status));
    if status.shards.len() > 1 {
        text += &cli::columns(&shards(status));
    }
    if !status.slowest.is_empty() {
        text += "slowest images:\n";
        text += &cli::columns(&slowest(status));
    }
    if !status.failures.is_empty() {
        text += "failed images:\n";
        text.extend(failed(status).iter().skip(1).take(MOST_LISTED).map(|row| format!("{}\n", row.join(": "))));
        if let Some(more) = status.failures.len().checked_sub(MOST_LISTED).filter(|more| *more > 0) {
            text.extend([format!("and {more} more; --json and --page list all\n")]);
        }
    }
    text
}

/// Table of the shards, with headers.
fn shards(status: &Status) -> Vec<[String; 7]> {
    let heads = ["shard", "images", "done", "failed", "images/h", "left", "state"].map(String::from);
    [heads].into_iter().chain(status.shards.iter().map(row)).collect()
}

/// Table of the slowest images, with headers.
fn slowest(status: &Status) -> Vec<[String; 6]> {
    let heads = ["image", "seconds", "building", "rendering", "labels", "plants"].map(String::from);
    let rows = status.slowest.iter().map(|image| {
        let [all, grow, draw, label] = [image.seconds, image.grow_s, image.draw_s, image.label_s].map(number);
        [Set::name(image.index), all, grow, draw, label, image.plants.map_or("-".into(), |n| n.to_string())]
    });
    [heads].into_iter().chain(rows).collect()
}

/// Table of the failed images, with headers.
fn failed(status: &Status) -> Vec<[String; 2]> {
    let row = |failure: &FailedImage| [Set::name(failure.index), failure.error.clone()];
    let heads = ["image", "why"].map(String::from);
    [heads].into_iter().chain(status.failures.iter().map(row)).collect()
}

/// One-line summary.
fn summary(status: &Status) -> String {
    let mut parts = vec![format!("{} of {} images", status.done, status.images)];
    if !status.failures.is_empty() {
        parts.push(format!("{} failed", status.failures.len()));
    }
    if let Some(rate) = status.images_per_hour {
        let each = if status.working == 0 && status.shards.len() > 1 { " and run" } else { "" };
        parts.push(format!("{} images per hour{each}", number(rate)));
    }
    if status.is_done() {
        parts.push("all done".into());
    } else {
        parts.extend(status.left_s.map(|left| format!("{} left", time(left))));
        parts.push(match (status.working, &status.shards[..]) {
            (0, [one]) => state(one),
            (0, _) => "no run is active".into(),
            (n, _) => format!("{} active", count(n.to_u64(), "run", "runs")),
        });
    }
    if status.core_s > 0.0 {
        parts.push(format!("{} core hours in finished runs", number(status.core_s / 3600.0)));
    }
    parts.join(", ")
}

fn row(shard: &ShardStatus) -> [String; 7] {
    let ShardStatus { number: k, images, done, failed, images_per_hour, left_s, .. } = shard;
    let left = if shard.state == State::Done { None } else { *left_s };
    [
        k.to_string(),
        images.to_string(),
        done.to_string(),
        failed.to_string(),
        images_per_hour.map_or("-".into(), number),
        left.map_or("-".into(), time),
        state(shard),
    ]
}

/// Describes the last run of a shard.
fn state(shard: &ShardStatus) -> String {
    let ago = shard.last_s.map(|last| format!("{} ago", time(last)));
    let (words, when) = match shard.state {
        State::Done => ("done", None),
        State::Working => ("active, last update", ago),
        State::Silent => ("possibly killed, last update", ago),
        State::Stopped => ("stopped", ago),
        State::Failed => ("ended with failures", ago),
        State::Missing => ("no run is active", None),
    };
    when.map_or(words.to_owned(), |when| format!("{words} {when}"))
}

/// Formats a duration with its two largest units.
fn time(seconds: f64) -> String {
    let words = format_duration(Duration::from_secs(seconds.clamp(0.0, 1e10).trunc_to::<u64>())).to_string();
    words.split(' ').take(2).collect::<Vec<_>>().join(" ")
}
