//! `trace ablate`: one dataset, and the same fields again with one thing changed at a time.

use crate::dataset::order::{self, ImageArgs};
use crate::dataset::render::{WorkArgs, generate};
use furrow::ablation::{Change, EDITS, Edit, FULL};
use furrow::cli::signal::Signals;
use furrow::dataset::generate::Shard;
use furrow::dataset::{Set, finish};
use furrow::job::Renderer;
use furrow::output::write_atomically;
use furrow::settings::{RenderOptions, Techniques};
use furrow::train::table::variants;
use furrow::{Error, Result, cli};
use std::path::{Path, PathBuf};

/// Makes a dataset in DIR/full and one for each edit in DIR/NAME: the same fields, plants, light and noise with one thing changed.
///
/// All have the same files, and where geometry stays the same labels bit for bit. Stopped, killed or damaged, the same command makes
/// what is missing. Each is a dataset like any other: `trace dataset verify` checks it, `trace dataset emit` sends it to a cluster.
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(crate) struct Args {
    #[command(flatten)]
    images: ImageArgs,
    /// Only these edits, separated by commas, beside the full dataset.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', conflicts_with = "except")]
    only: Vec<String>,
    /// All edits but these, separated by commas.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    except: Vec<String>,
    /// Tell the edits, one a line, and make nothing.
    #[arg(long, exclusive = true)]
    list: bool,
    /// Names of the sets of real images that DIR/ablation.ron, the experiment file for `train table`, asks for.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', default_value = "real", value_parser = set_name)]
    real: Vec<String>,
    /// Begin the datasets and render nothing: for shards, and for a cluster.
    #[arg(long, conflicts_with = "shard")]
    plan: bool,
    /// Render of each dataset the images whose number leaves k when divided by N, and finish nothing.
    #[arg(long, value_name = "k/N", value_parser = Shard::parse)]
    shard: Option<Shard>,
    #[command(flatten)]
    work: WorkArgs,
}

const AFTER: &str = "\
Examples:
  trace ablate --list
  trace ablate --scene scenes/synthetic-d.ron --count 100 --out ab --width 480 --height 360 --spp 32
  trace ablate --scene scenes/synthetic-d.ron --count 100 --out ab --only no-sky,flat-leaves

On several machines that share a folder, each with the same arguments:
  trace ablate … --out ab --plan                        begin all datasets
  trace ablate … --out ab --shard 0/8                   … to 7/8, each anywhere, as often as needed
  trace ablate … --out ab                               what is missing, and what belongs to all images
or one dataset at a time: trace dataset emit ab/no-sky --scheduler slurm --shards 8

What it all means to a network, learnt from each and judged on real images:
  train table ab/ablation.ron --out ab/answer --real real=DIR

100 images of 480 x 360 and 32 samples take two cores of 2 GHz about four hours with all edits, one of it for spp-256; learning from them,
three seeds of 600 steps each, about three and a half more.";

/// Makes what is missing; returns the paths of the files that belong to all images of a dataset.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    if args.list {
        cli::print(&list())?;
        return Ok(Vec::new());
    }
    let edits = chosen(args)?;
    let out = args.images.folder();
    cli::check_folder(out)?;
    let say = |text: String| {
        if !args.work.quiet {
            furrow::tell!("{text}");
        }
    };
    let mut sets: Vec<Set> = Vec::new();
    for edit in &edits {
        let folder = out.join(edit.name);
        sets.push(if args.shard.is_some() {
            begun(&folder)?
        } else {
            order::begin(&folder, args.images.order(edit)?, args.work.quiet, signals)?
        });
    }
    let mut paths = vec![page(out, &args.real)?];
    for (i, (edit, set)) in edits.iter().zip(&sets).enumerate() {
        if args.plan {
            paths.push(set.folder.join(furrow::dataset::recipe::FILE));
            continue;
        }
        say(format!("{} of {}: {}, {}", i + 1, edits.len(), edit.name, edit.about));
        generate(set, &args.work, args.shard.unwrap_or(Shard::ALL), args.images.memory.bytes, signals)?;
        if args.shard.is_none() {
            paths.extend(finish::finish(set, None)?);
        }
    }
    Ok(paths)
}

/// The edits, one a line.
fn list() -> String {
    let line = |edit: &Edit| {
        let labels = if edit.keeps_labels { "" } else { " (other labels)" };
        format!("{:<20} {}{labels}\n", edit.name, edit.about)
    };
    [&FULL].into_iter().chain(EDITS).map(line).collect()
}

/// The full dataset and the edits that were asked for, in the order of the table. Where all are, those that would change nothing here
/// or cannot be made here are left out, and told.
fn chosen(args: &Args) -> Result<Vec<&'static Edit>> {
    for name in args.only.iter().chain(&args.except) {
        Edit::named(name)?;
    }
    let mut all = vec![&FULL];
    let full = args.images.options();
    for edit in EDITS {
        let named = args.only.iter().any(|name| name == edit.name);
        if args.except.iter().any(|name| name == edit.name) || !(named || args.only.is_empty()) {
            continue;
        }
        let options = edit.options(full.clone());
        if matches!(edit.change, Change::Rendering(_)) && options == full {
            if named {
                return Err(Error::misuse(format!(
                    "--only {}: the full dataset is drawn like that already",
                    edit.name
                ))
                .help("leave it out, or give other arguments"));
            }
            if !args.work.quiet {
                furrow::tell!("{} is left out: the full dataset is drawn like that", edit.name);
            }
        } else if let (false, Err(e)) = (named, possible(&options, &full)) {
            furrow::tell!("warning: {} is left out: {e}", edit.name);
        } else {
            all.push(edit);
        }
    }
    Ok(all)
}

/// Whether this machine has what these options need beyond those of the full dataset.
fn possible(options: &RenderOptions, full: &RenderOptions) -> Result<()> {
    let more = options.quality.denoise && !full.quality.denoise || options.engine != full.engine;
    if !more {
        return Ok(());
    }
    Renderer::open(&RenderOptions { techniques: Techniques::default(), ..options.clone() }).map(drop)
}

/// Writes the experiment file for all datasets that lie in the folder. Networks learn from red, green and blue: where only near
/// infrared differs there is nothing to learn.
fn page(out: &Path, reals: &[String]) -> Result<PathBuf> {
    let mut sets = Vec::new();
    for edit in [&FULL].into_iter().chain(EDITS) {
        let folder = out.join(edit.name);
        if folder.join(furrow::dataset::recipe::FILE).is_file() && !matches!(edit.change, Change::Photograph(_)) {
            sets.push((Set::open(&folder)?, edit.about));
        }
    }
    let path = out.join("ablation.ron");
    write_atomically(&path, variants(&sets, reals)?.as_bytes())?;
    Ok(path)
}

/// A name of a set in an experiment file.
fn set_name(text: &str) -> Result<String, String> {
    let good = |c: char| c.is_ascii_alphanumeric() || "-_".contains(c);
    let taken = [&FULL].into_iter().chain(EDITS).any(|edit| edit.name == text);
    if text.is_empty() || taken || !text.chars().all(good) {
        return Err("write a name of letters, digits, - and _ that no edit has, such as jai".into());
    }
    Ok(text.to_owned())
}

/// A dataset that `--plan` has begun. Shards that began it at the same time would meet each other's unfinished files.
fn begun(folder: &Path) -> Result<Set> {
    if folder.join(furrow::dataset::recipe::FILE).is_file() {
        return Set::open(folder);
    }
    Err(Error::input("no dataset was begun here")
        .in_file(folder)
        .help("the same command with --plan instead of --shard begins all of them; then run the shards"))
}
