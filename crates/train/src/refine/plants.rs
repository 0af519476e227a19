//! Refinement steps `plants` and `rows`: connected plant pixels are of one class.
//!
//! A region of connected plant pixels takes the class with the largest sum of probabilities in it. If the image was predicted at several
//! sizes, the probabilities at the largest size are summed, since leaf shapes are resolved best there. Plants that touch are one region: in
//! closed canopies a weed among crops is outvoted.
//!
//! With the step `rows`, a region is crop or weed by the sum of three log odds: that of the network, ln(area / largest area in the
//! image), and a term for the distance to the nearest row, weighted by the probability that there are rows. [`super::appearance`]
//! adds a fourth term.

use super::rows::Rows;
use super::separate::{Vectors, instances};
use crate::measure::components::Components;
use furrow_base::math::ToInt;

/// Weight of the distance to the nearest row, where there are rows: log odds per half row spacing.
const PLACE: f64 = 50.0;
/// Zero of the distance term, in half row spacings from a row: nearer regions lean to crop, farther ones to weed.
const NEAR: f64 = 0.3;
/// Surplus of the row score, standard deviations, that gives rows a probability of 0.5.
pub(super) const LIKELY: f64 = 2.0;
/// Surplus of the row score, standard deviations, below which the lines found are ignored.
const CHANCE: f64 = 1.0;
/// Probability added to the mean of both classes over a region, so that the log odds stay finite.
const SURE: f64 = 0.02;

/// Plants of an image: regions of connected plant pixels, with the class probabilities that the network gives each.
pub(super) struct PlantRegions {
    pub regions: Components,
    size: (usize, usize),
    classes: usize,
    /// Sum of each class's probabilities over each region, regions × classes.
    sums: Vec<f64>,
}

impl PlantRegions {
    /// Finds the plants of an image. `probabilities` holds one plane per class, soil first, and defines the regions. The sums are
    /// taken over `finest`, which has the same layout, if it is given. `vectors` separate plants that touch.
    pub(super) fn of(
        size: (usize, usize),
        probabilities: &[f32],
        finest: Option<&[f32]>,
        vectors: Option<&Vectors>,
    ) -> Self {
        let n = size.0 * size.1;
        let classes = probabilities.len() / n.max(1);
        let regions = instances(size, &self::classes(n, probabilities), vectors);
        let mut sums = vec![0.0f64; regions.areas.len() * classes];
        for (at, region) in regions.labels.iter().enumerate().filter(|(_, region)| **region > 0) {
            for class in 1..classes {
                let p = finest.unwrap_or(probabilities)[class * n + at];
                sums[(region.to_usize() - 1) * classes + class] += f64::from(p);
            }
        }
        Self { regions, size, classes, sums }
    }

    /// Returns the class with the largest sum of probabilities for each region.
    pub(super) fn voted(&self) -> Vec<usize> {
        let winner = |sums: &[f64]| (1..self.classes).fold(1, |best, c| if sums[c] > sums[best] { c } else { best });
        self.sums.chunks_exact(self.classes.max(1)).map(winner).collect()
    }

    /// Returns the log odds of crop over weed of each region, from the network, rows and sizes, and the row score, `None` without
    /// plants. The classes must be soil, crop and weed.
    pub(super) fn arranged(&self) -> (Vec<f64>, Option<f64>) {
        let (regions, size) = (&self.regions, self.size);
        let found = Rows::of(regions, size);
        let rows = found.filter(|rows| rows.surplus >= CHANCE).map(|rows| {
            let likely = 1.0 / (1.0 + (LIKELY - rows.surplus).exp());
            (likely, rows.distances(regions, size))
        });
        let largest = f64::from(regions.areas.iter().copied().max().unwrap_or(1));
        let odds = |(region, sums): (usize, &[f64])| {
            let area = f64::from(regions.areas[region]);
            let network = ((sums[1] + SURE * area) / (sums[2] + SURE * area)).ln();
            let place = rows.as_ref().map_or(0.0, |(likely, distances)| PLACE * likely * (NEAR - distances[region]));
            network + (area / largest).ln() + place
        };
        (self.sums.chunks_exact(3).enumerate().map(odds).collect(), found.map(|rows| rows.surplus))
    }

    /// Assigns each plant pixel the class that `won(pixel, region)` returns; regions are numbered from 0. That class takes the
    /// highest plant probability of the pixel and the other plant classes 0, so that upscaling the map puts no third class between
    /// a plant and soil.
    pub(super) fn write(&self, probabilities: &mut [f32], won: impl Fn(usize, usize) -> usize) {
        let labels = &self.regions.labels;
        assign(self.size.0 * self.size.1, probabilities, |at| {
            (labels[at] > 0).then(|| won(at, labels[at].to_usize() - 1))
        });
    }
}

/// Assigns each of `n` pixels the plant class that `won` returns, if any, as [`PlantRegions::write`] does.
pub(super) fn assign(n: usize, probabilities: &mut [f32], won: impl Fn(usize) -> Option<usize>) {
    let classes = probabilities.len() / n.max(1);
    for (at, won) in (0..n).filter_map(|at| Some((at, won(at)?))) {
        let highest = probabilities[best(at, n, probabilities) * n + at];
        (1..classes).for_each(|class| probabilities[class * n + at] = if class == won { highest } else { 0.0 });
    }
}

/// Returns the class with the highest probability at each pixel.
pub(super) fn classes(n: usize, probabilities: &[f32]) -> Vec<u8> {
    (0..n).map(|at| best(at, n, probabilities).to_u8()).collect()
}

