//! Builds one leaf: poses its skeleton and bends blade and stalk with it.

use super::blade::{self, RestMesh};
use super::fern::{self, Fern};
use super::growth::{CELL, LeafState};
use super::kind::Shape;
use super::leaflets;
use super::margin::LeafOutline;
use super::organ::{LeafAxis, LeafSize, Organ, OrganKind, StemPosition};
use super::ribbons::{self, Division};
use super::rig;
use super::skeleton::{Measures, Pose, Skeleton};
use super::skin::{self, BladeRelief};
use super::spines;
use super::stipules;
use super::tube::{self, Profile, Ring};
use furrow_base::geometry::outline::Outline;
use furrow_base::math::{Mat3, RoundTo, ToFloat, Vec3, lerp, smoothstep, vec3};
use furrow_base::sampling::{Purpose, Stream};

/// Number of vertices around a stalk.
const SIDES: u32 = 9;
/// Smallest number of cells of a blade, along and across.
const FEWEST: (f64, f64) = (8.0, 4.0);
/// The same for meshes coarser than usual, where a leaf covers few pixels.
const FEWEST_COARSE: (f64, f64) = (4.0, 2.0);
/// Largest bare fraction of a rachis; the rest bears pinnae.
const MOST_BARE: f32 = 0.9;
/// Minimum height of a midrib above the soil, metres, plus [`LYING_WIDTH`] times the blade's width for its hanging
/// sides: a lower leaf lies on the soil's crumbs. Near the crown the minimum decreases to half the crown's height.
const LYING: f32 = 0.004;
/// See [`LYING`].
const LYING_WIDTH: f32 = 0.18;

/// Seat of a leaf on its axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seat {
    /// Base of the stalk, metres.
    pub(super) point: Vec3,
    /// Direction of the growth axis there, unit vector.
    pub(super) axis: Vec3,
    /// Direction from the axis towards the leaf; must not be parallel to the axis.
    pub(super) out: Vec3,
    /// Position on the plant's stems.
    pub(super) on: Option<StemPosition>,
}

/// Lower part of a leaf.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Lower {
    /// Petiole.
    Petiole,
    /// Sheath: a tube of this radius around the shoot, metres. Its outer wall is in line with the blade.
    Sheath(f32),
}

