//! Upright stems with stalked leaves, first in crossed pairs, then in a spiral (goosefoot); or several such stems from
//! one place (potato).

use super::axis::{self, Section};
use super::growth::Growth;
use super::leaf::{self, Lower};
use super::organ::Organ;
use super::stems;
use super::tube::Profile;

/// Round and tapering.
const SECTION: Section = Section { profile: Profile::Channelled(1.0), taper: 0.55, wander: 0.06, seat: (0.7, 0.5) };

/// Builds an upright plant, stem by stem.
pub(super) fn grow(growth: &Growth<'_>) -> Vec<Organ> {
    let others = stems::others(growth);
    let mut organs = Vec::with_capacity((2 + 2 * growth.leaves.len()) * (1 + others.len()));
    let axis = axis::grow(&mut organs, growth, SECTION);
    for leaf in &growth.leaves {
        leaf::grow(&mut organs, leaf, axis.seat(leaf), Lower::Petiole);
    }
    for stem in others {
        let axis = axis::stem(&mut organs, growth, SECTION, stem.foot.clone(), &mut stem.stream.clone());
        for leaf in growth.leaves.iter().filter_map(|leaf| stem.leaf(leaf, growth)) {
            leaf::grow(&mut organs, &leaf, axis.seat(&leaf), Lower::Petiole);
        }
    }
    organs
}
