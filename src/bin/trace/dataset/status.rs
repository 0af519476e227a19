//! How far a dataset is: `trace dataset status`.

use furrow::cli;
use furrow::cli::signal::Signals;
use furrow::dataset::Set;
use furrow::dataset::status::{FailedImage, ShardStatus, State, Status};
use furrow::report::{count, number};
use furrow::{Error, Result};
use humantime::format_duration;
use std::io::{self, IsTerminal, Write};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Between two looks.
const EVERY: Duration = Duration::from_secs(5);
/// How soon a signal is heeded between them.
const HEED: Duration = Duration::from_millis(50);
/// Failed images that are told to people; `--json` tells all.
const MOST_TOLD: usize = 20;

/// Which dataset.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the dataset.
    dir: PathBuf,
    /// Look again every five seconds, until all images are there or Ctrl-C.
    #[arg(long)]
    watch: bool,
    /// Print one JSON object, on one line.
    #[arg(long)]
    json: bool,
    /// How many shards it is made in; as many as its last run had, unless given.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=100_000))]
    shards: Option<u64>,
}

/// Looks once, or until all images are there.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    let stop = signals.heed();
    loop {
        // It may have got longer meanwhile.
        let set = Set::open(&args.dir)?;
        let status = Status::of(&set, args.shards, stop)?;
        let text = if args.json { status.json()? + "\n" } else { told(&set, &status) };
        let written = print(&text, args.watch && !args.json);
        if status.is_done() || !args.watch || written.is_err() {
            return Ok(Vec::new());
        }
        wait(stop)?;
    }
}

/// Waits until it is time to look again.
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

/// Prints to stdout; in the place of what stood there where a person watches. A closed pipe ends the watching, and is no failure.
fn print(text: &str, in_place: bool) -> io::Result<()> {
    let mut out = io::stdout().lock();
    if in_place && out.is_terminal() {
        out.write_all(b"\x1b[2J\x1b[H")?;
    }
    out.write_all(text.as_bytes())?;
    out.flush()
}

/// A status in words.
fn told(set: &Set, status: &Status) -> String {
    let mut text = format!("{}: {}\n", set.folder.display(), summary(status));
    if status.shards.len() > 1 {
        let head = ["shard", "images", "done", "failed", "images/h", "left", "state"].map(String::from);
        text += &cli::columns(&[&[head][..], &status.shards.iter().map(row).collect::<Vec<_>>()].concat());
    }
    if !status.slowest.is_empty() {
        text += "slowest images:\n";
        let head = ["image", "seconds", "growing", "drawing", "labels", "plants"].map(String::from);
        let rows = status.slowest.iter().map(|image| {
            let [all, grow, draw, label] = [image.seconds, image.grow_s, image.draw_s, image.label_s].map(number);
            [Set::name(image.index), all, grow, draw, label, image.plants.map_or("-".into(), |n| n.to_string())]
        });
        text += &cli::columns(&[head].into_iter().chain(rows).collect::<Vec<_>>());
    }
    if !status.failures.is_empty() {
        text += "failed images:\n";
        let line = |failure: &FailedImage| format!("{}: {}\n", Set::name(failure.index), failure.error);
        text.extend(status.failures.iter().take(MOST_TOLD).map(line));
        if let Some(more) = status.failures.len().checked_sub(MOST_TOLD).filter(|more| *more > 0) {
            text.extend([format!("and {more} more; --json tells all\n")]);
        }
    }
    text
}

/// The most important in a line.
fn summary(status: &Status) -> String {
    let mut parts = vec![format!("{} of {} images", status.done, status.images)];
    if !status.failures.is_empty() {
        parts.push(format!("{} failed", status.failures.len()));
    }
    if let Some(rate) = status.images_per_hour {
        parts.push(format!("{} images an hour", number(rate)));
    }
    if status.is_done() {
        parts.push("all done".into());
    } else {
        parts.extend(status.left_s.map(|left| format!("{} left", time(left))));
        parts.push(match (status.working, &status.shards[..]) {
            (0, [one]) => state(one),
            (0, _) => "nobody works on it".into(),
            (n, _) => format!("{} at work", count(n as u64, "run", "runs")),
        });
    }
    if status.core_s > 0.0 {
        parts.push(format!("{} core hours in runs that have ended", number(status.core_s / 3600.0)));
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

/// What the last run of a shard does, in words.
fn state(shard: &ShardStatus) -> String {
    let ago = shard.last_s.map(|last| format!("{} ago", time(last)));
    let (words, when) = match shard.state {
        State::Done => ("done", None),
        State::Working => ("at work, last heard of", ago),
        State::Silent => ("perhaps killed, last heard of", ago),
        State::Stopped => ("stopped", ago),
        State::Failed => ("ended with failures", ago),
        State::Missing => ("nobody works on it", None),
    };
    when.map_or(words.to_owned(), |when| format!("{words} {when}"))
}

/// Seconds as people say them: the two largest units.
fn time(seconds: f64) -> String {
    let words = format_duration(Duration::from_secs(seconds.clamp(0.0, 1e10) as u64)).to_string();
    words.split(' ').take(2).collect::<Vec<_>>().join(" ")
}
