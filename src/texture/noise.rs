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

/// Gradient noise that repeats: value and slope at 0 and at its period agree, so an image of it tiles. In about −1..1.
/// Perlin's lattice with its indices taken modulo the period; the `noise` crate has none that repeats.
#[derive(Clone, Copy, Debug)]
pub struct Tiling(u64);

impl Tiling {
    /// The noise of a seed.
    pub fn new(seed: u64) -> Self {
        Self(crate::sampling::rng::mix(seed))
    }

    /// Value at (x, y), both repeating after `period` (≥ 1).
    pub fn at(&self, x: f32, y: f32, period: u32) -> f32 {
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let fade = |t: f32| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
        let ends = |i: f32| {
            let i = (i as i64).rem_euclid(i64::from(period)) as u64;
            [i, if i + 1 == u64::from(period) { 0 } else { i + 1 }]
        };
        let (xs, ys) = (ends(x0), ends(y0));
        let corner = |dx: usize, dy: usize| {
            let h = crate::sampling::rng::mix(self.0 ^ (xs[dx] << 32 | ys[dy]));
            let (gx, gy) = DIRECTIONS[(h >> 60) as usize];
            gx * (fx - dx as f32) + gy * (fy - dy as f32)
        };
        let (u, v) = (fade(fx), fade(fy));
        let top = corner(0, 0) * (1.0 - u) + corner(1, 0) * u;
        let bottom = corner(0, 1) * (1.0 - u) + corner(1, 1) * u;
        (top * (1.0 - v) + bottom * v) * 1.5
    }

    /// Fractional Brownian motion, as [`Perlin::fbm2`]; the first octave repeats after `period`.
    pub fn fbm(&self, x: f32, y: f32, period: u32, octaves: u32, gain: f32) -> f32 {
        let (mut sum, mut amplitude, mut total, mut scale) = (0.0, 1.0, 0.0, 1u32);
        for octave in 0..octaves {
            let layer = Self(self.0.wrapping_add(u64::from(octave)));
            sum += amplitude * layer.at(x * scale as f32, y * scale as f32, period * scale);
            total += amplitude;
            amplitude *= gain;
            scale *= 2;
        }
        if total > 0.0 { sum / total } else { 0.0 }
    }
}

const D: f32 = std::f32::consts::FRAC_1_SQRT_2;

/// Sixteen unit vectors, 22.5° apart.
const DIRECTIONS: [(f32, f32); 16] = [
    (1.0, 0.0),
    (0.92387953, 0.38268343),
    (D, D),
    (0.38268343, 0.92387953),
    (0.0, 1.0),
    (-0.38268343, 0.92387953),
    (-D, D),
    (-0.92387953, 0.38268343),
    (-1.0, 0.0),
    (-0.92387953, -0.38268343),
    (-D, -D),
    (-0.38268343, -0.92387953),
    (0.0, -1.0),
    (0.38268343, -0.92387953),
    (D, -D),
    (0.92387953, -0.38268343),
];
