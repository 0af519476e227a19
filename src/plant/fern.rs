//! Fern-like blades: three times pinnate in one plane, widest near the base. Carrot.
//!
//! Pinnae stand opposite each other; the lowest pair is the longest, so the blade is a triangle. Each repeats the blade's
//! plan with pinnules, and each pinnule is cut into lobes with a pointed tip. The ribbons are those of mayweed.

use super::blade::Rest;
use super::ribbons::{MOST, Ribbons, drawn};
use super::skeleton::Skeleton;
use crate::math::{Vec3, lerp, vec3};
use crate::sampling::Stream;

/// One axis with what it carries on both sides.
struct Limb {
    start: Vec3,
    /// From its start to its tip, metres.
    along: Vec3,
    /// Out of the upper side, unit.
    up: Vec3,
    /// Pairs on it.
    pairs: usize,
    /// Length of its longest branch over its own.
    reach: f32,
}

/// The rest mesh of a blade with `pairs` of pinnae and `pinnules` pairs on the longest, within `width`, for a mesh whose shortest
/// cell is `cell` long, metres.
pub(super) fn blade(
    (pairs, pinnules): (usize, usize),
    segment: f32,
    (width, cell): (f32, f32),
    skeleton: &Skeleton,
    stream: &mut Stream,
) -> Rest {
    let length = skeleton.length();
    // Small leaves have fewer, not finer, segments.
    let (pairs, pinnules) = (pairs.min(MOST), pinnules.min(MOST));
    let pairs = pairs.min((length / (2.4 * segment)) as usize).max(1);
    let mut ribbons =
        Ribbons { rest: Rest::default(), skeleton, width: segment, count: 0, drawn: drawn(segment, cell) };
    ribbons.strip(Vec3::ZERO, vec3(0.0, length, 0.0), Vec3::Z, Vec3::ZERO, segment, 2 * pairs.min(8) as u32);
    let whole =
        Limb { start: Vec3::ZERO, along: vec3(0.0, length, 0.0), up: Vec3::Z, pairs, reach: 0.5 * width / length };
    for pinna in branches(&whole, stream) {
        let share = pinna.along.length() / (0.5 * width);
        let pairs = (pinnules as f32 * share).round() as usize;
        let pinna = Limb { pairs, reach: 0.42, ..pinna };
        let bow = pinna.up * (pinna.along.length() * stream.range32(-0.12, 0.12));
        ribbons.strip(pinna.start, pinna.along, pinna.up, bow, 0.8 * segment, 2);
        for pinnule in branches(&pinna, stream) {
            let long = pinnule.along.length();
            ribbons.strip(pinnule.start, pinnule.along, pinnule.up, Vec3::ZERO, segment, 1);
            let pinnule = Limb { pairs: ((long / (2.6 * segment)) as usize).min(2), reach: 0.5, ..pinnule };
            for lobe in branches(&pinnule, stream) {
                ribbons.strip(lobe.start, lobe.along, lobe.up, Vec3::ZERO, 0.9 * segment, 1);
            }
        }
    }
    ribbons.rest
}

/// The branches of a limb, pair by pair from its base.
fn branches(limb: &Limb, stream: &mut Stream) -> Vec<Limb> {
    let length = limb.along.length();
    let ahead = limb.along / length.max(1e-9);
    let right = ahead.cross(limb.up);
    let mut all = Vec::with_capacity(2 * limb.pairs);
    for k in 0..limb.pairs {
        let t = lerp(0.08, 0.9, ((k as f32 + 0.35) / limb.pairs as f32).powf(0.9));
        for side in [-1.0_f32, 1.0] {
            let t = (t + stream.range32(-0.12, 0.12) / (limb.pairs as f32 + 1.0)).clamp(0.03, 0.96);
            let spread = lerp(1.05, 0.55, t) + stream.range32(-0.1, 0.1);
            let tilt = stream.range32(-0.12, 0.4);
            let out = right * tilt.cos() * side + limb.up * tilt.sin();
            let along = ahead * spread.cos() + out * spread.sin();
            let up = (limb.up * tilt.cos() - right * (side * tilt.sin())).normalize_or(limb.up);
            let up = (up - along * up.dot(along)).normalize_or(limb.up);
            let reach = limb.reach * length * (1.0 - t).powf(0.75) * stream.range32(0.88, 1.12);
            // The width is that of the projection: a steep branch is as long as one that stands out.
            let along = along * (reach / spread.sin().max(0.5));
            all.push(Limb { start: limb.start + limb.along * t, along, up, pairs: 0, reach: 0.0 });
        }
    }
    all
}
