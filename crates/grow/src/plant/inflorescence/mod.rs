//! Flowering axes: scapes, flowering branches and peduncles, with their leaves, flowers and fruits.
//!
//! An axis starts at a tip, in an axil or along another axis. It turns up towards the light or arches over, evenly
//! along its length. Its leaves and flowers form a spiral with the golden angle. Between two stages every number is
//! interpolated, as for leaves; an axis or flower that only the later stage has grows from size zero. Flowering axes
//! have their own random streams, so a plant's leaves are the same with and without them.
//!
//! | file | contents |
//! |---|---|
//! | `seat` | tips and axils |

mod seat;

use super::flower;
use super::flower::bloom::Bloom;
use super::flower::head::GOLDEN;
use super::flower::mesher::FlowerMesher;
use super::growth::{Growth, LeafState, StageInterpolation};
use super::inflorescence_desc::{FlowersDesc, InflorescenceDesc, MOST_AXES, MOST_FLOWERS, Seat, StemLeafDesc};
use super::leaf::{self, Lower};
use super::organ::{self, Organ, OrganKind, StemLine, StemPosition};
use super::stage::BUD;
use furrow_base::math::{Frame, RoundTo, ToFloat, ToInt, Vec3, lerp};
use furrow_base::ron_file::{Bound, Vary};
use furrow_base::sampling::{Purpose, Stream};
use seat::AxisSite;

/// Index of a plant's child stream for its flowering axes.
const STREAM: u64 = 1 << 22;
/// Length below which axes, flowers and stalks are left out, metres.
const LEAST: f32 = 3e-4;
const MM: f32 = 1e-3;

/// An axis that has been built.
struct BuiltAxis {
    /// Number of its line among the plant's stems.
    line: u32,
    points: Vec<Vec3>,
    ways: Vec<Vec3>,
    /// Radii at base and tip, metres.
    radii: (f32, f32),
    /// Azimuth of the start of its spiral of leaves and flowers, radians.
    spin: f32,
}

impl BuiltAxis {
    /// Returns the position on the plant's stems of a point at a fraction of its length.
    fn on(&self, share: f32) -> StemPosition {
        StemPosition { line: self.line, at: share.clamp(0.0, 1.0) * (self.points.len() - 1).to_f32() }
    }

    /// Returns point, direction and radius at a fraction of its length.
    fn at(&self, share: f32) -> (Vec3, Vec3, f32) {
        let last = self.points.len() - 1;
        let t = share.clamp(0.0, 1.0) * last.to_f32();
        let i = t.trunc_to::<usize>().min(last - 1);
        let point = self.points[i].lerp(self.points[i + 1], t - i.to_f32());
        (point, self.ways[i.min(self.ways.len() - 1)], lerp(self.radii.0, self.radii.1, share))
    }
}

/// Builder of flowering axes.
struct AxisBuilder<'a, 'b> {
    growth: &'b Growth<'a>,
    organs: &'b mut Vec<Organ>,
    pen: FlowerMesher,
    /// Number of the next axis among the plant's stems.
    line: u32,
    axes: usize,
    flowers: usize,
}

/// Builds a plant's flowering axes with all that they bear.
pub(super) fn grow(organs: &mut Vec<Organ>, growth: &Growth<'_>, cell: f32) {
    let StageInterpolation { from, to, .. } = growth.between;
    if to.inflorescences.is_empty() && from.inflorescences.is_empty() {
        return;
    }
    let tips = seat::tips(organs, growth);
    let line = organ::next_line(organs);
    let mut grower = AxisBuilder { growth, organs, pen: FlowerMesher::new(cell), line, axes: 0, flowers: 0 };
    let mut grown: Vec<Vec<BuiltAxis>> = Vec::new();
    for (k, desc) in to.inflorescences.iter().enumerate() {
        let ends = (from.inflorescences.get(k), desc);
        let stream = growth.stream.child(Purpose::Plant, STREAM).child(Purpose::Plant, k.to_u64());
        let axes = grower.sort(k, ends, &stream, &tips, &grown);
        grown.push(axes);
    }
    let drawn = grower.pen.finish();
    organs.extend(drawn);
}

/// Descriptions at the earlier stage, if present, and at the later stage.
type Ends<'a, T> = (Option<&'a T>, &'a T);

/// Returns the earlier description, for values that cannot be interpolated, or the later one if there is none.
fn held<T>(ends: Ends<'_, T>) -> &T {
    ends.0.unwrap_or(ends.1)
}

