//! Several main stems from one place, as a seed tuber of potato sends them up.
//!
//! The first stem stands where the plant does; each other one has its foot some centimetres away, leans outward and is a little smaller.
//! Nothing of a stem depends on how many there are. Leaves are numbered stem by stem ([`super::numbers`]).
//!
//! | | |
//! |---|---|
//! | 2 to 6 main stems of a seed tuber | quoted from memory: Allen & Wurr 1992, "Plant density", in The Potato Crop, 2nd ed.; Struik 2007, in Potato Biology and Biotechnology |
//! | where they leave the soil, how they lean, their sizes | estimates |

use super::axis::Foot;
use super::desc::Form;
use super::growth::{self, Growth, LeafNow};
use super::stage::{BUD, MOST_SHOOTS};
use crate::math::{direction, lerp};
use crate::sampling::{Purpose, Stream};
use std::f32::consts::{FRAC_PI_2, TAU};

/// Size of another stem over that of the first.
const SIZE: (f32, f32) = (0.75, 0.95);
/// How far its foot stands from the plant's middle, metres.
const APART: (f32, f32) = (0.01, 0.04);
/// How far it leans outward, radians: 8 to 25°.
const LEAN: (f32, f32) = (0.14, 0.44);
/// How far it continues below the soil, metres: it comes from a tuber, whether the soil there is higher or lower than under the first.
const ROOT: f32 = 0.02;
/// The golden angle, radians: stems stand apart however many there are.
const GOLDEN: f32 = 2.399_963;

/// A stem beside the first.
pub(super) struct OtherStem {
    /// Where it leaves the soil.
    pub(super) foot: Foot,
    /// What is added to the number of a leaf of the first stem.
    pub(super) above: u16,
    /// What is added to its azimuth, radians.
    turn: f32,
    /// Its own numbers.
    pub(super) stream: Stream,
}

impl OtherStem {
    /// Its leaf that stands where `leaf` stands on the first stem; none while it is hidden in the bud.
    pub(super) fn leaf<'a>(&self, leaf: &LeafNow<'a>, growth: &Growth<'_>) -> Option<LeafNow<'a>> {
        let size = self.foot.size;
        let number = leaf.number + self.above;
        (leaf.blade * size >= BUD).then(|| LeafNow {
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

/// The stems of a plant beside its first, as many as its `tillers`.
pub(super) fn others(growth: &Growth<'_>) -> Vec<OtherStem> {
    if growth.desc.form != Form::Erect {
        return Vec::new();
    }
    let count = (growth.tillers.round() as usize).min(MOST_SHOOTS);
    let stem = |k: usize| {
        let above = growth.numbers.side(k)?;
        let mut stream = growth.stream.child(Purpose::Plant, 100 + k as u64);
        let towards = growth::turn(growth.stream) + GOLDEN * k as f32 + stream.range32(-0.4, 0.4);
        let out = direction(FRAC_PI_2, towards);
        let foot = Foot {
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
