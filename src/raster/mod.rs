//! The rasterized engine: a field as a game engine of 2017 draws it, to be held against the path tracer.
//!
//! What Di Cicco et al. 2017 rendered their data with is Unreal Engine 4. This has the same parts, each as the literature of that time
//! has it: a coat of GGX over Lambert (Karis 2013), leaves cut by alpha test with mip maps, normal maps, ambient occlusion from the height maps,
//! gloss where soil is wet; a shadow map of 2048² with percentage-closer filtering for each sun and lamp; an even
//! surrounding in spherical harmonics for the sky; screen-space ambient occlusion; light from behind through leaves; four
//! samples a pixel on edges (MSAA). No light bounces. [`Technique`](crate::settings::Technique)s can be left out one at a time.
//!
//! Same [`Scene`], same camera, same four bands, same film: exposure, noise and tone curve are the sensor's, as for the path tracer.
//! Labels come from a target of ids of one sample a pixel, cut by the masks' own bits: they are those of the rays but for pixels whose
//! centre lies within rounding of an edge.
//!
//! One card draws one scene in the same bits each time. Mesa's lavapipe, which stands in where there is no card, rounds otherwise with
//! other vectors: `LP_NATIVE_VECTOR_WIDTH=256` makes it the same on processors with and without AVX-512. [`Rasterizer::adapter`] tells.
//!
//! What a thin lens blurs is not blurred here, and the filter of the path tracer's pixels is MSAA's box.

mod drawn;
mod frame;
mod gpu;
mod lights;
mod pipelines;
mod sheets;
mod vertices;

use crate::Result;
use crate::scene::Scene;
use crate::settings::Techniques;
pub use drawn::Drawn;

use gpu::Gpu;
use pipelines::Pipelines;

/// A card that draws scenes, one after the other or several at once.
pub struct Rasterizer {
    gpu: Gpu,
    pipelines: Pipelines,
}

impl Rasterizer {
    /// On the fastest card there is. A [`Kind::Missing`](crate::error::Kind::Missing) where there is none.
    pub fn new() -> Result<Self> {
        let gpu = Gpu::open()?;
        let pipelines = Pipelines::new(&gpu);
        Ok(Self { gpu, pipelines })
    }

    /// The card and its driver: what the last bits may depend on.
    pub fn adapter(&self) -> &str {
        self.gpu.name()
    }

    /// Draws the whole of what the camera sees. A [`Kind::Missing`](crate::error::Kind::Missing) where the picture is larger than the card can hold.
    pub fn draw(&self, scene: &Scene, techniques: &Techniques) -> Result<Drawn> {
        frame::draw(&self.gpu, &self.pipelines, scene, techniques)
    }
}
