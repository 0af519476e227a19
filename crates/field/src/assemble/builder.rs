//! State of a field under construction.

use super::ground_view::GroundView;
use super::lighting::Lighting;
use super::options::Options;
use super::season::Season;
use super::today::Today;
use crate::PartKind;
use crate::desc::FieldDesc;
use crate::drive::Capture;
use crate::layer::Layer;
use crate::library::Library;
use furrow_base::math::Vec3;
use furrow_base::ron_file::RonFile;
use furrow_grow::plant::OrganKind;
use furrow_grow::soil::Ground;
use furrow_optics::light::LightRecord;
use furrow_optics::sensor::Lidar;
use furrow_render::scene::Scene;
use std::sync::Arc;

/// Maximum coordinate of a model or a camera along an axis, metres. Single precision resolves 0.06 mm there.
pub(super) const FARTHEST: f32 = 1000.0;

/// Width of the planted margin around the view, metres: plants in it may lean or cast shadows into the view.
pub(super) const PLANT_MARGIN: f32 = 0.35;

/// A field under construction.
pub(super) struct Builder<'a> {
    pub(super) page: &'a RonFile,
    pub(super) desc: &'a FieldDesc,
    pub(super) options: &'a Options,
    pub(super) library: Library,
    pub(super) seed: u64,
    pub(super) index: u64,
    pub(super) season: Season,
    /// Day of the field; `None` if it has no days.
    pub(super) today: Option<Today>,
    /// Indices of the scene file's crops that this field has.
    pub(super) sown: std::ops::Range<usize>,
    /// Records of the drawn lights.
    pub(super) lights: Vec<LightRecord>,
    pub(super) lighting: Vec<Lighting>,
    pub(super) scene: Scene,
    /// Images to be taken of the field.
    pub(super) captures: Vec<Capture>,
    /// LiDAR at each frame of a scan; empty for images.
    pub(super) scanners: Vec<Lidar>,
    /// Ground in each image or scan; empty until the view was computed.
    pub(super) seen: Vec<GroundView>,
    /// Kinds of the ground's parts, in the order of the parts.
    pub(super) ground: Vec<PartKind>,
    /// Organ kinds of the plants' parts, in the order of the parts.
    pub(super) organs: Vec<OrganKind>,
    /// Kinds of the parts of models from disk, in the order of the parts.
    pub(super) things: Vec<PartKind>,
    pub(super) warnings: Vec<String>,
}

/// Radius of the plane fit that gives the ground's normal at a plant, metres.
const STANCE: f32 = 0.02;

/// The ground that plants and models are placed on.
#[derive(Clone, Copy)]
pub(super) struct Floor<'a> {
    pub(super) ground: &'a Ground,
    /// Textures of the ground's layers.
    pub(super) maps: &'a [Arc<Layer>],
    /// Whether the ground is the plane z = 0. Plants then still lean as on the ground with its heights.
    pub(super) flat: bool,
}

impl Floor<'_> {
    /// Returns the height of the ground at a point, metres.
    pub(super) fn height(&self, x: f32, y: f32) -> f32 {
        if self.flat { 0.0 } else { self.ground.height(x, y) }
    }

    /// Returns the height of a plant's foot, metres, and the normal of the ground around it.
    pub(super) fn stance(&self, x: f32, y: f32) -> (f32, Vec3) {
        let (height, normal) = self.ground.stance(self.maps, x, y, STANCE);
        (if self.flat { 0.0 } else { height }, normal)
    }
}
