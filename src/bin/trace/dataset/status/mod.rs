//! How far a dataset is: `trace dataset status`.

mod page;

use furrow::cli;
use furrow::cli::signal::Signals;
use furrow::dataset::Set;
use furrow::dataset::status::{FailedImage, ShardStatus, State, Status};
use furrow::output::write_atomically;
use furrow::report::{count, number};
use furrow::{Error, Result};
use humantime::format_duration;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};
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
    /// Write an HTML page as well, which shows all shards and all failures; with --watch it is written again at every look, and loads itself again.
    #[arg(long, value_name = "FILE")]
    page: Option<PathBuf>,
    /// How many shards it is made in; as many as its last run had, unless given.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=100_000))]
    shards: Option<u64>,
}

/// Looks once, or until all images are there.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    args.page.as_deref().map_or(Ok(()), |page| check_page(page, &args.dir))?;
    let stop = signals.heed();
    loop {
        // It may have got longer meanwhile.
        let set = Set::open(&args.dir)?;
        let status = Status::of(&set, args.shards, stop)?;
        let text = if args.json { status.json()? + "\n" } else { told(&set, &status) };
        if let Some(path) = &args.page {
            let again = (args.watch && !status.is_done()).then_some(EVERY.as_secs());
            write_atomically(path, page::html(&set, &status, again).as_bytes())?;
        }
        let is_read = print(&text, args.watch && !args.json)?;
        if status.is_done() || !args.watch || !is_read {
            return Ok(Vec::new());
        }
        if let Err(stopped) = wait(stop) {
            // Nobody writes it again.
            if let Some(path) = &args.page {
                write_atomically(path, page::html(&set, &status, None).as_bytes())?;
            }
            return Err(stopped);
        }
    }
}

/// Refuses a page in the place of a folder, or among the dataset's own files.
fn check_page(page: &Path, dataset: &Path) -> Result<()> {
    cli::check_file(page)?;
    let folder = page.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match (folder.canonicalize(), dataset.canonicalize()) {
        (Ok(folder), Ok(dataset)) if folder.starts_with(&dataset) => {
            let error = Error::misuse("this lies in the dataset's folder, whose files are the dataset's").in_file(page);
            Err(error.help("give --page a file elsewhere"))
        }
        _ => Ok(()),
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

/// Prints; in the place of what stood there where a person watches. Whether somebody reads on.
fn print(text: &str, in_place: bool) -> Result<bool> {
    let begin = if in_place && io::stdout().is_terminal() { "\x1b[2J\x1b[H" } else { "" };
    cli::print(&format!("{begin}{text}"))
}

/// A status in words.
fn told(set: &Set, status: &Status) -> String {
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
        text.extend(failed(status).iter().skip(1).take(MOST_TOLD).map(|row| format!("{}\n", row.join(": "))));
        if let Some(more) = status.failures.len().checked_sub(MOST_TOLD).filter(|more| *more > 0) {
            text.extend([format!("and {more} more; --json and --page tell all\n")]);
        }
    }
    text
}

/// Shard by shard below the heads of columns.
fn shards(status: &Status) -> Vec<[String; 7]> {
    let heads = ["shard", "images", "done", "failed", "images/h", "left", "state"].map(String::from);
    [heads].into_iter().chain(status.shards.iter().map(row)).collect()
}

/// The images that took longest below the heads of columns.
fn slowest(status: &Status) -> Vec<[String; 6]> {
    let heads = ["image", "seconds", "growing", "drawing", "labels", "plants"].map(String::from);
    let rows = status.slowest.iter().map(|image| {
        let [all, grow, draw, label] = [image.seconds, image.grow_s, image.draw_s, image.label_s].map(number);
        [Set::name(image.index), all, grow, draw, label, image.plants.map_or("-".into(), |n| n.to_string())]
    });
    [heads].into_iter().chain(rows).collect()
}

/// The images that could not be made below the heads of columns.
fn failed(status: &Status) -> Vec<[String; 2]> {
    let row = |failure: &FailedImage| [Set::name(failure.index), failure.error.clone()];
    let heads = ["image", "why"].map(String::from);
    [heads].into_iter().chain(status.failures.iter().map(row)).collect()
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
