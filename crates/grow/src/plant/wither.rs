//! Posture and shape of a leaf in senescence: limp, then dry, rolled and crumpled. [`super::senescence`] has the sources.

use super::condition::droop;
use super::growth::LeafState;
use super::senescence::ADDRESS;
use furrow_base::math::{lerp, smoothstep};
use furrow_base::sampling::Purpose;

/// Wilt of a limp leaf, see [`droop`].
const LIMP: f32 = 0.85;
/// Fractions of its length and of its width that a dry leaf has lost.
const SHRUNK: (f32, f32) = (0.05, 0.2);
/// Curl of each half of a dry leaf, radians: range drawn from.
const ROLLED: (f32, f32) = (1.0, 2.3);
/// Fraction of the leaves whose margins roll up rather than down.
const ROLLED_UP: f64 = 0.75;
/// Amplitude of the folds of a dry blade, as a fraction of its length.
const CRUMPLED: f32 = 0.022;

/// Changes posture and shape of a leaf according to its senescence.
pub(super) fn wither(leaf: &mut LeafState<'_>) {
    let s = leaf.senescence;
    if s <= 0.0 {
        return;
    }
    let (limp, dry) = (smoothstep(0.1, 0.75, s), smoothstep(0.5, 1.0, s));
    let mut stream = leaf.stream.child(Purpose::Leaf, ADDRESS + 2);
    let rolled = stream.range32(ROLLED.0, ROLLED.1);
    let side = if stream.chance(ROLLED_UP) { 1.0 } else { -1.0 };
    droop(leaf, LIMP * limp * stream.range32(0.8, 1.1));
    leaf.blade *= 1.0 - SHRUNK.0 * dry;
    leaf.width *= 1.0 - SHRUNK.1 * dry;
    leaf.curl = side * rolled * dry;
    leaf.crumple = CRUMPLED * dry;
    // The fold of a turgid leaf opens, or closes as its halves roll.
    leaf.fold *= lerp(1.0, 0.5, dry);
}
