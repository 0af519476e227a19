//! `train baseline`.

use crate::report::{self, Shots};
use furrow::cli::signal::Signals;
use furrow::train::baseline::{Kind, files};
use furrow::train::classes::Classes;
use furrow::train::data::{Band, Pick, Selection, Shape};
use furrow::train::run;
use furrow::{Result, cli};
use std::path::PathBuf;

/// Which rule, fitted to which images, judged on which.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// exg: all that is green is crop; exg-size: large green regions are crop, small ones weed.
    #[arg(value_parser = kind)]
    kind: Kind,
    /// Images that its thresholds are fitted to; may be given several times.
    #[arg(long, value_name = "DIR[@PICK]", required = true, value_parser = Selection::parse)]
    from: Vec<Selection>,
    /// Images that it is judged on.
    #[arg(long = "set", value_name = "DIR[@PICK]", value_parser = Selection::parse)]
    set: Selection,
    /// The size that images are brought to.
    #[arg(long, value_name = "WxH", default_value = "480x360", value_parser = crate::fit::size)]
    size: (u32, u32),
    /// Folder for what came out.
    #[arg(long, value_name = "DIR", default_value = "out/baseline")]
    out: PathBuf,
}

fn kind(text: &str) -> Result<Kind, String> {
    let names: Vec<&str> = Kind::ALL.iter().map(|k| k.name()).collect();
    Kind::named(text).ok_or_else(|| format!("there is no baseline `{text}`: write {}", names.join(" or ")))
}

/// Fits, judges, and writes what came out.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    cli::check_folder(&args.out)?;
    let (width, height) = args.size;
    let shape = Shape { bands: Band::RGB.to_vec(), width, height };
    let stop = signals.heed();
    let (_, images) = args.set.open(Pick::All, 0)?;
    let rule = files::fit(args.kind, &args.from, 0, &shape, stop)?;
    let mut shots = Shots::new(images.len(), &["red", "green", "blue"]);
    let report = files::judge(&rule, &args.set, &shape, stop, &mut |example, predicted| {
        shots.see(example, args.size, predicted);
    })?;
    let json = args.out.join("baseline.json");
    run::write_json(&json, &rule)?;
    let title = format!("{} on {}", args.kind.name(), args.set.folder.display());
    let lead = "The score of colour alone; a network that scores lower has learned nothing about shape.";
    let mut paths = report::write(&args.out, &title, lead, &report, &shots.kept, &Classes::default().colors())?;
    paths.push(json);
    eprint!("{}", report.summary().markdown());
    Ok(paths)
}
