//! Estimation of camera noise from a single image.
//!
//! Differences of second differences along rows and columns (Immerkaer 1996) respond to noise and not to structures
//! that are linear in either direction; for white noise of standard deviation σ they have 6 σ. They are computed in
//! blocks that are flat at a coarser scale. Their median is used (σ = median / 0.6745, as for a normal distribution),
//! so that edges do not count. Pixel-sized texture is included, because a single image cannot distinguish it from
//! noise.

use furrow_base::math::{RoundTo, ToFloat};

/// Side of a block, and of its cells, whose means determine how flat the block is, pixels.
const BLOCK: (usize, usize) = (16, 4);
/// Fraction of the blocks that are used as flat.
const FLAT: f64 = 0.2;
/// Range of mean coded values, 0 to 255, of usable blocks: darker and brighter ones are clipped and have no noise.
const USABLE: std::ops::RangeInclusive<f32> = 4.0..=251.0;
/// Median of the absolute value of a standard normal variable.
const MEDIAN: f64 = 0.674_489_75;

/// Returns σ of an image's noise in the unit of the values; `None` if all blocks are black or white.
pub(super) fn level(values: &[f32], (width, height): (usize, usize)) -> Option<f64> {
    let at = |x: usize, y: usize| values[y * width + x];
    // Blocks stay one pixel away from the edge, for the filter mask.
    let blocks = (1..height.saturating_sub(BLOCK.0)).step_by(BLOCK.0).flat_map(|y| {
        let columns = (1..width.saturating_sub(BLOCK.0)).step_by(BLOCK.0);
        columns.map(move |x| (x, y))
    });
    let mut rough: Vec<(f32, usize, usize)> = blocks
        .filter_map(|(x, y)| {
            let (mean, spread) = means(&at, x, y);
            USABLE.contains(&mean).then_some((spread, x, y))
        })
        .collect();
    rough.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.2, a.1).cmp(&(b.2, b.1))));
    rough.truncate((rough.len().to_f64() * FLAT).ceil_to::<usize>().max(1));
    let mut answers = vec![0_u64; (16.0 * 255.0).trunc_to::<usize>() + 2];
    for (_, left, top) in &rough {
        for (x, y) in (*top..top + BLOCK.0).flat_map(|y| (*left..left + BLOCK.0).map(move |x| (x, y))) {
            let row = |y: usize| at(x - 1, y) - 2.0 * at(x, y) + at(x + 1, y);
            answers[(row(y - 1) - 2.0 * row(y) + row(y + 1)).abs().round_to::<usize>()] += 1;
        }
    }
    Some(median(&answers)? / (6.0 * MEDIAN))
}

/// Returns the median of rounded values, given their counts. Values are assumed uniform within a rounding interval; 0
/// if most are 0, `None` if there are none.
fn median(counts: &[u64]) -> Option<f64> {
    let half = 0.5 * counts.iter().sum::<u64>().to_f64();
    let mut below = 0.0;
    for (value, n) in counts.iter().enumerate() {
        let n = n.to_f64();
        if n > 0.0 && below + n >= half {
            return Some(if value == 0 { 0.0 } else { value.to_f64() - 0.5 + (half - below) / n });
        }
        below += n;
    }
    None
}

/// Returns the mean of a block and the variance of its cells' means.
fn means(at: &impl Fn(usize, usize) -> f32, left: usize, top: usize) -> (f32, f32) {
    let (side, cell) = BLOCK;
    let cells = (side / cell) * (side / cell);
    let (mut sum, mut squares) = (0.0, 0.0);
    for k in 0..cells {
        let (x0, y0) = (left + k % (side / cell) * cell, top + k / (side / cell) * cell);
        let mean = (0..cell * cell).map(|p| at(x0 + p % cell, y0 + p / cell)).sum::<f32>() / (cell * cell).to_f32();
        sum += mean;
        squares += mean * mean;
    }
    let mean = sum / cells.to_f32();
    (mean, (squares / cells.to_f32() - mean * mean).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::sampling::rng::{Purpose, Stream};

    /// Expected: a slope and an edge around flat ground do not count as noise; the mean over ten images is within 5 %
    /// (a single image deviates by 2 to 3 %, one standard deviation).
    #[test]
    fn sigma_is_found_again() {
        let (width, height) = (320, 240);
        for sigma in [0.8, 3.0, 9.0] {
            let image = |number: u64| -> Vec<f32> {
                let mut stream = Stream::of(5, number, Purpose::Test, 2);
                let at = |k: usize| {
                    let (x, y) = ((k % width).to_f32(), (k / width).to_f32());
                    let scene = if x > 200.0 { 140.0 } else { 70.0 + 0.1 * y };
                    (scene + sigma * stream.normal().to_f32()).round()
                };
                (0..width * height).map(at).collect()
            };
            // Rounding to integers adds a variance of 1/12.
            let expected = (f64::from(sigma).powi(2) + 1.0 / 12.0).sqrt();
            let found = (0..10).map(|k| level(&image(k), (width, height)).unwrap()).sum::<f64>() / 10.0;
            assert!((found / expected - 1.0).abs() < 0.05, "{found} for {expected}");
        }
    }

    #[test]
    fn black_white_and_tiny_images_have_no_noise_estimate() {
        assert_eq!(level(&[255.0; 64 * 64], (64, 64)), None);
        assert_eq!(level(&[90.0; 64], (8, 8)), None);
        assert_eq!(level(&[90.0; 64 * 64], (64, 64)), Some(0.0));
    }
}