impl<'a> AxisBuilder<'a, '_> {
    /// Builds all axes of one description. The random stream of an axis and the numbers of its leaves depend on its
    /// place only, so axes at other places may appear and disappear.
    fn sort(
        &mut self,
        sort: usize,
        ends: Ends<'a, InflorescenceDesc>,
        stream: &Stream,
        tips: &[AxisSite],
        grown: &[Vec<BuiltAxis>],
    ) -> Vec<BuiltAxis> {
        let between = self.growth.between;
        let count = |stream: &Stream| between.draw(ends, Some(0.0), stream, 0, |d| &d.count).round_to::<usize>();
        let most = between.to.inflorescences[sort].count.largest().round_to::<usize>();
        let most = most.max(between.from.inflorescences.get(sort).map_or(0, |d| d.count.largest().round_to::<usize>()));
        // Place, relative size, and index among all axes that this description may give.
        let mut places: Vec<(AxisSite, f32, usize)> = Vec::new();
        let base = |nth: usize, place: AxisSite, stream: &Stream, places: &mut Vec<(AxisSite, f32, usize)>| {
            places.extend((0..count(stream)).map(|i| (place, 1.0, nth * most + i)));
        };
        match &held(ends).at {
            Seat::Tip => tips.iter().take(1).for_each(|tip| base(0, *tip, stream, &mut places)),
            Seat::Tips => {
                for (k, tip) in tips.iter().enumerate() {
                    base(k, *tip, &stream.child(Purpose::Plant, k.to_u64()), &mut places);
                }
            }
            Seat::Axils { first, last } => {
                for number in *first..=*last {
                    if let Some(axil) = seat::axil(self.organs, number) {
                        let nth = (number - first).to_usize();
                        base(nth, axil, &stream.child(Purpose::Leaf, u64::from(number)), &mut places);
                    }
                }
            }
            Seat::On { axis, from, to } => {
                let named = |d: &InflorescenceDesc| d.name == *axis;
                let of = |d: &InflorescenceDesc, own: f32, pick: fn(f32, f32) -> f32| match &d.at {
                    Seat::On { from, to, .. } => pick(from.f32(), to.f32()),
                    _ => own,
                };
                let from = self.blend(ends, |d| of(d, from.f32(), |from, _| from));
                let to = self.blend(ends, |d| of(d, to.f32(), |_, to| to));
                let which = between.to.inflorescences[..grown.len()].iter().rposition(named);
                for (k, parent) in (0..).zip(which.map_or(&[][..], |i| &grown[i])) {
                    let count = count(&stream.child(Purpose::Plant, 1000 + k));
                    for i in 0..count {
                        let share = spaced(i, count);
                        let (point, along, _) = parent.at(lerp(from, to, share));
                        let out = seat::across(along, parent.spin + GOLDEN * i.to_f32());
                        let size = lerp(1.0, self.blend(ends, |d| d.top.f32()), share);
                        let on = Some(parent.on(lerp(from, to, share)));
                        places.push((AxisSite { point, along, out: Some(out), on }, size, k.to_usize() * most + i));
                    }
                }
            }
        }
        let mut all = Vec::with_capacity(places.len());
        for (place, size, nth) in places {
            if self.axes >= MOST_AXES {
                break;
            }
            self.axes += 1;
            let own = stream.child(Purpose::Plant, 1 << 20 | nth.to_u64());
            if let Some(axis) = self.axis((sort, nth), ends, &own, (place, size)) {
                all.push(axis);
            }
        }
        all
    }

    /// Interpolates a random number of an axis or of its leaves and flowers.
    fn draw<T, B: Bound>(
        &self,
        ends: Ends<'a, T>,
        absent: Option<f32>,
        (stream, slot): (&Stream, u64),
        pick: impl Fn(&T) -> &Vary<B>,
    ) -> f32 {
        self.growth.between.draw(ends, absent, stream, slot, pick)
    }

    /// Interpolates a fixed number between the earlier and the later stage.
    fn blend<T>(&self, ends: Ends<'a, T>, pick: impl Fn(&T) -> f32) -> f32 {
        let to = pick(ends.1);
        lerp(ends.0.map_or(to, pick), to, self.growth.between.u)
    }

    /// Builds one axis with its leaves and flowers. Returns `None` if it is too short.
    fn axis(
        &mut self,
        (sort, nth): (usize, usize),
        ends: Ends<'a, InflorescenceDesc>,
        own: &Stream,
        (place, size): (AxisSite, f32),
    ) -> Option<BuiltAxis> {
        let vigour = self.growth.vigour;
        let length = self.draw(ends, Some(0.0), (own, 1), |d| &d.length_mm) * MM * vigour * size;
        let width = self.draw(ends, Some(0.0), (own, 2), |d| &d.width_mm) * MM * vigour * size.sqrt();
        if length < LEAST {
            return None;
        }
        let angle = self.draw(ends, None, (own, 3), |d| &d.angle_deg).to_radians();
        let bend = self.draw(ends, None, (own, 4), |d| &d.bend_deg).to_radians();
        let mut stream = own.child(Purpose::Plant, 10);
        let spin = stream.range32(0.0, std::f32::consts::TAU);
        let out = place.out.unwrap_or_else(|| seat::across(place.along, spin + GOLDEN * nth.to_f32()));
        let along = (place.along * angle.cos() + out * angle.sin()).normalize_or(place.along);
        let radius = (0.5 * width).max(1.2e-4);
        let radii = (radius, radius * self.blend(ends, |d| d.taper.f32()));
        let (points, ways) = curve(place.point, along, (length, bend), radius, &mut stream);
        let axis = BuiltAxis { line: self.line, points, ways, radii, spin };
        self.line += 1;
        let of_stem = &self.growth.desc.stem_material;
        let material =
            [&held(ends).material, of_stem].into_iter().find(|m| !m.is_empty()).map_or("stalk", String::as_str);
        let line = StemLine { number: axis.line, points: axis.points.clone(), on: place.on };
        self.pen.stem(material, line, axis.radii);
        for (k, leaves) in ends.1.leaves.iter().enumerate() {
            let ends = (ends.0.and_then(|d| d.leaves.get(k)), leaves);
            self.leaves((sort, nth, k), ends, &own.child(Purpose::Leaf, k.to_u64()), &axis);
        }
        for (k, flowers) in ends.1.flowers.iter().enumerate() {
            let ends = (ends.0.and_then(|d| d.flowers.get(k)), flowers);
            self.flowers(ends, &own.child(Purpose::Plant, 100 + k.to_u64()), &axis, material);
        }
        Some(axis)
    }

    /// Builds the leaves of an axis.
    fn leaves(
        &mut self,
        (sort, nth, row): (usize, usize, usize),
        ends: Ends<'a, StemLeafDesc>,
        stream: &Stream,
        axis: &BuiltAxis,
    ) {
        let count = self.draw(ends, Some(0.0), (stream, 0), |d| &d.count).round_to::<usize>();
        let (low, high) = (self.blend(ends, |d| d.from.f32()), self.blend(ends, |d| d.to.f32()));
        let top = self.blend(ends, |d| d.top.f32());
        let Some((name, kind)) = self.growth.desc.kinds.get_key_value(&ends.1.kind) else { return };
        for i in 0..count {
            let Some(number) = self.growth.numbers.on_axis(sort, nth, row, i) else { return };
            let own = stream.child(Purpose::Leaf, i.to_u64());
            let share = spaced(i, count);
            let (point, along, radius) = axis.at(lerp(low, high, share));
            let out = seat::across(along, axis.spin + GOLDEN * i.to_f32());
            let mut sized = own.child(Purpose::Leaf, 50);
            let size = self.growth.desc.size.draw32(&mut sized) * self.growth.vigour * lerp(1.0, top, share);
            let blade = self.draw(ends, Some(0.0), (&own, 1), |d| &d.blade_mm) * MM * size;
            if blade < BUD {
                continue;
            }
            let leaf = LeafState {
                number,
                layer: 0,
                kind_name: name,
                kind,
                azimuth: out.x.atan2(out.y),
                blade,
                width: self.draw(ends, Some(0.0), (&own, 2), |d| &d.width_mm) * MM * size,
                stalk: self.draw(ends, Some(0.0), (&own, 3), |d| &d.stalk_mm) * MM * size,
                angle: self.draw(ends, None, (&own, 4), |d| &d.angle_deg).to_radians(),
                pitch: self.draw(ends, None, (&own, 5), |d| &d.pitch_deg).to_radians(),
                bend: self.draw(ends, Some(0.0), (&own, 6), |d| &d.bend_deg).to_radians(),
                fold: self.draw(ends, None, (&own, 7), |d| &d.fold_deg).to_radians(),
                twist: 0.0,
                arch: 0.0,
                curl: 0.0,
                crumple: 0.0,
                senescence: 0.0,
                rise: 0.0,
                cell: self.pen.cell,
                rigged: self.growth.rigged,
                stream: own,
                plant: self.growth.stream,
            };
            let on = Some(axis.on(lerp(low, high, share)));
            let seat = leaf::Seat { point: point + out * (0.8 * radius), axis: along, out, on };
            leaf::grow(self.organs, &leaf, seat, Lower::Petiole);
        }
    }

    /// Builds the flowers of an axis on their stalks.
    fn flowers(&mut self, ends: Ends<'a, FlowersDesc>, stream: &Stream, axis: &BuiltAxis, material: &str) {
        let count = self.draw(ends, Some(0.0), (stream, 0), |d| &d.count).round_to::<usize>();
        let (low, high) = (self.blend(ends, |d| d.from.f32()), self.blend(ends, |d| d.to.f32()));
        let top = self.blend(ends, |d| d.top.f32());
        let Some(flower) = self.growth.desc.flowers.get(&ends.1.kind) else { return };
        for i in 0..count {
            if self.flowers >= MOST_FLOWERS {
                return;
            }
            let own = stream.child(Purpose::Plant, i.to_u64());
            let mut stream = own.child(Purpose::Plant, 50);
            let share = spaced(i, count);
            let factor = self.growth.vigour * lerp(1.0, top, share);
            let size = self.draw(ends, Some(0.0), (&own, 1), |d| &d.size_mm) * MM * factor;
            if size < LEAST {
                continue;
            }
            self.flowers += 1;
            let stalk = self.draw(ends, Some(0.0), (&own, 2), |d| &d.stalk_mm) * MM * factor;
            let angle = self.draw(ends, None, (&own, 3), |d| &d.angle_deg).to_radians();
            let nod = self.draw(ends, None, (&own, 4), |d| &d.nod_deg).to_radians();
            let (point, along, radius) = axis.at(lerp(low, high, share));
            self.pen.stand(axis.on(lerp(low, high, share)));
            let out = seat::across(along, axis.spin + GOLDEN * i.to_f32() + 0.15 * stream.normal().to_f32());
            let way = (along * angle.cos() + out * angle.sin()).normalize_or(along);
            let mut base = point + out * (0.5 * radius * angle.sin());
            let thick = (0.045 * size).min(0.8 * radius).max(1.2e-4);
            let facing = nodding(way, out, nod);
            if stalk > LEAST {
                // The last third of the stalk turns towards the flower's direction.
                let knee = base + way * (0.7 * stalk);
                let end = knee + (way + facing).normalize_or(way) * (0.3 * stalk);
                let points = [base, base.lerp(knee, 0.5), knee, end];
                self.pen.strand(OrganKind::Stem, material, &points, (thick, thick));
                base = end;
            }
            let up = if facing.z.abs() > 0.98 { out } else { Vec3::Z };
            let bloom = Bloom {
                base,
                frame: Frame::with_tangent(facing, up),
                size,
                opening: self.draw(ends, None, (&own, 5), |d| &d.opening).clamp(0.0, 1.0),
            };
            flower::grow(flower, &bloom, &mut self.pen, &mut stream);
        }
    }
}

