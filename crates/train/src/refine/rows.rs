//! Detection of crop rows: crops grow in rows, weeds anywhere.
//!
//! The rows of an image are the equidistant parallel lines that hold more of its plants than their share of the image area. Each region of
//! plant pixels is weighted by the square root of its area, so that one large plant does not outweigh a row of small ones. Angle, spacing
//! and phase of the lines maximize a score over a coarse grid, then over a fine grid around its best result.
//!
//! Some lines are found in every image. A permutation test measures whether they are rows: the score is compared with the highest
//! scores that the same regions reach when each is moved to a random position (toroidal shifts).

use crate::measure::components::Components;
use furrow_base::math::{RoundTo, ToFloat, ToInt};
use furrow_base::sampling::rng::mix;
use std::f64::consts::PI;

/// Number of angles of the coarse search, evenly spaced over 180°.
const ANGLES: usize = 60;
/// Row spacings of the coarse search, as fractions of the image's longer side, and the number of phases tried at each.
const SPACINGS: [(f64, usize); 11] = [
    (0.12, 16),
    (0.15, 16),
    (0.19, 16),
    (0.24, 16),
    (0.3, 16),
    (0.38, 16),
    (0.48, 16),
    (0.6, 32),
    (0.76, 32),
    (0.95, 32),
    (1.2, 32),
];
/// Fine search around the best coarse angle: number of steps to either side, and the step (half a degree).
const FINE_ANGLES: (i32, f64) = (6, PI / 360.0);
/// Fine search around the best coarse spacing: number of steps to either side, the step as a fraction of the spacing, and phases at each.
const FINE_SPACINGS: (i32, f64, u32) = (6, 0.025, 32);
/// Number of bins of the plant profile across the lines.
const BINS: usize = 160;
/// Half width of the profile, as a fraction of the image's longer side.
const REACH: f64 = 0.75;
/// Standard deviation of plants about their line, half row spacings.
const WIDTH: f64 = 0.25;
/// Minimum number of counting cells along the image's longer side, unless the image has fewer pixels.
const CELLS: usize = 240;
/// Minimum area of a region, as a fraction of the image area; smaller regions are ignored.
const LEAST: f64 = 2e-5;
/// Number of random placements that the score is compared with.
const PLACEMENTS: u64 = 16;
/// Constant added to the standard deviation of the random placements' scores.
const NOISE: f64 = 0.02;

/// Crop rows of an image; lengths are fractions of the image's longer side, the angle is in radians.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rows {
    angle: f64,
    spacing: f64,
    phase: f64,
    /// Score above the mean score of random placements of the same plants, in standard deviations of those scores.
    pub surplus: f64,
}

impl Rows {
    /// Finds the rows of the plant regions of an image of this width and height. Returns `None` without regions.
    pub(super) fn of(regions: &Components, (width, height): (usize, usize)) -> Option<Self> {
        let plants = Cells::of(regions, (width, height));
        if plants.places.is_empty() {
            return None;
        }
        let angles: Vec<f64> = (0..ANGLES).map(|k| k.to_f64() * PI / ANGLES.to_f64()).collect();
        let lines: Vec<(f64, f64)> = SPACINGS
            .iter()
            .flat_map(|(spacing, phases)| (0..*phases).map(move |k| (*spacing, k.to_f64() / phases.to_f64() * spacing)))
            .collect();
        let area = plants.all(&angles);
        let kernels = kernels(&lines);
        let coarse = best(&plants.profiles(&angles, |_| (0, 0)), &area, &kernels);
        let placed = |placement: u64| {
            let at = |region: u32, axis: u64, cells: usize| {
                let random = mix((placement << 32) + 2 * u64::from(region) + axis) >> 11;
                (random.to_f64() / (1u64 << 53).to_f64() * cells.to_f64()).trunc_to::<usize>()
            };
            let shift = |region: u32| (at(region, 0, plants.size.0), at(region, 1, plants.size.1));
            best(&plants.profiles(&angles, shift), &area, &kernels).score
        };
        let scores: Vec<f64> = (0..PLACEMENTS).map(placed).collect();
        let mean = scores.iter().sum::<f64>() / scores.len().to_f64();
        let variance = scores.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / scores.len().to_f64();
        let surplus = (coarse.score - mean) / (variance.sqrt() + NOISE);

        let (steps, step) = FINE_ANGLES;
        let near: Vec<f64> = (-steps..=steps).map(|k| angles[coarse.angle] + f64::from(k) * step).collect();
        let (steps, step, phases) = FINE_SPACINGS;
        let finer: Vec<(f64, f64)> = (-steps..=steps)
            .map(|k| lines[coarse.line].0 * (1.0 + f64::from(k) * step))
            .flat_map(|spacing| (0..phases).map(move |k| (spacing, f64::from(k) / f64::from(phases) * spacing)))
            .collect();
        let fine = best(&plants.profiles(&near, |_| (0, 0)), &plants.all(&near), &self::kernels(&finer));
        let (spacing, phase) = finer[fine.line];
        Some(Self { angle: near[fine.angle], spacing, phase, surplus })
    }

