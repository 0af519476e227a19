//! Effects of the condition on the posture and the shape of leaves.
//!
//! In a limp leaf the stalk leans out and arches, the blade nods and hangs, and the halves fold down. Angles at full
//! wilt are estimates from pictures of beet and sunflower at noon during a drought.

use super::{Condition, ConditionDesc, leaf_stream};
use crate::plant::growth::LeafState;
use furrow_base::math::{ToFloat, lerp};
use furrow_base::sampling::{Purpose, Stream};

/// Angles at full wilt, degrees: between stalk and axis, arch of the stalk, nod and bend of the blade, and downward
/// fold of its halves.
const LIMP_DEG: [f32; 5] = [95.0, 55.0, 35.0, 75.0, 35.0];

/// Parameters of the posture of a plant's leaves.
pub(in crate::plant) struct Posture<'a> {
    desc: &'a ConditionDesc,
    wilt: f32,
    stream: &'a Stream,
}

impl<'a> Posture<'a> {
    /// Returns the posture of a plant in a condition.
    pub(in crate::plant) fn new(desc: &'a ConditionDesc, condition: &Condition, stream: &'a Stream) -> Self {
        Self { desc, wilt: condition.wilt, stream }
    }

    /// Applies the posture to the leaves.
    pub(in crate::plant) fn apply(&self, leaves: &mut [LeafState<'_>]) {
        let last = leaves.iter().map(|l| l.number).max().unwrap_or(1);
        for leaf in leaves {
            let mut s = leaf_stream(self.stream, leaf.number).child(Purpose::Condition, 22);
            let mut normal = || s.normal().clamp(-2.5, 2.5).to_f32();
            leaf.width *= (self.desc.width_sd.f32() * normal()).exp();
            let sd = self.desc.bend_sd.f32();
            leaf.bend *= (sd * normal()).exp();
            leaf.fold *= (sd * normal()).exp();
            leaf.twist = (self.desc.twist_sd_deg.f32() * normal()).to_radians();
            if self.wilt > 0.0 {
                // The wilt varies between the leaves of a plant, and the youngest wilt last.
                let wilt =
                    self.wilt * lerp(1.0, 0.4, f32::from(leaf.number) / f32::from(last)) * (0.35 * normal()).exp();
                droop(leaf, wilt.min(1.0));
            }
        }
    }
}

/// Lets a leaf hang as at a wilt of `wilt`, 0–1.
pub(in crate::plant) fn droop(leaf: &mut LeafState<'_>, wilt: f32) {
    let [angle, arch, nod, hang, sink] = LIMP_DEG.map(f32::to_radians);
    leaf.angle += (angle - leaf.angle).max(0.0) * 0.7 * wilt;
    leaf.arch += arch * wilt;
    leaf.pitch += nod * wilt;
    leaf.bend += hang * wilt;
    leaf.fold -= sink * wilt;
}
