//! A scene: parts with materials and tags, lights, and a camera.

mod haze;
mod part;
pub mod tag;

use crate::accel::Surface;
use crate::film::Footprint;
use crate::material::Material;
use furrow_optics::light::Light;
use furrow_optics::sensor::Camera;
use tag::Tag;

pub use haze::Haze;
pub use part::{Instance, Part};

/// The scene of one field.
pub struct Scene {
    /// All parts that rays can hit.
    pub parts: Vec<Part>,
    /// Materials of the parts.
    pub materials: Vec<Material>,
    /// Light sources.
    pub lights: Vec<Light>,
    /// Haze of the air; `None` for clear air.
    pub haze: Option<Haze>,
    /// The camera.
    pub camera: Camera,
    /// Reconstruction filter of the pixels.
    pub filter: Footprint,
}

impl Scene {
    /// Returns the geometry of each part, for building an accelerator.
    pub fn surfaces(&self) -> Vec<Surface<'_>> {
        self.parts.iter().map(Part::surface).collect()
    }

    /// Returns the tag of each part.
    pub fn tags(&self) -> Vec<Tag> {
        self.parts.iter().map(|p| p.tag).collect()
    }

    /// Total number of triangles. A shared mesh is counted once for each part that uses it.
    pub fn triangles(&self) -> usize {
        self.parts.iter().map(|p| p.mesh.triangles.len()).sum()
    }
}
