//! Several main stems from one place, as from a seed tuber of potato.
//!
//! The first stem is at the plant's origin. Each other stem has its base a few centimetres away, leans outward and is
//! slightly smaller. No stem depends on the number of stems. Leaves are numbered stem by stem ([`super::numbers`]).
//!
//! Sources:
//! - 2 to 6 main stems of a seed tuber: quoted from memory, Allen & Wurr 1992, "Plant density", in The Potato Crop, 2nd ed.;
//!   Struik 2007, in Potato Biology and Biotechnology.
//! - Positions of their bases, lean and sizes: estimates.

use super::axis::StemBase;
use super::desc::Form;
use super::growth::{self, Growth, LeafState};
use super::stage::{BUD, MOST_SHOOTS};
use furrow_base::math::{RoundTo, ToFloat, ToInt, direction, lerp};
use furrow_base::sampling::{Purpose, Stream};
use std::f32::consts::{FRAC_PI_2, TAU};

/// Ratio of another stem's size to the first stem's: range drawn from.
const SIZE: (f32, f32) = (0.75, 0.95);
/// Distance of its base from the plant's origin, metres: range drawn from.
const APART: (f32, f32) = (0.01, 0.04);
/// Outward lean, radians: range drawn from, 8 to 25°.
const LEAN: (f32, f32) = (0.14, 0.44);
/// Depth of its buried part, metres. It comes from a tuber, so its base must be buried even where the soil is lower
/// than at the first stem.
const ROOT: f32 = 0.02;
/// Golden angle, radians: keeps stems apart whatever their number.
const GOLDEN: f32 = 2.399_963;

/// Main stem in addition to the first.
pub(super) struct OtherStem {
    /// Base of the stem.
    pub(super) foot: StemBase,
    /// Offset from a leaf number of the first stem to that of this stem.
    pub(super) above: u16,
    /// Offset added to the azimuths of the first stem's leaves, radians.
    turn: f32,
    /// Random stream of the stem.
    pub(super) stream: Stream,
}

impl OtherStem {
    /// Returns this stem's counterpart of the first stem's `leaf`; `None` while it is hidden in the bud.
    pub(super) fn leaf<'a>(&self, leaf: &LeafState<'a>, growth: &Growth<'_>) -> Option<LeafState<'a>> {
        let size = self.foot.size;
        let number = leaf.number + self.above;
        (leaf.blade * size >= BUD).then(|| LeafState {
            number,
            azimuth: leaf.azimuth + self.turn,
            blade: leaf.blade * size,
            width: leaf.width * size,
            stalk: leaf.stalk * size,
            stream: growth.stream.child(Purpose::Leaf, u64::from(number)),
            ..leaf.clone()
        })
    }
}

/// Returns the stems of an `Erect` plant in addition to the first, one for each of its `tillers`.
pub(super) fn others(growth: &Growth<'_>) -> Vec<OtherStem> {
    if growth.desc.form != Form::Erect {
        return Vec::new();
    }
    let count = growth.tillers.round_to::<usize>().min(MOST_SHOOTS);
    let stem = |k: usize| {
        let above = growth.numbers.side(k)?;
        let mut stream = growth.stream.child(Purpose::Plant, 100 + k.to_u64());
        let towards = growth::turn(growth.stream) + GOLDEN * k.to_f32() + stream.range32(-0.4, 0.4);
        let out = direction(FRAC_PI_2, towards);
        let foot = StemBase {
            point: out * stream.range32(APART.0, APART.1),
            along: direction(
                stream.range32(LEAN.0, LEAN.1) + growth.lean_further(&stream.child(Purpose::Plant, 1)),
                towards,
            ),
            size: lerp(stream.range32(SIZE.0, SIZE.1), 1.0, growth.tillers_grown),
            root: ROOT,
            stream: stream.child(Purpose::Plant, 2),
        };
        Some(OtherStem { foot, above, turn: stream.range32(0.0, TAU), stream })
    };
    (0..count).map_while(stem).collect()
}
