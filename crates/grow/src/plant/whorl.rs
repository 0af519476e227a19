//! Whorls of sessile leaves on a square stem, with side shoots from the axils of the cotyledons: bedstraws such as
//! cleavers. The stem is too weak to support itself and lies on the soil as it grows longer; the whorls keep their
//! arrangement around it.

use super::growth::Growth;
use super::organ::Organ;
use super::runner::{self, ShootParameters};
use super::tube::Profile;

/// Slender square stems. Leaves keep their place around a lying stem. `swerve`, the sideways wandering of a lying stem,
/// is an estimate.
const HABIT: ShootParameters = ShootParameters { profile: Profile::Square, sides: 12, whorled: true, swerve: 0.32 };

/// Builds a plant with whorls.
pub(super) fn grow(growth: &Growth<'_>) -> Vec<Organ> {
    runner::shoots(growth, HABIT)
}
