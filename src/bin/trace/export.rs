//! `trace export`: exports one field as a scene of another program.

use crate::field::{FieldArgs, print_warning};
use crate::growing::Line;
use crate::quality::threads;
use clap::ValueEnum;
use furrow_base::{Error, Result};
use furrow_cli::cli;
use furrow_field::Field;
use furrow_field::ablation::FULL;
use furrow_job::{SceneFile, Threads};
use furrow_output::Export;
use std::path::{Path, PathBuf};

/// What to export.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    field: FieldArgs,
    /// Format of the export.
    #[arg(long, value_enum)]
    format: Format,
    /// Folder for the files. Default: `out/`, the scene file's name and the format's.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Export the joints of leaves and stems as skins with weights, so that plants can bend in the other program; with
    /// `--format gltf` and `usd`.
    #[arg(long)]
    skins: bool,
    /// Points per square metre of surface; with `--format ply`, `las` and `laz`. Default: 100000.
    #[arg(long, value_name = "POINTS", value_parser = density)]
    density: Option<f64>,
    /// Number of threads; 0 for one per core. The files do not depend on it.
    #[arg(long, default_value_t = 0, value_parser = threads)]
    threads: usize,
    /// Print nothing but errors, warnings and the paths of the files.
    #[arg(long)]
    quiet: bool,
}

/// Export formats. To add one: a file in `crates/output/src/`, a name here and a line in [`Format::write`].
#[derive(Clone, Copy, ValueEnum)]
enum Format {
    /// glTF 2.0: scene.glb with meshes, textures, labels, sun, lamps and camera; for Blender and other programs.
    Gltf,
    /// USD: scene.usda with meshes, textures, labels as semantics, lights and camera; for Isaac Sim and other programs.
    Usd,
    /// Mitsuba 3: scene.xml with meshes, textures, lights and camera.
    Mitsuba,
    /// Point cloud of all surfaces, including hidden ones: points.ply with position, normal, colour and labels.
    Ply,
    /// The same points as LAS 1.4: points.las with position, colour, near infrared, class and, as extra bytes, plant, leaf
    /// and normal.
    Las,
    /// The same as LAZ, compressed LAS: points.laz.
    Laz,
}

/// Default number of points per square metre: 3 mm apart.
const DENSITY: f64 = 1e5;

/// Parses a number of points per square metre.
fn density(text: &str) -> Result<f64, String> {
    let points = text.parse().ok().filter(|points: &f64| (1.0..=1e9).contains(points));
    points.ok_or_else(|| "write points/m² from 1 to 1000000000, such as 100000".into())
}

impl Format {
    fn write(self, folder: &Path, field: &Field, density: f64) -> Result<Export> {
        match self {
            Self::Ply => furrow_output::cloud::write(folder, field, density),
            Self::Las | Self::Laz => furrow_output::cloud::write_las(folder, field, density, matches!(self, Self::Laz)),
            Self::Gltf => furrow_output::gltf::write(folder, &field.scene, &field.plants, &field.provenance()),
            Self::Usd => furrow_output::usd::write(folder, field),
            Self::Mitsuba => furrow_job::mitsuba::export(folder, &field.scene, &field.provenance()),
        }
    }

    /// Returns `true` if the export has points.
    fn has_points(self) -> bool {
        matches!(self, Self::Ply | Self::Las | Self::Laz)
    }

    /// Returns `true` if the export can have joints.
    fn has_joints(self) -> bool {
        matches!(self, Self::Gltf | Self::Usd)
    }

    fn name(self) -> String {
        self.to_possible_value().map(|v| v.get_name().to_owned()).unwrap_or_default()
    }
}

/// Builds a field and exports it. Returns the paths of the files.
pub(crate) fn run(args: &Args) -> Result<Vec<PathBuf>> {
    args.field.check()?;
    let out = args.out.clone().unwrap_or_else(|| args.field.default_folder().join(args.format.name()));
    cli::check_folder(&out)?;
    let note = |words: &str| {
        if !args.quiet {
            furrow_cli::message!("{words}");
        }
    };
    if args.skins && !args.format.has_joints() {
        let words = format!("--skins has no effect with --format {}, which has no joints", args.format.name());
        return Err(Error::misuse(words).help("use --format gltf or usd, or leave --skins out"));
    }
    if args.density.is_some() && !args.format.has_points() {
        let words = format!("--density has no effect with --format {}, which contains surfaces", args.format.name());
        return Err(Error::misuse(words).help("use --format ply, las or laz, or leave --density out"));
    }
    let density = args.density.unwrap_or(DENSITY);
    let threads = Threads::new(args.threads)?;
    let growing = Line::begin(args.quiet);
    let warn = |words: &str| growing.pause(|| print_warning(words));
    let wanted = |scene: SceneFile| scene.threads(&threads).rigged(args.skins).progress(growing.progress());
    let field = args.field.grow_as(&FULL, wanted, warn)?;
    growing.show("writing files");
    let export = field.threads().install(|| args.format.write(&out, field.grown(), density))?;
    growing.end();
    for warning in &export.warnings {
        print_warning(warning);
    }
    let amount = export.amount.unwrap_or_else(|| format!("{} files", export.paths.len()));
    note(&format!("{}: {amount} in {}", args.field.path().display(), out.display()));
    Ok(export.paths)
}
