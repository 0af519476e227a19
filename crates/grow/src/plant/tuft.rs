//! Grasses: nested sheaths, each with an arching blade, in two ranks; later, tillers from the same base.
//!
//! The sheaths of a shoot share its axis. Each is a tube around all younger ones, the oldest outermost and shortest, so
//! that one stem leaves the ground. A blade continues the outer wall of its sheath; both angles of the stage, the
//! sheath's and the blade's, apply where the blade leaves the sheath. Source: structure of a grass shoot, e.g. Clifford
//! & McLean 1962, "Grasses: their structure".

use super::axis::ROOT;
use super::growth::{self, Growth, LeafState};
use super::leaf::{self, Lower, Seat};
use super::organ::Organ;
use super::stage::BUD;
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec3, direction, lerp};
use furrow_base::sampling::Purpose;
use std::f32::consts::{FRAC_PI_2, PI};

/// Ratio of a tiller's size to the main shoot's: range drawn from.
const TILLER: (f32, f32) = (0.45, 0.7);
/// Angle between a tiller and the vertical, radians: the range of young tillers, and (`UPRIGHT`) that of one as large
/// as the main shoot.
const SPREAD: (f32, f32) = (0.35, 0.75);
const UPRIGHT: f32 = 0.1;
/// Distance of a tiller's base from the main shoot's, in stem widths: of a young one, and of one as large as the main shoot.
const APART: (f32, f32) = (0.4, 1.1);
/// Ratio of the youngest sheath's radius to the oldest's.
const TAPER: f32 = 0.5;
/// Angle between neighbouring tillers of one rank, seen from above, radians.
const FAN: f32 = 0.6;
/// Number of layers of the main shoot that a tiller lacks, because it grows out of their axils.
const LACKS: usize = 3;

/// Builds a grass with its tillers.
pub(super) fn grow(growth: &Growth<'_>) -> Vec<Organ> {
    let mut organs = Vec::with_capacity(2 * growth.leaves.len() * (1 + growth.tillers.trunc_to::<usize>()));
    let axis = lean(growth);
    shoot(&mut organs, (0.5 * growth.stem, TAPER), axis, Vec3::ZERO, growth.leaves.iter().cloned());
    for (k, there) in growth::shoots(growth.tillers) {
        let Some(above) = growth.numbers.side(k) else { break };
        let mut stream = growth.stream.child(Purpose::Plant, 100 + k.to_u64());
        let size = stream.range32(TILLER.0, TILLER.1) * 0.93_f32.powi(k.to_i32());
        let grown = growth.tillers_grown;
        let size = lerp(size, 1.0, grown) * there;
        // A tiller grows out of the axil of an older leaf, perpendicular to the ranks; tillers of one rank form a fan.
        let rank = growth.leaves.first().map_or(0.0, |l| l.azimuth) + PI * (k % 2).to_f32();
        let towards = rank + fanned(k / 2) + stream.range32(-FAN / 3.0, FAN / 3.0);
        let axis = direction(lerp(stream.range32(SPREAD.0, SPREAD.1), UPRIGHT, grown), towards);
        let base = direction(FRAC_PI_2, towards) * (lerp(APART.0, APART.1, grown) * growth.stem);
        let turn = FRAC_PI_2 + stream.range32(-0.5, 0.5);
        let leaves = growth.leaves.iter().filter(|leaf| leaf.layer >= LACKS && leaf.blade * size >= BUD);
        let leaves: Vec<LeafState<'_>> = leaves
            .map(|leaf| {
                let number = leaf.number + above;
                LeafState {
                    number,
                    azimuth: leaf.azimuth + turn,
                    blade: leaf.blade * size,
                    width: leaf.width * size.sqrt(),
                    stalk: leaf.stalk * size,
                    stream: growth.stream.child(Purpose::Leaf, u64::from(number)),
                    ..leaf.clone()
                }
            })
            .collect();
        shoot(&mut organs, (0.5 * growth.stem * size.sqrt(), TAPER), axis, base, leaves.into_iter());
    }
    organs
}

/// Returns the angle of the k-th tiller of a rank in its fan, radians from the centre: first the centre, then
/// alternating sides.
fn fanned(k: usize) -> f32 {
    let steps = k.div_ceil(2).to_f32();
    FAN * if k.is_multiple_of(2) { -steps } else { steps }
}

/// Returns the direction of the main shoot.
pub(super) fn lean(growth: &Growth<'_>) -> Vec3 {
    let mut stream = growth.stream.child(Purpose::Plant, 1);
    let lean = growth.lean(&mut stream);
    direction(lean, stream.range32(0.0, 2.0 * PI))
}

/// Builds one shoot: nested sheaths, the oldest outermost. `width` is its radius at the soil in metres, `taper` the
/// ratio of the youngest sheath's radius to it.
pub(super) fn shoot<'a>(
    organs: &mut Vec<Organ>,
    (width, taper): (f32, f32),
    axis: Vec3,
    base: Vec3,
    leaves: impl ExactSizeIterator<Item = LeafState<'a>>,
) {
    let count = leaves.len().max(1).to_f32();
    let foot = ROOT / axis.z.max(0.3);
    for (k, leaf) in leaves.enumerate() {
        let radius = width * lerp(1.0, taper, k.to_f32() / count);
        let out = direction(FRAC_PI_2, leaf.azimuth);
        let out = (out - axis * out.dot(axis)).normalize_or(Vec3::X);
        // The sheath continues into the soil; its length is measured from the surface up.
        let leaf = LeafState { stalk: leaf.stalk + foot, pitch: leaf.pitch + leaf.angle, angle: 0.0, ..leaf };
        let seat = Seat { point: base + out * radius - axis * foot, axis, out, on: None };
        leaf::grow(organs, &leaf, seat, Lower::Sheath(radius));
    }
}
