//! Selection of a field: flags shared by all commands that take a scene file.

use clap::builder::{PathBufValueParser, TypedValueParser};
use furrow_base::input::shipped;
use furrow_base::math::{RoundTo, ToFloat, ToInt};
use furrow_base::ron_file::Assignment;
use furrow_base::{Error, Result};
use furrow_cli::cli;
use furrow_field::ablation::Edit;
use furrow_field::drive::FIRST;
use furrow_job::{PreparedField, SceneFile};
use std::path::{Path, PathBuf};

/// A scene file's distribution over fields, at one image size.
#[derive(clap::Args)]
pub(crate) struct SceneArgs {
    /// Scene file (RON): soil, plants, lights and cameras. A bare name such as `field` also finds a shipped one.
    #[arg(long, value_name = "FILE", required = true, value_parser = scene_file())]
    scene: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) set: SetArgs,
    /// Seed that overrides the scene file's.
    #[arg(long, allow_negative_numbers = true)]
    pub(crate) seed: Option<u64>,
    /// Image width in pixels. The field of view is unchanged, and the height scales with the width unless --height is
    /// given.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=16384))]
    pub(crate) width: Option<u32>,
    /// Image height in pixels.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=16384))]
    pub(crate) height: Option<u32>,
}

/// Values that replace those of the scene file.
#[derive(clap::Args)]
pub(crate) struct SetArgs {
    /// Replace or add a value of the scene file, by its path: `camera.height_m=1.2`, `crops[0].species=maize`. May be
    /// repeated. Values are written as in the file; a text needs no quotes.
    #[arg(long = "set", value_name = "PATH=VALUE", value_parser = Assignment::parse)]
    pub(crate) values: Vec<Assignment>,
}

/// Memory limit of a field.
#[derive(clap::Args)]
pub(crate) struct MemoryArgs {
    /// Maximum memory of a field, GiB. Default: three quarters of this machine's memory. A field that would need more
    /// is refused before it is built. The files do not depend on it.
    #[arg(long = "memory", value_name = "GIB", value_parser = bytes)]
    pub(crate) bytes: Option<u64>,
}

/// Parses a size in GiB; returns bytes.
fn bytes(text: &str) -> Result<u64, String> {
    let gib = text.parse().ok().filter(|gib: &f64| (0.1..=1e6).contains(gib));
    gib.map(|gib| (gib * (1_u64 << 30).to_f64()).trunc_to::<u64>())
        .ok_or_else(|| "write GiB from 0.1 to 1000000, such as 24".into())
}

/// Parses a path of a scene file, or the name of a shipped one.
pub(crate) fn scene_file() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().map(shipped::scene_file)
}

impl SceneArgs {
    /// The scene file.
    pub(crate) fn path(&self) -> &Path {
        self.scene.as_deref().unwrap_or(Path::new(""))
    }

    /// Checks, before any work starts, that the scene file exists.
    pub(crate) fn check(&self) -> Result<()> {
        cli::check_scene(self.path())
    }
}

/// One field of a scene file.
#[derive(clap::Args)]
pub(crate) struct FieldArgs {
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    memory: MemoryArgs,
    /// Number of the field: each number from 0 gives another field of the scene file.
    #[arg(long, default_value_t = 0, allow_negative_numbers = true)]
    index: u64,
    /// Day, counted from the emergence of the first crop. Default: the first of the scene file's days, or else the
    /// growth stages written in it.
    #[arg(long, value_name = "DAY", value_parser = clap::value_parser!(u32).range(0..=1000))]
    day: Option<u32>,
    /// Number of the light. 0 is the field's own; with 1, 2 and so on, lights, exposure and sensor are sampled again from the
    /// scene file, differently for each number. Plants, ground and labels stay the same.
    #[arg(long, value_name = "K", default_value_t = 0)]
    light: u64,
    /// Frame of a drive, from 0.
    #[arg(long, value_name = "N", default_value_t = 0)]
    frame: u32,
    /// Name of one of the scene file's cameras.
    #[arg(long, value_name = "NAME", default_value = FIRST)]
    camera: String,
}

/// Prints a warning, also with `--quiet`.
pub(crate) fn print_warning(words: &str) {
    furrow_cli::message!("warning: {words}");
}

impl FieldArgs {
    /// The scene file.
    pub(crate) fn path(&self) -> &Path {
        self.scene.path()
    }

    /// Checks, before any work starts, that the scene file exists.
    pub(crate) fn check(&self) -> Result<()> {
        self.scene.check()
    }

    /// Builds the field with an edit and these scene options. Warnings are passed to `warn` as soon as they are known.
    pub(crate) fn grow_as(
        &self,
        edit: &'static Edit,
        asked: impl FnOnce(SceneFile) -> SceneFile,
        warn: impl Fn(&str),
    ) -> Result<PreparedField> {
        self.grow(&asked(self.of(SceneFile::edited(self.path(), edit)?)?), warn)
    }

    /// Returns a scene file with the values, seed, size, day, light and memory limit of these options.
    pub(crate) fn of(&self, scene: SceneFile) -> Result<SceneFile> {
        let SceneArgs { seed, width, height, .. } = self.scene;
        let scene = scene.assign(&self.scene.set.values)?.seed(seed).width(width).height(height);
        Ok(scene.day(self.day).light(self.light).memory(self.memory.bytes))
    }

    /// Builds the field of a scene file. Warnings are passed to `warn` as soon as they are known.
    pub(crate) fn grow(&self, scene: &SceneFile, warn: impl Fn(&str)) -> Result<PreparedField> {
        let warn = |warning: &String| warn(warning);
        let expected_warnings = scene.expected_warnings(self.index)?;
        expected_warnings.iter().for_each(warn);
        let mut field = scene.field(self.index)?;
        field.grown().warnings.iter().filter(|warning| !expected_warnings.contains(warning)).for_each(warn);
        let captures = &field.grown().captures;
        let place = captures.iter().position(|c| c.frame == self.frame && c.name == self.camera);
        let Some(place) = place else {
            let frames = captures.last().map_or(0, |last| last.frame);
            let names: Vec<&str> = captures.iter().take_while(|c| c.frame == 0).map(|c| c.name.as_str()).collect();
            let words = format!("there is no frame {} of a camera `{}`", self.frame, self.camera);
            let help = format!("frames 0 to {frames} of {}", names.join(", "));
            return Err(Error::misuse(words).help(help).in_file(self.path()));
        };
        field.take(place.to_u64())?;
        Ok(field)
    }

    /// `out/<name of the scene file>`.
    pub(crate) fn default_folder(&self) -> PathBuf {
        Path::new("out").join(self.path().file_stem().unwrap_or_default())
    }
}
