//! Plant and leaf numbers of a source, corrected so that they agree with the classes.
//!
//! A plant has a single class, and a leaf belongs to a single plant. If a source contradicts this, the class takes
//! precedence, since people annotate classes most carefully: pixels of a plant that are soil or unlabelled are removed
//! from it, a number that is used for crop and weed becomes two plants, and a leaf on two plants becomes two leaves.
//! Corrections are reported as warnings.

use furrow_base::Result;
use furrow_base::error::Error;
use furrow_base::math::ToInt;
use furrow_render::scene::tag::{Class, MOST_PLANTS};
use std::collections::BTreeMap;
use std::path::Path;

/// Plant and leaf number of each pixel.
pub(super) struct Instances {
    pub(super) plants: Vec<u32>,
    pub(super) leaves: Vec<u16>,
    pub(super) warnings: Vec<String>,
    /// New numbers of plant and leaf by the numbers of the source; leaf 0 is the plant itself.
    pub(super) numbers: BTreeMap<(u32, u32), (u32, u16)>,
}

/// Computes plant and leaf numbers from a source's class, plant and leaf of each pixel (0 for none). Leaves may be
/// numbered throughout the image. `path` is the file that errors name.
pub(super) fn instances(path: &Path, semantics: &[u8], plants: &[u32], leaves: &[u32]) -> Result<Instances> {
    let vegetation = |class: u8| class == Class::Crop as u8 || class == Class::Weed as u8;
    let kept: Vec<(u8, u32)> = semantics
        .iter()
        .zip(plants)
        .map(|(class, plant)| if vegetation(*class) { (*class, *plant) } else { (*class, 0) })
        .collect();
    let numbers = plant_numbers(path, &kept)?;
    let mut of_leaf: BTreeMap<(u32, u32), u16> = BTreeMap::new();
    let plant_of = |(class, plant): (u8, u32)| if plant == 0 { 0 } else { numbers[&(plant, class)] };
    for (place, leaf) in kept.iter().zip(leaves).filter(|(place, leaf)| place.1 != 0 && **leaf != 0) {
        of_leaf.insert((plant_of(*place), *leaf), 0);
    }
    // Renumbers the leaves of each plant from 1, in ascending order.
    let (mut plant_before, mut next) = (0, 0_u32);
    for ((plant, _), number) in &mut of_leaf {
        next = if *plant == plant_before { next + 1 } else { 1 };
        plant_before = *plant;
        *number = u16::try_from(next).map_err(|_| too_many(path, "leaves of a plant", u32::from(u16::MAX)))?;
    }
    let mut all = Instances { plants: Vec::new(), leaves: Vec::new(), warnings: Vec::new(), numbers: BTreeMap::new() };
    let mut lost = [0_u64; 2];
    for ((place, plant), leaf) in kept.iter().zip(plants).zip(leaves) {
        let number = plant_of(*place);
        let on_plant = of_leaf.get(&(number, *leaf)).copied().unwrap_or(0);
        lost[0] += u64::from(*plant != 0 && number == 0);
        lost[1] += u64::from(*leaf != 0 && on_plant == 0);
        if number != 0 {
            all.numbers.insert((*plant, 0), (number, 0));
            if on_plant != 0 {
                all.numbers.insert((*plant, *leaf), (number, on_plant));
            }
        }
        all.plants.push(number);
        all.leaves.push(on_plant);
    }
    let shared = numbers
        .keys()
        .filter(|(plant, class)| *class == Class::Weed as u8 && numbers.contains_key(&(*plant, Class::Crop as u8)));
    let notes = [
        (lost[0], "pixels of plants are soil or unlabelled and were removed from the plants"),
        (lost[1], "pixels of leaves are on no plant and were removed from the leaves"),
        (shared.count().to_u64(), "numbers are used for a crop plant and a weed; each becomes two plants"),
    ];
    all.warnings.extend(notes.into_iter().filter(|(n, _)| *n > 0).map(|(n, words)| format!("{n} {words}")));
    Ok(all)
}

/// Returns a number for each plant and class: the source's number if it is in range and not in use, otherwise the next
/// free one.
fn plant_numbers(path: &Path, kept: &[(u8, u32)]) -> Result<BTreeMap<(u32, u8), u32>> {
    let mut numbers: BTreeMap<(u32, u8), u32> = BTreeMap::new();
    for (class, plant) in kept.iter().filter(|(_, plant)| *plant != 0) {
        numbers.insert((*plant, *class), 0);
    }
    let mut before = 0;
    let mut last = numbers.keys().map(|(plant, _)| *plant).filter(|plant| *plant <= MOST_PLANTS).max().unwrap_or(0);
    for ((plant, _), number) in &mut numbers {
        *number = if *plant <= MOST_PLANTS && *plant != before {
            *plant
        } else if last < MOST_PLANTS {
            last += 1;
            last
        } else {
            return Err(too_many(path, "plants", MOST_PLANTS));
        };
        before = *plant;
    }
    Ok(numbers)
}

fn too_many(path: &Path, what: &str, most: u32) -> Error {
    Error::input(format!("it has more {what} than labels can number, {most}; cut the image into two")).in_file(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(semantics: &[u8], plants: &[u32], leaves: &[u32]) -> Instances {
        instances(Path::new("a.png"), semantics, plants, leaves).unwrap()
    }

    #[test]
    fn what_agrees_stays_and_leaves_count_on_their_plants() {
        let all = of(&[0, 1, 1, 1, 2, 2], &[0, 7, 7, 7, 9, 9], &[0, 31, 30, 0, 32, 40]);
        assert_eq!(all.plants, [0, 7, 7, 7, 9, 9]);
        assert_eq!(all.leaves, [0, 2, 1, 0, 1, 2]);
        assert!(all.warnings.is_empty());
        assert_eq!(all.numbers[&(7, 31)], (7, 2));
    }

    #[test]
    fn contradictions_are_mended_and_reported() {
        // Plant 3 is crop and weed and extends into soil and unlabelled pixels; leaf 5 is on both plants and beside
        // them.
        let all = of(&[1, 2, 0, 255, 1], &[3, 3, 3, 3, 0], &[5, 5, 0, 0, 5]);
        assert_eq!(all.plants, [3, 4, 0, 0, 0]);
        assert_eq!(all.leaves, [1, 1, 0, 0, 0]);
        assert_eq!(all.warnings.len(), 3);
    }

    /// Expected: numbers within 24 bits are kept; larger ones get the next free number, or an error if there is none.
    #[test]
    fn numbers_that_labels_hold_stay() {
        assert_eq!(of(&[1, 1, 2], &[70_000, 2, MOST_PLANTS], &[0; 3]).plants, [70_000, 2, MOST_PLANTS]);
        assert_eq!(of(&[1, 1], &[MOST_PLANTS + 1, 2], &[0; 2]).plants, [3, 2]);
        let error = instances(Path::new("a.png"), &[1, 1], &[MOST_PLANTS + 1, MOST_PLANTS], &[0; 2]).err().unwrap();
        assert!(error.message().contains("more plants than labels can number, 16777215"), "{error}");
    }
}
