//! Applies a plant's condition to its organs: holes in the opacity mask, and changed tissue optics, leaf by leaf.

use super::grown::GrownOrgan;
use crate::species::Choice;
use furrow_base::geometry::Mesh;
use furrow_base::math::{Spectrum, ToFloat, ToInt, Vec2};
use furrow_base::sampling::{Purpose, Stream};
use furrow_grow::plant::condition::{Bearer, leaf_stream};
use furrow_grow::plant::{Condition, ConditionDesc, LeafLife, OrganKind};
use furrow_optics::optics::Pigments;
use furrow_optics::texture::marks::Marks;
use furrow_render::material::{ConditionOptics, LeafMaterial};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Image size assumed for a blade without an image, mm; variation over such a blade is too small to be seen.
const NO_IMAGE_MM: Vec2 = Vec2::splat(30.0);

/// Days after which a leaf has all the damage that the scene file describes: leaves are eaten for about three weeks, until they are tough.
const MARKED_DAYS: f32 = 21.0;

/// Delay of a stalk's senescence relative to its blade's, in progress of senescence.
const STALK_LATER: f32 = 0.15;
/// Relative increase of a dead leaf's roughness.
const DULL: f32 = 0.8;

/// A plant's condition, drawn from its description.
pub(super) struct PlantCondition<'a> {
    desc: &'a ConditionDesc,
    drawn: Condition,
    /// Random stream of the plant.
    stream: &'a Stream,
    /// Reflectance of the soil that covers leaves as dust.
    soil: Spectrum,
    /// For a plant that is imaged on several days: its age in days, and the lives of its leaves.
    over_days: Option<(f32, BTreeMap<u16, LeafLife>)>,
}

/// Properties of an organ before its condition is applied.
pub(super) struct HealthyOrgan<'a> {
    /// Kind of the organ.
    pub(super) kind: OrganKind,
    /// Drawn variant of its material.
    pub(super) choice: &'a Choice,
    /// Material tinted for the organ's age.
    pub(super) material: &'a LeafMaterial,
    /// Pigments of the material.
    pub(super) pigments: &'a Pigments,
    /// Factor on the chlorophyll content.
    pub(super) green: f32,
    /// Height of the plant's foot, metres.
    pub(super) ground: f32,
    /// Number of the plant's last leaf.
    pub(super) last: u16,
    /// Progress of the leaf's senescence: 0 green, 1 dead.
    pub(super) senescence: f32,
}

impl HealthyOrgan<'_> {
    /// Returns `true` for the flat part of a leaf.
    fn flat(&self) -> bool {
        matches!(self.kind, OrganKind::Blade | OrganKind::Cotyledon)
    }

    /// Adds the senescence of the organ to `marks`.
    fn aged(&self, marks: Marks) -> Marks {
        let whole = !self.flat();
        // A stalk yellows after its blade.
        let senescence = if whole { (self.senescence - STALK_LATER).max(0.0) } else { self.senescence };
        Marks { senescence, whole, ..marks }
    }

    /// Returns the factor on the roughness of the surface: a dry leaf is dull.
    fn dull(&self) -> f32 {
        1.0 + DULL * self.senescence
    }
}

/// Gives an organ of a plant without a condition the tissue of its senescence; `plant` is the plant's random stream.
pub(super) fn fade(grown: GrownOrgan, bare: &HealthyOrgan<'_>, plant: &Stream) -> GrownOrgan {
    if bare.senescence <= 0.0 {
        return grown;
    }
    let image = grown.part.mesh.image_size().filter(|_| bare.flat() && bare.choice.pictured);
    let marks = Marks {
        image_mm: image.map_or(NO_IMAGE_MM, |size| (size * 1e3).max(Vec2::splat(0.1))),
        seed: leaf_stream(plant, grown.part.tag.leaf).child(Purpose::Condition, 30).seed32(),
        margin: bare.choice.margin.clone().filter(|_| image.is_some()),
        ..Marks::default()
    };
    let optics = ConditionOptics::new(
        (bare.pigments, bare.choice.tones(bare.pigments)),
        Some(bare.aged(marks)),
        0.0,
        Spectrum::ZERO,
    );
    GrownOrgan { material: grown.material.worn(optics, bare.dull()), own: true, ..grown }
}

