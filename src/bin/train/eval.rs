//! `train eval`.

use crate::machine::MachineArgs;
use furrow::cli::signal::Signals;
use furrow::output::write_atomically;
use furrow::train::data::Selection;
use furrow::train::run::{self, Learnt};
use furrow::train::session;
use furrow::{Result, cli};
use std::path::PathBuf;

/// Which network, on which images.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the run.
    run: PathBuf,
    /// Images with labels; all of the set unless it says DIR@PICK.
    #[arg(long = "set", value_name = "DIR[@PICK]", value_parser = Selection::parse)]
    set: Selection,
    /// Folder for the tables; `eval/NAME` in the run's, after the set, unless given.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    machine: MachineArgs,
}

/// Judges, and writes what came out.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    let learnt = Learnt::open(&args.run)?;
    let name = args.set.folder.file_name().unwrap_or_default();
    let out = args.out.clone().unwrap_or_else(|| args.run.join("eval").join(name));
    cli::check_folder(&out)?;
    let machine = args.machine.machine();
    let threads = args.machine.threads();
    let report =
        session::evaluate(&learnt, &args.set, &args.machine.precision, threads, &machine, signals.heed(), &mut |_| {
            Ok(())
        })?;
    let tables = report.tables();
    let markdown: String = tables.iter().map(|t| t.markdown() + "\n").collect();
    let [json, md] = [out.join("report.json"), out.join("report.md")];
    run::write_json(&json, &report)?;
    write_atomically(&md, markdown.as_bytes())?;
    eprint!("{}", report.summary().markdown());
    Ok(vec![json, md])
}
