//! SSIM, structural similarity: similarity of two gray images around each pixel in mean, contrast and structure.
//!
//! `(2 μa μb + C₁)(2 σab + C₂) / ((μa² + μb² + C₁)(σa² + σb² + C₂))`, with moments weighted by a Gaussian of σ 1.5 over
//! 11 × 11 pixels, and C₁ = 0.01², C₂ = 0.03² relative to white. Source: Wang, Bovik, Sheikh & Simoncelli 2004, "Image
//! Quality Assessment: From Error Visibility to Structural Similarity". At the edge the image is mirrored; as in the
//! authors' program, pixels whose window extends over the edge are excluded from means.

use furrow_base::math::{ToFloat, ToInt};
use rayon::prelude::*;

/// Half-width of the window, pixels.
const REACH: usize = 5;
/// Width of the window, pixels.
const TAPS: usize = 2 * REACH + 1;
/// Standard deviation of the window, pixels.
const SIGMA: f64 = 1.5;
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// Returns the luma of an sRGB pixel, 0 to 1. Source: Rec. 601, with the colour weights of the authors' program.
pub(super) fn luma([r, g, b]: [u8; 3]) -> f64 {
    (0.299 * f64::from(r) + 0.587 * f64::from(g) + 0.114 * f64::from(b)) / 255.0
}

/// Returns `true` if the window around the pixel is inside the image.
pub(super) fn is_whole(x: usize, y: usize, width: usize, height: usize) -> bool {
    let inside = |at: usize, size: usize| at >= REACH && at + REACH < size;
    inside(x, width) && inside(y, height)
}

/// Returns SSIM around each pixel, −1 to 1, of two gray images of the same size with values between 0 and 1.
pub(super) fn map(width: usize, height: usize, a: &[f64], b: &[f64]) -> Vec<f32> {
    let weights = weights();
    let row = |y: usize| {
        let columns: Vec<Moments> = (0..width)
            .map(|x| {
                let at = |k: usize| mirrored(y + k, height) * width + x;
                Moments::sum((0..TAPS).map(|k| Moments::of(a[at(k)], b[at(k)]).times(weights[k])))
            })
            .collect();
        let similar = |x: usize| {
            Moments::sum((0..TAPS).map(|k| columns[mirrored(x + k, width)].times(weights[k]))).similarity().to_f32()
        };
        (0..width).map(similar).collect::<Vec<f32>>()
    };
    (0..height).into_par_iter().flat_map_iter(row).collect()
}

fn weights() -> [f64; TAPS] {
    let gauss: [f64; TAPS] = std::array::from_fn(|k| {
        let d = k.to_f64() - REACH.to_f64();
        (-0.5 * d * d / (SIGMA * SIGMA)).exp()
    });
    let sum: f64 = gauss.iter().sum();
    gauss.map(|g| g / sum)
}

/// Returns the mirrored index for tap `k`, where `at` is the window's middle plus `k`; the edge pixel is repeated.
fn mirrored(at: usize, size: usize) -> usize {
    let around = (at.to_i64() - REACH.to_i64()).rem_euclid(2 * size.to_i64()).to_usize();
    around.min(2 * size - 1 - around)
}

/// Means of values, of their squares and of their product.
#[derive(Clone, Copy)]
struct Moments([f64; 5]);

impl Moments {
    fn of(a: f64, b: f64) -> Self {
        Self([a, b, a * a, b * b, a * b])
    }

    fn times(self, weight: f64) -> Self {
        Self(self.0.map(|m| m * weight))
    }

    fn sum(all: impl Iterator<Item = Self>) -> Self {
        all.fold(Self([0.0; 5]), |sum, m| Self(std::array::from_fn(|k| sum.0[k] + m.0[k])))
    }

    fn similarity(self) -> f64 {
        let [a, b, aa, bb, ab] = self.0;
        let (squares, product) = (a * a + b * b, a * b);
        let (spread, shared) = ((aa - a * a) + (bb - b * b), ab - product);
        (2.0 * product + C1) * (2.0 * shared + C2) / ((squares + C1) * (spread + C2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beyond_the_edge_lies_a_mirror() {
        let around: Vec<usize> = (0..14).map(|at| mirrored(at, 4)).collect();
        assert_eq!(around, [3, 3, 2, 1, 0, 0, 1, 2, 3, 3, 2, 1, 0, 0]);
        assert!((0..20).all(|at| mirrored(at, 1) == 0));
    }

    #[test]
    fn only_whole_windows_count() {
        assert!(is_whole(5, 5, 11, 11) && !is_whole(4, 5, 11, 11) && !is_whole(5, 6, 11, 11));
        assert!((0..10).all(|x| !is_whole(x, 5, 10, 11)));
    }
}
