//! Whorls of leaves without stalks on a square stem: bedstraws such as cleavers.

use super::axis::{self, Section};
use super::growth::Growth;
use super::leaf::{self, Lower};
use super::organ::Organ;
use super::tube::Profile;

/// Square, slender, leaves seated just below the surface.
const SECTION: Section = Section { profile: Profile::Square, taper: 0.65, wander: 0.11, seat: (0.7, 0.7) };

/// Grows whorls.
pub(super) fn grow(growth: &Growth<'_>) -> Vec<Organ> {
    let mut organs = Vec::with_capacity(2 + 2 * growth.leaves.len());
    let axis = axis::grow(&mut organs, growth, SECTION);
    for leaf in &growth.leaves {
        leaf::grow(&mut organs, leaf, axis.seat(leaf), Lower::Petiole);
    }
    organs
}
