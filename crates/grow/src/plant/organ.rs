//! Organs of a plant. One organ is one geometry of the scene, so it is also the finest label.

use super::rig::RigJoint;
use super::skeleton::PlacedJoint;
use furrow_base::geometry::Mesh;
use furrow_base::math::{ToFloat, ToInt, Vec3};

/// Kind of organ.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
pub enum OrganKind {
    /// Flat part of a true leaf.
    Blade,
    /// Stalk of a leaf, with the raised midrib that continues it under the blade.
    Petiole,
    /// Flat part of a cotyledon (seed leaf).
    Cotyledon,
    /// Stem below the cotyledons, with the crown of a rosette on top.
    Hypocotyl,
    /// Stem above the cotyledons; also scapes and the stalks of flowers.
    Stem,
    /// Lower part of a grass leaf, rolled around the stem.
    Sheath,
    /// Open single flower, with its stamens and sepals.
    Flower,
    /// Closed flower or head.
    Bud,
    /// Head of a composite: disc, rays and bracts.
    Head,
    /// Ear or spike: wheat; maize with husks and silks.
    Ear,
    /// A tassel.
    Tassel,
    /// A pod, silicle, silique or capsule.
    Pod,
    /// A berry.
    Berry,
}

impl OrganKind {
    /// Returns the lower-case name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Blade => "blade",
            Self::Petiole => "petiole",
            Self::Cotyledon => "cotyledon",
            Self::Hypocotyl => "hypocotyl",
            Self::Stem => "stem",
            Self::Sheath => "sheath",
            Self::Flower => "flower",
            Self::Bud => "bud",
            Self::Head => "head",
            Self::Ear => "ear",
            Self::Tassel => "tassel",
            Self::Pod => "pod",
            Self::Berry => "berry",
        }
    }
}

/// Sizes of a leaf, flat and undamaged, metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LeafSize {
    /// Length of the blade along the midrib, or of a compound leaf along the rachis.
    pub length: f32,
    /// Largest width of the blade.
    pub width: f32,
    /// Length of the petiole, or of the sheath of a grass leaf.
    pub petiole: f32,
}

/// Keypoints of a leaf: the ends of its blade, its size and its joints.
#[derive(Clone, Debug, PartialEq)]
pub struct LeafAxis {
    /// Leaf number, as in [`Organ::leaf`].
    pub leaf: u16,
    /// Base of the blade's midrib, where the stalk ends, metres.
    pub base: Vec3,
    /// Tip of the midrib, metres.
    pub tip: Vec3,
    /// Size of the leaf.
    pub size: LeafSize,
    /// Joints of the kinematic tree, metres; for a compound leaf, those along the rachis.
    pub joints: Vec<PlacedJoint>,
    /// All joints with their axes; empty unless [`GrowOptions::rigged`](super::GrowOptions::rigged) is set.
    pub rig: Vec<RigJoint>,
    /// Attachment to the plant's stems; `None` if the leaf's sheath starts at the soil.
    pub on: Option<StemPosition>,
    /// Index in [`Plant::rig`](super::Plant::rig) of the stem joint that bears the leaf; `None` without a rig.
    pub bearer: Option<u16>,
}

/// Position on the stems of a plant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StemPosition {
    /// [`StemLine::number`] of the stem.
    pub line: u32,
    /// Position along the line, in points: 1.5 is half-way between its second and its third point.
    pub at: f32,
}

/// Centre line of a stem.
#[derive(Clone, Debug, PartialEq)]
pub struct StemLine {
    /// Number of the line, from 0. It is larger than the number of the stem that bears this one.
    pub number: u32,
    /// Points from base to tip, metres.
    pub points: Vec<Vec3>,
    /// Attachment to another stem; `None` if this stem leaves the soil.
    pub on: Option<StemPosition>,
}

impl StemLine {
    /// Returns the position of the tip.
    pub(super) fn end(&self) -> StemPosition {
        StemPosition { line: self.number, at: self.points.len().saturating_sub(1).to_f32() }
    }
}

/// Run of consecutive vertices of an organ's mesh that follow the motion of one stem.
#[derive(Clone, Debug, PartialEq)]
pub struct StemVertices {
    /// Number of vertices.
    pub corners: usize,
    /// Number of the stem's line.
    pub line: u32,
    /// Position along the line of an appendage's attachment, which moves all its vertices. `None`: each vertex follows
    /// the nearest part of the line.
    pub at: Option<f32>,
}

impl LeafAxis {
    /// Applies `motion` to all points. `motion` must be rigid or a similarity; the sizes are not changed.
    #[must_use]
    pub fn moved(mut self, motion: impl Fn(Vec3) -> Vec3) -> Self {
        (self.base, self.tip) = (motion(self.base), motion(self.tip));
        for joint in &mut self.joints {
            joint.at = motion(joint.at);
        }
        for joint in &mut self.rig {
            *joint = joint.moved(&motion);
        }
        self
    }
}

/// One organ of one plant.
#[derive(Clone, Debug, PartialEq)]
pub struct Organ {
    /// Kind of organ.
    pub kind: OrganKind,
    /// Number of the leaf that it belongs to, counted from 1 in order of appearance, cotyledons first; 0 for organs
    /// outside of leaves: stem, hypocotyl, flowers and fruits.
    pub leaf: u16,
    /// Key in the species file's `materials`.
    pub material: String,
    /// Progress of the leaf's senescence: 0 green, 1 dead.
    pub senescence: f32,
    /// Mesh in plant coordinates: metres, growth axis +z, origin where the stem meets the soil.
    pub mesh: Mesh,
    /// Keypoints, size and joints of the leaf in the same coordinates; present for blades only.
    pub axis: Option<LeafAxis>,
    /// Centre lines of the stems in it, in the same coordinates.
    pub lines: Vec<StemLine>,
    /// Stems that carry the vertices of the mesh; empty if the leaf's own joints carry them.
    pub carried: Vec<StemVertices>,
}

impl Organ {
    /// Builds an organ of a leaf.
    pub(super) fn of_leaf(kind: OrganKind, leaf: u16, material: &str, mesh: Mesh, axis: Option<LeafAxis>) -> Self {
        Self {
            kind,
            leaf,
            material: material.to_owned(),
            senescence: 0.0,
            mesh,
            axis,
            lines: Vec::new(),
            carried: Vec::new(),
        }
    }

    /// Builds a stem along a line.
    pub(super) fn stem(kind: OrganKind, material: String, mesh: Mesh, line: StemLine) -> Self {
        let carried = vec![StemVertices { corners: mesh.positions.len(), line: line.number, at: None }];
        Self { kind, leaf: 0, material, senescence: 0.0, mesh, axis: None, lines: vec![line], carried }
    }

    /// Returns the tip of the last stem in the mesh, or the attachment of the last appendage.
    pub(super) fn end(&self) -> Option<StemPosition> {
        let last = self.carried.last()?;
        let own = self.lines.iter().find(|line| line.number == last.line).map(StemLine::end);
        own.or_else(|| Some(StemPosition { line: last.line, at: last.at? }))
    }
}

/// Returns the number of the next stem line of these organs.
pub(super) fn next_line(organs: &[Organ]) -> u32 {
    organs.iter().map(|organ| organ.lines.len()).sum::<usize>().to_u32()
}
