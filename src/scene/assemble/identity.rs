//! Identities of plants and leaves that depend on the field alone.
//!
//! A plant's identity is a 32-bit hash of the field's seed and index, its population (which crop, weed, plant or model of the
//! scene file) and its address there (row and slot, cell of the ground, place in the list). A leaf's is a hash of its plant's and
//! its own number. Neither knows of the camera or of other plants.
//!
//! Two hashes may be equal: with 500 plants of 10 leaves, in one field of 300. The later of the two, plants before leaves and
//! each in the order of populations and addresses, is then hashed again until it is alone. Only such a one can have another
//! identity where the one that it collides with is out of view.

use crate::sampling::rng::mix;
use crate::scene::PlantRecord;
use std::collections::BTreeSet;

/// The population of single plants; crops and weeds have those of their streams.
pub(super) const PLACED: u64 = 2001;
/// The population of the first model; each is one of its own.
pub(super) const MODELS: u64 = 3001;

/// The identity of what has this address in a population of a field, before collisions are resolved.
pub(super) fn of(seed: u64, index: u64, population: u64, address: u64) -> u32 {
    folded(mix(mix(mix(mix(seed) ^ index) ^ population) ^ address))
}

/// Gives every leaf its identity, and makes those of all plants and leaves unique.
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

/// The first of `id` and its hashes that is not taken, which takes it.
fn alone(mut id: u32, taken: &mut BTreeSet<u32>) -> u32 {
    while !taken.insert(id) {
        id = folded(mix(u64::from(id)));
    }
    id
}

/// The upper half of a hash; never 0, which stands for nothing.
fn folded(hash: u64) -> u32 {
    ((hash >> 32) as u32).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: 32 bits collide. Expected: all identities differ though every hash is taken once already; the first keeps its own.
    #[test]
    fn equal_hashes_are_told_apart() {
        let mut taken = BTreeSet::new();
        let first = of(7, 0, 1, 42);
        assert_eq!(alone(first, &mut taken), first);
        let again: BTreeSet<u32> = (0..100).map(|_| alone(first, &mut taken)).collect();
        assert!(again.len() == 100 && !again.contains(&first) && !again.contains(&0));
        assert_eq!(folded(5), 1);
    }
}
