//! Identities of plants and leaves that depend only on the field.
//!
//! A plant's identity is a 32-bit hash of the field's seed and index, its population (which crop, weed, plant or model of the
//! scene file) and its address there (row and slot, cell of the ground, index in the list). A leaf's identity is a hash of the plant's
//! identity and the leaf number. Neither depends on the camera or on other plants.
//!
//! Hashes can collide: with 500 plants of 10 leaves, in one field of 300. The later of the two (plants before leaves, each in the
//! order of populations and addresses) is hashed again until it is unique. Only such a plant or leaf can have a different identity when
//! the one that it collides with is out of view.

use crate::PlantRecord;
use furrow_base::math::ToInt;
use furrow_base::sampling::rng::mix;
use std::collections::BTreeSet;

/// Population number of single plants; crops and weeds use the numbers of their random streams.
pub(super) const PLACED: u64 = 2001;
/// Population number of the first model; each model is its own population.
pub(super) const MODELS: u64 = 3001;

/// Returns the identity of the plant with this address in a population of a field, before collisions are resolved.
pub(super) fn of(seed: u64, index: u64, population: u64, address: u64) -> u32 {
    folded(mix(mix(mix(mix(seed) ^ index) ^ population) ^ address))
}

/// Assigns the identities of leaves, and makes all identities of plants and leaves unique.
pub(super) fn settle(plants: &mut [PlantRecord]) {
    let mut taken = BTreeSet::new();
    for plant in plants.iter_mut() {
        plant.id = alone(plant.id, &mut taken);
    }
    for plant in plants {
        let own = |leaf: u16| folded(mix(u64::from(plant.id) << 16 | u64::from(leaf)));
        plant.leaf_ids = (1..=plant.leaves).map(|leaf| alone(own(leaf), &mut taken)).collect();
    }
}

/// Returns the first value among `id` and its repeated hashes that is not taken, and marks it as taken.
fn alone(mut id: u32, taken: &mut BTreeSet<u32>) -> u32 {
    while !taken.insert(id) {
        id = folded(mix(u64::from(id)));
    }
    id
}

/// Returns the upper 32 bits of a hash, but never 0, which means "no plant".
fn folded(hash: u64) -> u32 {
    (hash >> 32).to_u32().max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: 32-bit hashes collide. Expected: 101 equal hashes get distinct identities; the first keeps its hash.
    #[test]
    fn equal_hashes_get_different_identities() {
        let mut taken = BTreeSet::new();
        let first = of(7, 0, 1, 42);
        assert_eq!(alone(first, &mut taken), first);
        let again: BTreeSet<u32> = (0..100).map(|_| alone(first, &mut taken)).collect();
        assert!(again.len() == 100 && !again.contains(&first) && !again.contains(&0));
        assert_eq!(folded(5), 1);
    }
}