/// Returns the relative position of the i-th of `count` leaves or flowers between the first and the last; a single one
/// is at the end.
fn spaced(i: usize, count: usize) -> f32 {
    if count > 1 { i.to_f32() / (count - 1).to_f32() } else { 1.0 }
}

/// Rotates `way` towards the ground by `nod` radians, in the vertical plane through it, or through `out` if it is
/// vertical.
fn nodding(way: Vec3, out: Vec3, nod: f32) -> Vec3 {
    let level = way.with_z(0.0);
    let level = if level.length() > 0.15 { level.normalize() } else { out.with_z(0.0).normalize_or(Vec3::X) };
    let elevation = way.dot(level).atan2(way.z) + nod;
    (level * elevation.sin() + Vec3::Z * elevation.cos()).normalize_or(way)
}

/// Returns the points of an axis and its directions there. It turns up evenly by `bend` radians, but not beyond the
/// vertical, strays slightly, and does not enter the soil.
fn curve(
    base: Vec3,
    along: Vec3,
    (length, bend): (f32, f32),
    radius: f32,
    stream: &mut Stream,
) -> (Vec<Vec3>, Vec<Vec3>) {
    let pieces = (length / 0.012).round().clamp(4.0, 9.0).trunc_to::<usize>();
    let step = length / pieces.to_f32();
    let heading = along.x.atan2(along.y);
    let (mut zenith, mut turn) = (along.z.clamp(-1.0, 1.0).acos(), heading);
    let (mut points, mut ways) = (vec![base], Vec::new());
    for i in 0..pieces {
        let up = bend / pieces.to_f32();
        let before = zenith;
        zenith -= up;
        if up > 0.0 {
            zenith = zenith.max(before.min(0.04));
        }
        zenith += 0.02 * stream.normal().to_f32();
        turn += 0.05 * stream.normal().to_f32();
        let mut way = furrow_base::math::direction(zenith, turn);
        let floor = radius + 1e-3;
        if points[i].z + way.z * step < floor && i > 0 {
            way = way.with_z(((floor - points[i].z) / step).clamp(0.0, 0.7)).normalize_or(way);
        }
        points.push(points[i] + way * step);
        ways.push(way);
    }
    (points, ways)
}

#[cfg(test)]
mod tests;
