//! Excess green index (ExG) and its threshold.

use furrow_base::math::{RoundTo, ToFloat};
use serde::{Deserialize, Serialize};

/// Excess green index.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Index {
    /// ExG of chromatic coordinates: `2g − r − b` with `r = R / (R + G + B)` etc., which equals `3g − 1`. Range −1 to 2; 0 for black.
    /// Source: Woebbecke et al. 1995, "Color indices for weed identification under various soil, residue, and lighting conditions".
    Chromatic,
    /// ExG of the pixel values: `(2G − R − B) / 255`. Range −2 to 2; dark greens have lower values.
    Absolute,
}

impl Index {
    /// Both indices.
    pub(super) const ALL: [Self; 2] = [Self::Chromatic, Self::Absolute];

    /// Returns the excess green of a colour with channels from 0 to 255.
    pub(super) fn of(self, [r, g, b]: [f32; 3]) -> f32 {
        match self {
            Self::Chromatic if r + g + b > 0.0 => 3.0 * g / (r + g + b) - 1.0,
            Self::Chromatic => 0.0,
            Self::Absolute => (2.0 * g - r - b) / 255.0,
        }
    }
}

/// Number of quantization levels per unit of excess green.
const PER_UNIT: f64 = 1024.0;
/// Excess green at the start of level 0.
const LEAST: f64 = -2.0;
/// Number of levels: they cover −2 to 2.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small positive integer")]
pub(super) const LEVELS: usize = 4 * PER_UNIT as usize + 1;

/// Returns the level of an excess green value, clamped to the range.
pub(super) fn level(value: f64) -> usize {
    ((value - LEAST) * PER_UNIT).clamp(0.0, LEVELS.to_f64() - 1.0).trunc_to::<usize>()
}

/// Returns the excess green at the start of a level. It is exact in binary, so that `level(begin(k)) == k`.
pub(super) fn begin(level: usize) -> f64 {
    level.to_f64() / PER_UNIT + LEAST
}

/// Counts the pixels of each level.
pub(super) fn histogram(levels: &[usize]) -> Vec<u64> {
    let mut counts = vec![0; LEVELS];
    for level in levels {
        counts[*level] += 1;
    }
    counts
}

/// Returns Otsu's threshold: the first level of the upper of two classes with the largest between-class variance. If only one level
/// is filled, the threshold is above all levels. Source: Otsu 1979, "A threshold selection method from gray-level histograms".
pub(super) fn otsu(counts: &[u64]) -> usize {
    let all = counts.iter().enumerate();
    let (total, sum) = all.fold((0.0, 0.0), |(n, s), (k, c)| (n + c.to_f64(), s + k.to_f64() * c.to_f64()));
    let (mut below, mut sum_below) = (0.0, 0.0);
    let mut best = (0.0, counts.len());
    for (k, count) in counts.iter().enumerate() {
        // Between-class variance of the levels below k and those from k on.
        let above = total - below;
        if below > 0.0 && above > 0.0 {
            let apart: f64 = sum_below / below - (sum - sum_below) / above;
            let variance = below * above * apart * apart;
            if variance > best.0 {
                best = (variance, k);
            }
        }
        below += count.to_f64();
        sum_below += k.to_f64() * count.to_f64();
    }
    best.1
}

/// Blurs colours with a Gaussian of standard deviation `deviation` pixels, truncated at three standard deviations. Edge pixels are repeated
/// beyond the border.
pub(super) fn blurred(width: usize, height: usize, rgb: &[[u8; 3]], deviation: f64) -> Vec<[f32; 3]> {
    let sharp: Vec<[f32; 3]> = rgb.iter().map(|pixel| pixel.map(f32::from)).collect();
    let reach = (3.0 * deviation).ceil_to::<usize>();
    if reach == 0 || sharp.is_empty() {
        return sharp;
    }
    let bell: Vec<f32> = (0..=2 * reach)
        .map(|k| (k.to_f64() - reach.to_f64()) / deviation)
        .map(|z| (-0.5 * z * z).exp().to_f32())
        .collect();
    let sum: f32 = bell.iter().sum();
    let bell: Vec<f32> = bell.iter().map(|weight| weight / sum).collect();
    // A Gaussian is separable: blur along rows, then along columns.
    let places = || (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let rows: Vec<[f32; 3]> = places().map(|(x, y)| mean(&bell, x, width - 1, |x| sharp[y * width + x])).collect();
    places().map(|(x, y)| mean(&bell, y, height - 1, |y| rows[y * width + x])).collect()
}

/// Returns the weighted mean of the pixels around index `middle` of a line whose last index is `last`; `bell` holds the weights.
fn mean(bell: &[f32], middle: usize, last: usize, pixel: impl Fn(usize) -> [f32; 3]) -> [f32; 3] {
    let reach = bell.len() / 2;
    bell.iter().enumerate().fold([0.0; 3], |sum, (k, weight)| {
        let colour = pixel((middle + k).saturating_sub(reach).min(last));
        std::array::from_fn(|c| sum[c] + weight * colour[c])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn excess_green_is_that_of_the_formulas() {
        // The chromatic coordinates are g = 60 / 100 and r = b = 20 / 100.
        assert!((Index::Chromatic.of([20.0, 60.0, 20.0]) - 0.8).abs() < 1e-6);
        assert!((Index::Absolute.of([20.0, 60.0, 20.0]) - 80.0 / 255.0).abs() < 1e-6);
        assert_eq!(Index::Chromatic.of([0.0; 3]), 0.0);
        assert_eq!((Index::Chromatic.of([0.0, 9.0, 0.0]), Index::Chromatic.of([9.0, 0.0, 0.0])), (2.0, -1.0));
        assert!(Index::Chromatic.of([70.0; 3]).abs() < 1e-6);
        assert!((0..LEVELS).all(|k| level(begin(k)) == k));
        assert_eq!((level(-9.0), level(9.0)), (0, LEVELS - 1));
    }

    #[test]
    fn the_threshold_lies_between_two_heaps() {
        let mut counts = vec![0; 100];
        for (k, n) in [(10, 50), (11, 70), (12, 40), (60, 5), (61, 9)] {
            counts[k] = n;
        }
        assert!((13..=60).contains(&otsu(&counts)));
        assert_eq!(otsu(&[0, 7, 0]), 3);
        assert_eq!(otsu(&[3, 0, 4]), 1);
    }

    #[test]
    fn a_blur_keeps_what_is_flat_and_spreads_a_point_evenly() {
        let flat = blurred(7, 5, &[[10, 20, 30]; 35], 1.7);
        assert!(flat.iter().flatten().zip([10.0_f32, 20.0, 30.0].iter().cycle()).all(|(a, b)| (a - b).abs() < 1e-4));
        let mut point = vec![[0; 3]; 21 * 21];
        point[10 * 21 + 10] = [200; 3];
        let spread = blurred(21, 21, &point, 2.0);
        assert!((spread.iter().map(|p| p[0]).sum::<f32>() - 200.0).abs() < 1e-2);
        let at = |x: usize, y: usize| spread[y * 21 + x][0];
        assert!((at(8, 10) - at(12, 10)).abs() < 1e-5 && (at(8, 10) - at(10, 12)).abs() < 1e-5);
        // Two pixels from the centre is one standard deviation: e^(−1/2) of the central value.
        assert!((at(12, 10) / at(10, 10) - (-0.5_f32).exp()).abs() < 1e-4);
        assert_eq!(blurred(1, 1, &[[1, 2, 3]], 0.0), [[1.0, 2.0, 3.0]]);
    }
}
