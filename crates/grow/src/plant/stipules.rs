//! Stipules: a pair at the base of the stalk, each a narrow blade with finger-like lobes at its base. They are
//! characteristic of pansies.
//!
//! They are built of ribbons, have the stalk's material and belong to its organ.

use super::blade::RestMesh;
use super::growth::LeafState;
use super::kind::Stipules;
use super::ribbons::Ribbons;
use super::skeleton::Skeleton;
use furrow_base::math::{RoundTo, ToFloat, Vec3, lerp, vec3};
use furrow_base::sampling::Purpose;

/// Angle between stalk and end lobe, radians.
const SPREAD: f32 = 0.55;

/// Builds both stipules of a leaf in the flat leaf's coordinates.
pub(super) fn pair(plan: &Stipules, leaf: &LeafState<'_>, skeleton: &Skeleton) -> RestMesh {
    let mut stream = leaf.stream.child(Purpose::Leaf, 103);
    let long = plan.length.f32() * leaf.blade;
    let rest = RestMesh::default();
    let mut ribbons = Ribbons { rest, skeleton, half_width: None, width: 0.2 * long, count: 0, drawn: 1.0 };
    let lobes = plan.lobes.get().min(12.0).trunc_to::<usize>();
    for side in [-1.0_f32, 1.0] {
        let heading = |angle: f32, rise: f32| vec3(side * angle.sin(), angle.cos(), rise).normalize_or(Vec3::Y);
        let foot = vec3(side * 0.3 * leaf.kind.stalk_width.f32() * leaf.blade, -0.96 * leaf.stalk, 0.0);
        let ahead = heading(SPREAD + stream.range32(-0.12, 0.12), stream.range32(0.0, 0.3));
        let out = ahead * long;
        let broad = 0.24 * long * stream.range32(0.85, 1.15);
        ribbons.band((foot, out, Vec3::Z, Vec3::Z * (-0.1 * long)), 5, |s| {
            broad * lerp(0.45, 1.0, (2.2 * s).min(1.0)) * (1.0 - s * s * s).max(0.12)
        });
        for (inner, count) in [(false, lobes + 1), (true, lobes)] {
            for k in 0..count {
                let share = (k.to_f32() + 0.5) / count.to_f32();
                let reach = long * lerp(0.3, 0.5, share) * stream.range32(0.8, 1.2);
                let turn = lerp(1.0, 0.4, share) + stream.range32(-0.12, 0.12);
                let lobe = heading(SPREAD + if inner { -turn } else { turn }, stream.range32(-0.1, 0.3));
                ribbons.strip(foot + out * (0.4 * share), lobe * reach, Vec3::Z, Vec3::ZERO, 0.09 * long, 2);
            }
        }
    }
    ribbons.rest
}
