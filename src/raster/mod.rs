//! The rasterized engine: a field as a game engine of 2017 draws it, to be held against the path tracer.
//!
//! What Di Cicco et al. 2017 rendered their data with is Unreal Engine 4. This has the same parts, each as the literature of that time
//! has it: a coat of GGX over Lambert (Karis 2013), leaves cut by alpha test with mip maps, normal maps, openness from the height maps,
//! gloss where soil is wet; a shadow map of 2048² with percentage-closer filtering for each sun and lamp; an even
//! surrounding in spherical harmonics for the sky; screen-space ambient occlusion; light from behind through leaves; four
//! samples a pixel on edges (MSAA). No light bounces. [`Effect`]s can be left out one at a time.
//!
//! Same [`Scene`], same camera, same four bands, same film: exposure, noise and tone curve are the sensor's, as for the path tracer.
//! Labels come from a target of ids of one sample a pixel, cut by the masks' own bits: they are those of the rays but for pixels whose
//! centre lies within rounding of an edge.
//!
//! One card draws one scene in the same bits each time. Mesa's lavapipe, which stands in where there is no card, rounds otherwise with
//! other vectors: `LP_NATIVE_VECTOR_WIDTH=256` makes it the same on processors with and without AVX-512. [`Rasterizer::adapter`] tells.
//!
//! What a thin lens blurs is not blurred here, and the filter of the path tracer's pixels is MSAA's box.

mod frame;
mod gpu;
mod lights;
mod pipelines;
mod sheets;
mod vertices;

use crate::Result;
use crate::film::Film;
use crate::render::LabelMap;
use crate::scene::Scene;
use gpu::Gpu;
use pipelines::Pipelines;

/// Something that a picture can do without.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// Shadow maps.
    Shadows,
    /// Screen-space ambient occlusion.
    Ssao,
    /// Normal maps.
    NormalMaps,
    /// Light through leaves.
    Foliage,
    /// Spherical harmonics of the sky; without them it is the same from everywhere.
    Harmonics,
    /// Four samples a pixel.
    Msaa,
}

impl Effect {
    /// All of them, with the names that flags and files have for them.
    pub const ALL: [(&'static str, Self); 6] = [
        ("shadows", Self::Shadows),
        ("ssao", Self::Ssao),
        ("normal-maps", Self::NormalMaps),
        ("foliage", Self::Foliage),
        ("harmonics", Self::Harmonics),
        ("msaa", Self::Msaa),
    ];

    /// The effect of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|(n, _)| *n == name).map(|(_, effect)| effect)
    }
}

/// How a picture is drawn.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Settings {
    /// What is left out.
    pub without: Vec<Effect>,
}

impl Settings {
    /// Whether an effect is there.
    pub fn has(&self, effect: Effect) -> bool {
        !self.without.contains(&effect)
    }
}

/// A picture and its labels.
pub struct Drawn {
    /// Radiance, and the first surface's position and normal; its variance is zero and its albedo unknown.
    pub film: Film,
    /// What lies at each pixel's centre.
    pub labels: LabelMap,
}

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
    pub fn draw(&self, scene: &Scene, settings: &Settings) -> Result<Drawn> {
        frame::draw(&self.gpu, &self.pipelines, scene, settings)
    }
}
