//! Materials of parts: textures and optical properties at a point become a BSDF in a shading frame.

mod condition;
mod damage;
mod feature;
pub mod ground;
pub mod leaf;
mod model_surface;
mod shading;
mod solid;
pub mod swatch;
mod varies;

use furrow_base::geometry::Interaction;
use furrow_base::math::{Frame, Spectrum, Vec3};
use furrow_optics::bsdf::Bsdf;
use swatch::{Swatch, Tone};

pub use condition::{ConditionOptics, Tones, tissues};
pub use damage::Damage;
pub use feature::Feature;
pub use ground::{BakedGround, Ground};
pub use leaf::{LeafDesc, LeafMaterial, LeafTexture};
pub use model_surface::{ModelSurface, SurfaceOverride};
pub use solid::Solid;
pub use varies::Varies;

/// Material of a part.
#[derive(Clone, Debug)]
pub enum Material {
    /// A blade, a petiole, a stem.
    Leaf(LeafMaterial),
    /// The ground and its soil clods.
    Ground(Ground),
    /// Stone, wood, straw: one rough colour.
    Solid(Solid),
    /// Surfaces of models loaded from disk.
    ModelSurface(ModelSurface),
    /// A uniform BSDF, for tests and teaching.
    Plain(Bsdf),
}

impl Material {
    /// Returns the material with its images read at one mip level (0 is the finest) for all ray widths, as in programs
    /// without mip maps. Materials without images are unchanged.
    #[must_use]
    pub fn on_level(&self, level: u32) -> Self {
        let mut same = self.clone();
        match &mut same {
            Self::Leaf(m) => m.fix_level(level),
            Self::ModelSurface(m) => m.fix_level(level),
            Self::Ground(_) | Self::Solid(_) | Self::Plain(_) => {}
        }
        same
    }

    /// Returns the leaf with its colour multiplied by `factor` (R, G, B). Other materials are unchanged.
    #[must_use]
    pub fn tinted(&self, factor: Vec3) -> Self {
        match self {
            Self::Leaf(m) => Self::Leaf(m.tinted(factor)),
            Self::Ground(_) | Self::Solid(_) | Self::ModelSurface(_) | Self::Plain(_) => self.clone(),
        }
    }

    /// Factors on the swatch's reflectance and transmittance that are equivalent to the tint `tint` (R, G, B), computed
    /// for the mean healthy tissue of a leaf; 1 for other materials.
    pub fn tint_factors(&self, tint: Vec3) -> Tone {
        match self {
            Self::Leaf(m) if tint != Vec3::ONE => m.tint_factors(tint),
            _ => Tone { reflectance: Spectrum::ONE, transmittance: Spectrum::ONE },
        }
    }

    /// Domain over which the scattering varies, which an exporter must sample.
    pub fn varies(&self) -> Varies {
        match self {
            Self::Leaf(m) => m.varies(),
            Self::Ground(m) => m.varies(),
            Self::Solid(m) => m.varies(),
            Self::ModelSurface(m) => m.varies(),
            Self::Plain(_) => Varies::Nowhere,
        }
    }

    /// Returns the BSDF at a point seen from `wo` (world, unit) and its shading frame. The frame's z axis is the
    /// shading normal on the upper side of the surface. `wo` is always on the same side of the frame as of the
    /// triangle.
    #[inline]
    pub fn scatter(&self, at: &Interaction, wo: Vec3) -> (Bsdf, Frame) {
        match self {
            Self::Leaf(m) => m.scatter(at, wo),
            Self::Ground(m) => m.scatter(at, wo),
            Self::Solid(m) => m.scatter(at, wo),
            Self::ModelSurface(m) => m.scatter(at, wo),
            Self::Plain(bsdf) => (*bsdf, shading::grained_frame(at, at.ns, at.tangents().0, wo)),
        }
    }

    /// Returns the damage of leaf tissue at a hit of a ray along `direction`; none for other materials.
    pub fn damage(&self, at: &Interaction, direction: Vec3) -> Damage {
        match self {
            Self::Leaf(m) => m.damage(at.uv, direction.dot(at.ng) < 0.0),
            Self::Ground(_) | Self::Solid(_) | Self::ModelSurface(_) | Self::Plain(_) => Damage::default(),
        }
    }

    /// Removes a feature from the material; no effect if it does not have the feature.
    pub fn leave_out(&mut self, feature: Feature) {
        match self {
            Self::Leaf(m) => m.leave_out(feature),
            Self::Ground(m) => m.leave_out(feature),
            Self::Solid(m) => m.leave_out(feature),
            Self::ModelSurface(m) => m.leave_out(feature),
            Self::Plain(_) => {}
        }
    }

    /// Returns the swatch of a leaf with a condition as it would be without it; `None` for other materials. Its image is
    /// that of the species.
    pub fn healthy_swatch(&self) -> Option<Swatch<'_>> {
        match self {
            Self::Leaf(m) => m.healthy_swatch(),
            Self::Ground(_) | Self::Solid(_) | Self::ModelSurface(_) | Self::Plain(_) => None,
        }
    }

    /// Returns the material in a form that other file formats can represent.
    pub fn swatch(&self) -> Swatch<'_> {
        match self {
            Self::Leaf(m) => m.swatch(),
            Self::Ground(m) => m.swatch(),
            Self::Solid(m) => m.swatch(),
            Self::ModelSurface(m) => m.swatch(),
            Self::Plain(bsdf) => {
                let tone = Tone { reflectance: bsdf.reflectance(1.0), transmittance: bsdf.transmittance() };
                Swatch::plain(tone, 1.0)
            }
        }
    }
}
