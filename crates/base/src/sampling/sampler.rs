//! Owen-scrambled Sobol points, four dimensions at a time.
//!
//! Each set of four dimensions of each pixel scrambles the same sequence with its own hash, so samples can be taken in
//! any number and order by any thread. Source: Burley 2020, "Practical Hash-based Owen Scrambling", JCGT 9(4), with the
//! hashes of `sobol_burley`.
//!
//! Independent random numbers can replace them ([`Points::Independent`]); the expected image must be the same for both.

use super::rng::mix;
use super::sobol;
use crate::math::{ToFloat, ToInt};

/// Assignment of the sets of four dimensions.
pub mod sets {
    /// Position in the pixel, stratified jointly with what the pixel's error depends on most: the position on the first
    /// narrow light, or, without one, the scattering direction at the first surface.
    pub const FIRST: u32 = 0;
    /// Position on the lens.
    pub const LENS: u32 = (1 << 24) - 1;

    /// Time within the exposure.
    pub const SHUTTER: u32 = (1 << 24) - 2;

    /// Lobe, direction and, at the first surface, number of scattered paths: for surface number `depth` of a path's
    /// `branch`.
    pub const fn scatter(branch: u32, depth: u32) -> u32 {
        branch * BRANCH + 1 + 2 * depth
    }

    /// Light, position on it and Russian roulette: for the same surface.
    pub const fn light(branch: u32, depth: u32) -> u32 {
        branch * BRANCH + 2 + 2 * depth
    }

    /// Position on light number `light`, and whether it is sampled: at the first surface.
    pub const fn first_light(light: u32) -> u32 {
        (1 << 24) + light
    }

    /// Number of sets per branch: twice the maximum number of surfaces of a path.
    const BRANCH: u32 = 1 << 12;
}

/// Kind of sample points within a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Points {
    /// Owen-scrambled Sobol points, stratified over the samples of a pixel.
    #[default]
    Sobol,
    /// Independent random numbers: noisier, the reference for stratified points.
    Independent,
}

/// Random numbers of one sample of one pixel.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    index: u32,
    seed: u32,
    points: Points,
}

impl Sampler {
    /// Maximum number of samples per pixel: the length of the tabulated sequence.
    pub const MAX_SAMPLES: u32 = 1 << 16;

    /// Sampler for sample `index` (below [`Self::MAX_SAMPLES`]) of pixel (x, y), in the image identified by `seed`.
    pub fn new(seed: u64, x: u32, y: u32, index: u32) -> Self {
        Self::of(Points::Sobol, seed, x, y, index)
    }

    /// Like [`Self::new`] with the given kind of points.
    pub fn of(points: Points, seed: u64, x: u32, y: u32, index: u32) -> Self {
        Self { index, seed: mix(seed ^ (u64::from(y) << 32 | u64::from(x))).low_u32(), points }
    }

    /// Returns the four numbers in [0, 1) of dimension set `set`. Each set is stratified over the samples of a pixel
    /// and independent of the other sets.
    #[inline]
    pub fn get4(&self, set: u32) -> [f32; 4] {
        match self.points {
            Points::Sobol => sobol::point(self.index, mix(u64::from(self.seed) << 32 | u64::from(set)).low_u32()),
            Points::Independent => self.independent4(set),
        }
    }

    /// Returns four numbers independent of all other samples and sets: a hash of their address.
    #[cold]
    fn independent4(&self, set: u32) -> [f32; 4] {
        let first = mix(mix(u64::from(self.seed) << 32 | u64::from(self.index)) ^ u64::from(set));
        let second = mix(first);
        // 24 bits each: the precision of a uniform f32 below one.
        [first >> 40, first >> 16 & 0xff_ffff, second >> 40, second >> 16 & 0xff_ffff]
            .map(|bits| bits.to_f32() * (1.0 / (1 << 24).to_f32()))
    }
}
