//! `trace export`: writes one field as a scene of another program.

use crate::field::FieldArgs;
use clap::ValueEnum;
use furrow::ablation::FULL;
use furrow::job::Threads;
use furrow::output::{self, Export};
use furrow::scene::Field;
use furrow::{Error, Result, cli};
use std::path::{Path, PathBuf};

/// What to write, and how.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    field: FieldArgs,
    /// The other program's format.
    #[arg(long, value_enum)]
    format: Format,
    /// Folder for the files; `out/`, the scene file's name and the format's unless given.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Keep the joints of leaves and stems as skins with weights, so that plants bend in the other program; with `--format gltf`.
    #[arg(long)]
    skins: bool,
    /// Points a square metre of surface; with `--format ply`, 100000 unless given.
    #[arg(long, value_name = "POINTS", value_parser = density)]
    density: Option<f64>,
    /// Print nothing but errors and the paths of the files.
    #[arg(long)]
    quiet: bool,
}

/// The formats. A further one is a file in `src/output/`, a name here and a line in [`Format::write`].
#[derive(Clone, Copy, ValueEnum)]
enum Format {
    /// glTF 2.0: scene.glb with meshes, textures, labels, sun, lamps and camera; for Blender and others.
    Gltf,
    /// Mitsuba 3: scene.xml with meshes, textures, lights and camera.
    Mitsuba,
    /// A cloud of points on all surfaces, hidden ones too: points.ply with place, normal, colour and labels.
    Ply,
}

/// Points a square metre where none are asked for: 3 mm apart.
const DENSITY: f64 = 1e5;

/// Points a square metre.
fn density(text: &str) -> Result<f64, String> {
    let points = text.parse().ok().filter(|points: &f64| (1.0..=1e9).contains(points));
    points.ok_or_else(|| "write points/m² from 1 to 1000000000, such as 100000".into())
}

impl Format {
    fn write(self, folder: &Path, field: &Field, density: f64) -> Result<Export> {
        match self {
            Self::Ply => output::cloud::write(folder, field, density),
            Self::Gltf => output::gltf::write(folder, &field.scene, &field.plants, &field.provenance()),
            Self::Mitsuba => output::mitsuba::write(folder, &field.scene, &field.provenance()),
        }
    }

    fn name(self) -> String {
        self.to_possible_value().map(|v| v.get_name().to_owned()).unwrap_or_default()
    }
}

/// Grows a field and writes it down; returns the paths of the files.
pub(crate) fn run(args: &Args) -> Result<Vec<PathBuf>> {
    args.field.check()?;
    let out = args.out.clone().unwrap_or_else(|| args.field.default_folder().join(args.format.name()));
    cli::check_folder(&out)?;
    let tell = |words: &str| {
        if !args.quiet {
            furrow::tell!("{words}");
        }
    };
    if args.skins && !matches!(args.format, Format::Gltf) {
        let words = format!("--skins says nothing with --format {}, which holds no joints", args.format.name());
        return Err(Error::misuse(words).help("use --format gltf, or leave --skins out"));
    }
    if args.density.is_some() && !matches!(args.format, Format::Ply) {
        let words = format!("--density says nothing with --format {}, which holds surfaces", args.format.name());
        return Err(Error::misuse(words).help("use --format ply, or leave --density out"));
    }
    let density = args.density.unwrap_or(DENSITY);
    let threads = Threads::all()?;
    let field = args.field.grow_as(&FULL, |scene| scene.threads(&threads).rigged(args.skins), tell)?;
    let export = field.threads().install(|| args.format.write(&out, field.grown(), density))?;
    for warning in &export.warnings {
        tell(&format!("warning: {warning}"));
    }
    let amount = export.amount.unwrap_or_else(|| format!("{} files", export.paths.len()));
    tell(&format!("{}: {amount} in {}", args.field.path().display(), out.display()));
    Ok(export.paths)
}
