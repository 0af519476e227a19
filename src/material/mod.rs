//! What parts are made of: textures and optics at a point → its scattering and the frame it scatters in.

mod feature;
pub mod ground;
pub mod leaf;
mod painted;
mod shading;
mod solid;
pub mod swatch;
mod wear;

use crate::bsdf::Bsdf;
use crate::geometry::Interaction;
use crate::math::{Frame, Vec3};

pub use feature::Feature;
pub use ground::{Ground, GroundSkin};
pub use leaf::{LeafDesc, LeafMaterial, Picture};
pub use painted::{Painted, Repaint};
pub use solid::Solid;
pub use wear::{Tones, Wear, tissues};

/// What a part is made of.
#[derive(Clone, Debug)]
pub enum Material {
    /// A blade, a petiole, a stem.
    Leaf(LeafMaterial),
    /// The ground and its clods.
    Ground(Ground),
    /// Stone, wood, straw: one colour, rough.
    Solid(Solid),
    /// What models from disk wear.
    Painted(Painted),
    /// The same scattering everywhere: for tests and teaching.
    Plain(Bsdf),
}

/// Over what a material's scattering varies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Varies {
    /// The same everywhere.
    Nowhere,
    /// Over texture coordinates, as finely as an image of this many texels across and down, or coarser where the ray is wider.
    Picture(u32, u32),
    /// The same, whatever the ray's width.
    Raster(u32, u32),
    /// Over the world.
    Place,
}

impl Material {
    /// Over what the scattering varies: what a program that writes the material down must sample.
    pub fn varies(&self) -> Varies {
        match self {
            Self::Leaf(m) => m.varies(),
            Self::Ground(m) => m.varies(),
            Self::Solid(m) => m.varies(),
            Self::Painted(m) => m.varies(),
            Self::Plain(_) => Varies::Nowhere,
        }
    }

    /// The scattering at a point seen from `wo` (world, unit), and the frame of its directions. The frame's z axis is the
    /// shading normal on the upper side of the surface; it always sees `wo` from the side that the triangle does.
    #[inline]
    pub fn scatter(&self, at: &Interaction, wo: Vec3) -> (Bsdf, Frame) {
        match self {
            Self::Leaf(m) => m.scatter(at, wo),
            Self::Ground(m) => m.scatter(at, wo),
            Self::Solid(m) => m.scatter(at, wo),
            Self::Painted(m) => m.scatter(at, wo),
            Self::Plain(bsdf) => (*bsdf, shading::grained_frame(at, at.ns, at.tangents().0, wo)),
        }
    }
}
