//! Small pictures of the first indices of a scene file: how its fields differ.

use furrow::job::{Renderer, Request, SceneFile};
use furrow::output::{self, Picture as Png};
use furrow::render::Watch;
use furrow::settings::{Quality, RenderOptions};
use serde_json::{Value, json};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Indices of a sheet, from 0.
pub(super) const COUNT: u64 = 12;
/// Most pixels across of one of its pictures.
pub(super) const WIDTH: u32 = 240;
/// Samples a pixel.
const SPP: u32 = 4;

/// Pictures of the indices from 0, as far as they are rendered.
#[derive(Clone, Default)]
pub(super) struct Sheet {
    /// What they are pictures of: the file's text with the hash of what was read, and the seed.
    pub(super) of: Option<(String, Option<u64>, u64)>,
    /// As PNG, or why there is none.
    pub(super) pictures: Vec<Result<Arc<Vec<u8>>, String>>,
}

impl Sheet {
    /// What the page says of it.
    pub(super) fn about(&self, wanted: bool) -> Value {
        let failed: Vec<Option<&str>> = self.pictures.iter().map(|p| p.as_ref().err().map(String::as_str)).collect();
        json!({ "wanted": wanted, "count": COUNT, "done": failed.len(), "failed": failed, "key": self.of.as_ref().map(|of| of.2) })
    }
}

/// One picture of a sheet as PNG.
pub(super) fn picture(scene: &SceneFile, index: u64, stop: &AtomicBool) -> furrow::Result<Vec<u8>> {
    let field = scene.field(index)?;
    let request = Request { watch: Watch { done: &|_| (), stop }, ..Request::default() };
    let renderer = Renderer::open(&RenderOptions::path_traced(Quality::spp(SPP)))?;
    let photograph = renderer.render(&field, &request)?.photograph();
    output::encode_png(photograph.width, photograph.height, &Png::Rgb(photograph.rgb.as_chunks::<3>().0), "")
}
