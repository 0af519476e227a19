//! What a field is built with, and of.

use super::ground_view::GroundView;
use super::lighting::Lighting;
use super::options::Options;
use super::season::Season;
use super::today::Today;
use crate::light::LightRecord;
use crate::math::Vec3;
use crate::plant::OrganKind;
use crate::ron_file::RonFile;
use crate::scene::desc::FieldDesc;
use crate::scene::drive::Capture;
use crate::scene::layer::Layer;
use crate::scene::library::Library;
use crate::scene::{PartKind, Scene};
use crate::sensor::Lidar;
use crate::soil::Ground;
use std::sync::Arc;

/// Farthest that a model or a camera may be from the world's origin along an axis, metres: single precision tells 0.06 mm apart there.
pub(super) const FARTHEST: f32 = 1000.0;

/// Room around the view in which plants are grown, metres: they lean in and throw shadows.
pub(super) const PLANT_MARGIN: f32 = 0.35;

/// A field under way.
pub(super) struct Builder<'a> {
    pub(super) page: &'a RonFile,
    pub(super) desc: &'a FieldDesc,
    pub(super) options: &'a Options,
    pub(super) library: Library,
    pub(super) seed: u64,
    pub(super) index: u64,
    pub(super) season: Season,
    /// Its day, where it has days.
    pub(super) today: Option<Today>,
    /// Places of the crops that this field has.
    pub(super) sown: std::ops::Range<usize>,
    /// The lights as they were drawn.
    pub(super) lights: Vec<LightRecord>,
    pub(super) lighting: Vec<Lighting>,
    pub(super) scene: Scene,
    /// The images that are taken of it.
    pub(super) captures: Vec<Capture>,
    /// The LiDAR at each frame, for a scan; none for images.
    pub(super) scanners: Vec<Lidar>,
    /// The ground in each of them, once it was looked at.
    pub(super) seen: Vec<GroundView>,
    /// What the parts of the ground are, in the order of the parts.
    pub(super) ground: Vec<PartKind>,
    /// What the plants' parts are, in the order of the parts.
    pub(super) organs: Vec<OrganKind>,
    /// What the parts of models from disk are, in the order of the parts.
    pub(super) things: Vec<PartKind>,
    pub(super) warnings: Vec<String>,
}

/// Radius over which the ground's slope decides how a plant stands, metres.
const STANCE: f32 = 0.02;

/// What plants and models stand on.
#[derive(Clone, Copy)]
pub(super) struct Floor<'a> {
    pub(super) ground: &'a Ground,
    /// Of its layers.
    pub(super) maps: &'a [Arc<Layer>],
    /// Whether the ground is the plane z = 0; what grows leans on it as it does on the ground with its heights.
    pub(super) flat: bool,
}

impl Floor<'_> {
    /// Height at a place, metres.
    pub(super) fn height(&self, x: f32, y: f32) -> f32 {
        if self.flat { 0.0 } else { self.ground.height(x, y) }
    }

    /// Height at which a plant stands, metres, and the normal of the ground about it.
    pub(super) fn stance(&self, x: f32, y: f32) -> (f32, Vec3) {
        let (height, normal) = self.ground.stance(self.maps, x, y, STANCE);
        (if self.flat { 0.0 } else { height }, normal)
    }
}
