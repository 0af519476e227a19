//! Rosettes: all leaves stand on one crown at the soil. Beet, shepherd's purse.

use super::axis::{self, Section};
use super::growth::Growth;
use super::leaf::{self, Lower};
use super::organ::Organ;
use super::tube::Profile;

/// A crown: older leaves on its flank, the youngest on top.
pub(super) const SECTION: Section =
    Section { profile: Profile::Channelled(1.0), taper: 0.8, wander: 0.05, seat: (0.75, 0.2) };

/// Grows a rosette.
pub(super) fn grow(growth: &Growth<'_>) -> Vec<Organ> {
    let mut organs = Vec::with_capacity(1 + 2 * growth.leaves.len());
    let axis = axis::grow(&mut organs, growth, SECTION);
    for leaf in &growth.leaves {
        leaf::grow(&mut organs, leaf, axis.seat(leaf), Lower::Petiole);
    }
    organs
}
