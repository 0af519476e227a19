//! Stout grasses (maize): one shoot of sheaths rolled around each other, with large arching blades in two ranks.

use super::growth::Growth;
use super::organ::Organ;
use super::tuft;
use furrow_base::math::Vec3;

/// Ratio of the youngest sheath's radius to the oldest's.
const TAPER: f32 = 0.45;

/// Builds one shoot; `tillers` is ignored.
pub(super) fn grow(growth: &Growth<'_>) -> Vec<Organ> {
    let mut organs = Vec::with_capacity(2 * growth.leaves.len());
    let shape = (0.5 * growth.stem, TAPER);
    tuft::shoot(&mut organs, shape, tuft::lean(growth), Vec3::ZERO, growth.leaves.iter().cloned());
    organs
}
