//! The words of botany: what a plant is made of. One organ is one geometry of the scene, so it is also the finest label.

use super::rig::RigJoint;
use super::skeleton::PlacedJoint;
use crate::geometry::Mesh;
use crate::math::Vec3;

/// What an organ is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
pub enum OrganKind {
    /// The flat part of a true leaf.
    Blade,
    /// The stalk of a leaf, with the raised midrib that continues it under the blade.
    Petiole,
    /// The flat part of a seed leaf.
    Cotyledon,
    /// The stem below the seed leaves, with the crown that a rosette carries on it.
    Hypocotyl,
    /// The stem above the seed leaves, scapes and the stalks of flowers too.
    Stem,
    /// The lower part of a grass leaf, rolled round the stem.
    Sheath,
    /// A single flower that is open, stamens and sepals too.
    Flower,
    /// A flower or head that is closed.
    Bud,
    /// The head of a composite: disc, rays, bracts.
    Head,
    /// An ear or spike: wheat, maize with its husks and silks.
    Ear,
    /// A tassel.
    Tassel,
    /// A pod, silicle, silique or capsule.
    Pod,
    /// A berry.
    Berry,
}

impl OrganKind {
    /// Lower-case name.
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

/// How large a leaf is, flat and whole, metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LeafSize {
    /// Length of its blade along the midrib, of a compound leaf along the rachis.
    pub length: f32,
    /// Largest width of the blade.
    pub width: f32,
    /// Length of its petiole, of a grass leaf of its sheath.
    pub petiole: f32,
}

/// Where a leaf's blade begins and ends, the keypoints of a leaf, how large it is, and how it bends.
#[derive(Clone, Debug, PartialEq)]
pub struct LeafAxis {
    /// The leaf, counted as in [`Organ::leaf`].
    pub leaf: u16,
    /// The base of the blade's midrib, where the stalk ends, metres.
    pub base: Vec3,
    /// The midrib's tip, metres.
    pub tip: Vec3,
    /// Its size.
    pub size: LeafSize,
    /// The joints of its kinematic tree, metres; those of a compound leaf along its rachis.
    pub joints: Vec<PlacedJoint>,
    /// All its joints with their axes; none unless asked for by [`GrowOptions::rigged`](super::GrowOptions::rigged).
    pub rig: Vec<RigJoint>,
    /// Where it stands on its plant's stems; nowhere where its sheath begins at the soil.
    pub on: Option<OnStem>,
    /// The joint of its plant's stems that bears it, a place in [`Plant::rig`](super::Plant::rig); none without that.
    pub bearer: Option<u16>,
}

/// A place on a plant's stems.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OnStem {
    /// [`StemLine::number`].
    pub line: u32,
    /// How far along it: 1.5 is half-way from its second point to its third.
    pub at: f32,
}

/// The middle line of a stem.
#[derive(Clone, Debug, PartialEq)]
pub struct StemLine {
    /// Its number, from 0: that of a stem is larger than that of the one that bears it.
    pub number: u32,
    /// Its points from foot to tip, metres.
    pub points: Vec<Vec3>,
    /// Where it stands on another; nowhere where it leaves the soil.
    pub on: Option<OnStem>,
}

impl StemLine {
    /// Its tip.
    pub(super) fn end(&self) -> OnStem {
        OnStem { line: self.number, at: self.points.len().saturating_sub(1) as f32 }
    }
}

/// Corners of an organ that follow each other in its mesh, and the stem that carries them.
#[derive(Clone, Debug, PartialEq)]
pub struct Carried {
    /// How many they are.
    pub corners: usize,
    /// Its number.
    pub line: u32,
    /// How far along it they stand, of what is borne by it; without, each corner is carried by what is next to it.
    pub at: Option<f32>,
}

impl LeafAxis {
    /// The same with all its points moved by a rigid motion, or by one that changes all lengths alike; its size is what it was.
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
    /// What it is.
    pub kind: OrganKind,
    /// The leaf it belongs to, counted from 1 in order of appearance, seed leaves first; 0 for what belongs to no leaf: stem,
    /// hypocotyl, flowers and fruits.
    pub leaf: u16,
    /// Its key in the species file's `materials`.
    pub material: String,
    /// Its shape in plant coordinates: metres, growth axis +z, origin where the stem meets the soil.
    pub mesh: Mesh,
    /// Of a blade, and of nothing else: its leaf's keypoints, size and joints, in the same coordinates.
    pub axis: Option<LeafAxis>,
    /// The middle lines of the stems in it, in the same coordinates.
    pub lines: Vec<StemLine>,
    /// What carries its mesh; empty where that is its leaf.
    pub carried: Vec<Carried>,
}

impl Organ {
    /// An organ of a leaf.
    pub(super) fn of_leaf(kind: OrganKind, leaf: u16, material: &str, mesh: Mesh, axis: Option<LeafAxis>) -> Self {
        Self { kind, leaf, material: material.to_owned(), mesh, axis, lines: Vec::new(), carried: Vec::new() }
    }

    /// A stem along a line.
    pub(super) fn stem(kind: OrganKind, material: String, mesh: Mesh, line: StemLine) -> Self {
        let carried = vec![Carried { corners: mesh.positions.len(), line: line.number, at: None }];
        Self { kind, leaf: 0, material, mesh, axis: None, lines: vec![line], carried }
    }

    /// Where what is last in its mesh ends, of a stem.
    pub(super) fn end(&self) -> Option<OnStem> {
        let last = self.carried.last()?;
        let own = self.lines.iter().find(|line| line.number == last.line).map(StemLine::end);
        own.or_else(|| Some(OnStem { line: last.line, at: last.at? }))
    }
}

/// The number of the next line of these organs' stems.
pub(super) fn next_line(organs: &[Organ]) -> u32 {
    organs.iter().map(|organ| organ.lines.len()).sum::<usize>() as u32
}
