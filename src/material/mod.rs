//! What parts are made of: textures and optics at a point → its scattering and the frame it scatters in.

mod condition;
mod damage;
mod feature;
pub mod ground;
pub mod leaf;
mod painted;
mod shading;
mod solid;
pub mod swatch;
mod varies;

use crate::bsdf::Bsdf;
use crate::geometry::Interaction;
use crate::math::{Frame, Spectrum, Vec3};
use swatch::{Swatch, Tone};

pub use condition::{ConditionOptics, Tones, tissues};
pub use damage::Damage;
pub use feature::Feature;
pub use ground::{BakedGround, Ground};
pub use leaf::{LeafDesc, LeafMaterial, Picture};
pub use painted::{Painted, Repaint};
pub use solid::Solid;
pub use varies::Varies;

/// What a part is made of.
#[derive(Clone, Debug)]
pub enum Material {
    /// A blade, a petiole, a stem.
    Leaf(LeafMaterial),
    /// The ground and its clods.
    Ground(Ground),
    /// Stone, wood, straw: one colour, rough.
    Solid(Solid),
    /// How models from disk look.
    Painted(Painted),
    /// The same scattering everywhere: for tests and teaching.
    Plain(Bsdf),
}

impl Material {
    /// The same material with its pictures read on one mip level (0 the finest) whatever the ray's width, as programs read them
    /// that have no mip levels. As it is where it has no pictures.
    #[must_use]
    pub fn on_level(&self, level: u32) -> Self {
        let mut same = self.clone();
        match &mut same {
            Self::Leaf(m) => m.fix_level(level),
            Self::Painted(m) => m.fix_level(level),
            Self::Ground(_) | Self::Solid(_) | Self::Plain(_) => {}
        }
        same
    }

    /// The same leaf in another colour, as a factor on R, G and B; what is no leaf stays as it is.
    #[must_use]
    pub fn tinted(&self, factor: Vec3) -> Self {
        match self {
            Self::Leaf(m) => Self::Leaf(m.tinted(factor)),
            Self::Ground(_) | Self::Solid(_) | Self::Painted(_) | Self::Plain(_) => self.clone(),
        }
    }

    /// Factors on the reflectance and the transmittance of its swatch that stand for another colour, a factor on R, G and B: those of a leaf's mean
    /// healthy place; 1 for what is no leaf.
    pub fn tint_factors(&self, tint: Vec3) -> Tone {
        match self {
            Self::Leaf(m) if tint != Vec3::ONE => m.tint_factors(tint),
            _ => Tone { reflectance: Spectrum::ONE, transmittance: Spectrum::ONE },
        }
    }

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

    /// What is wrong with a leaf's tissue at a hit of a ray along `direction`; nothing with what is no leaf.
    pub fn damage(&self, at: &Interaction, direction: Vec3) -> Damage {
        match self {
            Self::Leaf(m) => m.damage(at.uv, direction.dot(at.ng) < 0.0),
            Self::Ground(_) | Self::Solid(_) | Self::Painted(_) | Self::Plain(_) => Damage::default(),
        }
    }

    /// The same material without a feature; as it is where it has no such thing.
    pub fn leave_out(&mut self, feature: Feature) {
        match self {
            Self::Leaf(m) => m.leave_out(feature),
            Self::Ground(m) => m.leave_out(feature),
            Self::Solid(m) => m.leave_out(feature),
            Self::Painted(m) => m.leave_out(feature),
            Self::Plain(_) => {}
        }
    }

    /// The material as documents of other programs can hold it.
    pub fn swatch(&self) -> Swatch<'_> {
        match self {
            Self::Leaf(m) => m.swatch(),
            Self::Ground(m) => m.swatch(),
            Self::Solid(m) => m.swatch(),
            Self::Painted(m) => m.swatch(),
            Self::Plain(bsdf) => {
                let transmittance = match bsdf {
                    Bsdf::Leaf(leaf) => leaf.transmittance(),
                    _ => Spectrum::ZERO,
                };
                Swatch::plain(Tone { reflectance: bsdf.reflectance(1.0), transmittance }, 1.0)
            }
        }
    }
}
