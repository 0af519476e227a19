//! Whorls of leaves without stalks on a square stem, with side shoots from the axils of the seed leaves: bedstraws such as cleavers. The
//! stem is too weak to stand by itself and lies down as it grows longer; its whorls stand round it there too.

use super::growth::Growth;
use super::organ::Organ;
use super::runner::{self, Habit};
use super::tube::Profile;

/// Square, slender; a leaf stays where it stands on the stem, and stems wander over the ground (how much is an estimate).
const HABIT: Habit = Habit { profile: Profile::Square, sides: 12, whorled: true, swerve: 0.32 };

/// Grows whorls.
pub(super) fn grow(growth: &Growth<'_>) -> Vec<Organ> {
    runner::shoots(growth, HABIT)
}
