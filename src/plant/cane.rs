//! Stout grasses: one shoot of sheaths rolled round each other, two ranks of big arching blades. Maize.

use super::growth::Growth;
use super::organ::Organ;
use super::tuft;
use crate::math::Vec3;

/// Radius of the youngest sheath over that of the oldest.
const TAPER: f32 = 0.45;

/// Grows one shoot; side shoots are not asked for.
pub(super) fn grow(growth: &Growth<'_>) -> Vec<Organ> {
    let mut organs = Vec::with_capacity(2 * growth.leaves.len());
    let shape = (0.5 * growth.stem, TAPER);
    tuft::shoot(&mut organs, shape, tuft::lean(growth), Vec3::ZERO, growth.leaves.iter().cloned());
    organs
}