impl<'a> PlantCondition<'a> {
    /// Draws the condition of the plant with this random stream.
    pub(super) fn new(desc: &'a ConditionDesc, stream: &'a Stream, soil: Spectrum) -> Self {
        Self { desc, drawn: desc.draw(stream), stream, soil, over_days: None }
    }

    /// Limits the marks to those that the plant has at an age of `days`. Marks only accumulate: those of earlier days stay in place.
    pub(super) fn over_days(&mut self, lives: BTreeMap<u16, LeafLife>, days: f32) {
        self.over_days = Some((days, lives));
    }

    /// Returns the share of its final marks that a leaf has by now, and the blade size that marks are placed on, mm.
    fn met(&self, leaf: u16, share: f32) -> Option<(f32, Vec2)> {
        let (days, lives) = self.over_days.as_ref()?;
        let life = lives.get(&leaf)?;
        let met = ((days - life.appears_days) / MARKED_DAYS).clamp(0.0, 1.0);
        Some((met, Vec2::new(life.width, life.blade) * 1e3 * share.sqrt()))
    }

    /// Returns description and drawn values, as the growth model takes them.
    pub(super) fn posture(&self) -> (&ConditionDesc, &Condition) {
        (self.desc, &self.drawn)
    }

    /// Returns the drawn values.
    pub(super) fn drawn(&self) -> Condition {
        self.drawn
    }

    /// Applies the condition to an organ. Returns one organ, or one for each leaflet.
    pub(super) fn dress(&self, grown: &GrownOrgan, bare: &HealthyOrgan<'_>) -> Vec<GrownOrgan> {
        let leaf = grown.part.tag.leaf;
        let age = match leaf {
            0 => 1.0,
            _ => 1.0 - f32::from(leaf - 1) / f32::from(bare.last.max(2) - 1),
        };
        let stream = leaf_stream(self.stream, leaf);
        let green = if leaf == 0 { self.drawn.greenness } else { self.desc.green(&self.drawn, age, &stream) };
        let gloss = if leaf == 0 { 1.0 } else { self.desc.gloss(&stream) * bare.dull() };
        let base = bare.pigments.chlorophyll.f32();
        let own = bare.material.with_chlorophyll(base, bare.green * green);
        let blade = bare.flat();
        // Leaflets share an image but have separate holes.
        let pieces = match grown.part.mesh.image_size() {
            Some(_) if blade && bare.choice.pictured => grown.part.mesh.pieces(),
            _ => vec![Mesh::clone(&grown.part.mesh)],
        };
        let share = 1.0 / pieces.len().max(1).to_f32();
        let mut dressed = Vec::with_capacity(pieces.len());
        for (k, mesh) in pieces.into_iter().enumerate() {
            let of_piece = stream.child(Purpose::Condition, 100 + k.to_u64());
            let marks = blade.then(|| self.marks(leaf, &mesh, (age, share), bare, &of_piece));
            let old = bare.senescence > 0.0;
            let bearing = || Marks {
                image_mm: NO_IMAGE_MM,
                seed: of_piece.child(Purpose::Condition, 30).seed32(),
                ..Marks::default()
            };
            let marks = if old { Some(bare.aged(marks.unwrap_or_else(bearing))) } else { marks };
            let chlorophyll = base * bare.green * green;
            let mut one = GrownOrgan { chlorophyll, material: own.clone(), ..grown.with(mesh) };
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

    fn marks(
        &self,
        leaf: u16,
        mesh: &Mesh,
        (age, share): (f32, f32),
        bare: &HealthyOrgan<'_>,
        stream: &Stream,
    ) -> Marks {
        let middle = mesh.positions.iter().map(|p| p.z).sum::<f32>() / mesh.positions.len().max(1).to_f32();
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
        // A ribbon without an image is too narrow for bites and spots; only uniform effects apply.
        let all_over = Condition { chlorosis: self.drawn.chlorosis, dust: self.drawn.dust, ..Condition::default() };
        let drawn = if image.is_some() { &self.drawn } else { &all_over };
        bearer.draw_marks(self.desc, drawn, stream)
    }
}