    /// Returns the mean distance of each region's pixels to the nearest row, in half row spacings: 0 on a row, 1 half way between two rows.
    pub(super) fn distances(&self, regions: &Components, (width, height): (usize, usize)) -> Vec<f64> {
        let (sin, cos) = self.angle.sin_cos();
        let longer = width.max(height).to_f64();
        let mut sums = vec![0.0; regions.areas.len()];
        for (at, region) in regions.labels.iter().enumerate().filter(|(_, region)| **region > 0) {
            let x = (at % width).to_f64() + 0.5 - width.to_f64() / 2.0;
            let y = (at / width).to_f64() + 0.5 - height.to_f64() / 2.0;
            sums[region.to_usize() - 1] += from_line((x * cos + y * sin) / longer, (self.spacing, self.phase));
        }
        sums.iter().zip(&regions.areas).map(|(sum, area)| sum / f64::from(*area)).collect()
    }
}

/// Returns the distance of a position across the lines to the nearest line, in half row spacings.
fn from_line(place: f64, (spacing, phase): (f64, f64)) -> f64 {
    let half = spacing / 2.0;
    ((place - phase + half).rem_euclid(spacing) - half).abs() / half
}

/// Plants of an image, counted in square cells.
struct Cells {
    /// Width and height of the grid, cells.
    size: (usize, usize),
    /// Region, cell x, cell y and weight of the region in that cell.
    places: Vec<(u32, usize, usize, f64)>,
    /// Position of the first cell's centre relative to the image centre, as a fraction of the image's longer side.
    first: (f64, f64),
    /// Side of a cell, as a fraction of the image's longer side.
    side: f64,
}

impl Cells {
    fn of(regions: &Components, (width, height): (usize, usize)) -> Self {
        let longer = width.max(height).max(1);
        let step = (longer / CELLS).max(1);
        let size = (width.div_ceil(step), height.div_ceil(step));
        let least = LEAST * (width * height).to_f64();
        let mut counts = std::collections::BTreeMap::new();
        for (at, region) in regions.labels.iter().enumerate().filter(|(_, region)| **region > 0) {
            if f64::from(regions.areas[region.to_usize() - 1]) >= least {
                *counts.entry((*region, at / width / step, at % width / step)).or_insert(0u32) += 1;
            }
        }
        let weight =
            |region: u32, count: u32| f64::from(count) / f64::from(regions.areas[region.to_usize() - 1]).sqrt();
        let places = counts.iter().map(|(&(region, y, x), count)| (region, x, y, weight(region, *count))).collect();
        let (half, longer) = (step.to_f64() / 2.0, longer.to_f64());
        let first = ((half - width.to_f64() / 2.0) / longer, (half - height.to_f64() / 2.0) / longer);
        Self { size, places, first, side: step.to_f64() / longer }
    }

    fn bin(&self, (x, y): (usize, usize), (sin, cos): (f64, f64)) -> usize {
        let (x, y) = (self.first.0 + x.to_f64() * self.side, self.first.1 + y.to_f64() * self.side);
        let bin = (x * cos + y * sin + REACH) * (BINS.to_f64() / (2.0 * REACH));
        bin.max(0.0).trunc_to::<usize>().min(BINS - 1)
    }

    /// Returns the fraction of the plants' weight in each bin across the lines, for each angle. `shift` moves each region by a
    /// number of cells right and down, with wrap-around.
    fn profiles(&self, angles: &[f64], shift: impl Fn(u32) -> (usize, usize)) -> Vec<[f64; BINS]> {
        let moved = |(region, x, y, weight): &(u32, usize, usize, f64)| {
            let (right, down) = shift(*region);
            ((x + right) % self.size.0, (y + down) % self.size.1, *weight)
        };
        let places: Vec<(usize, usize, f64)> = self.places.iter().map(moved).collect();
        self.shares(angles, &places)
    }

    /// Returns the fraction of the image area in each bin, for each angle.
    fn all(&self, angles: &[f64]) -> Vec<[f64; BINS]> {
        let places: Vec<_> = (0..self.size.0 * self.size.1).map(|k| (k % self.size.0, k / self.size.0, 1.0)).collect();
        self.shares(angles, &places)
    }

    fn shares(&self, angles: &[f64], places: &[(usize, usize, f64)]) -> Vec<[f64; BINS]> {
        let total: f64 = places.iter().map(|(_, _, weight)| weight).sum();
        let profile = |angle: &f64| {
            let (mut bins, turned) = ([0.0; BINS], angle.sin_cos());
            for (x, y, weight) in places {
                bins[self.bin((*x, *y), turned)] += weight / total;
            }
            bins
        };
        angles.iter().map(profile).collect()
    }
}

