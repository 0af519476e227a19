//! Fern-like blades (carrot): tripinnate in one plane, widest near the base.
//!
//! Pinnae are in opposite pairs. The lowest pair is the longest, so the blade is a triangle. Each pinna repeats the
//! blade's plan with pinnules, and each pinnule is cut into lobes with a pointed tip. Built of the same ribbons as
//! mayweed leaves.

use super::blade::RestMesh;
use super::ribbons::{MOST, Ribbons, series};
use super::skeleton::Skeleton;
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec3, lerp, vec3};
use furrow_base::sampling::{Purpose, Stream};

/// Width of the broadest lobes of a leaf, relative to the leaf's width.
const BROADEST: f32 = 0.14;

/// An axis of the blade and the parameters of its branches.
struct FernAxis {
    start: Vec3,
    /// Vector from its start to its tip, metres.
    along: Vec3,
    /// Normal of the upper side, unit vector.
    up: Vec3,
    /// Number of pairs of branches that have grown, the last of them partially.
    pairs: f32,
    /// Ratio of the longest branch's length to its own.
    reach: f32,
}

/// Plan of a blade. Lengths in metres.
pub(super) struct Fern {
    /// Number of pairs of pinnae, and of pairs of pinnules on the longest pinna.
    pub(super) counts: (usize, usize),
    /// Width of a segment.
    pub(super) segment: f32,
    /// Width of the last lobes, in segments.
    pub(super) breadth: f32,
    /// Width of the blade.
    pub(super) width: f32,
    /// Shortest cell of the mesh.
    pub(super) cell: f32,
}

impl Fern {
    /// Builds the rest mesh.
    pub(super) fn blade(&self, skeleton: &Skeleton, stream: &mut Stream) -> RestMesh {
        let &Self { counts: (pairs, pinnules), segment, breadth, width, cell } = self;
        let length = skeleton.length();
        // Broad lobes grow with the blade; they need the room of several segments.
        let breadth = breadth.min(BROADEST * width / segment).max(1.0);
        let room = breadth.powf(0.7);
        // Small leaves have fewer, not finer, segments.
        let (pairs, pinnules) = (pairs.min(MOST).to_f32(), pinnules.min(MOST).to_f32() / room);
        let pairs = pairs.min(length / (2.4 * segment * room)).max(1.0);
        let half_width = |t: f32| half_width(t) * width;
        let mut ribbons = Ribbons::new(skeleton, &half_width, segment, cell);
        ribbons.strip(
            Vec3::ZERO,
            vec3(0.0, length, 0.0),
            Vec3::Z,
            Vec3::ZERO,
            segment,
            2 * pairs.min(8.0).trunc_to::<u32>(),
        );
        let whole = FernAxis {
            start: Vec3::ZERO,
            along: vec3(0.0, length, 0.0),
            up: Vec3::Z,
            pairs,
            reach: 0.5 * width / length,
        };
        // Branches shorter than a segment's width are not built yet.
        let is_seen = |limb: &FernAxis| limb.along.length() > segment;
        for (pinna, mut own) in branches(&whole, stream) {
            let share = pinna.along.length() / (0.5 * width);
            let pinna = FernAxis { pairs: pinnules * share, reach: 0.42, ..pinna };
            let bow = pinna.up * (pinna.along.length() * own.range32(-0.12, 0.12));
            ribbons.strip(pinna.start, pinna.along, pinna.up, bow, 0.8 * segment, 2);
            if breadth > 1.0 {
                ribbons.lobe(pinna.start + 0.5 * pinna.along + 0.25 * bow, 0.5 * pinna.along, pinna.up, breadth);
            }
            for (pinnule, own) in branches(&pinna, &own).into_iter().filter(|(pinnule, _)| is_seen(pinnule)) {
                let long = pinnule.along.length();
                ribbons.lobe(pinnule.start, pinnule.along, pinnule.up, breadth);
                let pinnule = FernAxis { pairs: (long / (2.6 * segment * room)).min(2.0), reach: 0.5, ..pinnule };
                for (lobe, _) in branches(&pinnule, &own).into_iter().filter(|(lobe, _)| is_seen(lobe)) {
                    ribbons.lobe(lobe.start, lobe.along, lobe.up, 0.9 * breadth);
                }
            }
        }
        ribbons.rest
    }
}

/// Returns the length of branches at the fraction `t` of their axis, relative to the longest.
fn taper(t: f32) -> f32 {
    (1.0 - t).max(0.0).powf(0.75)
}

/// Returns the half-width of the outline that encloses the pinnae at the fraction `t` of the length, relative to the
/// blade's width.
pub(super) fn half_width(t: f32) -> f32 {
    0.5 * taper(t)
}

/// Returns the branches of an axis, pair by pair from its base, each with its own stream, so that later branches do not
/// move earlier ones.
fn branches(limb: &FernAxis, stream: &Stream) -> Vec<(FernAxis, Stream)> {
    let length = limb.along.length();
    let ahead = limb.along / length.max(1e-9);
    let right = ahead.cross(limb.up);
    let mut all = Vec::new();
    for (k, place, grown) in series(limb.pairs) {
        let t = lerp(0.08, 0.9, (place - 0.15 / limb.pairs.max(1.0)).max(0.0).powf(0.9));
        for (far, side) in [-1.0_f32, 1.0].into_iter().enumerate() {
            let mut own = stream.child(Purpose::Leaf, (2 * k + far).to_u64());
            let t = (t + own.range32(-0.12, 0.12) / (limb.pairs + 1.0)).clamp(0.03, 0.96);
            let spread = lerp(1.05, 0.55, t) + own.range32(-0.1, 0.1);
            let tilt = own.range32(-0.12, 0.4);
            let out = right * tilt.cos() * side + limb.up * tilt.sin();
            let along = ahead * spread.cos() + out * spread.sin();
            let up = (limb.up * tilt.cos() - right * (side * tilt.sin())).normalize_or(limb.up);
            let up = (up - along * up.dot(along)).normalize_or(limb.up);
            let reach = grown * limb.reach * length * taper(t) * own.range32(0.88, 1.12);
            // The width is measured in projection, so branches at a small angle to the axis are lengthened.
            let along = along * (reach / spread.sin().max(0.5));
            all.push((FernAxis { start: limb.start + limb.along * t, along, up, pairs: 0.0, reach: 0.0 }, own));
        }
    }
    all
}
