//! Seeded gradient noise. The only door to the `noise` crate.

use ::noise::{NoiseFn, Perlin as Gradient};

/// Perlin noise with a seed, in about −1..1, feature size 1. Source: Perlin 1985, improved 2002 (`noise::Perlin`).
#[derive(Clone, Copy, Debug)]
pub struct Perlin(Gradient);

impl Perlin {
    /// The noise of a seed.
    pub fn new(seed: u32) -> Self {
        Self(Gradient::new(seed))
    }

    /// Value at (x, y).
    pub fn at2(&self, x: f64, y: f64) -> f64 {
        self.0.get([x, y])
    }

    /// Value at (x, y, z).
    pub fn at3(&self, x: f64, y: f64, z: f64) -> f64 {
        self.0.get([x, y, z])
    }

    /// Fractional Brownian motion: `octaves` layers, each twice as fine and `gain` times as high as the one before;
    /// normalised so that the octaves' amplitudes sum to one.
    pub fn fbm2(&self, x: f64, y: f64, octaves: u32, gain: f64) -> f64 {
        let (mut sum, mut amplitude, mut total, mut frequency) = (0.0, 1.0, 0.0, 1.0);
        for octave in 0..octaves {
            // Each octave is shifted so that the lattice's zeros never line up.
            let shift = f64::from(octave) * 17.31;
            sum += amplitude * self.at2(x * frequency + shift, y * frequency - shift);
            total += amplitude;
            amplitude *= gain;
            frequency *= 2.0;
        }
        if total > 0.0 { sum / total } else { 0.0 }
    }

    /// As [`Perlin::fbm2`] in three dimensions.
    pub fn fbm3(&self, p: [f64; 3], octaves: u32, gain: f64) -> f64 {
        let (mut sum, mut amplitude, mut total, mut frequency) = (0.0, 1.0, 0.0, 1.0);
        for octave in 0..octaves {
            let shift = f64::from(octave) * 17.31;
            sum += amplitude * self.at3(p[0] * frequency + shift, p[1] * frequency - shift, p[2] * frequency + shift);
            total += amplitude;
            amplitude *= gain;
            frequency *= 2.0;
        }
        if total > 0.0 { sum / total } else { 0.0 }
    }
}
