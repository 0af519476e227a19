//! State of a plant at an age, before any geometry is built: interpolation between two stages.
//!
//! Between two stages every number is interpolated by age. A layer that only the later stage has grows from size zero,
//! upright and folded like a bud. A leaf shorter than [`BUD`] is still hidden and is left out.

use super::desc::{PlantDesc, Stage};
use super::kind::LeafKind;
use super::numbers::Numbers;
use super::organ::OrganKind;
use super::senescence::End;
use super::stage::{BUD, MOST_SHOOTS, StageDesc};
use furrow_base::math::{RoundTo, ToFloat, ToInt, lerp};
use furrow_base::ron_file::{Bound, NonNegative, Vary};
use furrow_base::sampling::{Purpose, Stream};
use std::f32::consts::PI;

/// Default shortest cell of a blade's mesh, metres: about the footprint of four pixels of a field camera.
pub(super) const CELL: f32 = 0.9e-3;

/// One leaf at the current age. Lengths in metres, angles in radians.
#[derive(Clone, Debug)]
pub(super) struct LeafState<'a> {
    /// Leaf number, from 1.
    pub(super) number: u16,
    /// Layer, from 0.
    pub(super) layer: usize,
    pub(super) kind_name: &'a str,
    pub(super) kind: &'a LeafKind,
    /// Azimuth, clockwise from north.
    pub(super) azimuth: f32,
    pub(super) blade: f32,
    pub(super) width: f32,
    pub(super) stalk: f32,
    pub(super) angle: f32,
    pub(super) pitch: f32,
    pub(super) bend: f32,
    pub(super) fold: f32,
    /// Twist in addition to the kind's.
    pub(super) twist: f32,
    /// Arch of the stalk in addition to the kind's.
    pub(super) arch: f32,
    /// Curl of each half in addition to the kind's.
    pub(super) curl: f32,
    /// Amplitude of waves and blisters in addition to the kind's, as a fraction of the length.
    pub(super) crumple: f32,
    /// Progress of senescence: 0 green, 1 dead.
    pub(super) senescence: f32,
    /// Height of the ground's crumbs around the plant, metres.
    pub(super) rise: f32,
    /// Shortest cell of its mesh, metres.
    pub(super) cell: f32,
    /// Whether its meshes keep the skin weights.
    pub(super) rigged: bool,
    /// Random stream of this leaf.
    pub(super) stream: Stream,
    /// Random stream of the plant, for properties that all its leaves share.
    pub(super) plant: &'a Stream,
}

/// The plant at the current age, before any geometry is built.
#[derive(Clone, Debug)]
pub(super) struct Growth<'a> {
    pub(super) desc: &'a PlantDesc,
    pub(super) bbch: u32,
    pub(super) age_days: f32,
    /// Height of the first layer, metres.
    pub(super) hypocotyl: f32,
    /// Width of the stem at the soil, metres.
    pub(super) stem: f32,
    /// Number of side shoots or further stems: whole at the stages; a shoot that appears or disappears in between
    /// counts as a fraction.
    pub(super) tillers: f32,
    /// How much of their lag behind the main shoot the side shoots of a grass, or the other stems of an upright plant,
    /// have made up, 0–1.
    pub(super) tillers_grown: f32,
    /// Number of side shoots of each side shoot, likewise.
    pub(super) branches: f32,
    /// Numbering of the leaves.
    pub(super) numbers: Numbers,
    /// Layer and azimuth of each axil from below, including those of withered leaves.
    pub(super) axils: Vec<(usize, f32)>,
    /// Height of each layer above the first, metres.
    pub(super) rise: Vec<f32>,
    pub(super) leaves: Vec<LeafState<'a>>,
    /// Factor on all sizes of this plant.
    pub(super) vigour: f32,
    /// Whether its leaves keep their joints.
    pub(super) rigged: bool,
    /// The two stages around the current age, for inflorescences.
    pub(super) between: StageInterpolation<'a>,
    /// Random stream of the plant.
    pub(super) stream: &'a Stream,
}

impl Growth<'_> {
    /// Returns the shortest cell of the plant's meshes, metres.
    pub(super) fn cell(&self) -> f32 {
        self.leaves.first().map_or(CELL, |leaf| leaf.cell)
    }

    /// Returns the angle between axis and vertical, radians. Advances `stream` as if the plant's `lean_deg` had been
    /// drawn, so that the direction of the lean does not depend on the stages.
    pub(super) fn lean(&self, stream: &mut Stream) -> f32 {
        let of = |stage: &StageDesc| stage.lean_deg.as_ref().unwrap_or(&self.desc.lean_deg).draw32(&mut stream.clone());
        let degrees = lerp(of(self.between.from), of(self.between.to), self.between.u);
        self.desc.lean_deg.draw32(stream);
        degrees.to_radians()
    }

    /// Returns the difference between the lean at this stage and the plant's `lean_deg`, radians.
    pub(super) fn lean_further(&self, stream: &Stream) -> f32 {
        let plain = self.desc.lean_deg.draw32(&mut stream.clone()).to_radians();
        self.lean(&mut stream.clone()) - plain
    }
}

