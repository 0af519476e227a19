//! Seeded gradient noise. This file is the only one that uses the `noise` crate.
//!
//! Two-dimensional noise is evaluated here with the crate's permutation: the same bits take 12 ns instead of the 80 ns of
//! `noise::Perlin::get` (4 million points, x86-64-v3). A unit test compares the two.

use ::noise::permutationtable::{NoiseHasher, PermutationTable};
use ::noise::{NoiseFn, Perlin as Gradient};
use furrow_base::math::{RoundTo, ToFloat, ToInt};
use std::f64::consts::SQRT_2;

/// Perlin noise with a seed, with values in about −1..1 and features of size 1. Source: Perlin 1985, improved 2002
/// (`noise::Perlin`).
#[derive(Clone, Copy, Debug)]
pub struct Perlin {
    solid: Gradient,
    /// The crate's permutation of 0 to 255, for 2D noise.
    order: [u8; 256],
}

impl Perlin {
    /// Creates the noise from a seed.
    pub fn new(seed: u32) -> Self {
        let table = PermutationTable::new(seed);
        let order = std::array::from_fn(|k| table.hash(&[k.to_isize()]).to_u8());
        Self { solid: Gradient::new(seed), order }
    }

    /// Returns the value at (x, y), bit for bit that of `noise::Perlin`, but without its checks and branches.
    #[inline]
    pub fn at2(&self, x: f64, y: f64) -> f64 {
        // Lower corner as in the crate: for zero and negative values the next lower integer, also from an exact
        // integer.
        let corner = |v: f64| v.trunc_to::<i64>() - i64::from(v <= 0.0);
        let (left, top) = (corner(x), corner(y));
        let (fx, fy) = (x - left.to_f64(), y - top.to_f64());
        let signed = |v: f64, negative: u8| f64::from_bits(v.to_bits() ^ (u64::from(negative) << 63));
        let slope = |right: i64, below: i64| {
            let column = usize::from(self.order[((left + right) & 0xff).to_usize()]);
            let choice = self.order[column ^ ((top + below) & 0xff).to_usize()];
            signed(fx - right.to_f64(), choice & 1) + signed(fy - below.to_f64(), (choice >> 1) & 1)
        };
        let fade = |t: f64| {
            let t = t.clamp(0.0, 1.0);
            t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
        };
        let mix = |a: f64, b: f64, share: f64| b * share + a * (1.0 - share);
        let (u, v) = (fade(fx), fade(fy));
        let (near, far) = (mix(slope(0, 0), slope(0, 1), v), mix(slope(1, 0), slope(1, 1), v));
        (mix(near, far, u) * (2.0 / SQRT_2)).clamp(-1.0, 1.0)
    }

    /// Returns the value at (x, y, z).
    pub fn at3(&self, x: f64, y: f64, z: f64) -> f64 {
        self.solid.get([x, y, z])
    }

    /// Returns fractional Brownian motion: `octaves` layers, each with twice the frequency and `gain` times the
    /// amplitude of the one before, normalised by the sum of the amplitudes.
    pub fn fbm2(&self, x: f64, y: f64, octaves: u32, gain: f64) -> f64 {
        let (mut sum, mut amplitude, mut total, mut frequency) = (0.0, 1.0, 0.0, 1.0);
        for octave in 0..octaves {
            // Each octave is shifted so that the zeros of the lattices do not coincide.
            let shift = f64::from(octave) * 17.31;
            sum += amplitude * self.at2(x * frequency + shift, y * frequency - shift);
            total += amplitude;
            amplitude *= gain;
            frequency *= 2.0;
        }
        if total > 0.0 { sum / total } else { 0.0 }
    }

    /// Returns [`Perlin::fbm2`] in three dimensions.
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

/// Periodic gradient noise: value and slope at 0 and at the period agree, so an image of it tiles. Values are in about
/// −1..1. Uses Perlin's lattice with indices modulo the period; the `noise` crate has no periodic noise.
#[derive(Clone, Copy, Debug)]
pub struct Tiling(u64);

impl Tiling {
    /// Creates the noise from a seed.
    pub fn new(seed: u64) -> Self {
        Self(furrow_base::sampling::rng::mix(seed))
    }

    /// Returns the value at (x, y); both axes repeat after `period` (≥ 1).
    pub fn at(&self, x: f32, y: f32, period: u32) -> f32 {
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let fade = |t: f32| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
        let ends = |i: f32| {
            let i = i.trunc_to::<i64>().rem_euclid(i64::from(period)).to_u64();
            [i, if i + 1 == u64::from(period) { 0 } else { i + 1 }]
        };
        let (xs, ys) = (ends(x0), ends(y0));
        let corner = |dx: usize, dy: usize| {
            let h = furrow_base::sampling::rng::mix(self.0 ^ (xs[dx] << 32 | ys[dy]));
            let (gx, gy) = DIRECTIONS[(h >> 60).to_usize()];
            gx * (fx - dx.to_f32()) + gy * (fy - dy.to_f32())
        };
        let (u, v) = (fade(fx), fade(fy));
        let top = corner(0, 0) * (1.0 - u) + corner(1, 0) * u;
        let bottom = corner(0, 1) * (1.0 - u) + corner(1, 1) * u;
        (top * (1.0 - v) + bottom * v) * 1.5
    }

    /// Returns fractional Brownian motion as [`Perlin::fbm2`] does; the first octave repeats after `period`.
    pub fn fbm(&self, x: f32, y: f32, period: u32, octaves: u32, gain: f32) -> f32 {
        let (mut sum, mut amplitude, mut total, mut scale) = (0.0, 1.0, 0.0, 1u32);
        for octave in 0..octaves {
            let layer = Self(self.0.wrapping_add(u64::from(octave)));
            sum += amplitude * layer.at(x * scale.to_f32(), y * scale.to_f32(), period * scale);
            total += amplitude;
            amplitude *= gain;
            scale *= 2;
        }
        if total > 0.0 { sum / total } else { 0.0 }
    }
}

const D: f32 = std::f32::consts::FRAC_1_SQRT_2;

/// Sixteen unit vectors at steps of 22.5°.
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

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::sampling::{Purpose, Stream};

    /// Rationale: every relief and patch, and so every stored scene, depends on these bits. Expected: equal to the
    /// crate's own values on both sides of zero, at integers, and far from the origin. Source: `noise::Perlin`.
    #[test]
    fn the_plane_is_that_of_the_crate_bit_for_bit() {
        let mut s = Stream::of(1, 0, Purpose::Test, 0);
        for seed in [0, 1, 77, u32::MAX] {
            let ours = Perlin::new(seed);
            let whole = (-4..=4).flat_map(|x| (-4..=4).map(move |y| (f64::from(x), f64::from(y) * 0.5)));
            let drawn: Vec<(f64, f64)> = (0..20_000)
                .map(|k| {
                    let reach = [0.5, 3.0, 300.0, 1e7][k % 4];
                    (s.range(-reach, reach), s.range(-reach, reach))
                })
                .collect();
            for (x, y) in whole.chain(drawn) {
                assert_eq!(ours.at2(x, y).to_bits(), ours.solid.get([x, y]).to_bits(), "{seed} {x} {y}");
            }
        }
    }
}
