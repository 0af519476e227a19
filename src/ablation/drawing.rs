//! How a field is drawn: what of a recipe an edit may change.

/// How a field is drawn.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Drawing {
    /// What draws, by name: `trace` for the path tracer, `raster` for the rasterized engine.
    pub engine: String,
    /// Samples a pixel.
    pub spp: u32,
    /// Whether the photographs are without the noise of few samples.
    pub denoise: bool,
    /// Most surfaces on a path, where it is not the default.
    pub max_depth: Option<u32>,
}

impl Drawing {
    /// The rasterized engine: each pixel once, without noise, without paths.
    pub fn raster() -> Self {
        Self { engine: "raster".into(), spp: 1, denoise: false, max_depth: None }
    }
}
