//! Data of a field's ground during construction.

use super::detail::MeshDetail;
use super::ground_view::Viewpoint;
use crate::layer::Layer;
use furrow_base::math::Spectrum;
use furrow_grow::soil::{Debris, Ground, MOISTURE_LEVELS, Pile, Site, SoilDesc};
use furrow_render::material::BakedGround;
use std::sync::Arc;

/// All inputs of the ground that do not depend on the plants.
#[derive(Clone, PartialEq)]
pub(super) struct Soil {
    pub(super) desc: SoilDesc,
    pub(super) detail: MeshDetail,
    /// Reflectances of the soil's `colors`; the textures of its layers are in `maps`.
    pub(super) colors: Vec<Spectrum>,
    pub(super) maps: Vec<Arc<Layer>>,
    pub(super) site: Site,
    /// Texel size of the baked maps, metres.
    pub(super) texel: f32,
    /// Cameras near whose views the ground is built; empty if all of it is built.
    pub(super) viewpoints: Vec<Viewpoint>,
    /// Seed and index of the field.
    pub(super) of: (u64, u64),
}

/// Ground and stones, before clods and litter are added.
#[derive(Clone)]
pub(super) struct GroundAndStones {
    pub(super) ground: Arc<Ground>,
    pub(super) pile: Pile,
    pub(super) stones: Vec<Debris>,
}

/// Baked textures of the ground and of its clods at each level of moisture.
pub(super) struct BakedGrounds {
    pub(super) ground: Arc<BakedGround>,
    pub(super) clods: [Arc<BakedGround>; MOISTURE_LEVELS],
    /// Reflectance of the dry soil that covers stones and straw as dust.
    pub(super) dust: Spectrum,
}

/// Ground without cover, its baked textures, and the inputs that it was built from.
pub(super) struct BareGround {
    pub(super) soil: Soil,
    pub(super) earth: GroundAndStones,
    pub(super) baked: Arc<BakedGrounds>,
}
