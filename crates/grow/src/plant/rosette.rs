//! Rosettes (beet, shepherd's purse): all leaves sit on one crown at the soil.

use super::axis::{self, Section};
use super::growth::Growth;
use super::leaf::{self, Lower};
use super::organ::Organ;
use super::tube::Profile;

/// Crown with the older leaves on its flank and the youngest on top.
pub(super) const SECTION: Section =
    Section { profile: Profile::Channelled(1.0), taper: 0.8, wander: 0.05, seat: (0.75, 0.2) };

/// Builds a rosette.
pub(super) fn grow(growth: &Growth<'_>) -> Vec<Organ> {
    let mut organs = Vec::with_capacity(1 + 2 * growth.leaves.len());
    let axis = axis::grow(&mut organs, growth, SECTION);
    for leaf in &growth.leaves {
        leaf::grow(&mut organs, leaf, axis.seat(leaf), Lower::Petiole);
    }
    organs
}
