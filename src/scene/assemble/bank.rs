//! Plants that share their meshes, so that a hectare of them fits into memory.
//!
//! Where `detail` is `Instanced`, what stands so far away that a pixel shows more than [`COARSE`] of it is no plant of its own shape: each
//! population has a bank of plants, grown as all of its plants are, and each plant stands in the field as an instance of one of them,
//! turned by an angle of its own and leant as its ground. Which one that is, and how it is turned, follows from the plant's own stream
//! alone, so it does not depend on what else is in view.

use super::builder::Builder;
use super::grown::Grown;
use super::member::Member;
use super::seedling::{Place, Seedling, grow};
use crate::Result;
use crate::geometry::Placement;
use crate::math::{Frame, Mat3, Spectrum, Vec2, Vec3};
use crate::plant::LeafAxis;
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
}

impl Model {
    /// What is known of the plant of `seedling`, an instance of this one that stands at `foot` on ground with this normal, and how it stands.
    pub(super) fn stand(&self, seedling: &Seedling, foot: Vec3, normal: Vec3) -> (PlantRecord, Placement) {
        let turn = Member::turn(&seedling.stream);
        let ahead = Vec3::new(turn.sin(), turn.cos(), 0.0);
        let frame = Frame::with_tangent(normal, ahead.cross(normal));
        let at = Placement { rotation: Mat3::from_cols(frame.x, frame.y, frame.z), offset: foot };
        let axes: Vec<LeafAxis> = self.record.leaf_axes.iter().map(|a| a.clone().moved(|p| at.point(p))).collect();
        let axis = at.direction(self.record.axis);
        let record = PlantRecord { id: seedling.id, position: foot, axis, leaf_axes: axes, ..self.record.clone() };
        (record, at)
    }
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
        let raise = |(member, like): &(Member, &Seedling)| {
            self.options.wanted()?;
            let stream = self.stream(Purpose::Plant, member.population).child(BANK, member.number);
            let own = Seedling { position: Vec2::ZERO, turn: 0.0, member: None, stream, ..(*like).clone() };
            let place = Place { height: 0.0, normal: Vec3::Z, dust, cell: member.cell(), rigged: false };
            let (record, organs) = grow(&own, &place, |_| true);
            Ok((*member, Arc::new(Model { record, organs })))
        };
        wanted.par_iter().map(raise).collect()
    }
}
