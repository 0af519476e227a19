//! Rosettes of finely divided leaves.

use super::axis;
use super::growth::Growth;
use super::leaf::{self, Lower};
use super::organ::Organ;
use super::rosette;

/// Builds a rosette of divided leaves. The axis is that of any rosette; the kind of leaf sets the divisions. In older
/// plants the youngest leaves are raised on a short stem.
pub(super) fn grow(growth: &Growth<'_>) -> Vec<Organ> {
    let mut organs = Vec::new();
    let axis = axis::grow(&mut organs, growth, rosette::SECTION);
    for now in &growth.leaves {
        leaf::grow(&mut organs, now, axis.seat(now), Lower::Petiole);
    }
    organs
}
