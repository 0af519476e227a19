//! Plant pixels that hang together are of one class.
//!
//! A region of neighbouring plant pixels takes the class that has the largest sum of probabilities in it: those of the largest size that
//! the picture was seen at, where it was seen at several, since there leaves show most of their form. Plants that touch are one region:
//! in closed canopies a weed between crops is outvoted.

use crate::train::measure::components::Components;

/// Gives each plant pixel the class of its region: that class has the highest of the plants' probabilities then, the others 0, so that no
/// other class lies between a plant and soil when the map is enlarged. `probabilities` have one plane a class, soil first, and so has
/// `finest`, which decides where it is given.
pub(super) fn refine((width, height): (usize, usize), probabilities: &mut [f32], finest: Option<&[f32]>) {
    let n = width * height;
    let classes = probabilities.len() / n.max(1);
    let best = |at: usize, probabilities: &[f32]| {
        // The first of equal ones, as a network's classes are read.
        (1..classes).fold(0, |best, c| if probabilities[c * n + at] > probabilities[best * n + at] { c } else { best })
    };
    let regions = Components::of(width, height, |at| (best(at, probabilities) > 0).then_some(()));
    let mut sums = vec![0.0f64; regions.areas.len() * classes];
    for (at, region) in regions.labels.iter().enumerate().filter(|(_, region)| **region > 0) {
        for class in 1..classes {
            let p = finest.unwrap_or(probabilities)[class * n + at];
            sums[(*region as usize - 1) * classes + class] += f64::from(p);
        }
    }
    let winner = |sums: &[f64]| (1..classes).fold(1, |best, c| if sums[c] > sums[best] { c } else { best });
    let winners: Vec<usize> = sums.chunks_exact(classes.max(1)).map(winner).collect();
    for (at, region) in regions.labels.iter().enumerate().filter(|(_, region)| **region > 0) {
        let (own, won) = (best(at, probabilities), winners[*region as usize - 1]);
        let highest = probabilities[own * n + at];
        (1..classes).for_each(|class| probabilities[class * n + at] = if class == won { highest } else { 0.0 });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: of a plant said to be crop, weed, crop all is crop, by its sums; one apart from it stays weed; soil stays soil. Source: the rule.
    #[test]
    fn a_plant_is_of_one_class_and_another_of_its_own() {
        let soil = [0.1f32, 0.2, 0.1, 0.9, 0.8, 0.1];
        let crop = [0.7f32, 0.2, 0.8, 0.06, 0.1, 0.3];
        let weed = [0.2f32, 0.6, 0.1, 0.04, 0.1, 0.6];
        let mut p = [soil, crop, weed].concat();
        refine((6, 1), &mut p, None);
        assert_eq!(p[..6], soil);
        assert_eq!(p[6..12], [0.7, 0.6, 0.8, 0.06, 0.1, 0.0]);
        assert_eq!(p[12..], [0.0, 0.0, 0.0, 0.04, 0.1, 0.6]);
        // All plants are one where they touch.
        let mut p = [[0.1f32, 0.1], [0.5, 0.3], [0.4, 0.6]].concat();
        let before = p.clone();
        refine((2, 1), &mut p, None);
        assert_eq!(p, [0.1, 0.1, 0.0, 0.0, 0.5, 0.6]);
        // The finest size says crop.
        p = before;
        refine((2, 1), &mut p, Some(&[0.1, 0.1, 0.6, 0.5, 0.3, 0.4]));
        assert_eq!(p, [0.1, 0.1, 0.5, 0.6, 0.0, 0.0]);
        refine((0, 0), &mut [], None);
    }
}