/// Returns the class with the highest probability at a pixel; ties go to the lower class number, as in the argmax of predictions.
fn best(at: usize, n: usize, probabilities: &[f32]) -> usize {
    (1..probabilities.len() / n)
        .fold(0, |best, c| if probabilities[c * n + at] > probabilities[best * n + at] { c } else { best })
}

/// Returns the class number for log odds of crop over weed: 1 (crop) if they are at least 0, otherwise 2 (weed).
pub(super) fn crop_or_weed(odds: f64) -> usize {
    if odds >= 0.0 { 1 } else { 2 }
}

#[cfg(test)]
mod tests {
    use crate::refine::{Refine, Seen};
    use furrow_base::sampling::{Purpose, Stream};

    /// Refines probabilities by `plants` or, with `rows`, by `plants,rows`.
    fn refine(size: (u32, u32), probabilities: &mut [f32], finest: Option<&[f32]>, rows: bool) {
        let seen = Seen { pixels: &[], size, bands: &[], finest, features: None, vectors: None, points: &[] };
        Refine { plants: true, rows, ..Refine::default() }.apply(&seen, probabilities, None);
    }

    /// Expected: a plant predicted as crop, weed, crop becomes all crop, by its sums; a separate plant stays weed; soil stays soil.
    /// Source: the rule.
    #[test]
    fn a_plant_is_of_one_class_and_another_of_its_own() {
        let soil = [0.1f32, 0.2, 0.1, 0.9, 0.8, 0.1];
        let crop = [0.7f32, 0.2, 0.8, 0.06, 0.1, 0.3];
        let weed = [0.2f32, 0.6, 0.1, 0.04, 0.1, 0.6];
        let mut p = [soil, crop, weed].concat();
        refine((6, 1), &mut p, None, false);
        assert_eq!(p[..6], soil);
        assert_eq!(p[6..12], [0.7, 0.6, 0.8, 0.06, 0.1, 0.0]);
        assert_eq!(p[12..], [0.0, 0.0, 0.0, 0.04, 0.1, 0.6]);
        // Plants that touch are one region.
        let mut p = [[0.1f32, 0.1], [0.5, 0.3], [0.4, 0.6]].concat();
        let before = p.clone();
        refine((2, 1), &mut p, None, false);
        assert_eq!(p, [0.1, 0.1, 0.0, 0.0, 0.5, 0.6]);
        // The probabilities at the largest size favour crop.
        p = before;
        refine((2, 1), &mut p, Some(&[0.1, 0.1, 0.6, 0.5, 0.3, 0.4]), false);
        assert_eq!(p, [0.1, 0.1, 0.5, 0.6, 0.0, 0.0]);
        refine((0, 0), &mut [], None, false);
        refine((0, 0), &mut [], None, true);
    }

    /// Returns probabilities of a 300 × 300 image with square plants (x, y, half side), all with these probabilities of crop and weed.
    fn squares(plants: &[(usize, usize, usize)], crop: f32, weed: f32) -> Vec<f32> {
        let mut p = [vec![0.9f32; 90_000], vec![0.05; 90_000], vec![0.05; 90_000]].concat();
        for (x, y, half) in plants {
            for at in (y - half..=y + half).flat_map(|row| (x - half..=x + half).map(move |column| row * 300 + column))
            {
                (p[at], p[90_000 + at], p[180_000 + at]) = (1.0 - crop - weed, crop, weed);
            }
        }
        p
    }

    /// Expected: of equal squares that the network predicts as crop, those between rows become weed and those in rows stay crop.
    /// With random positions and a certain network, rows are found by chance in one image of six (the upper tail of a normal
    /// distribution above 1: 1.3 of 8, standard deviation 1.0); all other images keep the network's classes, bit for bit. Of two
    /// isolated squares the small one becomes weed if the network is undecided and stays crop if it is certain. Source: the rule.
    #[test]
    fn weeds_are_found_between_rows_and_seldom_where_there_are_none() {
        let class = |p: &[f32], (x, y, _): &(usize, usize, usize)| {
            let at = y * 300 + x;
            if p[90_000 + at] > p[180_000 + at] { 1 } else { 2 }
        };
        let crops: Vec<_> = (0..4).flat_map(|row| (0..12).map(move |k| (40 + 70 * row, 12 + 25 * k, 4))).collect();
        let weeds = [(75, 60, 4), (75, 200, 4), (145, 140, 4), (218, 270, 4)];
        let mut p = squares(&[crops.as_slice(), &weeds].concat(), 0.6, 0.3);
        refine((300, 300), &mut p, None, true);
        assert!(crops.iter().all(|plant| class(&p, plant) == 1) && weeds.iter().all(|plant| class(&p, plant) == 2));

        let plants_of = |picture: u64| -> Vec<_> {
            let mut s = Stream::of(11, picture, Purpose::Test, 0);
            (0..30).map(|_| (6 + s.index(288), 6 + s.index(288), 3)).collect()
        };
        let changed = |picture: &u64| {
            let mut p = squares(&plants_of(*picture), 0.75, 0.05);
            let mut voted = p.clone();
            refine((300, 300), &mut voted, None, false);
            refine((300, 300), &mut p, None, true);
            p != voted
        };
        let changed = (0..8).filter(changed).count();
        assert!(changed <= 5, "{changed} of 8");

        let two = [(100, 150, 20), (250, 60, 5)];
        for (crop, expected) in [(0.45, 2), (0.88, 1)] {
            let mut p = squares(&two, crop, 0.9 - crop);
            refine((300, 300), &mut p, None, true);
            assert_eq!((class(&p, &two[0]), class(&p, &two[1])), (1, expected));
        }
    }
}
