//! Position of label outlines relative to the visible edges of leaves.
//!
//! Across an outline, colour changes from that of soil to that of plants. The visible edge is where it is midway. The
//! distance from the edge out to the outline is the margin that annotators left around leaves. Rendered labels have
//! none.

use super::regions;
use furrow_base::math::{RoundTo, ToFloat, ToInt, disc};

/// Distance in pixels from the outline, on both sides, that is evaluated.
const REACH: usize = 10;
/// Pixels further from the outline than this represent the colour of plants, or soil.
const BEYOND: usize = 5;
/// Smallest number of pixels at a distance for a valid mean.
const FEWEST: u64 = 16;

/// Returns the distance in pixels of a mask's outline outside the visible edge, negative if inside, from the mean
/// colours at each distance. `None` if too few pixels are deep enough inside plants, or if plants and soil have the
/// same colour.
pub(super) fn margin(colors: &[[f32; 3]], mask: &[bool], width: usize) -> Option<f64> {
    // Mean colour at the distances −REACH + 0.5, … REACH − 0.5 from the outline; soil first.
    let mut sums = [[0.0f64; 3]; 2 * REACH];
    let mut counts = [0u64; 2 * REACH];
    for (at, distance) in distances(mask, width) {
        let level = (distance + REACH.to_f32()).floor_to::<usize>();
        sums[level].iter_mut().zip(colors[at]).for_each(|(sum, value)| *sum += f64::from(value));
        counts[level] += 1;
    }
    let mean = |levels: std::ops::Range<usize>| {
        let n: u64 = counts[levels.clone()].iter().sum();
        let sum = |c: usize| sums[levels.clone()].iter().map(|sum| sum[c]).sum::<f64>();
        (n >= FEWEST).then(|| [0, 1, 2].map(|c| sum(c) / n.to_f64()))
    };
    let (soil, plant) = (mean(0..REACH - BEYOND)?, mean(REACH + BEYOND..2 * REACH)?);
    let axis = [0, 1, 2].map(|c| plant[c] - soil[c]);
    let length: f64 = axis.iter().map(|a| a * a).sum();
    // Position of the colour between soil (0) and plant (1) at each distance.
    let share = |level: usize| {
        let color = mean(level..level + 1)?;
        Some((0..3).map(|c| (color[c] - soil[c]) * axis[c]).sum::<f64>() / length)
    };
    if length < 4.0 {
        return None;
    }
    // Selects the crossing that is closest to the outline.
    let crossing = |level: usize| {
        let (low, high) = (share(level)?, share(level + 1)?);
        let place = level.to_f64() + 0.5 + (0.5 - low) / (high - low) - REACH.to_f64();
        (low < 0.5 && high >= 0.5).then_some(place)
    };
    (0..2 * REACH - 1).filter_map(crossing).min_by(|a, b| a.abs().total_cmp(&b.abs()))
}

/// Returns the pixels near the outline with the distance of their centres from it: positive inside, at most [`REACH`].
fn distances(mask: &[bool], width: usize) -> Vec<(usize, f32)> {
    let steps = disc(REACH.to_f32() + 0.5);
    let height = mask.len() / width.max(1);
    let inverse: Vec<bool> = mask.iter().map(|inside| !inside).collect();
    let (near_plants, near_soil) = (regions::near(mask, width, REACH), regions::near(&inverse, width, REACH));
    let of = |at: usize| {
        let (x, y) = ((at % width).to_i64(), (at / width).to_i64());
        let other = |(dx, dy): &&(i64, i64)| {
            let (x, y) = (x + dx, y + dy);
            (0..width.to_i64()).contains(&x)
                && (0..height.to_i64()).contains(&y)
                && mask[y.to_usize() * width + x.to_usize()] != mask[at]
        };
        let (dx, dy) = steps.iter().find(other)?;
        let distance = (dx * dx + dy * dy).to_f32().sqrt() - 0.5;
        (distance < REACH.to_f32()).then_some((at, if mask[at] { distance } else { -distance }))
    };
    (0..mask.len()).filter(|at| if mask[*at] { near_soil[*at] } else { near_plants[*at] }).filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 160;

    /// Returns a blurred green disc of radius 40 on brown, and a mask with another radius.
    fn drawn(radius: f32) -> (Vec<[f32; 3]>, Vec<bool>) {
        let from_centre = |k: usize| ((k % WIDTH).to_f32() - 79.5).hypot((k / WIDTH).to_f32() - 74.5);
        let share = |k| 1.0 / (1.0 + ((from_centre(k) - 40.0) / 0.7).exp());
        let color = |k| {
            let s = share(k);
            [40.0 + 10.0 * s, 8.0 - 30.0 * s, 15.0 + 12.0 * s]
        };
        ((0..WIDTH * 150).map(color).collect(), (0..WIDTH * 150).map(|k| from_centre(k) < radius).collect())
    }

    /// Rationale: networks that are evaluated on manual outlines must know where these are. Expected: a mask drawn 1.4
    /// pixels too wide has a margin of 1.4, a mask that is too narrow has a negative margin, and an exact one has none,
    /// within three tenths of a pixel, because distances are measured between whole pixels. Source: the radii.
    #[test]
    fn a_margin_is_found_where_it_was_drawn() {
        for margin_drawn in [-2.5f32, 0.0, 0.7, 1.4, 3.0] {
            let (colors, mask) = drawn(40.0 + margin_drawn);
            let found = margin(&colors, &mask, WIDTH).unwrap();
            assert!((found - f64::from(margin_drawn)).abs() < 0.3, "{margin_drawn}: {found}");
        }
    }

    #[test]
    fn what_has_no_edge_has_no_margin() {
        let (colors, mask) = drawn(40.0);
        assert_eq!(margin(&vec![[50.0, 0.0, 0.0]; colors.len()], &mask, WIDTH), None);
        assert_eq!(margin(&colors, &vec![false; mask.len()], WIDTH), None);
        assert_eq!(margin(&colors, &vec![true; mask.len()], WIDTH), None);
        // A blade of five pixels has no pixel deep enough inside.
        assert_eq!(margin(&colors, &drawn(5.0).1, WIDTH), None);
        assert_eq!(margin(&[], &[], 0), None);
    }
}
