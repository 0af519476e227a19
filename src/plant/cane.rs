//! Stout grasses: sheaths rolled round each other to a thick shoot, two ranks of big arching blades. Maize.
//!
//! A blade continues the outer wall of its sheath, so the leaf's chain of joints runs along that wall, and the shoot's axis lies a
//! sheath's radius above it. Younger sheaths are narrower and come out of older ones.

use super::axis::ROOT;
use super::growth::{Growth, LeafNow};
use super::leaf::{self, Lower, Seat};
use super::organ::Organ;
use crate::math::{Vec3, direction, lerp};
use crate::sampling::Purpose;
use std::f32::consts::{FRAC_PI_2, TAU};

/// Radius of the youngest sheath over that of the oldest.
const TAPER: f32 = 0.45;

/// Grows one shoot; side shoots are not asked for.
pub(super) fn grow(growth: &Growth<'_>) -> Vec<Organ> {
    let mut organs = Vec::with_capacity(2 * growth.leaves.len());
    let mut stream = growth.stream.child(Purpose::Plant, 1);
    let lean = growth.desc.lean_deg.draw32(&mut stream).to_radians();
    let axis = direction(lean, stream.range32(0.0, TAU));
    let foot = ROOT / axis.z.max(0.3);
    let count = growth.leaves.len().max(1) as f32;
    for (k, leaf) in growth.leaves.iter().enumerate() {
        let radius = 0.5 * growth.stem * lerp(1.0, TAPER, k as f32 / count);
        let out = direction(FRAC_PI_2, leaf.azimuth);
        let out = (out - axis * out.dot(axis)).normalize_or(Vec3::X);
        // The sheath stands in the soil; its length counts from there up.
        let leaf = LeafNow { stalk: leaf.stalk + foot, ..leaf.clone() };
        leaf::grow(&mut organs, &leaf, Seat { point: out * radius - axis * foot, axis }, Lower::Wrap(radius));
    }
    organs
}
