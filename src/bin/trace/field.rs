//! Which field: the flags that every verb with a scene shares.

use furrow::ablation::Edit;
use furrow::scene::Field;
use furrow::scene::assemble::Options;
use furrow::{Result, cli};
use std::path::{Path, PathBuf};

/// A scene's distribution over fields, at one size.
#[derive(clap::Args)]
pub(crate) struct PageArgs {
    /// Scene page (RON): what grows, what shines, who looks.
    #[arg(long, value_name = "PAGE", required = true)]
    scene: Option<PathBuf>,
    /// Seed, instead of the page's.
    #[arg(long, allow_negative_numbers = true)]
    pub(crate) seed: Option<u64>,
    /// Image width in pixels; the field of view stays, the height follows unless given.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=16384))]
    pub(crate) width: Option<u32>,
    /// Image height in pixels.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=16384))]
    pub(crate) height: Option<u32>,
}

impl PageArgs {
    /// The page.
    pub(crate) fn path(&self) -> &Path {
        self.scene.as_deref().unwrap_or(Path::new(""))
    }

    /// Checks, before anything grows, that the page is there.
    pub(crate) fn check(&self) -> Result<()> {
        cli::check_scene(self.path())
    }
}

/// One field of a page.
#[derive(clap::Args)]
pub(crate) struct FieldArgs {
    #[command(flatten)]
    page: PageArgs,
    /// Which field of the distribution.
    #[arg(long, default_value_t = 0, allow_negative_numbers = true)]
    index: u64,
}

impl FieldArgs {
    /// The page.
    pub(crate) fn page(&self) -> &Path {
        self.page.path()
    }

    /// Checks, before anything grows, that the page is there.
    pub(crate) fn check(&self) -> Result<()> {
        self.page.check()
    }

    /// Grows the field as an edit has it. Call it inside a pool.
    pub(crate) fn grow(&self, edit: &Edit) -> Result<Field> {
        let PageArgs { seed, width, height, .. } = self.page;
        edit.field(&edit.open(self.page())?, &Options { seed, index: self.index, width, height })
    }

    /// `out/<name of the page>`.
    pub(crate) fn default_folder(&self) -> PathBuf {
        Path::new("out").join(self.page().file_stem().unwrap_or_default())
    }
}
