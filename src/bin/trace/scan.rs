//! `trace scan`: simulates a LiDAR scan of one field.

use crate::field::{FieldArgs, print_warning};
use crate::growing::Line;
use crate::quality::threads;
use clap::builder::PossibleValuesParser;
use furrow_base::Result;
use furrow_cli::cli;
use furrow_field::ablation::FULL;
use furrow_field::assemble::Scanner;
use furrow_job::{SceneFile, Threads};
use furrow_optics::sensor::{LIDARS, LidarDesc};
use furrow_output::scan::Further;
use std::path::PathBuf;

/// The field and the LiDAR.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    field: FieldArgs,
    /// LiDAR at the position of the first camera, upright, for a scene file without `lidar`.
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(LIDARS))]
    lidar: Option<String>,
    /// Folder for `scan.ply`. Default: `out/`, the scene file's name and `scan`.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Also write `scan.las`: LAS 1.4, point format 6.
    #[arg(long)]
    las: bool,
    /// Also write `scan.laz`, which is `scan.las` compressed.
    #[arg(long)]
    laz: bool,
    /// Number of threads; 0 for one per core. The file does not depend on it.
    #[arg(long, default_value_t = 0, value_parser = threads)]
    threads: usize,
    /// Print nothing but errors, warnings and the path of the file.
    #[arg(long)]
    quiet: bool,
}

/// Builds a field around its LiDAR and scans it. Returns the path of the file.
pub(crate) fn run(args: &Args) -> Result<Vec<PathBuf>> {
    args.field.check()?;
    let out = args.out.clone().unwrap_or_else(|| args.field.default_folder().join("scan"));
    cli::check_folder(&out)?;
    let note = |words: &str| {
        if !args.quiet {
            furrow_cli::message!("{words}");
        }
    };
    let threads = Threads::new(args.threads)?;
    let growing = Line::begin(args.quiet);
    let warn = |words: &str| growing.pause(|| print_warning(words));
    let named = args.lidar.as_deref().and_then(LidarDesc::named);
    let scanner = named.map_or(Scanner::OfScene, |lidar| Scanner::AtCamera(Box::new(lidar)));
    let wanted = |scene: SceneFile| scene.threads(&threads).scanned(scanner).progress(growing.progress());
    let field = args.field.grow_as(&FULL, wanted, warn)?;
    growing.show("scanning");
    let (lidar, echoes) = field.scan()?;
    growing.end();
    if echoes.is_empty() {
        print_warning("there are no echoes; see range, beams and min_intensity of the LiDAR: trace explain lidar");
    }
    let further = Further { las: args.las, laz: args.laz };
    let paths = furrow_output::scan::write(&out, field.grown(), lidar, &echoes, further)?;
    let pulses = u64::from(lidar.columns()) * u64::from(lidar.beams());
    note(&format!("{}: {} echoes of {pulses} pulses in {}", args.field.path().display(), echoes.len(), out.display()));
    Ok(paths)
}