/// Iterates over `many` shoots: the index of each and the fraction of it that has grown, 0–1.
pub(super) fn shoots(many: f32) -> impl Iterator<Item = (usize, f32)> {
    let most = many.ceil().max(0.0).trunc_to::<usize>().min(MOST_SHOOTS);
    (0..most).map(move |k| (k, (many - k.to_f32()).clamp(0.0, 1.0)))
}

/// Two neighbouring stages and the position between them.
#[derive(Clone, Copy, Debug)]
pub(super) struct StageInterpolation<'a> {
    pub(super) from: &'a StageDesc,
    pub(super) to: &'a StageDesc,
    /// 0 at the first, 1 at the second.
    pub(super) u: f32,
}

impl<'a> StageInterpolation<'a> {
    fn find(stages: &'a [StageDesc], stage: Stage) -> Option<Self> {
        let key = |s: &StageDesc| match stage {
            Stage::Age(_) => s.days.f32(),
            Stage::Bbch(_) => s.bbch.to_f32(),
        };
        let x = match stage {
            Stage::Age(days) => days,
            Stage::Bbch(code) => code.to_f32(),
        };
        let after = stages.partition_point(|s| key(s) <= x);
        let from = stages.get(after.saturating_sub(1))?;
        let to = stages.get(after).unwrap_or(from);
        let span = key(to) - key(from);
        let u = if span > 0.0 { ((x - key(from)) / span).clamp(0.0, 1.0) } else { 0.0 };
        Some(Self { from, to, u })
    }

    /// Interpolates a number between the two stages. Both ends are drawn from the same random numbers, so a plant that
    /// is large at one stage is large at the next. `absent` is the value at the earlier stage of a layer that only the
    /// later one has; by default the later value.
    pub(super) fn draw<B: Bound, T>(
        &self,
        ends: (Option<&T>, &T),
        absent: Option<f32>,
        stream: &Stream,
        slot: u64,
        pick: impl Fn(&T) -> &Vary<B>,
    ) -> f32 {
        let draw = |desc| pick(desc).draw32(&mut stream.child(Purpose::Leaf, slot));
        let to = draw(ends.1);
        if self.u == 0.0 && ends.0.is_some_and(|from| std::ptr::eq(from, ends.1)) {
            return to;
        }
        lerp(ends.0.map_or(absent.unwrap_or(to), draw), to, self.u)
    }
}

/// Returns the BBCH code of ground cover selected by `code` and the age in days at which the crop reaches it; `None` if
/// `code` belongs to the stages of the species file.
fn covering(desc: &PlantDesc, code: u32) -> Option<(u32, f32)> {
    // Codes of later principal stages belong to the stages, if the species file has such stages.
    if code >= 40 && desc.stages.last().is_some_and(|last| last.bbch >= 40) {
        return None;
    }
    let (before, early) = desc.cover_days.range(..=code).next_back()?;
    let Some((after, late)) = desc.cover_days.range(code..).next() else { return Some((*before, early.f32())) };
    let u = (code - before).to_f32() / (after - before).max(1).to_f32();
    Some((code, lerp(early.f32(), late.f32(), u)))
}

/// Returns the age in days after emergence at which a plant reaches `stage`.
pub(super) fn age(desc: &PlantDesc, stage: Stage) -> f32 {
    let code = match stage {
        Stage::Age(days) => return days,
        Stage::Bbch(code) => code,
    };
    let between = || {
        let between = StageInterpolation::find(&desc.stages, stage);
        between.map_or(0.0, |StageInterpolation { from, to, u }| lerp(from.days.f32(), to.days.f32(), u))
    };
    covering(desc, code).map_or_else(between, |(_, days)| days)
}

/// Returns the azimuth that the leaf azimuths of the plant of `stream` are relative to, radians clockwise from north.
pub(super) fn turn(stream: &Stream) -> f32 {
    stream.child(Purpose::Plant, 0).child(Purpose::Plant, 1).range32(0.0, 2.0 * PI)
}

