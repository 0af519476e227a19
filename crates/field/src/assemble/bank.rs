//! Banks of plants that share their meshes, so that a hectare of plants fits into memory.
//!
//! With `detail: Instanced`, a plant has no shape of its own if it is so far away that a pixel shows more than [`COARSE`] of it. Each
//! population has a bank of plants, grown like all plants of the population. A distant plant is an instance of one of them, with its own
//! rotation and size, and tilted like the ground below it. The choice, the rotation and the size follow only from the plant's own random
//! stream, so they do not depend on the rest of the view.
//!
//! The chlorophyll content is also the plant's own: the value that it would have if it were grown. There are only as many materials as
//! bank plants, so each organ of an instance has a factor on the R, G and B of its material: R(Cᵢ) / R(Cₘ), where R is the reflectance of
//! the leaf model, and Cᵢ and Cₘ are the chlorophyll contents of the organ on this plant and on the bank plant.
//!
//! The product is the organ's colour on this plant. Near infrared and transmittance are derived from it during shading and never sum to
//! more than 0.99 with it ([`furrow_optics::optics::LeafOptics::at`]). Damage is that of the bank plant.

use super::detail::MeshDetail;
use super::drawn::Drawn;
use super::grown::GrownOrgan;
use super::member::Member;
use super::progress::Stage;
use super::seedling::{PlantSite, Seedling, greenness, grow};
use crate::PlantRecord;
use furrow_base::Result;
use furrow_base::geometry::Placement;
use furrow_base::math::{Frame, Mat3, Spectrum, Vec2, Vec3};
use furrow_base::sampling::{Purpose, Stream};
use furrow_grow::plant::{LeafAxis, LeafSize};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Minimum pixel footprint on a plant that is an instance, metres: a beet blade is then about forty pixels long.
const COARSE: f32 = 2.5e-3;
/// Purpose of the random streams of bank plants; plants of the field use [`Purpose::Plant`].
const BANK: Purpose = Purpose::Scatter;

/// A grown bank plant, in plant coordinates.
pub(super) struct Model {
    record: PlantRecord,
    /// Organs; `None` if the plant has not emerged.
    pub(super) organs: Option<Vec<GrownOrgan>>,
    /// Chlorophyll relative to the species' mean.
    green: f32,
}

impl Model {
    /// Places `seedling` as an instance of this plant at `foot`, on ground with this normal.
    pub(super) fn stand(&self, seedling: &Seedling, foot: Vec3, normal: Vec3) -> (PlantRecord, Variation) {
        let turn = Member::turn(&seedling.stream);
        let ahead = Vec3::new(turn.sin(), turn.cos(), 0.0);
        let frame = Frame::with_tangent(normal, ahead.cross(normal));
        // Species whose plants are all alike have one size.
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

/// Differences of an instance from its bank plant.
pub(super) struct Variation {
    /// Position, rotation and scale.
    pub(super) at: Placement,
    /// Factor on the chlorophyll content of all organs.
    pub(super) greener: f32,
}

/// Transforms the axis and the sizes of a bank plant's leaf to those of an instance.
fn placed(axis: &LeafAxis, at: &Placement) -> LeafAxis {
    let LeafSize { length, width, petiole } = axis.size;
    let size = LeafSize { length: length * at.scale, width: width * at.scale, petiole: petiole * at.scale };
    LeafAxis { size, ..axis.clone().moved(|p| at.point(p)) }
}

/// Returns the bank plant that the plant at `at` is an instance of; `None` if the plant has its own shape.
pub(super) fn member(drawn: &Drawn<'_>, population: u64, stream: &Stream, at: Vec2) -> Option<Member> {
    let whole = drawn.options.preview.is_some() || drawn.options.rigged;
    let shared = drawn.detail == MeshDetail::Instanced && !whole && drawn.camera_pixel_at(at) >= COARSE;
    shared.then(|| Member::of(population, stream, drawn.cell(at)))
}

/// Grows the bank plants that these seedlings are instances of.
pub(super) fn bank(drawn: &Drawn<'_>, seedlings: &[Seedling], dust: Spectrum) -> Result<BTreeMap<Member, Arc<Model>>> {
    let mut wanted: BTreeMap<Member, &Seedling> = BTreeMap::new();
    for seedling in seedlings {
        if let Some(member) = seedling.member {
            wanted.entry(member).or_insert(seedling);
        }
    }
    let wanted: Vec<(Member, &Seedling)> = wanted.into_iter().collect();
    let progress = &drawn.options.progress;
    if !wanted.is_empty() {
        progress.enter(Stage::Shared);
        progress.shared.expect(wanted.len());
    }
    let raise = |(member, like): &(Member, &Seedling)| {
        drawn.options.wanted()?;
        let stream = drawn.stream(Purpose::Plant, member.population).child(BANK, member.number);
        let own = Seedling { position: Vec2::ZERO, turn: 0.0, member: None, stream, ..(*like).clone() };
        let place = PlantSite { height: 0.0, normal: Vec3::Z, rise: 0.0, dust, cell: member.cell(), rigged: false };
        let (record, organs) = grow(&own, &place, |_| true)?;
        Ok((*member, Arc::new(Model { record, organs, green: greenness(&own) })))
    };
    wanted.par_iter().map(raise).inspect(|_| progress.shared.add()).collect()
}
