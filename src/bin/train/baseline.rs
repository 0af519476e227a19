//! `train baseline`.

use crate::report;
use furrow_base::Result;
use furrow_cli::cli;
use furrow_cli::cli::signal::Signals;
use furrow_dataset::model::classes::Classes;
use furrow_train::baseline::{Kind, files};
use furrow_train::data::{Band, Pick, Selection, Shape};
use furrow_train::fit::settings::{self, parse_size};
use furrow_train::run;
use std::path::PathBuf;

/// Arguments of `train baseline`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// exg: pixels above an excess-green (ExG) threshold are crop; exg-size: of these, large connected components are crop, small ones
    /// weed.
    #[arg(value_parser = kind)]
    kind: Kind,
    /// Training set to fit the thresholds to; may be given several times.
    #[arg(long, value_name = "DIR[@PICK]", required = true, value_parser = Selection::parse)]
    from: Vec<Selection>,
    /// Test set.
    #[arg(long = "set", value_name = "DIR[@PICK]", value_parser = Selection::parse)]
    set: Selection,
    /// Size that images are resized to, pixels.
    #[arg(long, value_name = "WxH", default_value = settings::default_of("size"), value_parser = parse_size)]
    size: (u32, u32),
    /// Folder for the report and the fitted baseline.
    #[arg(long, value_name = "DIR", default_value = "out/baseline")]
    out: PathBuf,
}

fn kind(text: &str) -> Result<Kind, String> {
    let names: Vec<&str> = Kind::ALL.iter().map(|k| k.name()).collect();
    Kind::named(text).ok_or_else(|| format!("there is no baseline `{text}`: write {}", names.join(" or ")))
}

/// Fits, evaluates, and writes the report.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    cli::check_folder(&args.out)?;
    let (width, height) = args.size;
    let shape = Shape { bands: Band::RGB.to_vec(), width, height };
    let stop = signals.catch();
    let (_, images) = args.set.open(Pick::All, 0)?;
    let rule = files::fit(args.kind, &args.from, 0, &shape, stop)?;
    let mut thumbnails = report::thumbnails(images.len(), &Band::RGB, Classes::default().len());
    let report = files::evaluate(&rule, &args.set, &shape, stop, &mut |example, predicted| {
        thumbnails.see(example, args.size, predicted)
    })?;
    let json = args.out.join("baseline.json");
    run::write_json(&json, &rule)?;
    let title = format!("{} on {}", args.kind.name(), args.set.folder.display());
    let lead = "Scores of an ExG threshold; a network that scores lower has learned nothing about shape.";
    let mut paths = report::write(&args.out, &title, lead, &report, &thumbnails.kept(), &Classes::default().colors())?;
    paths.push(json);
    furrow_cli::message!("{}", report.summary().markdown().trim_end());
    Ok(paths)
}