/// Builds a leaf and adds its organs.
pub(super) fn grow(organs: &mut Vec<Organ>, leaf: &LeafState<'_>, seat: Seat, lower: Lower) {
    // Posture and relief have separate streams, so that changes to the relief never change the posture.
    let mut stream = leaf.stream.child(Purpose::Leaf, 100);
    let mut skeleton = Skeleton::new(&measures(leaf));
    let root = stand(leaf, seat, lower, &mut stream);
    pose(&mut skeleton, leaf, root, lower, &mut stream);
    if leaf.kind.flat {
        skeleton.straighten();
    }
    let motions = skeleton.motions(root);
    let mut stream = leaf.stream.child(Purpose::Leaf, 101);
    let relief = relief(leaf, &mut stream);
    let mut spined = RestMesh::default();
    let rest = match &leaf.kind.shape {
        Shape::Sheet { outline } => {
            let (rows, columns) = cells(leaf);
            let mut sheet = blade::sheet(*outline, leaf.width, rows, columns, &skeleton);
            let mut own = leaf.stream.child(Purpose::Leaf, 102);
            LeafOutline::draw(leaf.kind.margin_sd.f32(), &mut own).apply(&mut sheet, leaf.blade);
            relief.apply(&mut sheet, leaf.blade);
            if let Some(spines) = &leaf.kind.spines {
                let mut own = leaf.stream.child(Purpose::Leaf, 104);
                spined = spines::grow(&sheet, spines, leaf.blade, &mut own);
            }
            sheet.rest
        }
        Shape::Pinnate { pairs, lobes, segment_mm, bare } => {
            let (pairs, lobes) =
                (pairs.draw(&mut stream).trunc_to::<usize>(), lobes.draw(&mut stream).trunc_to::<usize>());
            let segment = segment_mm.draw32(&mut stream) * 1e-3;
            let division = Division { pairs, lobes, bare: bare.f32().min(MOST_BARE), segment, cell: leaf.cell };
            pressed(leaf, ribbons::blade(division, leaf.width, &skeleton, &mut stream))
        }
        Shape::Fern { pairs, pinnules, segment_mm, breadth } => {
            let counts = (pairs.draw(&mut stream).trunc_to::<usize>(), pinnules.draw(&mut stream).trunc_to::<usize>());
            let segment = segment_mm.draw32(&mut stream) * 1e-3;
            let breadth = breadth.draw32(&mut leaf.plant.child(Purpose::Plant, 3));
            let fern = Fern { counts, segment, breadth, width: leaf.width, cell: leaf.cell };
            pressed(leaf, fern.blade(&skeleton, &mut stream))
        }
        Shape::Leaflets { .. } => leaflets::blade(leaf, &relief, cells(leaf), &skeleton, &mut stream),
    };
    let material = if leaf.kind.material.is_empty() { leaf.kind_name } else { &leaf.kind.material };
    let kind = leaf.kind.organ;
    // The relief does not move the midrib's ends, so they follow their joints.
    let end = |joint: usize| motions[joint].point(vec3(0.0, skeleton.along()[joint], 0.0));
    let foremost = (0..rest.positions.len()).max_by(|a, b| rest.positions[*a].y.total_cmp(&rest.positions[*b].y));
    let mesh = skin::skin(rest, &motions, leaf.rigged);
    let tip = match (&leaf.kind.shape, foremost) {
        // A terminal leaflet has the tip. Without one, the rachis ends between the foremost pair.
        (Shape::Leaflets { terminal, .. }, Some(corner)) if terminal.get() > 0.0 => mesh.positions[corner],
        (Shape::Leaflets { .. }, _) => skin::carried(&skeleton, &motions, leaf.kind.rib.f32() * leaf.blade),
        _ => end(skeleton.along().len() - 1),
    };
    let axis = LeafAxis {
        leaf: leaf.number,
        base: end(skeleton.base()),
        tip,
        size: LeafSize { length: leaf.blade, width: leaf.width, petiole: leaf.stalk },
        joints: skeleton.placed(root),
        rig: if leaf.rigged { rig::rig(&skeleton, root) } else { Vec::new() },
        on: seat.on,
        bearer: None,
    };
    let senescence = leaf.senescence;
    organs.push(Organ { senescence, ..Organ::of_leaf(kind, leaf.number, material, mesh, Some(axis)) });
    let mut rest = stalk(leaf, &skeleton, &relief, lower, &mut stream);
    let ringed = rest.positions.len();
    rest.append(spined);
    if rest.triangles.is_empty() {
        return;
    }
    let mut mesh = skin::skin(rest, &motions, leaf.rigged);
    tube::close_seams(&mut mesh, sides(leaf), ringed);
    if !leaf.kind.stipules.none() {
        let stipules = stipules::pair(&leaf.kind.stipules, leaf, &skeleton);
        mesh.append(&skin::skin(stipules, &motions, leaf.rigged));
    }
    let kind = if lower == Lower::Petiole { OrganKind::Petiole } else { OrganKind::Sheath };
    organs.push(Organ { senescence, ..Organ::of_leaf(kind, leaf.number, &leaf.kind.stalk_material, mesh, None) });
}

/// Returns the number of vertices around the stalk.
fn sides(leaf: &LeafState<'_>) -> u32 {
    tube::sides(0.5 * leaf.kind.stalk_width.f32() * leaf.blade, SIDES, leaf.cell)
}

/// Returns the number of segments of a stalk or midrib of `length` metres; `usual` at the usual mesh resolution.
fn pieces(leaf: &LeafState<'_>, length: f32, usual: u8) -> u8 {
    if leaf.cell > CELL { (length / leaf.cell).ceil().min(255.0).trunc_to::<u8>().clamp(2, usual) } else { usual }
}