/// Returns the state of the plant of `stream` at `stage`; `None` without stages. All sizes except the height of the
/// hypocotyl are multiplied by `vigour`.
pub(super) fn growth<'a>(desc: &'a PlantDesc, stage: Stage, stream: &'a Stream, vigour: f32) -> Option<Growth<'a>> {
    const MM: f32 = 1e-3;
    let covering = match stage {
        Stage::Bbch(code) => covering(desc, code),
        Stage::Age(_) => None,
    };
    let stage = covering.map_or(stage, |(_, days)| Stage::Age(days));
    let between = StageInterpolation::find(&desc.stages, stage)?;
    let StageInterpolation { from, to, u } = between;
    let whole = (Some(from), to);
    let own = stream.child(Purpose::Plant, 0);
    let stem = between.draw(whole, None, &own, 3, |s| &s.stem_mm) * MM * vigour;
    let vigour = vigour * desc.vigour.draw32(&mut own.child(Purpose::Plant, 0));
    let spin = turn(stream);
    let hypocotyl = between.draw(whole, None, &own, 2, |s| &s.hypocotyl_mm) * MM;
    // Rounded at both stages, so that the number of shoots is as written; in between shoots appear or disappear one by one.
    let whole_at = |slot: u64, pick: fn(&StageDesc) -> &Vary<NonNegative<1000>>| {
        let drawn = |stage| pick(stage).draw32(&mut own.child(Purpose::Leaf, slot)).round();
        lerp(drawn(from), drawn(to), u)
    };
    let (tillers, branches) = (whole_at(4, |s| &s.tillers), whole_at(5, |s| &s.branches));
    let (mut leaves, mut rise, mut height, mut number) = (Vec::new(), Vec::new(), 0.0, 0);
    let mut axils = Vec::new();
    let days = match stage {
        Stage::Age(days) => days.min(to.days.f32()),
        Stage::Bbch(_) => lerp(from.days.f32(), to.days.f32(), u),
    };
    for (k, layer) in to.layers.iter().enumerate() {
        let before = from.layers.get(k);
        let ends = (before, layer);
        let shared = own.child(Purpose::Plant, 16 + k.to_u64());
        height += between.draw(ends, Some(0.0), &shared, 0, |l| &l.internode_mm) * MM * vigour;
        rise.push(height);
        let alpha = between.draw(ends, None, &shared, 1, |l| &l.alpha);
        let n = layer.leaves.get().trunc_to::<u32>();
        let is_blade = |kind: &str| desc.kinds.get(kind).is_some_and(|kind| kind.organ == OrganKind::Blade);
        let end = End::of(&desc.senescence, &desc.stages, is_blade, k);
        // A leaf that falls keeps the size and the posture that it had.
        let ends = match before {
            Some(before) if end.before(to) => (Some(before), before),
            _ => ends,
        };
        for i in 0..n {
            number += 1;
            let plant = stream;
            let mut stream = stream.child(Purpose::Leaf, u64::from(number));
            let size = desc.size.draw32(&mut stream) * vigour;
            let jitter = desc.azimuth_deg.draw32(&mut stream).to_radians();
            let blade = between.draw(ends, Some(0.0), &stream, 1, |l| &l.blade_mm) * MM * size;
            let Some((name, kind)) = desc.kinds.get_key_value(&layer.kind) else { continue };
            let azimuth = spin + PI * (2.0 * i.to_f32() / n.to_f32() + alpha) + jitter;
            axils.push((k, azimuth));
            let senescence = desc.senescence.progress(&end, kind.organ, days, &stream);
            if blade < BUD || senescence >= 1.0 {
                continue;
            }
            let grown = before.map_or(u, |_| 1.0);
            let angle = between.draw(ends, None, &stream, 4, |l| &l.angle_deg).to_radians();
            let fold = between.draw(ends, None, &stream, 7, |l| &l.fold_deg).to_radians();
            leaves.push(LeafState {
                number,
                layer: k,
                kind_name: name,
                kind,
                azimuth,
                blade,
                width: between.draw(ends, Some(0.0), &stream, 2, |l| &l.width_mm) * MM * size,
                stalk: between.draw(ends, Some(0.0), &stream, 3, |l| &l.stalk_mm) * MM * size,
                angle: angle * lerp(0.5, 1.0, grown),
                pitch: between.draw(ends, None, &stream, 5, |l| &l.pitch_deg).to_radians(),
                bend: between.draw(ends, Some(0.0), &stream, 6, |l| &l.bend_deg).to_radians(),
                fold: lerp(fold.max(0.9), fold, grown),
                twist: 0.0,
                arch: 0.0,
                curl: 0.0,
                crumple: 0.0,
                senescence,
                rise: 0.0,
                cell: CELL,
                rigged: false,
                stream,
                plant,
            });
        }
    }
    Some(Growth {
        desc,
        bbch: match (covering, stage) {
            (Some((code, _)), _) => code,
            (None, Stage::Bbch(code)) => code.clamp(from.bbch, to.bbch),
            (None, Stage::Age(_)) => from.bbch,
        },
        age_days: match stage {
            Stage::Age(days) => days,
            Stage::Bbch(_) => lerp(from.days.f32(), to.days.f32(), u),
        },
        hypocotyl,
        stem,
        tillers,
        tillers_grown: lerp(from.tiller_growth.f32(), to.tiller_growth.f32(), u),
        branches,
        numbers: Numbers::of(desc),
        axils,
        rise,
        leaves,
        vigour,
        rigged: false,
        between,
        stream,
    })
}
