//! The rasterizer: renders a field like a game engine of 2017, for comparison with the path tracer.
//!
//! Di Cicco et al. 2017 rendered their data with Unreal Engine 4. This module implements the same components from the
//! literature of that time: a GGX coat over Lambert (Karis 2013), alpha-tested leaves with mip maps, normal maps,
//! ambient occlusion from height maps and gloss on wet soil; for each sun and lamp a 2048² shadow map with
//! percentage-closer filtering; ambient light from the sky in spherical harmonics; screen-space ambient occlusion;
//! translucency of leaves; MSAA with four samples per pixel.
//!
//! There is no indirect light. [`Technique`](crate::settings::Technique)s can be left out individually.
//!
//! It uses the same [`Scene`], camera, four bands and film as the path tracer; exposure, noise and tone curve are
//! applied by the sensor model. Labels come from an id buffer with one sample per pixel, cut by the original one-bit
//! masks. They equal the ray-traced labels except for pixels whose centre is within rounding distance of an edge.
//!
//! A given GPU renders a scene with the same bits each time. Mesa's lavapipe, used where there is no GPU, rounds
//! differently with different vector widths: `LP_NATIVE_VECTOR_WIDTH=256` makes it identical on processors with and
//! without AVX-512. [`Rasterizer::adapter`] returns the device in use.
//!
//! Depth of field is not rendered, and the pixel filter is the box of MSAA instead of the path tracer's.

mod frame;
mod gpu;
mod labelled_image;
mod lights;
mod pipelines;
mod textures;
mod vertices;

use crate::scene::Scene;
use crate::settings::Techniques;
use furrow_base::Result;
pub use labelled_image::LabelledImage;

use gpu::Gpu;
use pipelines::Pipelines;

/// A GPU that renders scenes, sequentially or concurrently.
pub struct Rasterizer {
    gpu: Gpu,
    pipelines: Pipelines,
}

impl Rasterizer {
    /// Opens the fastest GPU available. Returns [`Kind::Missing`](furrow_base::error::Kind::Missing) if there is none.
    pub fn new() -> Result<Self> {
        let gpu = Gpu::open()?;
        let pipelines = Pipelines::new(&gpu);
        Ok(Self { gpu, pipelines })
    }

    /// Name of the GPU and its driver, which the last bits may depend on.
    pub fn adapter(&self) -> &str {
        self.gpu.name()
    }

    /// Renders the whole camera image. Returns [`Kind::Missing`](furrow_base::error::Kind::Missing) if the image is
    /// larger than the GPU supports.
    pub fn draw(&self, scene: &Scene, techniques: &Techniques) -> Result<LabelledImage> {
        frame::draw(&self.gpu, &self.pipelines, scene, techniques)
    }
}
