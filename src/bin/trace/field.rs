//! Which field: the flags that every verb with a scene shares.

use furrow::scene::{Field, build};
use furrow::{Result, cli};
use std::path::{Path, PathBuf};

/// One field of a scene's distribution, at one size.
#[derive(clap::Args)]
pub(crate) struct FieldArgs {
    /// Scene page (RON): what grows, what shines, who looks.
    #[arg(long, value_name = "PAGE", required = true)]
    scene: Option<PathBuf>,
    /// Seed, instead of the page's.
    #[arg(long, allow_negative_numbers = true)]
    seed: Option<u64>,
    /// Which field of the distribution.
    #[arg(long, default_value_t = 0, allow_negative_numbers = true)]
    index: u64,
    /// Image width in pixels; the field of view stays, the height follows unless given.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=16384))]
    width: Option<u32>,
    /// Image height in pixels.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=16384))]
    height: Option<u32>,
}

impl FieldArgs {
    /// The page.
    pub(crate) fn page(&self) -> &Path {
        self.scene.as_deref().unwrap_or(Path::new(""))
    }

    /// Checks, before anything grows, that the page is there.
    pub(crate) fn check(&self) -> Result<()> {
        cli::check_scene(self.page())
    }

    /// Grows the field. Call it inside a pool.
    pub(crate) fn grow(&self) -> Result<Field> {
        let options = build::Options { seed: self.seed, index: self.index, width: self.width, height: self.height };
        build::field(self.page(), &options)
    }

    /// `out/<name of the page>`.
    pub(crate) fn default_folder(&self) -> PathBuf {
        Path::new("out").join(self.page().file_stem().unwrap_or_default())
    }
}
