//! `trace export`: writes one field as a scene of another program.

use crate::field::FieldArgs;
use clap::ValueEnum;
use furrow::ablation::FULL;
use furrow::job::Threads;
use furrow::output::{self, Export};
use furrow::scene::Field;
use furrow::{Result, cli};
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
}

impl Format {
    fn write(self, folder: &Path, field: &Field) -> Result<Export> {
        match self {
            Self::Gltf => output::gltf::write(folder, &field.scene, &field.provenance()),
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
    let field = args.field.grow(&FULL, &Threads::all()?, tell)?;
    let export = field.threads().install(|| args.format.write(&out, field.grown()))?;
    for warning in &export.warnings {
        tell(&format!("warning: {warning}"));
    }
    tell(&format!("{}: {} files in {}", args.field.path().display(), export.paths.len(), out.display()));
    Ok(export.paths)
}