/// Returns the number of cells along and across the blade: that of the kind, reduced where cells would be shorter than
/// the leaf's shortest cell, so that a bud has few triangles.
fn cells(leaf: &LeafState<'_>) -> (usize, usize) {
    let (rows, columns) = (leaf.kind.rows.get(), leaf.kind.columns.get());
    let fewest = if leaf.cell > CELL { FEWEST_COARSE } else { FEWEST };
    let fit = f64::from(leaf.blade / leaf.cell).max(fewest.0).min(rows);
    let across = (columns * (fit / rows).sqrt()).round();
    // Columns of a coarse blade are as wide as its rows are long.
    let across = if leaf.cell > CELL { across.min(f64::from(leaf.width / leaf.cell).ceil()) } else { across };
    (fit.round_to::<usize>(), across.max(fewest.1).min(columns).trunc_to::<usize>())
}

fn measures(leaf: &LeafState<'_>) -> Measures {
    let count = leaf.kind.joints.get().trunc_to::<usize>();
    let half_width = |t: f32| match &leaf.kind.shape {
        Shape::Sheet { outline } | Shape::Leaflets { outline, .. } => outline.half_width(t) * leaf.width,
        Shape::Pinnate { bare, .. } => ribbons::half_width(bare.f32().min(MOST_BARE), t) * leaf.width,
        Shape::Fern { .. } => fern::half_width(t) * leaf.width,
    };
    let (veins, secondaries) = if let Shape::Leaflets { .. } = leaf.kind.shape {
        // The branching joints are in the leaflets.
        ((1..=count).map(|k| k.to_f32() / (count.to_f32() + 1.0)).collect(), None)
    } else {
        let veins = leaf.kind.joints_along(count);
        let branches = leaf.kind.branches(half_width, &veins);
        (veins, branches)
    };
    Measures {
        stalk: leaf.stalk,
        stalk_joints: if leaf.stalk > 0.0 { 4 } else { 1 },
        length: leaf.blade,
        veins,
        secondaries,
    }
}

/// Returns the frame of ST1 in plant coordinates: vein along the stalk, y out of the upper side, which faces the axis.
fn stand(leaf: &LeafState<'_>, seat: Seat, lower: Lower, stream: &mut Stream) -> Pose {
    let out = (seat.out - seat.axis * seat.out.dot(seat.axis)).normalize_or(Vec3::X);
    let (sin, cos) = leaf.angle.sin_cos();
    let vein = seat.axis * cos + out * sin;
    let up = seat.axis * sin - out * cos;
    let roll = leaf.kind.roll_deg.draw32(stream).to_radians();
    // A sheath cannot roll out of the sheath that encloses it.
    let roll = if lower == Lower::Petiole { roll } else { 0.0 };
    let rotation = Mat3::from_cols(vein, up, vein.cross(up)) * Mat3::from_rotation_x(roll);
    Pose { rotation, origin: seat.point }
}

