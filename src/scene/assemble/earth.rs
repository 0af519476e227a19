//! The ground of a field while it is made.

use super::ground_view::Onlooker;
use crate::material::{BakedGround, Material};
use crate::math::Spectrum;
use crate::scene::desc::Detail;
use crate::scene::layer::Layer;
use crate::scene::{Part, PartKind};
use crate::soil::{Debris, Ground, Pile, Site, SoilDesc};
use std::sync::Arc;

/// All that the ground follows from before plants grow in it.
#[derive(Clone, PartialEq)]
pub(super) struct Soil {
    pub(super) desc: SoilDesc,
    pub(super) detail: Detail,
    /// Reflectances of its layers, and their textures.
    pub(super) colors: Vec<Spectrum>,
    pub(super) maps: Vec<Arc<Layer>>,
    pub(super) site: Site,
    /// Side of a texel of its maps, metres.
    pub(super) texel: f32,
    /// Those near whose views it is made; none where all of it is.
    pub(super) onlookers: Vec<Onlooker>,
    /// Seed and index of the field.
    pub(super) of: (u64, u64),
}

/// The ground and the stones in it, before it is covered.
#[derive(Clone)]
pub(super) struct Earth {
    pub(super) ground: Arc<Ground>,
    pub(super) pile: Pile,
    pub(super) stones: Vec<Debris>,
}

/// What the ground shows, and what its clods show: dry ones and damp ones.
pub(super) struct BakedGrounds {
    pub(super) ground: Arc<BakedGround>,
    pub(super) clods: [Arc<BakedGround>; 2],
    /// Reflectance of the dry soil that lies on stones and straw.
    pub(super) dust: Spectrum,
}

/// A ground that is ready to be covered, and what it was made of.
pub(super) struct Bed {
    pub(super) soil: Soil,
    pub(super) earth: Earth,
    pub(super) baked: Arc<BakedGrounds>,
}

/// The ground with all that lies on it, as parts of a scene; their materials count from the first of these.
#[derive(Default)]
pub(super) struct Laid {
    pub(super) parts: Vec<Part>,
    pub(super) kinds: Vec<PartKind>,
    pub(super) materials: Vec<Material>,
}
