//! Input normalization: removes exposure and white balance from an image before a network processes it.

use super::store::Store;
use furrow_base::Result;
use furrow_base::math::{ToFloat, ToInt};
use serde::{Deserialize, Serialize};

/// Normalization of bands to mean 0 and standard deviation 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Normalization {
    /// By the mean and standard deviation of each band of each image: removes exposure, white balance and contrast.
    Band,
    /// By one mean and one standard deviation for all bands of an image: removes exposure and contrast but keeps colours.
    Image,
    /// By the mean and standard deviation of each band over the training set (of values 0 to 1), the same for all images.
    Fixed {
        /// Means of the bands.
        mean: Vec<f32>,
        /// Standard deviations of the bands.
        sd: Vec<f32>,
    },
}

/// Lower limit of a standard deviation, for values 0 to 1: one step of 8 bits. It keeps images of a single colour finite.
pub(crate) const LEAST: f32 = 1.0 / 255.0;

impl Normalization {
    /// Returns [`Self::Fixed`] with the mean and standard deviation of each band over the images of a store.
    pub fn fixed(store: &Store) -> Result<Self> {
        let bands = store.shape().bands.len();
        let mut sums = vec![(0u64, 0u64); bands];
        let mut pixels = 0u64;
        for place in 0..store.len() {
            let example = store.get(place)?;
            pixels += example.labels.len().to_u64();
            for (sum, plane) in sums.iter_mut().zip(&example.planes) {
                for v in plane {
                    sum.0 += u64::from(*v);
                    sum.1 += u64::from(*v) * u64::from(*v);
                }
            }
        }
        let n = pixels.max(1).to_f64();
        let mean: Vec<f64> = sums.iter().map(|(s, _)| s.to_f64() / n / 255.0).collect();
        let sd =
            sums.iter().zip(&mean).map(|((_, q), m)| (q.to_f64() / n / 255.0 / 255.0 - m * m).max(0.0).sqrt().to_f32());
        let sd = sd.map(|s| s.max(LEAST)).collect();
        Ok(Self::Fixed { mean: mean.iter().map(|m| m.to_f32()).collect(), sd })
    }

    /// Normalizes an image in place; `pixels` has interleaved bands.
    pub fn apply(&self, pixels: &mut [f32], bands: usize) {
        let scales = self.scales(pixels, bands);
        scale(pixels, &scales);
    }

    /// Returns the mean and standard deviation with which each band of an image is normalized. `pixels` are all pixels of the image
    /// or a sample of them.
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
    let n = n.max(1).to_f64();
    let mean = sum / n;
    (mean.to_f32(), (squares / n - mean * mean).max(0.0).sqrt().to_f32().max(LEAST))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exposure_and_white_balance_go_colours_stay_where_asked() {
        let picture: Vec<f32> = (0..60).map(|i| ((i * 37) % 23).to_f32() / 30.0).collect();
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