/// Sets the bends of the joints: the angle between stalk and blade, gravity, random deviations, and contact with the
/// soil.
///
/// Gravity: the moment of the mass beyond joint k is Σ mⱼ·(sⱼ − sₖ)·cos φ, with φ the elevation at the joint. The
/// midrib's stiffness decreases towards the tip as (1 − 0.75 s)³. The ratio of the two is scaled so that a level blade
/// bends by `bend` in total, and is added to the joint's angle together with the random bends.
fn pose(skeleton: &mut Skeleton, leaf: &LeafState<'_>, root: Pose, lower: Lower, stream: &mut Stream) {
    let wobble = leaf.kind.wobble_deg.f32().to_radians();
    let free = if lower == Lower::Petiole { 1.0 } else { 0.0 };
    let stalk_bend = free * (leaf.kind.stalk_bend_deg.draw32(stream).to_radians() + leaf.arch);
    let base = skeleton.base();
    let along: Vec<f32> = skeleton.along().to_vec();
    let shape = |t: f32| match leaf.kind.shape {
        Shape::Sheet { outline: outline @ Outline::Power { .. } } => outline.half_width(t),
        _ => 0.25,
    };
    let sag: Vec<f32> = (base..along.len() - 1)
        .map(|k| {
            let s = along[k] / leaf.blade;
            let moment: f32 =
                (0..12).map(|i| (i.to_f32() + 0.5) / 12.0).filter(|t| *t > s).map(|t| shape(t) * (t - s)).sum();
            moment / (1.0 - 0.75 * s).powi(3)
        })
        .collect();
    let total: f32 = sag.iter().sum::<f32>().max(1e-6);
    let mut height = root.origin.z;
    let far = LYING.min(0.2 * leaf.blade) + LYING_WIDTH * leaf.width + leaf.rise;
    // Where the stem is short, the ground around it lifts the base of the leaf too.
    let near = (0.5 * height).max(leaf.rise.min(height));
    let (start, whole) = (along[0], along[along.len() - 1] - along[0]);
    let mut elevation = root.rotation.col(0).z.clamp(-1.0, 1.0).asin();
    for k in 0..along.len() - 1 {
        let (designed, load) = if k < base {
            (0.0, stalk_bend / base.to_f32())
        } else {
            let pitch = if k == base { -leaf.pitch } else { 0.0 };
            (pitch, leaf.bend * sag[k - base] / total)
        };
        let mut bend = designed - load * (elevation + designed).cos().max(0.0);
        // Neighbouring stalks hold the base of a stalk (k = 0); a sheath does not wobble at all.
        let held = if k < base { free } else { 1.0 };
        bend += wobble * stream.normal().to_f32() * if k == 0 { 0.4 } else { 1.0 } * held;
        let link = along[k + 1] - along[k];
        let lying = lerp(near, far.max(near), ((along[k + 1] - start) / whole).min(1.0));
        let lowest = ((lying - height) / link.max(1e-6)).clamp(-1.0, 0.25).asin();
        if k > 0 || lowest < 0.0 {
            bend = bend.max(lowest - elevation);
        }
        elevation += bend;
        height += link * elevation.sin();
        skeleton.joints[k].bend = bend;
    }
    // The halves of a level blade hang slightly, each branch independently.
    let hang = 0.12 * leaf.bend * elevation.cos();
    let mut own = leaf.stream.child(Purpose::Leaf, 102);
    let [inner, outer] = [&leaf.kind.branch_bend_deg.0, &leaf.kind.branch_bend_deg.1];
    skeleton.bend_branches(|_, _| {
        let designed = [inner, outer].map(|bend| bend.draw32(&mut own).to_radians());
        let noise = [wobble * stream.normal().to_f32(), 1.5 * wobble * stream.normal().to_f32()];
        (designed[0] + noise[0], designed[1] + noise[1] - hang)
    });
}

/// Returns a dissected blade, flattened into its plane if `flat` is set.
fn pressed(leaf: &LeafState<'_>, mut rest: RestMesh) -> RestMesh {
    if leaf.kind.flat {
        rest.positions.iter_mut().for_each(|p| p.z = 0.0);
    }
    rest
}

