//! Addressed random streams: each object has its own stream, so adding plant 13 changes nothing about plant 12.
//!
//! The generator is PCG-XSL-RR 128/64 (MCG), portable between versions and machines (`rand_pcg::Pcg64Mcg`). Its seed is
//! a hash of the address, so streams do not depend on their order of creation.
//!
//! Normal, Poisson and other distributions are implemented here: a new version of `rand_distr` could sample
//! differently, and every pixel depends on the samples.

use crate::math::{RoundTo, ToFloat};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Purpose of a stream. The discriminants are part of every image's identity: append, never renumber.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u64)]
pub enum Purpose {
    /// Values sampled by the scene file itself: light, camera, soil moisture.
    Page = 1,
    /// Positions of plants and objects.
    Scatter = 2,
    /// One plant.
    Plant = 3,
    /// One leaf of a plant.
    Leaf = 4,
    /// Relief and layer blend of the ground.
    Soil = 5,
    /// One clod, stone, stick or piece of straw.
    Debris = 6,
    /// A procedural texture.
    Texture = 7,
    /// Sensor noise.
    Sensor = 8,
    /// A test.
    Test = 9,
    /// Order of training images, and their augmentation.
    Training = 10,
    /// Images in a bootstrap resample.
    Resample = 11,
    /// Age, health and damage of a plant.
    Condition = 12,
    /// Sensor steps after the noise.
    Chain = 20,
    /// Path of the vehicle that carries the camera.
    Motion = 21,
    /// Properties of an individual camera: the fixed-pattern noise of its sensor.
    Body = 22,
    /// Positions of points on the surfaces of a field.
    Cloud = 23,
    /// Range errors of a LiDAR.
    Lidar = 24,
    /// Light, exposure and sensor of a relit field, as a child of the streams of the field's own.
    Relight = 25,
    /// Hedges and trees on the horizon.
    Horizon = 26,
}

/// Addressed stream of random numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Stream {
    key: u64,
    rng: Pcg64Mcg,
}

/// Finaliser of SplitMix64: a bijection that spreads every input bit over the output.
/// Source: Steele, Lea & Flood 2014, "Fast splittable pseudorandom number generators".
pub fn mix(mut x: u64) -> u64 {
    x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

impl Stream {
    /// Returns the stream of object `index` for a purpose, in image `image` under `seed`.
    pub fn of(seed: u64, image: u64, purpose: Purpose, index: u64) -> Self {
        Self::keyed(mix(mix(mix(mix(seed) ^ image) ^ purpose as u64) ^ index))
    }

    fn keyed(key: u64) -> Self {
        Self { key, rng: Pcg64Mcg::seed_from_u64(key) }
    }

    /// Returns a separate stream for part `index` of this object, independent of how many numbers were taken from this
    /// stream.
    #[must_use]
    pub fn child(&self, purpose: Purpose, index: u64) -> Self {
        Self::keyed(mix(mix(self.key ^ ((purpose as u64) << 32)) ^ index))
    }

    /// Returns a 32-bit seed for a noise function or a sampler.
    pub fn seed32(&mut self) -> u32 {
        self.rng.next_u32()
    }

    /// Uniform in [0, 1), 53 bits.
    pub fn uniform(&mut self) -> f64 {
        (self.rng.next_u64() >> 11).to_f64() * (1.0 / (1u64 << 53).to_f64())
    }

    /// Uniform in [0, 1), 24 bits.
    pub fn uniform32(&mut self) -> f32 {
        (self.rng.next_u32() >> 8).to_f32() * (1.0 / (1u32 << 24).to_f32())
    }

    /// Uniform in [lo, hi).
    pub fn range(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * self.uniform()
    }

    /// Uniform in [lo, hi), single precision.
    pub fn range32(&mut self, lo: f32, hi: f32) -> f32 {
        lo + (hi - lo) * self.uniform32()
    }

    /// Standard normal. Source: Box & Muller 1958.
    pub fn normal(&mut self) -> f64 {
        let u = 1.0 - self.uniform();
        let v = self.uniform();
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }

    /// True with probability `p`.
    pub fn chance(&mut self, p: f64) -> bool {
        self.uniform() < p
    }

    /// Uniform in 0..n; 0 if n = 0.
    pub fn index(&mut self, n: usize) -> usize {
        (self.uniform() * n.to_f64()).trunc_to::<usize>().min(n.saturating_sub(1))
    }

    /// Poisson with the given mean (≥ 0). Source: Knuth, TAOCP vol. 2, §3.4.1. A large mean is split into a sum of
    /// Poisson variables of mean at most 500, so that the product never underflows.
    pub fn poisson(&mut self, mean: f64) -> u64 {
        let mut count = 0;
        let mut left = mean;
        while left > 0.0 {
            let floor = (-left.min(500.0)).exp();
            left -= 500.0;
            let mut product = self.uniform();
            while product > floor {
                count += 1;
                product *= self.uniform();
            }
        }
        count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_are_addressed_not_dealt() {
        let mut a = Stream::of(7, 0, Purpose::Plant, 12);
        let first = a.uniform();
        let child = a.child(Purpose::Leaf, 3).uniform();
        let mut b = Stream::of(7, 0, Purpose::Plant, 12);
        assert_eq!(child, b.child(Purpose::Leaf, 3).uniform());
        assert_eq!(first, b.uniform());
        assert_ne!(first, Stream::of(7, 0, Purpose::Plant, 13).uniform());
        assert_ne!(first, Stream::of(7, 1, Purpose::Plant, 12).uniform());
    }

    #[test]
    fn poisson_has_its_mean_and_variance() {
        for mean in [0.3, 4.0, 60.0, 1200.0] {
            let mut s = Stream::of(1, 0, Purpose::Test, 0);
            let n = 4000;
            let draws: Vec<f64> = (0..n).map(|_| s.poisson(mean).to_f64()).collect();
            let m = draws.iter().sum::<f64>() / f64::from(n);
            let var = draws.iter().map(|x| (x - m).powi(2)).sum::<f64>() / f64::from(n);
            // Four standard errors; Var(s²) of a Poisson is (λ + 2λ²)/n.
            assert!((m - mean).abs() < 4.0 * (mean / f64::from(n)).sqrt(), "mean {m} for {mean}");
            assert!(
                (var - mean).abs() < 4.0 * ((mean + 2.0 * mean * mean) / f64::from(n)).sqrt(),
                "variance {var} for {mean}"
            );
        }
    }
}
