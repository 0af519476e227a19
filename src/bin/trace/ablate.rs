//! `trace ablate`: renders one dataset, and the same fields again with one change at a time.

use crate::dataset::order::{self, ImageArgs};
use crate::dataset::render::{WorkArgs, generate};
use crate::variants::variants;
use furrow_base::{Error, Result};
use furrow_cli::cli;
use furrow_cli::cli::signal::Signals;
use furrow_dataset::Set;
use furrow_dataset::make::finish;
use furrow_dataset::make::generate::Shard;
use furrow_field::ablation::{Change, EDITS, Edit, FULL};
use furrow_job::Renderer;
use furrow_output::write_atomically;
use furrow_render::settings::{RenderOptions, Techniques};
use std::path::{Path, PathBuf};

/// Renders a dataset in DIR/full and one for each edit in DIR/NAME: the same fields, plants, light and noise with one
/// change.
///
/// All have the same files and, if the geometry is unchanged, bit-identical labels. Repeating the command after a stop,
/// crash or damage completes the datasets. Each one is an ordinary dataset: `trace dataset verify` checks it, `trace
/// dataset emit` writes cluster jobs for it.
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(crate) struct Args {
    #[command(flatten)]
    images: ImageArgs,
    /// Only these edits in addition to the full dataset, separated by commas.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', conflicts_with = "except")]
    only: Vec<String>,
    /// All edits except these, separated by commas.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    except: Vec<String>,
    /// List the edits, one per line, and render nothing.
    #[arg(long, exclusive = true)]
    list: bool,
    /// Names of the sets of real images that DIR/ablation.ron, the experiment file for `train table`, refers to.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', default_value = "real", value_parser = set_name)]
    real: Vec<String>,
    /// Create the datasets without rendering: for shards, and for a cluster.
    #[arg(long, conflicts_with = "shard")]
    plan: bool,
    /// Render the images of each dataset whose number modulo N equals k, without finishing the datasets.
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

On several machines with a shared folder, each with the same arguments:
  trace ablate … --out ab --plan                        create all datasets
  trace ablate … --out ab --shard 0/8                   … to 7/8, each on any machine, repeated as needed
  trace ablate … --out ab                               render what is missing, write lists and reports
or one dataset at a time: trace dataset emit ab/no-sky --scheduler slurm --shards 8

Train a network on each dataset and test it on real images:
  train table ab/ablation.ron --out ab/answer --real real=DIR

100 images of 480 x 360 and 32 samples with all edits take about four hours on two cores of 2 GHz, one of them for spp-256; training on them,
with three seeds of 600 steps each, takes about three and a half more.";

/// Renders what is missing. Returns the paths of the dataset-wide files.
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
            furrow_cli::message!("{text}");
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
            paths.push(set.folder.join(furrow_dataset::model::recipe::FILE));
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

/// Lists the edits, one per line.
fn list() -> String {
    let line = |edit: &Edit| {
        let labels = if edit.keeps_labels { "" } else { " (other labels)" };
        format!("{:<20} {}{labels}\n", edit.name, edit.about)
    };
    [&FULL].into_iter().chain(EDITS).map(line).collect()
}

/// Returns the full dataset and the selected edits, in the order of the table. If all edits are selected, those that
/// would change nothing here or cannot be rendered here are left out with a message.
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
                    "--only {}: the full dataset is already rendered like this",
                    edit.name
                ))
                .help("leave it out, or give other arguments"));
            }
            if !args.work.quiet {
                furrow_cli::message!("{} is left out: the full dataset is already rendered like this", edit.name);
            }
        } else if let (false, Err(e)) = (named, possible(&options, &full)) {
            furrow_cli::message!("warning: {} is left out: {e}", edit.name);
        } else {
            all.push(edit);
        }
    }
    Ok(all)
}

/// Checks that this machine supports what these options need beyond those of the full dataset.
fn possible(options: &RenderOptions, full: &RenderOptions) -> Result<()> {
    let more = options.quality.denoise && !full.quality.denoise || options.engine != full.engine;
    if !more {
        return Ok(());
    }
    Renderer::open(&RenderOptions { techniques: Techniques::default(), ..options.clone() }).map(drop)
}

/// Writes the experiment file for all datasets in the folder. Networks are trained on red, green and blue, so datasets
/// that differ only in near infrared are not included.
fn page(out: &Path, reals: &[String]) -> Result<PathBuf> {
    let mut sets = Vec::new();
    for edit in [&FULL].into_iter().chain(EDITS) {
        let folder = out.join(edit.name);
        if folder.join(furrow_dataset::model::recipe::FILE).is_file() && !matches!(edit.change, Change::Photograph(_)) {
            sets.push((Set::open(&folder)?, edit.about));
        }
    }
    let path = out.join("ablation.ron");
    write_atomically(&path, variants(&sets, reals)?.as_bytes())?;
    Ok(path)
}

/// Parses the name of a set in an experiment file.
fn set_name(text: &str) -> Result<String, String> {
    let good = |c: char| c.is_ascii_alphanumeric() || "-_".contains(c);
    let taken = [&FULL].into_iter().chain(EDITS).any(|edit| edit.name == text);
    if text.is_empty() || taken || !text.chars().all(good) {
        return Err("write a name of letters, digits, - and _ that no edit has, such as jai".into());
    }
    Ok(text.to_owned())
}

/// Opens a dataset created by `--plan`. Shards that created it concurrently would find each other's unfinished files.
fn begun(folder: &Path) -> Result<Set> {
    if folder.join(furrow_dataset::model::recipe::FILE).is_file() {
        return Set::open(folder);
    }
    Err(Error::input("there is no dataset here")
        .in_file(folder)
        .help("run the same command with --plan instead of --shard first, which creates all datasets"))
}
