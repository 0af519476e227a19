//! Rosettes of finely divided leaves.

use super::axis;
use super::growth::Growth;
use super::leaf::{self, Lower};
use super::organ::Organ;
use super::rosette;

/// Grows a rosette of divided leaves. Where it stands on its axis it is a rosette like any other; its leaves' kind says how
/// they are divided, and older plants lift the youngest on a short stem.
pub(super) fn grow(growth: &Growth<'_>) -> Vec<Organ> {
    let mut organs = Vec::new();
    let axis = axis::grow(&mut organs, growth, rosette::SECTION);
    for now in &growth.leaves {
        leaf::grow(&mut organs, now, axis.seat(now), Lower::Petiole);
    }
    organs
}
