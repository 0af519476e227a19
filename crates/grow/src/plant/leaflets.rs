//! Compound blades: leaflets on a rachis. Peanut has two pairs; soybean one pair and a terminal leaflet; potato small
//! leaflets between its pairs.
//!
//! A leaflet is a sheet like a whole blade. It has its own relief, fold and bend, and joints along its midrib and
//! branches. These joints bend it in the flat leaf's coordinates; the rachis then moves it rigidly with its base. Young
//! leaflets are upright and face each other.

use super::blade::{self, RestMesh};
use super::growth::LeafState;
use super::kind::Shape;
use super::margin::LeafOutline;
use super::skeleton::{Measures, Pose, Skeleton};
use super::skin::{self, BladeRelief};
use furrow_base::math::{Mat3, RoundTo, ToFloat, ToInt, lerp, vec3};
use furrow_base::sampling::{Purpose, Stream};

/// Number of vein joints of a leaflet.
const JOINTS: usize = 4;

/// Builds the rest mesh of all leaflets, each with `rows` × `columns` cells; an empty mesh for other shapes.
pub(super) fn blade(
    leaf: &LeafState<'_>,
    relief: &BladeRelief,
    (rows, columns): (usize, usize),
    rachis: &Skeleton,
    stream: &mut Stream,
) -> RestMesh {
    let mut rest = RestMesh::default();
    let Shape::Leaflets {
        outline,
        pairs,
        aspect,
        spread_deg,
        terminal,
        interjected,
        pair_at,
        rise_deg,
        leaflet_bend_deg,
    } = &leaf.kind.shape
    else {
        return rest;
    };
    let veins = leaf.kind.joints_along(JOINTS);
    // Angles from the species file have their own stream.
    let mut own = leaf.stream.child(Purpose::Leaf, 103);
    let pairs = pairs.get().trunc_to::<usize>();
    let reach = leaf.kind.rib.f32() * leaf.blade;
    let spread = [spread_deg.0, spread_deg.1].map(|s| s.f32().to_radians());
    let length = 0.5 * leaf.width / spread[0].sin().max(0.2);
    let terminal = terminal.f32();
    // The foremost pair is at the tip of the rachis, unless a terminal leaflet is there.
    let steps = if terminal > 0.0 { pairs } else { pairs - 1 };
    let mut add = |share: f32, side: f32, size: f32, turn: f32, stream: &mut Stream| {
        let size = size * (1.0 + 0.04 * stream.normal().to_f32());
        let turn = turn + 0.06 * stream.normal().to_f32();
        let fold = rise_deg.as_ref().map_or(leaf.fold, |rise| rise.draw32(&mut own).to_radians());
        let bend = leaflet_bend_deg.as_ref().map_or(leaf.bend, |bend| bend.draw32(&mut own).to_radians());
        let rise = (fold + 0.08 * stream.normal().to_f32()).min(1.35);
        let (along, width) = (length * size, length * size * aspect.f32());
        let mut skeleton = Skeleton::new(&Measures {
            stalk: 0.0,
            stalk_joints: 1,
            length: along,
            secondaries: leaf.kind.branches(|t| outline.half_width(t) * width, &veins),
            veins: veins.clone(),
        });
        let chain = skeleton.along().len();
        for joint in &mut skeleton.joints[1..chain] {
            joint.bend = -bend / (veins.len().to_f32() + 1.0) + 0.02 * stream.normal().to_f32();
        }
        let (inner, outer) = &leaf.kind.branch_bend_deg;
        skeleton.bend_branches(|_, _| {
            let [i, o] = [inner, outer].map(|b| b.draw32(&mut own).to_radians() + 0.03 * own.normal().to_f32());
            (i, o)
        });
        let mut sheet = blade::sheet(*outline, width, rows, columns, &skeleton);
        let mut margin = leaf.stream.child(Purpose::Leaf, 102).child(Purpose::Leaf, rest.positions.len().to_u64());
        LeafOutline::draw(leaf.kind.margin_sd.f32(), &mut margin).apply(&mut sheet, along);
        let seed = stream.seed32();
        BladeRelief { fold: 0.5 * leaf.fold, fold_tip: 0.3 * leaf.fold, seed, ..*relief }.apply(&mut sheet, along);
        let foot = Pose { rotation: stance(side, turn, rise), origin: vec3(0.0, reach * share, 0.0) };
        let tie = rachis.weights_on_chain(foot.origin.y);
        let first = rest.positions.len().to_u32();
        for (p, uv) in skin::bend(&sheet.rest, &skeleton.motions(foot)).into_iter().zip(&sheet.rest.uvs) {
            rest.corner(p, *uv, tie);
        }
        rest.triangles.extend(sheet.rest.triangles.iter().map(|t| t.map(|i| i + first)));
    };
    for pair in 0..pairs {
        let even = if steps > 0 { pair.to_f32() / steps.to_f32() } else { 1.0 };
        let share = pair_at.get(pair).map_or(even, |at| at.f32());
        for side in [-1.0_f32, 1.0] {
            add(share, side, lerp(0.92, 1.0, share), lerp(spread[0], spread[1], share), stream);
        }
    }
    let interjected = interjected.f32();
    for pair in 0..if interjected > 0.0 { pairs } else { 0 } {
        // Between each pair and the next one or the terminal leaflet, each with its own size.
        let share = (pair.to_f32() + 0.5) / pairs.to_f32();
        for side in [-1.0_f32, 1.0] {
            let size = interjected * stream.range32(0.6, 1.2);
            add(share, side, size, spread[0], stream);
        }
    }
    if terminal > 0.0 {
        add(1.0, 0.0, terminal, 0.0, stream);
    }
    rest
}

/// Returns the frame of a leaflet's first joint in the flat leaf's coordinates: vein, upper side, hinge. `rise` turns
/// both leaflets of a pair up about the rachis, until they face each other at 90°. A terminal leaflet (`side` 0)
/// continues the rachis.
fn stance(side: f32, turn: f32, rise: f32) -> Mat3 {
    let vein = vec3(side * turn.sin() * rise.cos(), turn.cos(), turn.sin() * rise.sin());
    let up = vec3(-side * rise.sin(), 0.0, rise.cos());
    let up = (up - vein * up.dot(vein)).normalize();
    Mat3::from_cols(vein, up, vein.cross(up))
}