/// Returns the relief of the blade.
fn relief(leaf: &LeafState<'_>, stream: &mut Stream) -> BladeRelief {
    let kind = leaf.kind;
    let angle = kind.vein_angle_deg.f32().to_radians();
    let relief = BladeRelief {
        fold: leaf.fold,
        fold_tip: 0.6 * leaf.fold,
        curl: kind.curl_deg.draw32(stream).to_radians() + leaf.curl,
        wave: kind.wave.draw32(stream) + leaf.crumple,
        period: kind.wave_period.draw32(stream),
        quilt: kind.quilt.draw32(stream) + 0.5 * leaf.crumple,
        pairs: kind.vein_pairs.f32(),
        slant: if angle > 0.1 { angle.tan().recip() } else { 0.0 },
        asymmetry: kind.asymmetry.draw32(stream),
        sway: kind.sway.draw32(stream),
        twist: kind.twist_deg.draw32(stream).to_radians() + leaf.twist,
        seed: stream.seed32(),
    };
    // A rachis is straight; its leaflets bow and twist individually.
    let relief = match kind.shape {
        Shape::Leaflets { .. } => BladeRelief { sway: 0.0, twist: 0.0, ..relief },
        _ => relief,
    };
    // Flat blades keep the deformations within the blade's plane.
    let BladeRelief { asymmetry, sway, seed, .. } = relief;
    if kind.flat { BladeRelief { asymmetry, sway, seed, ..BladeRelief::default() } } else { relief }
}

/// Builds the stalk in the flat leaf's coordinates, and the midrib that continues it under the blade.
fn stalk(
    leaf: &LeafState<'_>,
    skeleton: &Skeleton,
    relief: &BladeRelief,
    lower: Lower,
    stream: &mut Stream,
) -> RestMesh {
    let mut rest = RestMesh::default();
    if leaf.stalk <= 0.0 && leaf.kind.rib.get() == 0.0 {
        return rest;
    }
    let tip_radius = 0.5 * leaf.kind.stalk_width.f32() * leaf.blade;
    let channel = -leaf.kind.channel.draw32(stream).clamp(-1.0, 0.9);
    let mut rings = Vec::with_capacity(20);
    let ring = |y: f32, radii: (f32, f32), top: f32, sink: f32| Ring {
        centre: relief.carry(vec3(0.0, y, -sink), leaf.blade),
        right: Vec3::X,
        up: Vec3::Z,
        radii,
        profile: Profile::Channelled(top),
    };
    if leaf.stalk > 0.0 {
        let count = pieces(leaf, leaf.stalk, 10);
        for i in 0..=count {
            let s = f32::from(i) / f32::from(count);
            let y = -leaf.stalk * (1.0 - s);
            match lower {
                Lower::Petiole => {
                    // The base widens over its first fifth to clasp the stem.
                    let flare = lerp(leaf.kind.stalk_base.f32(), 1.0, s.powf(0.7)) + 0.25 * smoothstep(0.2, 0.0, s);
                    let wide = tip_radius * flare;
                    // The channel fades into the midrib.
                    let channel = channel * lerp(1.0, 0.3, smoothstep(0.7, 1.0, s));
                    rings.push(ring(y, (wide, wide * lerp(0.7, 0.85, s)), channel, 0.0));
                }
                Lower::Sheath(radius) => {
                    // The sheath opens where the next leaf emerges, and flattens into the blade.
                    let open = smoothstep(0.8, 1.0, s);
                    let r = radius * lerp(1.0, 0.9, s);
                    let deep = r * lerp(1.0, 0.5, open);
                    rings.push(ring(y, (r * (1.0 + 0.25 * open), deep), lerp(1.0, -0.7, open), -deep));
                }
            }
        }
    }
    let reach = leaf.kind.rib.f32() * leaf.blade;
    if reach > 0.0 {
        let wide = if let Lower::Sheath(radius) = lower { tip_radius.min(0.35 * radius) } else { tip_radius };
        let rachis = matches!(leaf.kind.shape, Shape::Leaflets { .. });
        // Without a stalk the midrib starts at the stem.
        let count = pieces(leaf, reach, 8);
        for i in u8::from(leaf.stalk > 0.0)..=count {
            let s = f32::from(i) / f32::from(count);
            let r = wide * if rachis { lerp(0.8, 0.5, s) } else { lerp(0.8, 0.06, s.sqrt()) };
            // Lowered so that the blade rests on its flat top.
            rings.push(ring(s * reach, (r, r), -0.2, 0.1 * r));
        }
    }
    tube::sweep(&mut rest, &rings, sides(leaf), |p| skeleton.weights_on_chain(p.y));
    rest
}
