//! Plants that share their meshes, so that a hectare of them fits into memory.
//!
//! Where `detail` is `Instanced`, what stands so far away that a pixel shows more than [`COARSE`] of it is no plant of its own shape: each
//! population has a bank of plants, grown as all of its plants are, and each plant stands in the field as an instance of one of them,
//! turned by an angle and larger or smaller by a factor of its own, and leant as its ground. Which one that is, how it is turned and how large it is
//! follows from the plant's own stream alone, so it does not depend on what else is in view.
//!
//! Its chlorophyll is its own, too: what the plant would have if it grew. Materials are as many as plants in the bank, so each organ of an instance has a
//! factor on the R, G and B of its material, R(Cᵢ) / R(Cₘ), where R is the leaf model's reflectance, Cᵢ and Cₘ the chlorophyll contents of that
//! organ on this plant and on the bank's. The product is the colour that the organ would have on this plant; near infrared and transmittance follow from
//! it where it is shaded, and never sum to more than 0.99 with it ([`crate::optics::LeafOptics::at`]). Wear is that of the bank's plant.

use super::builder::Builder;
use super::grown::Grown;
use super::member::Member;
use super::progress::Stage;
use super::seedling::{Place, Seedling, greenness, grow};
use crate::Result;
use crate::geometry::Placement;
use crate::math::{Frame, Mat3, Spectrum, Vec2, Vec3};
use crate::plant::{LeafAxis, LeafSize};
use crate::sampling::{Purpose, Stream};
use crate::scene::PlantRecord;
use crate::scene::desc::Detail;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Side of the smallest pixel on a plant from which on it may be an instance, metres: blades of a beet are then some forty pixels long.
const COARSE: f32 = 2.5e-3;
/// Which of a population's streams its bank is grown from: plants of the field have those of [`Purpose::Plant`].
const BANK: Purpose = Purpose::Scatter;

/// A plant of a bank that has grown, in plant coordinates.
pub(super) struct Model {
    record: PlantRecord,
    /// None where it has not emerged.
    pub(super) organs: Option<Vec<Grown>>,
    /// Its chlorophyll over its species'.
    green: f32,
}

impl Model {
    /// The plant of `seedling`, an instance of this one that stands at `foot` on ground with this normal.
    pub(super) fn stand(&self, seedling: &Seedling, foot: Vec3, normal: Vec3) -> (PlantRecord, Variation) {
        let turn = Member::turn(&seedling.stream);
        let ahead = Vec3::new(turn.sin(), turn.cos(), 0.0);
        let frame = Frame::with_tangent(normal, ahead.cross(normal));
        // Plants that are all alike are of one size.
        let scale = if seedling.individual.is_some() { 1.0 } else { Member::size(&seedling.stream) };
        let at = Placement { rotation: Mat3::from_cols(frame.x, frame.y, frame.z), scale, offset: foot };
        let record = PlantRecord {
            id: seedling.id,
            position: foot,
            axis: at.direction(self.record.axis),
            height: self.record.height * scale,
            radius: self.record.radius * scale,
            leaf_axes: self.record.leaf_axes.iter().map(|axis| placed(axis, &at)).collect(),
            ..self.record.clone()
        };
        (record, Variation { at, greener: greenness(seedling) / self.green })
    }
}

/// How an instance differs from the plant of the bank.
pub(super) struct Variation {
    /// Where and how large it stands.
    pub(super) at: Placement,
    /// Factor on the chlorophyll of all its organs.
    pub(super) greener: f32,
}

/// The axis of a bank's leaf where an instance has it, as large as it is there.
fn placed(axis: &LeafAxis, at: &Placement) -> LeafAxis {
    let LeafSize { length, width, petiole } = axis.size;
    let size = LeafSize { length: length * at.scale, width: width * at.scale, petiole: petiole * at.scale };
    LeafAxis { size, ..axis.clone().moved(|p| at.point(p)) }
}

impl Builder<'_> {
    /// What the plant at a place is an instance of; none of one that has a shape of its own.
    pub(super) fn member(&self, population: u64, stream: &Stream, at: Vec2) -> Option<Member> {
        let whole = self.options.preview.is_some() || self.options.rigged;
        let shared = self.desc.detail == Detail::Instanced && !whole && self.camera_pixel_at(at) >= COARSE;
        shared.then(|| Member::of(population, stream, self.cell(at)))
    }

    /// The plants of banks that these are instances of.
    pub(super) fn bank(&self, seedlings: &[Seedling], dust: Spectrum) -> Result<BTreeMap<Member, Arc<Model>>> {
        let mut wanted: BTreeMap<Member, &Seedling> = BTreeMap::new();
        for seedling in seedlings {
            if let Some(member) = seedling.member {
                wanted.entry(member).or_insert(seedling);
            }
        }
        let wanted: Vec<(Member, &Seedling)> = wanted.into_iter().collect();
        let progress = &self.options.progress;
        if !wanted.is_empty() {
            progress.enter(Stage::Shared);
            progress.shared.expect(wanted.len());
        }
        let raise = |(member, like): &(Member, &Seedling)| {
            self.options.wanted()?;
            let stream = self.stream(Purpose::Plant, member.population).child(BANK, member.number);
            let own = Seedling { position: Vec2::ZERO, turn: 0.0, member: None, stream, ..(*like).clone() };
            let place = Place { height: 0.0, normal: Vec3::Z, dust, cell: member.cell(), rigged: false };
            let (record, organs) = grow(&own, &place, |_| true);
            Ok((*member, Arc::new(Model { record, organs, green: greenness(&own) })))
        };
        wanted.par_iter().map(raise).inspect(|_| progress.shared.add()).collect()
    }
}