/// Returns one kernel over the bins per (spacing, phase): a Gaussian of the distance to the nearest line.
fn kernels(lines: &[(f64, f64)]) -> Vec<[f64; BINS]> {
    let value = |bin: usize, line| {
        let place = (bin.to_f64() + 0.5) / BINS.to_f64() * 2.0 * REACH - REACH;
        (-0.5 * (from_line(place, line) / WIDTH).powi(2)).exp()
    };
    lines.iter().map(|line| std::array::from_fn(|bin| value(bin, *line))).collect()
}

/// Best lines of a search: indices of the angle and of the (spacing, phase) pair, and the score.
struct Best {
    angle: usize,
    line: usize,
    score: f64,
}

/// Returns the lines whose share of the plants exceeds their share of the area most, in standard deviations of the share of a single pixel.
fn best(plants: &[[f64; BINS]], area: &[[f64; BINS]], kernels: &[[f64; BINS]]) -> Best {
    let mut best = Best { angle: 0, line: 0, score: f64::NEG_INFINITY };
    let on = |shares: &[f64; BINS], kernel: &[f64; BINS]| shares.iter().zip(kernel).map(|(s, k)| s * k).sum::<f64>();
    for (angle, (plants, area)) in plants.iter().zip(area).enumerate() {
        for (line, kernel) in kernels.iter().enumerate() {
            let expected = on(area, kernel);
            let score = (on(plants, kernel) - expected) / (expected * (1.0 - expected) + 1e-3).sqrt();
            if score > best.score {
                best = Best { angle, line, score };
            }
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::sampling::{Purpose, Stream};

    /// Returns the regions of a 480 × 360 image with squares of 7 × 7 pixels centred at `places`.
    fn regions(places: &[(f64, f64)]) -> Components {
        Components::of(480, 360, |at| {
            let (x, y) = ((at % 480).to_f64(), (at / 480).to_f64());
            places.iter().any(|(px, py)| (x - px).abs() <= 3.0 && (y - py).abs() <= 3.0).then_some(())
        })
    }

    /// Expected: rows 90 pixels apart and 25° from vertical are found within 1° and 3 %; plants in rows are near a line, plants
    /// half way between rows are far from it; the surplus exceeds 6 standard deviations.
    #[test]
    fn rows_are_found_where_plants_stand_in_rows() {
        let (sin, cos) = 25f64.to_radians().sin_cos();
        let place = |across: f64, along: f64| (240.0 + across * cos - along * sin, 180.0 + across * sin + along * cos);
        let inside = |(x, y): &(f64, f64)| (5.0..475.0).contains(x) && (5.0..355.0).contains(y);
        let crops: Vec<_> = (-4..=4)
            .flat_map(|row| (-12..12).map(move |k| (90.0 * f64::from(row) + 20.0, 24.0 * f64::from(k) + 3.0)))
            .map(|(across, along)| place(across, along))
            .filter(inside)
            .collect();
        let weeds = [place(65.0, 10.0), place(65.0, -60.0), place(-25.0, 90.0)];
        let regions = regions(&[crops.as_slice(), &weeds].concat());
        let rows = Rows::of(&regions, (480, 360)).unwrap();
        assert!((rows.angle.to_degrees() - 25.0).abs() <= 1.0, "{rows:?}");
        assert!((rows.spacing * 480.0 / 90.0 - 1.0).abs() < 0.03 && rows.surplus > 6.0, "{rows:?}");
        let distances = rows.distances(&regions, (480, 360));
        let of = |(x, y): &(f64, f64)| {
            distances[regions.labels[y.trunc_to::<usize>() * 480 + x.trunc_to::<usize>()].to_usize() - 1]
        };
        assert!(crops.iter().all(|plant| of(plant) < 0.25), "{distances:?}");
        assert!(weeds.iter().all(|plant| of(plant) > 0.8), "{distances:?}");
    }

    /// Expected: plants at random positions score about the same as at other random positions; images without plants have no rows.
    #[test]
    fn random_places_are_no_rows() {
        let mut surplus = Vec::new();
        for index in 0..8 {
            let mut stream = Stream::of(7, 0, Purpose::Test, index);
            let places: Vec<_> = (0..40).map(|_| (stream.range(4.0, 476.0), stream.range(4.0, 356.0))).collect();
            surplus.push(Rows::of(&regions(&places), (480, 360)).unwrap().surplus);
        }
        assert!(surplus.iter().all(|s| *s < 3.5), "{surplus:?}");
        assert!((surplus.iter().sum::<f64>() / 8.0).abs() < 1.2, "{surplus:?}");
        assert!(Rows::of(&regions(&[]), (480, 360)).is_none());
        assert!(Rows::of(&Components::of(0, 0, |_| Some(())), (0, 0)).is_none());
    }
}
