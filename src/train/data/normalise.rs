//! Input normalization: exposure and white balance are removed from an image before a network sees it.

use super::store::Store;
use crate::Result;
use serde::{Deserialize, Serialize};

/// How bands are brought to mean 0 and standard deviation 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Normalization {
    /// Each band of each image by its own mean and standard deviation: removes exposure, white balance and contrast.
    Band,
    /// All bands of an image by one mean and one standard deviation: removes exposure and contrast, colours stay.
    Image,
    /// By the training set's mean and standard deviation of each band (of values in 0 to 1): all images alike.
    Fixed {
        /// Means.
        mean: Vec<f32>,
        /// Deviations.
        sd: Vec<f32>,
    },
}

/// What a deviation is at least, in values from 0 to 1: a picture of one colour stays finite. A step of 8 bits.
pub(crate) const LEAST: f32 = 1.0 / 255.0;

impl Normalization {
    /// [`Self::Fixed`] to what the images of a store have.
    pub fn fixed(store: &Store) -> Result<Self> {
        let bands = store.shape().bands.len();
        let mut sums = vec![(0u64, 0u64); bands];
        let mut pixels = 0u64;
        for place in 0..store.len() {
            let example = store.get(place)?;
            pixels += example.labels.len() as u64;
            for (sum, plane) in sums.iter_mut().zip(&example.planes) {
                for v in plane {
                    sum.0 += u64::from(*v);
                    sum.1 += u64::from(*v) * u64::from(*v);
                }
            }
        }
        let n = pixels.max(1) as f64;
        let mean: Vec<f64> = sums.iter().map(|(s, _)| *s as f64 / n / 255.0).collect();
        let sd =
            sums.iter().zip(&mean).map(|((_, q), m)| (*q as f64 / n / 255.0 / 255.0 - m * m).max(0.0).sqrt() as f32);
        let sd = sd.map(|s| s.max(LEAST)).collect();
        Ok(Self::Fixed { mean: mean.iter().map(|m| *m as f32).collect(), sd })
    }

    /// Normalizes an image in place: `pixels` holds `bands` values a pixel, side by side.
    pub fn apply(&self, pixels: &mut [f32], bands: usize) {
        let scales = self.scales(pixels, bands);
        scale(pixels, &scales);
    }

    /// Mean and standard deviation of each band of an image with these pixels, or with some of them.
    pub(super) fn scales(&self, pixels: &[f32], bands: usize) -> Vec<(f32, f32)> {
        match self {
            Self::Fixed { mean, sd } => mean.iter().copied().zip(sd.iter().copied()).collect(),
            Self::Band => (0..bands).map(|b| moments(pixels.iter().skip(b).step_by(bands))).collect(),
            Self::Image => vec![moments(pixels.iter()); bands],
        }
    }
}

/// Subtracts the mean of each band and divides by its standard deviation.
pub(super) fn scale(pixels: &mut [f32], scales: &[(f32, f32)]) {
    for pixel in pixels.chunks_exact_mut(scales.len()) {
        for (v, (mean, sd)) in pixel.iter_mut().zip(scales) {
            *v = (*v - mean) / sd;
        }
    }
}

fn moments<'a>(values: impl Iterator<Item = &'a f32>) -> (f32, f32) {
    let (mut n, mut sum, mut squares) = (0u64, 0.0f64, 0.0f64);
    for v in values {
        n += 1;
        sum += f64::from(*v);
        squares += f64::from(*v) * f64::from(*v);
    }
    let n = n.max(1) as f64;
    let mean = sum / n;
    (mean as f32, ((squares / n - mean * mean).max(0.0).sqrt() as f32).max(LEAST))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exposure_and_white_balance_go_colours_stay_where_asked() {
        let picture: Vec<f32> = (0..60).map(|i| ((i * 37) % 23) as f32 / 30.0).collect();
        let brighter: Vec<f32> = picture.iter().map(|v| 1.2 * v + 0.05).collect();
        let tinted: Vec<f32> = picture.iter().enumerate().map(|(i, v)| v * [1.0, 0.7, 1.3][i % 3]).collect();
        let apply = |n: &Normalization, p: &[f32]| {
            let mut p = p.to_vec();
            n.apply(&mut p, 3);
            p
        };
        let close = |a: &[f32], b: &[f32]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4);
        let plain = apply(&Normalization::Band, &picture);
        assert!(close(&plain, &apply(&Normalization::Band, &brighter)));
        assert!(close(&plain, &apply(&Normalization::Band, &tinted)));
        let plain = apply(&Normalization::Image, &picture);
        assert!(close(&plain, &apply(&Normalization::Image, &brighter)));
        assert!(!close(&plain, &apply(&Normalization::Image, &tinted)));
        assert!(apply(&Normalization::Band, &[0.3; 6]).iter().all(|v| v.abs() < 1e-4));
    }
}
