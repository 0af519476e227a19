//! Plants in a condition: leaf by leaf, what is cut out of it and what its tissue has become.

use super::grown::Grown;
use crate::geometry::Mesh;
use crate::material::{ConditionOptics, LeafMaterial};
use crate::math::{Spectrum, Vec2};
use crate::optics::Pigments;
use crate::plant::condition::{Bearer, Marks, leaf_stream};
use crate::plant::{Condition, ConditionDesc, LeafLife, OrganKind};
use crate::sampling::{Purpose, Stream};
use crate::scene::library::Choice;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Size of the image of a blade that has none, mm: what varies over it does so too little to be seen.
const NO_IMAGE_MM: Vec2 = Vec2::splat(30.0);

/// Days in which a leaf meets as much as a scene file says of the oldest: young ones are eaten for about three weeks, until they are tough.
const MARKED_DAYS: f32 = 21.0;

/// A plant's condition as it was drawn.
pub(super) struct Ailing<'a> {
    desc: &'a ConditionDesc,
    drawn: Condition,
    /// The plant's.
    stream: &'a Stream,
    /// Reflectance of the soil that lies on leaves.
    soil: Spectrum,
    /// Of a plant that is seen on several days: its age in days, and its leaves over time.
    over_days: Option<(f32, BTreeMap<u16, LeafLife>)>,
}

/// An organ before its condition.
pub(super) struct Bare<'a> {
    /// What it is.
    pub(super) kind: OrganKind,
    /// Its material.
    pub(super) choice: &'a Choice,
    /// That material at the organ's age.
    pub(super) material: &'a LeafMaterial,
    /// What its material is made of.
    pub(super) pigments: &'a Pigments,
    /// Factor on its chlorophyll.
    pub(super) green: f32,
    /// Height of the plant's foot.
    pub(super) ground: f32,
    /// Number of the plant's last leaf.
    pub(super) last: u16,
}

impl<'a> Ailing<'a> {
    /// Draws the condition of the plant of `stream`.
    pub(super) fn new(desc: &'a ConditionDesc, stream: &'a Stream, soil: Spectrum) -> Self {
        Self { desc, drawn: desc.draw(stream), stream, soil, over_days: None }
    }

    /// From now on with the marks that it has at an age of so many days: those that it had before, where they were, and more.
    pub(super) fn over_days(&mut self, lives: BTreeMap<u16, LeafLife>, days: f32) {
        self.over_days = Some((days, lives));
    }

    /// The share of its marks that a leaf has met by now, and the size that marks are measured on, mm.
    fn met(&self, leaf: u16, share: f32) -> Option<(f32, Vec2)> {
        let (days, lives) = self.over_days.as_ref()?;
        let life = lives.get(&leaf)?;
        let met = ((days - life.appears_days) / MARKED_DAYS).clamp(0.0, 1.0);
        Some((met, Vec2::new(life.width, life.blade) * 1e3 * share.sqrt()))
    }

    /// As growing asks for it.
    pub(super) fn posture(&self) -> (&ConditionDesc, &Condition) {
        (self.desc, &self.drawn)
    }

    /// As it was drawn.
    pub(super) fn drawn(&self) -> Condition {
        self.drawn
    }

    /// The organ as its condition has it: one part, or one for each leaflet.
    pub(super) fn dress(&self, grown: &Grown, bare: &Bare<'_>) -> Vec<Grown> {
        let leaf = grown.part.tag.leaf;
        let age = match leaf {
            0 => 1.0,
            _ => 1.0 - f32::from(leaf - 1) / f32::from(bare.last.max(2) - 1),
        };
        let stream = leaf_stream(self.stream, leaf);
        let green = if leaf == 0 { self.drawn.greenness } else { self.desc.green(&self.drawn, age, &stream) };
        let gloss = if leaf == 0 { 1.0 } else { self.desc.gloss(&stream) };
        let base = bare.pigments.chlorophyll.f32();
        let own = bare.material.with_chlorophyll(base, bare.green * green);
        let blade = matches!(bare.kind, OrganKind::Blade | OrganKind::Cotyledon);
        // What stands apart is eaten apart: leaflets share a picture, not their holes.
        let pieces = match grown.part.mesh.image_size() {
            Some(_) if blade && bare.choice.pictured => grown.part.mesh.pieces(),
            _ => vec![Mesh::clone(&grown.part.mesh)],
        };
        let share = 1.0 / pieces.len().max(1) as f32;
        let mut dressed = Vec::with_capacity(pieces.len());
        for (k, mesh) in pieces.into_iter().enumerate() {
            let of_piece = stream.child(Purpose::Condition, 100 + k as u64);
            let marks = blade.then(|| self.marks(leaf, &mesh, (age, share), bare, &of_piece));
            let chlorophyll = base * bare.green * green;
            let mut one = Grown { chlorophyll, material: own.clone(), ..grown.with(mesh) };
            if let Some(marks) = marks.as_ref().filter(|m| m.cuts()) {
                one.part.mask = Some(Arc::new(marks.cut(one.part.mask.as_deref())));
            }
            let marked = marks.as_ref().is_some_and(|m| !m.nothing());
            let wears = marked || self.drawn.reddening > 0.0 || gloss != 1.0;
            one.own |= wears || green != 1.0;
            if wears {
                let of = (bare.pigments, bare.choice.tones(bare.pigments));
                one.material = own.worn(ConditionOptics::new(of, marks, self.drawn.reddening, self.soil), gloss);
            }
            dressed.push(one);
        }
        dressed
    }

    fn marks(&self, leaf: u16, mesh: &Mesh, (age, share): (f32, f32), bare: &Bare<'_>, stream: &Stream) -> Marks {
        let middle = mesh.positions.iter().map(|p| p.z).sum::<f32>() / mesh.positions.len().max(1) as f32;
        let image = mesh.image_size().filter(|_| bare.choice.pictured);
        let met = self.met(leaf, share);
        let bearer = Bearer {
            age,
            cotyledon: bare.kind == OrganKind::Cotyledon,
            share,
            height: middle - bare.ground,
            met: met.map(|(share, _)| share),
            image_mm: image.map_or(NO_IMAGE_MM, |size| met.map_or(size * 1e3, |(_, mm)| mm).max(Vec2::splat(0.1))),
            mask: bare.choice.mask.as_deref(),
            margin: bare.choice.margin.as_ref(),
        };
        // A ribbon is too narrow to be bitten or spotted, and has no places to tell apart.
        let all_over = Condition { chlorosis: self.drawn.chlorosis, dust: self.drawn.dust, ..Condition::default() };
        let drawn = if image.is_some() { &self.drawn } else { &all_over };
        Marks::draw(self.desc, drawn, &bearer, stream)
    }
}
