//! Thumbnails of the first indices of a scene file, which show the variation between its fields.

use furrow_job::{Renderer, Request, SceneFile};
use furrow_output::ImageData as Png;
use furrow_render::render::RenderMonitor;
use furrow_render::settings::{Quality, RenderOptions};
use serde_json::{Value, json};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Number of indices on a sheet, from 0.
pub(super) const COUNT: u64 = 12;
/// Maximum width of a thumbnail, pixels.
pub(super) const WIDTH: u32 = 240;
/// Samples per pixel.
const SPP: u32 = 4;

/// Thumbnails of the indices from 0 that are rendered so far.
#[derive(Clone, Default)]
pub(super) struct ContactSheet {
    /// Content of the thumbnails: the file's text with the hash of the files read, the seed, and the request number.
    pub(super) of: Option<(String, Option<u64>, u64)>,
    /// Thumbnails as PNG, or the reason why there is none.
    pub(super) pictures: Vec<Result<Arc<Vec<u8>>, String>>,
}

impl ContactSheet {
    /// State of the sheet for the page.
    pub(super) fn about(&self, wanted: bool) -> Value {
        let failed: Vec<Option<&str>> = self.pictures.iter().map(|p| p.as_ref().err().map(String::as_str)).collect();
        json!({ "wanted": wanted, "count": COUNT, "done": failed.len(), "failed": failed, "key": self.of.as_ref().map(|of| of.2) })
    }
}

/// Renders one thumbnail as PNG.
pub(super) fn picture(scene: &SceneFile, index: u64, stop: &AtomicBool) -> furrow_base::Result<Vec<u8>> {
    let field = scene.field(index)?;
    let request = Request { watch: RenderMonitor { done: &|_| (), stop }, ..Request::default() };
    let renderer = Renderer::open(&RenderOptions::path_traced(Quality::spp(SPP)))?;
    let photograph = renderer.render(&field, &request)?.photograph();
    furrow_output::encode_png(photograph.width, photograph.height, &Png::Rgb(photograph.rgb.as_chunks::<3>().0), "")
}
